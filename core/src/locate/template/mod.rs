//! The template locator: `scale_roll` → `match_template` → `point_stereo` → `triangulate` (K§4.1, R23–R29).
//!
//! What each step saw is one field of [`TemplateEvidence`]; arrays (patches and surfaces) are kept beside the
//! numbers but never serialised with them: the interface serves them one by one.
//!
//! Noise (ours; the papers' half pixel is the preset `half_pixel`): the covariance of the target's left
//! position against the designated point is that of the template carried along on the surface, `F D Fᵀ`, plus
//! that of this match; what biases the matches is carried as `F B + b` and enters the position as `B Bᵀ`.
//! `point_stereo` sees the same left position, so both eyes share its error.

mod choices;
pub mod settings;
mod window_map;
pub mod scale_roll;
mod choose;
pub mod match_template;
pub mod klt;
pub mod affine;
pub mod drift_correction;
pub mod match_noise;
pub mod stereo_curve;
mod stereo_search;
pub mod point_stereo;
pub mod triangulate;
mod relief;
pub mod warnings;
pub mod height;
pub mod history;
pub mod compare_searches;

pub use settings::TemplateSettings;

#[cfg(test)]
mod tests;
#[cfg(test)]
mod configuration_tests;

use nalgebra::Matrix2;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use self::choose::Chosen;
use self::drift_correction::DriftCorrection;
use self::height::Relief;
use self::match_template::TemplateMatch;
use self::point_stereo::{PointStereo, StereoInput};
use self::scale_roll::ScaleRoll;
use self::settings::{NoiseModel, TemplateUpdate};
use self::triangulate::Triangulation;
use self::warnings::Warning;
use super::{DesignateInput, Evidence, LocateInput, Located, Locator};
use crate::estimate::drift::Drift;
use crate::frames::Pixel;
use crate::image::patch;

/// What the template locator saw; a step that was not reached is null.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TemplateEvidence {
    /// Why the target may be badly picked; at the designation only.
    pub warnings: Vec<Warning>,
    /// The template, scaled and rolled.
    pub scale_roll: Option<ScaleRoll>,
    /// Its match in the left image.
    pub match_template: Option<TemplateMatch>,
    /// The match of the designated window, where matches are corrected by it.
    pub drift_correction: Option<DriftCorrection>,
    /// The heights around the target, where they are weighed.
    pub relief: Option<Relief>,
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
        let settings = &input.settings.template;
        if let Some(missing) = settings.contradiction().or_else(|| without_contrast(input, settings)) {
            return nothing(TemplateEvidence::default(), missing);
        }
        let covariance = match settings.noise_model {
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
        let mut located = finish(TemplateEvidence::default(), &stereo, Drift::of_pixel(covariance), settings);
        let Some(evidence) = located.evidence.template_mut() else { return located };
        if let (Some(found), Some(matched)) = (&evidence.triangulate, &evidence.point_stereo) {
            evidence.warnings = warnings::look(&stereo, found.range_m, matched.score, input.settings);
        }
        located
    }

    fn locate(&self, input: &LocateInput<'_>) -> Located {
        let settings = &input.settings.template;
        let mut evidence = TemplateEvidence::default();
        if let Some(missing) = settings.contradiction() {
            return nothing(evidence, missing);
        }
        let chosen = match choose::choose(input, settings) {
            Ok(chosen) => chosen,
            Err(unmatched) => {
                evidence.scale_roll = unmatched.scale_roll.map(|prepared| *prepared);
                return nothing(evidence, unmatched.missing);
            }
        };
        let image = input.capture.pair.left.as_ref();
        let Chosen { prepared, now_from_template, mut first, drift, tried, comparisons } = chosen;
        if let Some(relief) = prepared.appearance().relief.as_ref().filter(|_| settings.height_weight > 0.0) {
            let stereo = stereo_input(input, first.peak.pixel);
            first.weighed = height::weigh(&mut first, relief, &now_from_template, &stereo, settings);
        }
        let matched = match_template::finish(&prepared, first, tried, comparisons, image, settings);
        let mut left_pixel = matched.pixel;
        let mut error = drift.after_match(
            &prepared.record.image_from_template,
            &matched.covariance_px2,
            matched.bias_px,
            settings.match_correlation,
        );
        evidence.scale_roll = Some(prepared.record);
        evidence.match_template = Some(matched);
        if settings.template_update == TemplateUpdate::DriftCorrected
            && let Some((correction, its_error)) = drift_correction::correct(input, left_pixel, settings)
        {
            if correction.accepted {
                (left_pixel, error) = (correction.pixel, its_error);
            }
            evidence.drift_correction = Some(correction);
        }
        if settings.noise_model == NoiseModel::HalfPixel {
            error = Drift::of_pixel(Matrix2::identity() * HALF_PIXEL_VARIANCE);
        }
        let stereo = stereo_input(input, left_pixel);
        finish(evidence, &stereo, error, settings)
    }
}

/// What point stereo is given at a later stop.
fn stereo_input<'a>(input: &LocateInput<'a>, left_pixel: Pixel) -> StereoInput<'a> {
    let left = &input.pointing.left;
    StereoInput {
        left_pixel,
        left_image: &input.capture.pair.left,
        right_image: &input.capture.pair.right,
        left,
        right: &input.pointing.right,
        geometry: input.stereo,
        predicted_range_m: Some((input.prediction.position_in_rover - left.model.centre()).norm()),
    }
}

/// Why a designated window cannot be found again, as one sentence, where all its pixels are alike.
fn without_contrast(input: &DesignateInput<'_>, settings: &TemplateSettings) -> Option<String> {
    let size = settings.template_size_px;
    let window = patch::extract(&input.capture.pair.left, input.pixel, size / 2, settings.kernel);
    (window.is_complete() && window.is_flat()).then(|| {
        format!(
            "the window of template_size_px {size} around it has no contrast: choose a target with texture"
        )
    })
}

/// The two steps that designation and tracking share: point stereo and triangulation.
fn finish(
    mut evidence: TemplateEvidence,
    input: &StereoInput<'_>,
    left_error: Drift,
    settings: &TemplateSettings,
) -> Located {
    let confidence = evidence.match_template.as_ref().map_or(1.0, |m| m.score.clamp(0.0, 1.0));
    let left_pixel = Some(input.left_pixel);
    let mut located = Located { left_pixel, left_error, confidence, ..Located::default() };
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
            if settings.height_weight > 0.0 {
                evidence.relief = height::relief(input, triangulation.range_m, settings);
            }
            evidence.triangulate = Some(triangulation);
        }
        Err(missing) => located.missing = Some(missing),
    }
    evidence.point_stereo = Some(stereo);
    located.evidence = Evidence::Template(Box::new(evidence));
    located
}

fn nothing(evidence: TemplateEvidence, missing: String) -> Located {
    Located { missing: Some(missing), evidence: Evidence::Template(Box::new(evidence)), ..Located::default() }
}
