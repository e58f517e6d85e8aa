//! Time that a stop takes on Mars, by stage (R147–R150): a 20 MHz processor, tens of seconds per image transfer.
//!
//! | stage | time | source |
//! |---|---|---|
//! | point_mast | 5 s | ours |
//! | capture | 30 s for a 12-bit 1024 × 1024 pair, less with fewer pixels, at least 5 s | R148 |
//! | locate | 25 s: correlation 4 s, point stereo 1 s, 20 s of other tasks of the processor | R147, R149 |
//! | visual odometry | 90 s for each update, and point_mast and capture for a separate pair | R149 |
//! | select_path | 300 s with a hazard map: its pair, the map and the path | R149 |
//! | drive | 3.75 cm/s, 2.1°/s | domain.md 5.4 |
//!
//! The time of the other tasks is chosen such that an update takes one minute, as in the first line of Table IV (R143):
//! two updates in two minutes, without a motion. The other lines of the table, and the 19 min of checkout 2, are test
//! data.
//!
//! Unit: s.

use serde::{Deserialize, Serialize};
use sightline_track::cycle_stage::CycleStage;
use utoipa::ToSchema;

use super::motion::Motion;
use super::odometry::OdometryPair;
use crate::visual_odometry::MeasuredMotion;

/// Transfer of a full pair, s, and its pixels.
const CAPTURE_S: f64 = 30.0;
const CAPTURE_PX: f64 = 2.0 * 1024.0 * 1024.0;
/// Transfer of the smallest pair, s.
const CAPTURE_MIN_S: f64 = 5.0;
/// Turning the mast, s.
const POINT_MAST_S: f64 = 5.0;
/// Locating the target, including concurrent tasks, s.
const LOCATE_S: f64 = 25.0;
/// One update of the navigator: pair, hazard map and path, s.
const HAZARDS_S: f64 = 300.0;
/// One update of visual odometry, s.
const ODOMETRY_S: f64 = 90.0;
/// Speed of the rover, m/s (domain.md 5.4).
pub const SPEED_M_S: f64 = 0.0375;
/// Rate of a turn in place, rad/s (domain.md 5.4).
pub const TURN_RAD_S: f64 = 2.1 * std::f64::consts::PI / 180.0;

/// Time of one stop on Mars by stage, s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FlightTime {
    /// Measuring the motion to the stop by visual odometry; 0 without it.
    #[serde(default)]
    pub odometry_s: f64,
    /// Turning the mast.
    pub point_mast_s: f64,
    /// Exposing and transferring the pair.
    pub capture_s: f64,
    /// Locating the target, including other tasks of the processor.
    pub locate_s: f64,
    /// Pair, hazard map and path; 0 without a hazard map.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub hazards_s: f64,
    /// Driving to the next stop.
    pub drive_s: f64,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(value_s: &f64) -> bool {
    *value_s == 0.0
}

/// Exposing and transferring a pair, s.
fn capture_s(image_sizes: [[u32; 2]; 2]) -> f64 {
    let pixels: f64 = image_sizes.iter().map(|[width, height]| f64::from(*width) * f64::from(*height)).sum();
    (CAPTURE_S * pixels / CAPTURE_PX).max(CAPTURE_MIN_S)
}

/// Duration of a motion, s.
pub(super) fn drive_s(motion: &Motion) -> f64 {
    match *motion {
        Motion::Arc { length_m, curvature_per_m } => {
            (length_m.abs() / SPEED_M_S).max((length_m * curvature_per_m).abs() / TURN_RAD_S)
        }
        Motion::Turn { angle_rad } => angle_rad.abs() / TURN_RAD_S,
    }
}

impl FlightTime {
    /// The time of a tracked stop with images of these sizes, px, without the following drive.
    pub fn of_stop(image_sizes: [[u32; 2]; 2], odometry: Option<&MeasuredMotion>) -> Self {
        let capture_s = capture_s(image_sizes);
        let pair_s = POINT_MAST_S + capture_s;
        let odometry_s = odometry.map_or(0.0, |measured| {
            f64::from(measured.updates()) * ODOMETRY_S + f64::from(measured.own_pairs()) * pair_s
        });
        Self {
            odometry_s,
            point_mast_s: POINT_MAST_S,
            capture_s,
            locate_s: LOCATE_S,
            hazards_s: 0.0,
            drive_s: 0.0,
        }
    }

    /// The same for a stop at which a path is chosen on a hazard map.
    pub(crate) const fn with_hazards(self) -> Self {
        Self { hazards_s: HAZARDS_S, ..self }
    }

    /// The same for a stop at which only visual odometry runs, in the tracker's pair or in a separate one.
    pub(crate) fn without_tracking(self, pair: OdometryPair) -> Self {
        let alone = Self { locate_s: 0.0, ..self };
        match pair {
            OdometryPair::Shared => alone,
            OdometryPair::Own => Self { point_mast_s: 0.0, capture_s: 0.0, ..alone },
        }
    }

    /// The time of a stage, s; 0 for stages that take almost none. Visual odometry precedes the prediction and counts with
    /// it.
    pub const fn of(&self, stage: CycleStage) -> f64 {
        match stage {
            CycleStage::Predict => self.odometry_s,
            CycleStage::PointMast => self.point_mast_s,
            CycleStage::Capture => self.capture_s,
            CycleStage::Locate => self.locate_s,
            CycleStage::Drive => self.drive_s,
            CycleStage::SelectPath => self.hazards_s,
            CycleStage::Judge | CycleStage::Update | CycleStage::SetGoal => 0.0,
        }
    }

    /// Total time of all stages, s.
    pub(crate) fn total_s(&self) -> f64 {
        self.odometry_s + self.point_mast_s + self.capture_s + self.locate_s + self.hazards_s + self.drive_s
    }
}

#[cfg(test)]
mod tests {
    use sightline_geometry::camera::CameraName;

    use super::*;

    #[test]
    fn an_update_takes_half_a_minute_to_a_minute_as_in_flight() {
        // R149: one update 0.5 to 1 min; R148: a small pair is transferred in several seconds instead of 30.
        let full = FlightTime::of_stop([[1024, 1024]; 2], None).total_s();
        assert!((30.0..=60.0).contains(&full), "{full}");
        let small = FlightTime::of_stop([[256, 256]; 2], None).total_s();
        assert!((30.0..=full - 20.0).contains(&small), "{small}");
        // R149: 1.5 to 2 min for an update of visual odometry.
        for (camera, expected_s) in [(None, 90.0), (Some(CameraName::ODOMETRY), 125.0)] {
            let measured = MeasuredMotion { camera, ..crate::visual_odometry::accepted() };
            let with_odometry = FlightTime::of_stop([[1024, 1024]; 2], Some(&measured)).total_s();
            assert!((with_odometry - full - expected_s).abs() < 1e-9, "{with_odometry}");
        }
    }
}
