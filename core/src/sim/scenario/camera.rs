//! The detector and the optics.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::within;
use crate::error::{Error, Result};

/// The detector and the optics (domain.md 5.1 and 11.3).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CameraSettings {
    /// Side of the square image, px: 1024, 512, 256 or 128; smaller ones are block averages (domain.md 2.1).
    pub image_size: u32,
    /// σ of the optics' Gaussian blur, px of the image (0.5–0.7: domain.md 11.3).
    pub blur_px: f64,
    /// Samples along each axis of a pixel, 1 to 8; the pixel's value is their mean over its area.
    pub samples_per_axis: u32,
    /// Bits of a recorded pixel: 12, or 8 (the 12-bit number scaled down).
    pub bit_depth: u32,
    /// Electrons per number of the 12-bit converter (42: 170 ke⁻ / 4095).
    pub gain_electrons_per_dn: f64,
    /// Read noise, electrons (30).
    pub read_noise_electrons: f64,
    /// Number that the converter gives in the dark, DN of 12 bits (20).
    pub bias_dn: f64,
    /// Pixel-to-pixel spread of the response, relative, fixed for each camera (0.01).
    pub response_spread: f64,
    /// Mean of the first left image, fraction of full scale; the exposure is then kept for all images (ours).
    pub mean_level: f64,
}

impl Default for CameraSettings {
    fn default() -> Self {
        Self {
            image_size: 1024,
            blur_px: 0.6,
            samples_per_axis: 4,
            bit_depth: 12,
            gain_electrons_per_dn: 42.0,
            read_noise_electrons: 30.0,
            bias_dn: 20.0,
            response_spread: 0.01,
            mean_level: 0.4,
        }
    }
}

impl CameraSettings {
    pub(super) fn validate(&self) -> Result<()> {
        if ![1024, 512, 256, 128].contains(&self.image_size) {
            return Err(Error::setting("camera.image_size", "choose 1024, 512, 256 or 128"));
        }
        if ![12, 8].contains(&self.bit_depth) {
            return Err(Error::setting("camera.bit_depth", "choose 12 or 8"));
        }
        within("camera.blur_px", self.blur_px, 0.0, 3.0)?;
        within("camera.samples_per_axis", f64::from(self.samples_per_axis), 1.0, 8.0)?;
        within("camera.gain_electrons_per_dn", self.gain_electrons_per_dn, 0.1, 1000.0)?;
        within("camera.read_noise_electrons", self.read_noise_electrons, 0.0, 1000.0)?;
        within("camera.bias_dn", self.bias_dn, 0.0, 1000.0)?;
        within("camera.response_spread", self.response_spread, 0.0, 0.2)?;
        within("camera.mean_level", self.mean_level, 0.02, 0.9)
    }
}
