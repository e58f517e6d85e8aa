//! The light: the sun, with hard shadows, the sky, and the law of reflection.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::range::within;
use sightline_geometry::error::Result;

/// The law of reflection for the sun's light (domain.md 11.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Reflectance {
    /// A mixture of Lommel–Seeliger's and Lambert's laws.
    #[default]
    LunarLambert,
    /// Hapke's model with a two-lobe phase function: backscattering, brightest opposite the sun.
    Hapke,
}

/// The sun, with hard shadows, and the light of the sky.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SunSettings {
    /// Azimuth of the sun, deg, clockwise from above, 0 straight ahead of the drive, 90 on the right.
    pub azimuth_deg: f64,
    /// Elevation of the sun above the horizon, deg.
    pub elevation_deg: f64,
    /// Fraction of the light on level ground that comes from the sky (0.45: optical depth 0.55, sun at 45°, domain.md
    /// 11.1; shadows in Spirit's images of sol 1869 have half of the mean level).
    pub diffuse_fraction: f64,
    /// Optical depth of the dust in the air; if set, it determines the sky's fraction from the sun's elevation
    /// instead of `diffuse_fraction` (0.3 to 0.5 in the clear season, 1 when dusty: domain.md 11.1).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub optical_depth: Option<f64>,
    /// Ratio of the sky's radiance around the sun to that far from it, minus one (2: domain.md 11.1).
    pub aureole: f64,
    /// The law of reflection for the sun's light.
    pub reflectance: Reflectance,
    /// L of the lunar–Lambert law, 0 = Lambert (0.5: domain.md 11.2).
    pub lunar_lambert: f64,
    /// Mean slope of the roughness below the resolution of the surface, deg (15: domain.md 11.2 gives 10 to 20): it
    /// keeps grazing surfaces from shining.
    pub roughness_deg: f64,
    /// b of Hapke's phase function: how narrow its two lobes are, 0 = isotropic (0.35: domain.md 11.2).
    pub hapke_lobe: f64,
    /// c of Hapke's phase function: 1 = all backscattering, −1 = all forward scattering (0.5: domain.md 11.2).
    pub hapke_backscatter: f64,
    /// B0 of Hapke's opposition surge: its height relative to the phase function (1: domain.md 11.2).
    pub hapke_surge: f64,
    /// h of Hapke's opposition surge: tangent of half its width (0.05: domain.md 11.2).
    pub hapke_surge_width: f64,
}

impl Default for SunSettings {
    fn default() -> Self {
        Self {
            azimuth_deg: 115.0,
            elevation_deg: 42.0,
            diffuse_fraction: 0.45,
            optical_depth: None,
            aureole: 2.0,
            reflectance: Reflectance::LunarLambert,
            lunar_lambert: 0.5,
            roughness_deg: 15.0,
            hapke_lobe: 0.35,
            hapke_backscatter: 0.5,
            hapke_surge: 1.0,
            hapke_surge_width: 0.05,
        }
    }
}

impl SunSettings {
    pub(crate) fn validate(&self) -> Result<()> {
        within("sun.azimuth_deg", self.azimuth_deg, -360.0, 360.0)?;
        within("sun.elevation_deg", self.elevation_deg, 5.0, 90.0)?;
        within("sun.diffuse_fraction", self.diffuse_fraction, 0.0, 1.0)?;
        within("sun.optical_depth", self.optical_depth.unwrap_or(0.0), 0.0, 4.0)?;
        within("sun.aureole", self.aureole, 0.0, 20.0)?;
        within("sun.lunar_lambert", self.lunar_lambert, 0.0, 1.0)?;
        within("sun.roughness_deg", self.roughness_deg, 0.0, 40.0)?;
        within("sun.hapke_lobe", self.hapke_lobe, 0.0, 0.9)?;
        within("sun.hapke_backscatter", self.hapke_backscatter, -1.0, 1.0)?;
        within("sun.hapke_surge", self.hapke_surge, 0.0, 1.0)?;
        within("sun.hapke_surge_width", self.hapke_surge_width, 0.005, 1.0)
    }
}
