//! Pauses of a commanded drive before or after a stage: the form, the current pause, and the records to discard when the
//! drive continues.

use sightline_session::compare::RunName;
use sightline_session::driving::Steering;
use sightline_session::pause::{Halt, PauseSide, StagePause};
use sightline_session::view::RunView;
use sightline_track::cycle_stage::CycleStage;

use crate::cache::Key;
use crate::command::Stage;
use crate::state::State;

/// The pause in the form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PauseForm {
    /// The side and the stage.
    pub pause: StagePause,
    /// Whether the drive pauses at every stop; otherwise at one stop only.
    pub is_every_stop: bool,
}

impl Default for PauseForm {
    fn default() -> Self {
        let pause = StagePause { when: PauseSide::Before, stage: CycleStage::Drive };
        Self { pause, is_every_stop: true }
    }
}

impl PauseForm {
    /// The pause to send in a command; `None` for the default, before `drive`.
    pub(super) fn to_request(self) -> Option<StagePause> {
        (self.pause != Self::default().pause).then_some(self.pause)
    }

    /// The stop of the next pause of a paused drive, for the command; `None`: it drives on without a pause.
    pub(super) fn next_stop(self, here: Halt) -> Option<usize> {
        let stops = here.stop..=here.stop + usize::from(self.is_every_stop);
        stops.into_iter().find(|stop| self.pause.at(*stop) > here)
    }
}

/// The steering with its next pause at `halt`.
pub(super) fn until(steering: Steering, halt: Halt) -> Steering {
    let pause = StagePause { when: PauseSide::Before, stage: halt.before };
    Steering { pause_at: Some(halt.stop), pause: Some(pause), ..steering }
}

impl State {
    /// Where the drive of the open session is paused.
    pub(crate) fn halt(&self) -> Option<Halt> {
        self.drive()?.paused
    }

    /// The first stage that is not computed at a stop, because the drive is paused there.
    pub(crate) fn paused_before(&self, step: usize) -> Option<CycleStage> {
        let row = self.row_at(step);
        if let Some(before) = row.and_then(|row| row.paused_before) {
            return Some(before);
        }
        let before = self.halt().filter(|halt| halt.stop == step)?.before;
        // A complete row lacks only stages after `update`; without a row, all stages are missing.
        let is_here = if row.is_some() { before > CycleStage::Update } else { before == CycleStage::Predict };
        is_here.then_some(before)
    }

    /// Whether a stop has no images because the drive is paused before their capture.
    pub(crate) fn lacks_images_yet(&self, step: usize) -> bool {
        self.halt().is_some_and(|halt| halt.stop == step && halt.before <= CycleStage::Capture)
    }

    /// Whether a run is paused with its drive.
    pub(crate) fn is_paused(&self, run: &RunView) -> bool {
        let is_next = |row: &sightline_session::step::StepRow| {
            row.paused_before.is_some()
                || self.halt() == Some(Halt { stop: row.step + 1, before: CycleStage::Predict })
        };
        run.rows.last().is_some_and(is_next)
    }

    /// Why a stage is missing, if the drive is paused before it; otherwise `None`.
    pub(crate) fn missing_by_pause(&self, step: usize) -> Option<String> {
        let before = self.paused_before(step).filter(|before| *before <= CycleStage::Update)?;
        let located = self.trace_at(step).ready().and_then(|trace| trace.located());
        // A located stage without a result contains its own explanation.
        if before > CycleStage::Locate && located.is_some_and(|located| located.missing.is_some()) {
            return None;
        }
        Some(not_computed(before))
    }

    /// Whether a stage that only a drive has is complete at the cursor's stop.
    pub(crate) fn is_decided(&self, stage: Stage) -> bool {
        let step = self.cursor.step;
        let is_before = self.paused_before(step).is_none_or(|before| stage.in_cycle() < before);
        let has_driven =
            |cycle: &sightline_rover::driving::Cycle| stage != Stage::DRIVE || cycle.report.is_some();
        is_before && self.cycle_at(step).is_some_and(has_driven)
    }

    /// Discards the records of steps that were paused when they were read and have had further stages computed since.
    pub(crate) fn forget_begun_steps(&mut self) {
        let open = self.session.as_ref().map(|session| session.id.clone());
        for (key, before) in self.cache.begun() {
            let run = self.run_named(RunName { target: key.target, run: key.run }).map(|(_, run)| run);
            let row = run.and_then(|run| run.rows.iter().rev().find(|row| row.step == key.step));
            let has_more = row.is_some_and(|row| row.paused_before.is_none_or(|now| now > before));
            if has_more && open.as_ref() == Some(&key.session) {
                self.cache.forget(|cached| match cached {
                    Key::Trace(of) | Key::Array(of, _) | Key::Arrays(of) => *of == key,
                    Key::EarlierTemplates(of) | Key::Times(of) => *of == key,
                    Key::Image { .. } | Key::Stop { .. } | Key::Odometry { .. } | Key::Hazards { .. } => {
                        false
                    }
                });
            }
        }
    }

    /// Discards the cameras of a stop whose mast was not pointed when they were read.
    pub(super) fn forget_unpointed(&mut self, before: Option<Halt>) {
        let Some(halt) = before.filter(|halt| halt.before <= CycleStage::PointMast) else { return };
        if self.halt() != before {
            self.cache.forget(|key| matches!(key, Key::Stop { step, .. } if *step == halt.stop));
        }
    }
}

/// The explanation of a stage that is missing because of a pause, and how to compute it.
pub(crate) fn not_computed(before: CycleStage) -> String {
    format!(
        "Not computed yet: the drive is paused before `{}`. “Next stage” or “Continue” in the panel Drive goes on.",
        before.word()
    )
}

/// A description of a pause.
pub(super) fn in_words(halt: Halt) -> String {
    let (stop, before) = (halt.stop, halt.before.word());
    match halt.before.previous() {
        Some(after) => format!("paused at stop {stop}: after {}, before {before}", after.word()),
        None => format!("paused at stop {stop}: after drive, before {before}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn form(when: PauseSide, stage: CycleStage, is_every_stop: bool) -> PauseForm {
        PauseForm { pause: StagePause { when, stage }, is_every_stop }
    }

    #[test]
    fn continuing_goes_to_the_chosen_stage_of_this_or_of_the_next_stop() {
        use CycleStage::{Drive, Judge, Locate, Predict};
        let here = |before| Halt { stop: 3, before };
        let every = form(PauseSide::After, Locate, true);
        assert_eq!(every.next_stop(here(Locate)), Some(3));
        assert_eq!(every.next_stop(here(Judge)), Some(4), "it waits there already");
        let once = form(PauseSide::After, Locate, false);
        assert_eq!(once.next_stop(here(Predict)), Some(3));
        assert_eq!(once.next_stop(here(Drive)), None, "it drives on");
        // After `drive` is before `predict` of the next stop.
        assert_eq!(form(PauseSide::After, Drive, true).next_stop(here(Predict)), Some(3));
        assert_eq!(PauseForm::default().next_stop(here(Drive)), Some(4));
        assert_eq!((PauseForm::default().to_request(), every.to_request()), (None, Some(every.pause)));
    }

    #[test]
    fn a_pause_is_named_by_the_stages_on_both_sides() {
        let words = |before| in_words(Halt { stop: 2, before });
        assert_eq!(words(CycleStage::Judge), "paused at stop 2: after locate, before judge");
        assert_eq!(words(CycleStage::Predict), "paused at stop 2: after drive, before predict");
    }
}
