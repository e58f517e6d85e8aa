//! Dust in the air that reduces the contrast of an image: an injected fault.
//!
//! ```text
//! L(pixel) ← L̄ + (1 − s)(L(pixel) − L̄)      L̄: mean of the image; s: fraction of the contrast that is lost
//! ```
//! Source: papers.md R208 (feature starvation); the law is ours.

use sightline_vision::image::GrayImage;

use crate::scenario::{FaultKind, Scenario};

/// Fraction of the contrast lost to the dust.
const TAKEN: f32 = 0.95;

/// Reduces the contrast of a whole image of clean radiance if the scenario has this fault at the stop.
pub fn add_dust(radiance: &mut GrayImage, scenario: &Scenario, stop: u32) {
    if !scenario.events.has_fault(FaultKind::FeatureStarvation, stop) {
        return;
    }
    let mean = radiance.iter().copied().map(f64::from).sum::<f64>() / radiance.len().max(1) as f64;
    let mean = mean as f32;
    radiance.iter_mut().for_each(|value| *value = mean + (1.0 - TAKEN) * (*value - mean));
}
