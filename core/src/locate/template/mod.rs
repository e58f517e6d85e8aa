//! The template locator: `scale_roll` → `match_template` → `point_stereo` → `triangulate` (K§4.1, R23–R29).
//!
//! What each step saw is one field of [`TemplateEvidence`]; arrays (patches and surfaces) are kept beside the
//! numbers but never serialised with them: the interface serves them one by one.
//!
//! Noise (ours; the papers' half pixel is the preset `half_pixel`): the covariance of the target's left
//! position against the designated point is that of the template carried along on the surface, `F D Fᵀ`, plus
//! that of this match; what biases the matches is carried as `F B + b` and enters the position as `B Bᵀ`.
//! `point_stereo` sees the same left position, so both eyes share its error.

pub mod settings;
pub mod scale_roll;
pub mod match_template;
pub mod match_noise;
pub mod stereo_curve;
mod stereo_search;
pub mod point_stereo;
pub mod triangulate;

pub use settings::TemplateSettings;

#[cfg(test)]
mod tests;

use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use self::match_template::TemplateMatch;
use self::point_stereo::{PointStereo, StereoInput};
use self::scale_roll::ScaleRoll;
use self::settings::NoiseModel;
use self::triangulate::Triangulation;
use super::{DesignateInput, Evidence, LocateInput, Located, Locator};
use crate::estimate::drift::Drift;

/// What the template locator saw; a step that was not reached is null.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TemplateEvidence {
    /// The template, scaled and rolled.
    pub scale_roll: Option<ScaleRoll>,
    /// Its match in the left image.
    pub match_template: Option<TemplateMatch>,
    /// The corresponding point in the right image.
    pub point_stereo: Option<PointStereo>,
    /// The position from both.
    pub triangulate: Option<Triangulation>,
}

/// The papers' noise: half a pixel (1σ) in each coordinate of each eye (R172).
const HALF_PIXEL_VARIANCE: f64 = 0.25;

/// Normalised correlation of a scaled and rolled template (Kim et al. 2009).
#[derive(Clone, Copy, Debug)]
pub struct TemplateLocator;

impl Locator for TemplateLocator {
    fn designate(&self, input: &DesignateInput<'_>) -> Located {
        let covariance = match input.settings.template.noise_model {
            // The click defines the target: it has no error of its own.
            NoiseModel::Measured => Matrix2::zeros(),
            NoiseModel::HalfPixel => Matrix2::identity() * HALF_PIXEL_VARIANCE,
        };
        let stereo = StereoInput {
            left_pixel: input.pixel,
            left_image: &input.capture.pair.left,
            right_image: &input.capture.pair.right,
            left: input.left,
            right: input.right,
            geometry: input.stereo,
            predicted_range_m: None,
        };
        finish(TemplateEvidence::default(), &stereo, Drift::of_pixel(covariance), &input.settings.template)
    }

    fn locate(&self, input: &LocateInput<'_>) -> Located {
        let settings = &input.settings.template;
        let mut evidence = TemplateEvidence::default();
        let left = &input.pointing.left;
        let prepared =
            match scale_roll::scale_roll(&input.target.appearance, input.now_from_template, left, settings) {
                Ok(prepared) => evidence.scale_roll.insert(prepared),
                Err(missing) => return nothing(evidence, missing),
            };
        let matched = match match_template::match_template(prepared, input, settings) {
            Ok(matched) => matched,
            Err(missing) => return nothing(evidence, missing),
        };
        let left_pixel = matched.pixel;
        let error = match settings.noise_model {
            NoiseModel::Measured => input.target.drift.after_match(
                &prepared.image_from_template,
                &matched.covariance_px2,
                matched.bias_px,
                settings.match_correlation,
            ),
            NoiseModel::HalfPixel => Drift::of_pixel(Matrix2::identity() * HALF_PIXEL_VARIANCE),
        };
        evidence.match_template = Some(matched);
        let stereo = StereoInput {
            left_pixel,
            left_image: &input.capture.pair.left,
            right_image: &input.capture.pair.right,
            left,
            right: &input.pointing.right,
            geometry: input.stereo,
            predicted_range_m: Some((input.prediction.position_in_rover - left.model.centre()).norm()),
        };
        finish(evidence, &stereo, error, settings)
    }
}

/// The two steps that designation and tracking share: point stereo and triangulation.
fn finish(
    mut evidence: TemplateEvidence,
    input: &StereoInput<'_>,
    left_error: Drift,
    settings: &TemplateSettings,
) -> Located {
    let confidence = evidence.match_template.as_ref().map_or(1.0, |m| m.peak.score.clamp(0.0, 1.0));
    let left_pixel = Some(input.left_pixel);
    let mut located = Located { left_pixel, left_error, confidence, ..empty() };
    let stereo = match point_stereo::point_stereo(input, settings) {
        Ok(stereo) => stereo,
        Err(missing) => {
            located.missing = Some(missing);
            located.evidence = Evidence::Template(Box::new(evidence));
            return located;
        }
    };
    located.right_pixel = Some(stereo.right_pixel);
    // A best score at the end of the curve may belong to a point beyond it: its range is not known.
    let triangulated = if stereo.at_end {
        let range_m = stereo.range_m;
        Err(format!("the best stereo match lies at the end of the searched ranges, at {range_m:.1} m"))
    } else {
        triangulate::triangulate(input, &stereo, left_error.mean_square_px2(), settings.noise_model)
    };
    match triangulated {
        Ok(triangulation) => {
            located.position_in_rover = Some(triangulation.position_in_rover);
            located.covariance_in_rover = Some(triangulation.covariance_in_rover);
            located.surface_by_pixel = triangulation.surface_by_pixel;
            evidence.triangulate = Some(triangulation);
        }
        Err(missing) => located.missing = Some(missing),
    }
    evidence.point_stereo = Some(stereo);
    located.evidence = Evidence::Template(Box::new(evidence));
    located
}

fn nothing(evidence: TemplateEvidence, missing: String) -> Located {
    Located { missing: Some(missing), evidence: Evidence::Template(Box::new(evidence)), ..empty() }
}

fn empty() -> Located {
    Located {
        left_pixel: None,
        right_pixel: None,
        left_error: Drift::default(),
        surface_by_pixel: None,
        position_in_rover: None,
        covariance_in_rover: None,
        confidence: 0.0,
        missing: None,
        evidence: Evidence::Template(Box::default()),
    }
}
