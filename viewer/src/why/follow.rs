//! Why follows the cursor: the value that was asked for last is asked again where the cursor goes, in whichever run.
//!
//! Only a move of the cursor does that, so that a value of an earlier step can be looked into from where one is. While an
//! answer is waited for no further one is asked: who plays or drags gets the tree of where the cursor comes to rest. A step
//! whose record is not here yet, or lacks the value, leaves the tree of the step before, which says whose it is.

use crate::cache::StepKey;
use crate::state::State;
use crate::why::Told;

impl State {
    /// Follows the cursor, where the panel is on the screen.
    pub fn follow_why(&mut self) {
        let here = self.step_key(self.cursor.step).filter(|_| self.row().is_some());
        let Some(here) = here.filter(|here| self.why.followed.as_ref() != Some(here)) else { return };
        let Some((shown, value)) = self.why.asked.last().cloned() else {
            self.why.followed = Some(here);
            return;
        };
        let place = (shown, value);
        if matches!(self.why.trees.get(&place), Some(Told::Waiting)) {
            return;
        }
        let (shown, value) = place;
        if shown != here && !self.has_value(&value) {
            return;
        }
        self.why.followed = Some(here.clone());
        if shown != here {
            self.want_tree(&here, &value);
            self.why.asked = vec![(here, value)];
        }
    }

    /// Asks again for what the server could not say while it was gone.
    pub(crate) fn ask_why_again(&mut self) {
        self.why.trees.retain(|_, told| matches!(told, Told::Here(_)));
        if let Some((key, value)) = self.why.asked.last().cloned() {
            self.want_tree(&key, &value);
        }
    }

    /// Whose value is shown, in words: step and run, and the target where it is not the one that is looked at.
    pub fn whose(&self, key: &StepKey) -> String {
        let targets = self.session.iter().flat_map(|session| &session.targets);
        let other = targets.filter(|target| Some(target.number) != self.cursor.target);
        let label =
            other.filter(|target| target.number == key.target).map(|target| format!("{}, ", target.label));
        let run = crate::state::run_letter(key.run);
        format!("{}run {run}, step {}", label.last().unwrap_or_default(), key.step)
    }
}
