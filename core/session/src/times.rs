//! What the stages of a stop take: on Mars, by the model of [`FlightTime`], and on this machine, as measured.
//!
//! Unit: s.

use std::cell::RefCell;
use std::time::Instant;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_rover::driving::FlightTime;
use sightline_track::cycle_stage::CycleStage;

use crate::step::RunStep;

/// The time of one stage.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StageTime {
    /// The stage.
    pub stage: CycleStage,
    /// On Mars, s.
    pub flight_s: f64,
    /// On this machine, when the step was computed, s; null where it was not measured.
    pub own_s: Option<f64>,
}

/// The measured times of the stages of a step. They are no part of its record: steps are equal whatever they took.
#[derive(Clone, Debug, Default)]
pub struct Took(pub Vec<(CycleStage, f64)>);

impl PartialEq for Took {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// Measures the stages of a step, each from the end of the one before.
pub(crate) struct Stopwatch {
    last: RefCell<Instant>,
    took: RefCell<Took>,
}

impl Stopwatch {
    pub(crate) fn start() -> Self {
        Self { last: RefCell::new(Instant::now()), took: RefCell::default() }
    }

    /// Takes the end of a stage.
    pub(crate) fn ended(&self, stage: CycleStage) {
        let now = Instant::now();
        let before = self.last.replace(now);
        self.took.borrow_mut().0.push((stage, (now - before).as_secs_f64()));
    }

    /// The times so far.
    pub(crate) fn took(self) -> Took {
        self.took.into_inner()
    }
}

/// The times of a step's stages in running order; `drive_s` is the duration of the drive from its stop, s, of a drive on commands.
pub fn times(step: &RunStep, drive_s: Option<f64>) -> Vec<StageTime> {
    let pointing = &step.point_mast;
    let sizes = [pointing.left.size, pointing.right.size];
    let flight = FlightTime { drive_s: drive_s.unwrap_or(0.0), ..FlightTime::of_stop(sizes) };
    let own_s = |stage: CycleStage| step.took.0.iter().find(|(own, _)| *own == stage).map(|(_, s)| *s);
    let reached = CycleStage::ALL.into_iter().filter(|stage| match stage {
        CycleStage::SetGoal | CycleStage::SelectPath => false,
        CycleStage::Drive => drive_s.is_some(),
        stage => step.paused_before().is_none_or(|before| *stage < before),
    });
    reached.map(|stage| StageTime { stage, flight_s: flight.of(stage), own_s: own_s(stage) }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stage_takes_the_time_from_the_end_of_the_one_before() {
        let watch = Stopwatch::start();
        watch.ended(CycleStage::Predict);
        std::thread::sleep(std::time::Duration::from_millis(20));
        watch.ended(CycleStage::Capture);
        let took = watch.took();
        let [(first, first_s), (second, second_s)] = took.0[..] else { panic!("{took:?}") };
        assert_eq!((first, second), (CycleStage::Predict, CycleStage::Capture));
        assert!(first_s >= 0.0 && second_s >= 0.02, "{took:?}");
        assert_eq!(took, Took::default(), "times make no difference");
    }
}
