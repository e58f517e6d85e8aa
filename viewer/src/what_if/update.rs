//! Changes the trial at a step and computes its result on the server.

use std::sync::Arc;

use sightline_api::endpoint::Call;
use sightline_api::endpoints::TryStep;
use sightline_api::wire::Problem;
use sightline_session::what_if::{Ghost, WhatIf};
use sightline_track::settings::TrackerKind;
use sightline_track::trace::ArrayName;
use sightline_vision::image::GrayImage;

use crate::cache::StepKey;
use crate::drawing::raster::Raster;
use crate::state::State;
use crate::state::undoable::UndoableChange;
use crate::what_if::{Scores, Trial};

impl State {
    /// Changes the trial at the cursor's step.
    pub(crate) fn try_out(&mut self, what_if: WhatIf) {
        let Some(key) = self.step_key(self.cursor.step).filter(|_| self.row().is_some()) else { return };
        let before = self.trial().map(|trial| trial.what_if.clone()).unwrap_or_default();
        if before == what_if {
            return;
        }
        self.record_change(UndoableChange::Tried { of: key.clone(), before, after: what_if.clone() });
        self.set_trial(key, what_if);
    }

    pub(crate) fn set_trial(&mut self, of: StepKey, what_if: WhatIf) {
        if what_if.is_empty() {
            self.why.trial = None;
            return;
        }
        // The last result remains until the new one arrives, so that a drag does not flicker.
        let last = self.why.trial.take().filter(|trial| trial.of == of);
        let has_scores = last.as_ref().is_some_and(|trial| trial.has_scores);
        let ghost = last.and_then(|trial| trial.ghost);
        self.why.trial = Some(Trial { of, what_if, ghost, has_scores, refused: None });
        self.send_trial();
    }

    /// Sends the newest change, unless an older one is under way.
    pub(crate) fn send_trial(&mut self) {
        let Some(trial) = &self.why.trial else { return };
        let is_whole = trial.has_scores || !self.why.wants_scores;
        let is_answered =
            trial.ghost.as_ref().is_some_and(|ghost| ghost.what_if == trial.what_if) && is_whole;
        if self.why.trying.is_some() || is_answered || trial.refused.is_some() {
            return;
        }
        let (of, mut what_if) = (trial.of.clone(), trial.what_if.clone());
        if self.why.wants_scores {
            what_if.arrays.push(ArrayName::SURFACE);
        }
        self.why.trying = Some((of.clone(), what_if.clone()));
        let call = Call::with_body::<TryStep>(&of, &what_if);
        self.call_with_problem::<TryStep>(call, move |state, outcome| {
            state.on_trial_reply(&of, what_if, outcome);
        });
    }

    /// Stores the result of a trial, or why it was refused; then sends the newest change.
    fn on_trial_reply(&mut self, of: &StepKey, mut what_if: WhatIf, outcome: Result<Ghost, Problem>) {
        self.why.trying = None;
        let has_scores = !what_if.arrays.is_empty();
        // The requested arrays are not part of the change.
        what_if.arrays.clear();
        if let Some(trial) = self.why.trial.as_mut().filter(|trial| trial.of == *of) {
            let is_newest = trial.what_if == what_if;
            match outcome {
                Ok(mut ghost) => {
                    ghost.what_if.arrays.clear();
                    (trial.ghost, trial.has_scores) = (Some(ghost), has_scores);
                    trial.refused = trial.refused.take().filter(|_| !is_newest);
                }
                Err(problem) if is_newest => trial.refused = Some(problem.detail),
                Err(_) => {}
            }
        }
        self.send_trial();
    }

    /// Sets whether the scores of the trial are visible; requests the trial again if they are missing.
    pub fn show_trial_scores(&mut self, is_seen: bool) {
        let is_wanted =
            is_seen && self.why.scores_shown != Scores::Recorded && self.tracker() == TrackerKind::Template;
        self.why.wants_scores = is_wanted;
        if is_wanted {
            self.send_trial();
        }
    }

    /// The result of the trial at the cursor's step with its scores; `None` until both have arrived.
    pub(crate) fn trial_scores(&self, context: &egui::Context) -> Option<(&Ghost, Arc<Raster>)> {
        let trial = self.trial()?;
        let ghost = trial.ghost.as_ref()?;
        let array = ghost.arrays.iter().find(|array| array.name == ArrayName::SURFACE)?;
        let of = (trial.of.clone(), ghost.what_if.clone());
        let mut shown = self.why.scores.lock();
        if let Some((_, raster)) = shown.as_ref().filter(|(known, _)| *known == of) {
            return Some((ghost, Arc::clone(raster)));
        }
        let values = array.values.iter().map(|value| value.unwrap_or(f32::NAN)).collect();
        let values = GrayImage::from_raw(array.size[0], array.size[1], values)?;
        let raster = Arc::new(Raster::from_values(context, ArrayName::SURFACE, values));
        *shown = Some((of, Arc::clone(&raster)));
        Some((ghost, raster))
    }
}
