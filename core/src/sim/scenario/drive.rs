//! The way that the rover drives.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::within;
use crate::error::Result;
use crate::sim::rover::drive::distances_m;

/// The straight approach: distances follow `start · (1 − step)^i` until `end` is reached (R104, R106).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DriveSettings {
    /// Distance from the centre of the left camera to the targets' centre at the first stop, m (10: R108).
    pub start_distance_m: f64,
    /// The last stop is the first one at this distance or nearer, m (2: R106).
    pub end_distance_m: f64,
    /// Part of the remaining distance that a step takes away (0.10: R104).
    pub step_fraction: f64,
    /// 1σ error of each mast angle, deg; the index gives the measured angles, its truth the real cameras
    /// (0 by default; 0.05 is plausible: domain.md 4.5).
    pub pointing_error_deg: f64,
}

impl Default for DriveSettings {
    fn default() -> Self {
        Self { start_distance_m: 10.0, end_distance_m: 2.0, step_fraction: 0.10, pointing_error_deg: 0.0 }
    }
}

impl DriveSettings {
    pub(super) fn validate(&self) -> Result<()> {
        within("drive.end_distance_m", self.end_distance_m, 1.8, 50.0)?;
        within("drive.start_distance_m", self.start_distance_m, self.end_distance_m, 50.0)?;
        within("drive.step_fraction", self.step_fraction, 0.005, 0.5)?;
        let last_m = distances_m(self).last().copied().unwrap_or(0.0);
        within("drive.end_distance_m (distance of the last stop)", last_m, 1.7, 50.0)?;
        within("drive.pointing_error_deg", self.pointing_error_deg, 0.0, 5.0)
    }
}
