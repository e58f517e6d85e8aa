//! The light: the sun, with hard shadows, and the sky.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::within;
use crate::error::Result;

/// The sun, with hard shadows, and the light of the sky.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SunSettings {
    /// Where the sun stands, deg, clockwise from above, 0 straight ahead of the drive, 90 on the right.
    pub azimuth_deg: f64,
    /// Its height above the horizon, deg.
    pub elevation_deg: f64,
    /// The sky's part of the light on level ground (0.35: optical depth 0.4, sun at 45°, domain.md 11.1).
    pub diffuse_fraction: f64,
    /// L of the lunar–Lambert law, 0 = Lambert (0.5: domain.md 11.2).
    pub lunar_lambert: f64,
}

impl Default for SunSettings {
    fn default() -> Self {
        Self { azimuth_deg: 115.0, elevation_deg: 42.0, diffuse_fraction: 0.35, lunar_lambert: 0.5 }
    }
}

impl SunSettings {
    pub(super) fn validate(&self) -> Result<()> {
        within("sun.azimuth_deg", self.azimuth_deg, -360.0, 360.0)?;
        within("sun.elevation_deg", self.elevation_deg, 5.0, 90.0)?;
        within("sun.diffuse_fraction", self.diffuse_fraction, 0.0, 1.0)?;
        within("sun.lunar_lambert", self.lunar_lambert, 0.0, 1.0)
    }
}
