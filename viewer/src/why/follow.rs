//! The panel “Why” follows the cursor: it explains the value requested last at each step that the cursor reaches, in any
//! run.
//!
//! Only a move of the cursor triggers this, so that the user can examine a value of an earlier step. While a request is
//! pending no further one is sent: during playback or a drag, only the step where the cursor stops is explained. If a
//! step's record is not loaded or lacks the value, the previous step's explanation remains, labelled with its step.

use crate::cache::StepKey;
use crate::state::State;
use crate::why::Remote;

impl State {
    /// Requests the explanation at the cursor's step, if the cursor has moved. Called while the panel is visible.
    pub fn follow_why(&mut self) {
        let here = self.step_key(self.cursor.step).filter(|_| self.row().is_some());
        let Some(here) = here.filter(|here| self.why.followed.as_ref() != Some(here)) else { return };
        let Some((shown, value)) = self.why.history.last().cloned() else {
            self.why.followed = Some(here);
            return;
        };
        let place = (shown, value);
        if matches!(self.why.trees.get(&place), Some(Remote::Pending)) {
            return;
        }
        let (shown, value) = place;
        if shown != here && !self.has_value(&value) {
            return;
        }
        self.why.followed = Some(here.clone());
        if shown != here {
            self.request_explanation(&here, &value);
            self.why.history = vec![(here, value)];
        }
    }

    /// Requests again the explanations that failed while the server was unreachable.
    pub(crate) fn request_explanation_again(&mut self) {
        self.why.trees.retain(|_, remote| matches!(remote, Remote::Received(_)));
        if let Some((key, value)) = self.why.history.last().cloned() {
            self.request_explanation(&key, &value);
        }
    }

    /// The origin of the shown value as words: step and run, and the target if it is not selected.
    pub fn whose(&self, key: &StepKey) -> String {
        let targets = self.session.iter().flat_map(|session| &session.targets);
        let other = targets.filter(|target| Some(target.number) != self.cursor.target);
        let label =
            other.filter(|target| target.number == key.target).map(|target| format!("{}, ", target.label));
        let run = crate::state::run_letter(key.run);
        format!("{}run {run}, step {}", label.last().unwrap_or_default(), key.step)
    }
}
