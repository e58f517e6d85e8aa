//! The template locator: `scale_roll` → `match_template` → `point_stereo` → `triangulate` (K§4.1, R23–R29).
//!
//! The evidence of each step is one field of [`TemplateEvidence`].
//!
//! Noise (ours; the papers' half pixel is the preset `half_pixel`): the covariance of the target's left position
//! relative to the designated point is that of the template, mapped along the surface, `F D Fᵀ`, plus that of this
//! match. Biases of the matches accumulate as `F B + b` and enter the position as `B Bᵀ`. `point_stereo` uses the
//! same left position, so both cameras share its error.

mod choices;
pub mod evidence;
pub mod settings;
pub mod memory;
pub mod failure;
mod gates;
pub mod first_match;
mod window_map;
pub mod scale_roll;
mod choose;
pub mod match_template;
mod near;
pub mod klt;
pub mod affine;
pub mod drift_correction;
pub mod match_noise;
pub mod stereo_curve;
mod stereo_input;
mod stereo_search;
pub mod point_stereo;
pub mod point_match;
pub mod triangulate;
mod relief;
pub mod warnings;
pub mod height;
pub mod history;
pub mod compare_searches;

pub use evidence::TemplateEvidence;
pub use settings::TemplateSettings;

use std::sync::Arc;

use nalgebra::{Matrix2, Matrix3x2};

use self::choose::Chosen;
use self::failure::TemplateFailure;
use self::memory::{Appearance, Replaced, TemplateMemory};
use self::point_stereo::StereoInput;
use self::scale_roll::carried_surface;
use self::settings::{NoiseModel, TemplateUpdate};
use self::triangulate::HALF_PIXEL_VARIANCE;
use super::tracker::{Accepted, DesignateInput, GateInput, LocateInput, Sighting, Tracker};
use crate::gate::{Gate, GateKind};
use sightline_geometry::estimate::drift::Drift;
use sightline_geometry::frames::Pixel;
use sightline_vision::image::patch;

/// Tracks a scaled and rolled template by normalised correlation (Kim et al. 2009).
#[derive(Clone, Copy, Debug)]
pub struct TemplateTracker;

impl Tracker for TemplateTracker {
    type Memory = TemplateMemory;
    type Evidence = TemplateEvidence;

    const GATES: &'static [GateKind] = &gates::GATES;
    const STEPS: &'static [&'static str] = &["scale_roll", "match_template", "point_stereo", "triangulate"];

    fn designate(&self, input: &DesignateInput<'_>) -> (Sighting<TemplateEvidence>, Option<TemplateMemory>) {
        let found = designate(input);
        let memory = found.position_in_rover.map(|position_in_rover| TemplateMemory {
            appearance: Appearance {
                step: input.step,
                pixel: input.pixel,
                position_in_rover,
                surface_by_pixel: found.surface_by_pixel,
                relief: found.evidence.relief.clone(),
                camera: input.left.clone(),
                site_from_rover: *input.site_from_rover,
                image: Arc::clone(&input.capture.pair.left),
            },
            drift: found.left_error,
            replaced: Replaced::default(),
        });
        (found, memory)
    }

    fn locate(&self, input: &LocateInput<'_>, memory: &TemplateMemory) -> Sighting<TemplateEvidence> {
        let settings = &input.settings.template;
        let mut evidence = TemplateEvidence::default();
        if let Some(missing) = contradiction(settings) {
            return Sighting::nothing(missing, evidence);
        }
        let chosen = match choose::choose(input, memory, settings) {
            Ok(chosen) => chosen,
            Err(unmatched) => {
                evidence.scale_roll = unmatched.scale_roll.map(|prepared| *prepared);
                return Sighting::nothing(unmatched.missing, evidence);
            }
        };
        let (image, left) = (input.capture.pair.left.as_ref(), &input.pointing.left);
        let Chosen { prepared, now_from_template, mut first, drift, tried, comparisons } = chosen;
        let surface = carried_surface(prepared.appearance(), &now_from_template, left);
        if let Some(relief) = prepared.appearance().relief.as_ref().filter(|_| settings.height_weight > 0.0) {
            let stereo = stereo_input(input, first.peak.pixel, surface);
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
            && let Some((correction, its_error)) =
                drift_correction::correct(input, memory, left_pixel, settings)
        {
            if correction.accepted {
                (left_pixel, error) = (correction.pixel, its_error);
            }
            evidence.drift_correction = Some(correction);
        }
        if settings.noise_model == NoiseModel::HalfPixel {
            error = Drift::of_pixel(Matrix2::identity() * HALF_PIXEL_VARIANCE);
        }
        let stereo = stereo_input(input, left_pixel, surface);
        finish(evidence, &stereo, error, settings)
    }

    fn gates(&self, evidence: &TemplateEvidence, input: &GateInput<'_>) -> Vec<Gate> {
        gates::gates(evidence, input)
    }

    fn remember(
        &self,
        memory: TemplateMemory,
        evidence: &TemplateEvidence,
        update: &Accepted<'_>,
    ) -> TemplateMemory {
        let settings = &update.settings.template;
        let Some(pixel) = update.left_pixel.filter(|_| asks_for_a_new_template(evidence, settings)) else {
            return memory;
        };
        let appearance = Appearance {
            step: update.step,
            pixel,
            position_in_rover: update.position_in_rover,
            surface_by_pixel: update.surface_by_pixel,
            relief: evidence.relief.clone(),
            camera: update.left.clone(),
            site_from_rover: *update.site_from_rover,
            image: Arc::clone(&update.capture.pair.left),
        };
        let others = settings.reference_templates.saturating_sub(1) as usize;
        memory.renewed(appearance, update.left_error, others)
    }
}

