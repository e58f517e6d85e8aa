//! Times of the stages of a stop, s: on Mars by the model [`FlightTime`], and on this machine as measured by the server
//! (without rendering the images of a simulated stop).

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
    /// Modelled time on Mars, s.
    pub flight_s: f64,
    /// Measured time on this machine, s; null if it was not measured.
    pub own_s: Option<f64>,
}

/// The measured times of the stages of a step, s. They are not part of its record, so all values compare as equal.
#[derive(Clone, Debug, Default)]
pub struct Took(pub Vec<(CycleStage, f64)>);

impl PartialEq for Took {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// The times of a step's stages in running order; `drive_s` is the duration of the commanded drive from its stop, s.
pub fn times(step: &RunStep, drive_s: Option<f64>) -> Vec<StageTime> {
    let pointing = &step.point_mast;
    let sizes = [pointing.left.size, pointing.right.size];
    let flight = FlightTime {
        drive_s: drive_s.unwrap_or(0.0),
        ..FlightTime::of_stop(sizes, step.odometry.as_deref())
    };
    let own_s = |stage: CycleStage| step.took.0.iter().find(|(own, _)| *own == stage).map(|(_, s)| *s);
    let reached = CycleStage::ALL.into_iter().filter(|stage| match stage {
        CycleStage::SetGoal | CycleStage::SelectPath => false,
        CycleStage::Drive => drive_s.is_some(),
        stage => step.paused_before().is_none_or(|before| *stage < before),
    });
    reached.map(|stage| StageTime { stage, flight_s: flight.of(stage), own_s: own_s(stage) }).collect()
}
