//! Pauses of a commanded drive: before or after any stage of a stop.
//!
//! ```text
//! predict → point_mast → capture → locate → judge → update → set_goal → select_path → drive
//! ```
//! A pause is stored as the first stage that is not computed ([`Halt`]): after `drive` means before `predict` of the next
//! stop. The designation is not divided; a pause within it becomes a pause before `drive`.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::Session;
use crate::driving::Steering;
use crate::step::RunStep;
use sightline_rover::driving::Cycle;
use sightline_track::cycle_stage::CycleStage;

/// The side of a stage on which the drive pauses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PauseSide {
    /// The stage is the first one that is not computed.
    Before,
    /// The stage is the last one that is computed.
    After,
}

/// A pause before or after a stage of the stop `pause_at`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct StagePause {
    /// The side.
    pub when: PauseSide,
    /// The stage.
    pub stage: CycleStage,
}

/// The stop and stage at which a drive pauses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[schema(as = DriveHalt)]
pub struct Halt {
    /// The stop, from 0.
    pub stop: usize,
    /// The first stage that is not computed at this stop.
    pub before: CycleStage,
}

impl StagePause {
    /// The halt of this pause at a stop.
    pub fn at(self, stop: usize) -> Halt {
        match self.when {
            PauseSide::Before => Halt { stop, before: self.stage },
            PauseSide::After => Halt { stop, before: self.stage }.next(),
        }
    }
}

impl Halt {
    /// The next possible halt: one stage later.
    #[must_use]
    pub fn next(self) -> Self {
        match self.before.next() {
            Some(before) => Self { before, ..self },
            None => Self { stop: self.stop + 1, before: CycleStage::Predict },
        }
    }
}

impl Steering {
    /// The halt of the command; `None` without a pause.
    pub fn halt(&self) -> Option<Halt> {
        let whole = StagePause { when: PauseSide::Before, stage: CycleStage::Drive };
        self.pause_at.map(|stop| self.pause.unwrap_or(whole).at(stop))
    }

    /// The same command, but staying at the last stop, with a pause that is due there.
    #[must_use]
    pub fn staying(&self, last_stop: usize) -> Self {
        let due = self.halt().filter(|halt| halt.stop <= last_stop);
        let pause = due.map(|halt| StagePause { when: PauseSide::Before, stage: halt.before });
        Self { pause_at: Some(0), pause, ..self.clone() }
    }

    /// The stage before which the drive pauses at its next stop, from `predict` to `update`; `None` if it does not.
    pub fn halt_within(&self, stop: usize) -> Option<CycleStage> {
        let halt = self.halt().filter(|halt| stop >= halt.stop)?;
        Some(halt.before).filter(|before| *before <= CycleStage::Update)
    }

    /// Truncates the decisions at the pause: removes the results of stages that are not computed from the last decision.
    pub(crate) fn up_to_halt(&self, cycles: &mut Vec<Cycle>) {
        let Some((halt, last)) = self.halt().zip(cycles.last_mut()) else { return };
        if last.step < halt.stop || last.report.is_some() {
            return;
        }
        match halt.before {
            CycleStage::SetGoal => drop(cycles.pop()),
            CycleStage::SelectPath => {
                (last.motion, last.choice, last.looks_at, last.ending) = (None, None, None, None);
            }
            _ => {}
        }
    }
}

impl Session {
    /// The stage before which a step at the last stop of a commanded drive pauses: by its command, or because the world is
    /// not ready for it. `None`: the whole step is computed.
    pub(crate) fn halt_within(&self, stop: usize) -> Option<CycleStage> {
        if stop + 1 != self.stop_count {
            return None;
        }
        let asked = self.steering.as_ref().and_then(|steering| steering.halt_within(stop));
        asked.into_iter().chain(self.awaits).min()
    }
}

/// The halt of the driving run, from its steps and the number of stops.
pub(crate) fn halted(
    steering: &Steering,
    steps: &[std::sync::Arc<RunStep>],
    stop_count: usize,
) -> Option<Halt> {
    let last = steps.last()?;
    if let Some(before) = last.paused_before() {
        return Some(Halt { stop: last.step, before });
    }
    if last.step + 1 < stop_count {
        return Some(Halt { stop: last.step + 1, before: CycleStage::Predict });
    }
    let before = steering.halt().filter(|halt| halt.stop <= last.step).map(|halt| halt.before);
    let before = before.filter(|before| *before > CycleStage::Update).unwrap_or(CycleStage::Drive);
    Some(Halt { stop: last.step, before })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steering(pause_at: Option<usize>, pause: Option<(PauseSide, CycleStage)>) -> Steering {
        let pause = pause.map(|(when, stage)| StagePause { when, stage });
        Steering { target: 0, run: 0, command: Default::default(), then: Vec::new(), pause_at, pause }
    }

    #[test]
    fn after_a_stage_is_before_the_next_and_after_drive_before_the_next_stop() {
        let halt = |when, stage| steering(Some(3), Some((when, stage))).halt().unwrap();
        for stage in CycleStage::ALL {
            assert_eq!(halt(PauseSide::Before, stage), Halt { stop: 3, before: stage });
            let after = halt(PauseSide::After, stage);
            let wanted = match stage.next() {
                Some(next) => Halt { stop: 3, before: next },
                None => Halt { stop: 4, before: CycleStage::Predict },
            };
            assert_eq!(after, wanted);
        }
        assert_eq!(steering(None, Some((PauseSide::After, CycleStage::Locate))).halt(), None);
        assert_eq!(steering(Some(2), None).halt(), Some(Halt { stop: 2, before: CycleStage::Drive }));
    }

    #[test]
    fn a_pause_holds_a_step_from_its_stop_on_and_the_world_holds_it_earlier() {
        let mut session = Session::new("s1", "t", 4);
        session.steering = Some(steering(Some(3), Some((PauseSide::After, CycleStage::Locate))));
        assert_eq!(session.halt_within(3), Some(CycleStage::Judge));
        assert_eq!(session.halt_within(2), None, "a stop that the rover has left is computed as a whole");
        session.awaits = Some(CycleStage::Capture);
        assert_eq!(session.halt_within(3), Some(CycleStage::Capture));
        session.steering = Some(steering(Some(4), None));
        (session.awaits, session.stop_count) = (None, 5);
        assert_eq!(session.halt_within(4), None, "the pause before `drive` is one between steps");
    }
}