/// Whether an accepted update renews the template.
fn asks_for_a_new_template(evidence: &TemplateEvidence, settings: &TemplateSettings) -> bool {
    let scale = evidence.scale_roll.as_ref().map_or(f64::INFINITY, |s| s.scale);
    let score = evidence.match_template.as_ref().map_or(-1.0, |m| m.score);
    match settings.template_update {
        TemplateUpdate::EveryUpdate | TemplateUpdate::DriftCorrected => true,
        TemplateUpdate::Never => false,
        TemplateUpdate::OnCondition => {
            scale.max(1.0 / scale) >= settings.renew_scale || score < settings.renew_ncc
        }
    }
}

/// Finds the 3-D position of a designated pixel by point stereo.
fn designate(input: &DesignateInput<'_>) -> Sighting<TemplateEvidence> {
    let settings = &input.settings.template;
    if let Some(missing) = contradiction(settings).or_else(|| without_contrast(input, settings)) {
        return Sighting::nothing(missing, TemplateEvidence::default());
    }
    let covariance = match settings.noise_model {
        // The designation defines the target: it has no error of its own.
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
        surface_by_pixel: None,
    };
    let mut found = finish(TemplateEvidence::default(), &stereo, Drift::of_pixel(covariance), settings);
    let evidence = &mut found.evidence;
    if let (Some(position), Some(matched)) = (&evidence.triangulate, &evidence.point_stereo) {
        evidence.warnings = warnings::look(&stereo, position.range_m, matched, input.settings);
    }
    found
}

/// The input of point stereo at a later stop.
fn stereo_input<'a>(
    input: &LocateInput<'a>,
    left_pixel: Pixel,
    surface_by_pixel: Option<Matrix3x2<f64>>,
) -> StereoInput<'a> {
    let left = &input.pointing.left;
    StereoInput {
        left_pixel,
        left_image: &input.capture.pair.left,
        right_image: &input.capture.pair.right,
        left,
        right: &input.pointing.right,
        geometry: input.stereo,
        predicted_range_m: Some((input.prediction.position_in_rover - left.model.centre()).norm()),
        surface_by_pixel,
    }
}

fn contradiction(settings: &TemplateSettings) -> Option<TemplateFailure> {
    settings.contradiction().map(TemplateFailure::Settings)
}

/// Returns why a designated window without contrast cannot be tracked.
fn without_contrast(input: &DesignateInput<'_>, settings: &TemplateSettings) -> Option<TemplateFailure> {
    let size = settings.template_size_px;
    let window = patch::extract(&input.capture.pair.left, input.pixel, size / 2, settings.kernel);
    (window.is_complete() && window.is_flat()).then_some(TemplateFailure::NoContrast { size_px: size })
}

/// Point stereo and triangulation, which designation and tracking share.
fn finish(
    mut evidence: TemplateEvidence,
    input: &StereoInput<'_>,
    left_error: Drift,
    settings: &TemplateSettings,
) -> Sighting<TemplateEvidence> {
    let confidence = evidence.match_template.as_ref().map_or(1.0, |m| m.score.clamp(0.0, 1.0));
    let left_pixel = Some(input.left_pixel);
    let mut found = Sighting { left_pixel, left_error, confidence, ..Sighting::default() };
    let stereo = match point_stereo::point_stereo(input, settings) {
        Ok(stereo) => stereo,
        Err(missing) => return Sighting { missing: Some(missing.to_string()), evidence, ..found },
    };
    found.right_pixel = Some(stereo.right_pixel);
    // A best score at the end of the curve may belong to a point beyond it: its range is unknown.
    let triangulated = if stereo.at_end {
        Err(TemplateFailure::StereoAtEnd { range_m: stereo.range_m })
    } else {
        triangulate::triangulate(input, &stereo, left_error.mean_square_px2(), settings.noise_model)
    };
    match triangulated {
        Ok(triangulation) => {
            found.position_in_rover = Some(triangulation.position_in_rover);
            found.covariance_in_rover = Some(triangulation.covariance_in_rover);
            found.surface_by_pixel = triangulation.surface_by_pixel;
            if settings.height_weight > 0.0 {
                evidence.relief = height::relief(input, triangulation.range_m, settings);
            }
            evidence.triangulate = Some(triangulation);
        }
        Err(missing) => found.missing = Some(missing.to_string()),
    }
    evidence.point_stereo = Some(stereo);
    Sighting { evidence, ..found }
}
