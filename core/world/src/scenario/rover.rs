//! The rover: wheel slip, odometry, and the tracks that it leaves.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::range::within;
use sightline_geometry::error::Result;

/// The soil under the wheels (domain.md 5.5).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Soil {
    /// Loose sand: slip ratio 45 % on 15°.
    LooseSand,
    /// Firm soil with rocks: slip ratio 15 % on 15°.
    #[default]
    FirmSoil,
    /// Bedrock: slip ratio 3 % on 15°.
    Bedrock,
}

/// Source of the pose estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum OdometryModel {
    /// The true motion with the errors that `odometry_error` states: exactly the model that the tracker assumes.
    #[default]
    Stated,
    /// Wheel odometry integrated along an attitude from gyro and accelerometers: slip is an error (R10).
    WheelsAndImu,
}

/// A given slip ratio on the motion to one stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ForcedSlip {
    /// Index of the stop at which the motion ends; the first stop is 0, so 1 or more.
    pub stop: u32,
    /// Slip ratio: 1 = the wheels turn and the rover stays (0 to 1.25: domain.md 5.5).
    pub slip: f64,
}

/// A jump of the estimated heading on the motion to one stop: the attitude is reset, for example by a sighting of the sun,
/// to a wrong value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct HeadingJump {
    /// Index of the first stop with the rotated estimate; the first stop is 0, so 1 or more.
    pub stop: u32,
    /// Angle of the jump, deg, positive to the right (−45 to 45).
    pub yaw_deg: f64,
}

/// The rover's wheels and its odometry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RoverSettings {
    /// The soil under the wheels (`firm_soil`, ours).
    pub soil: Soil,
    /// Factor on the slip of the soil: 1 = as in domain.md 5.5, 0 = none (0, ours).
    pub slip_scale: f64,
    /// 1σ spread of the slip of a step relative to it, drawn for each step of a commanded drive (0; 0.2 is plausible,
    /// ours).
    #[serde(skip_serializing_if = "is_zero")]
    pub slip_spread: f64,
    /// Height of the highest rock that a wheel climbs, m; a higher one stalls it (0.25: domain.md 5.4).
    pub climb_m: f64,
    /// From the motion to this stop on, the slip ratio is 100 % (the rover is stuck); 0 = never (0; Kim09 §5.5).
    pub stuck_from_stop: u32,
    /// Source of the pose estimate (`stated`).
    pub odometry: OdometryModel,
    /// Angle random walk of the gyro, deg/√h, for `wheels_and_imu` (0.1: domain.md 5.5).
    pub gyro_walk_deg_per_root_hour: f64,
    /// 1σ bias of the gyro, deg/h, drawn once for the drive, for `wheels_and_imu` (1: domain.md 5.5).
    pub gyro_bias_deg_per_hour: f64,
    /// Whether the wheels leave tracks (false: the demonstration shows untouched ground; Kim09 §7.3).
    pub tracks: bool,
    /// Width of a wheel's track, m (0.16, as wide as a wheel; ours).
    pub track_width_m: f64,
    /// Sinkage of a wheel, m (0.01, ours).
    pub track_depth_m: f64,
    /// Slip ratios given for single stops, in any order (none; Kim09 §5.5).
    pub forced_slip: Vec<ForcedSlip>,
    /// Jumps of the estimated heading at single stops, in any order (none); no covariance includes them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub heading_jumps: Vec<HeadingJump>,
}

fn is_zero(value: &f64) -> bool {
    *value == 0.0
}

impl Default for RoverSettings {
    fn default() -> Self {
        Self {
            soil: Soil::FirmSoil,
            slip_scale: 0.0,
            slip_spread: 0.0,
            climb_m: 0.25,
            stuck_from_stop: 0,
            odometry: OdometryModel::Stated,
            gyro_walk_deg_per_root_hour: 0.1,
            gyro_bias_deg_per_hour: 1.0,
            tracks: false,
            track_width_m: 0.16,
            track_depth_m: 0.01,
            forced_slip: Vec::new(),
            heading_jumps: Vec::new(),
        }
    }
}

impl RoverSettings {
    pub(crate) fn validate(&self) -> Result<()> {
        within("rover.slip_scale", self.slip_scale, 0.0, 5.0)?;
        within("rover.slip_spread", self.slip_spread, 0.0, 1.0)?;
        within("rover.climb_m", self.climb_m, 0.0, 0.4)?;
        within("rover.stuck_from_stop", f64::from(self.stuck_from_stop), 0.0, 10_000.0)?;
        for (index, forced) in self.forced_slip.iter().enumerate() {
            within(&format!("rover.forced_slip[{index}].stop"), f64::from(forced.stop), 1.0, 10_000.0)?;
            within(&format!("rover.forced_slip[{index}].slip"), forced.slip, 0.0, 1.25)?;
        }
        for (index, jump) in self.heading_jumps.iter().enumerate() {
            within(&format!("rover.heading_jumps[{index}].stop"), f64::from(jump.stop), 1.0, 10_000.0)?;
            within(&format!("rover.heading_jumps[{index}].yaw_deg"), jump.yaw_deg, -45.0, 45.0)?;
        }
        within("rover.gyro_walk_deg_per_root_hour", self.gyro_walk_deg_per_root_hour, 0.0, 10.0)?;
        within("rover.gyro_bias_deg_per_hour", self.gyro_bias_deg_per_hour, 0.0, 100.0)?;
        within("rover.track_width_m", self.track_width_m, 0.01, 0.5)?;
        within("rover.track_depth_m", self.track_depth_m, 0.0, 0.1)
    }

    /// The given slip ratio of the motion to a stop, if any.
    pub(crate) fn forced_slip_to(&self, stop: usize) -> Option<f64> {
        if self.stuck_from_stop > 0 && stop >= self.stuck_from_stop as usize {
            return Some(1.0);
        }
        self.forced_slip.iter().find(|forced| forced.stop as usize == stop).map(|forced| forced.slip)
    }
}
