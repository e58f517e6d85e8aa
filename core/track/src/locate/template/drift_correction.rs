//! A match corrected against the designated window (R71, `template_update = drift_corrected`).
//!
//! Renewing the template at every update keeps it similar to the current view, but accumulates the errors of all
//! matches. Here the designated window, prepared by the geometry from its own stop, is searched for within
//! `drift_reach_px` of the match (Matthews, Ishikawa & Baker 2004). Its position replaces the match, and its error
//! starts from the designation's, if it scores `drift_ncc_min`, is that near and is scaled by at most
//! `drift_scale_max`. Otherwise the match and its error are kept. The scale is limited because a window magnified
//! fivefold shows four of its pixels: a ramp that scores well anywhere.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::choose::now_from_kept;
use super::match_noise::match_noise;
use super::match_template::refine;
use super::memory::TemplateMemory;
use super::scale_roll::{Preparation, scale_roll};
use super::settings::TemplateSettings;
use crate::locate::tracker::LocateInput;
use sightline_geometry::estimate::drift::Drift;
use sightline_geometry::frames::Pixel;
use sightline_record::{Declaration, Record, Unit};
use sightline_vision::correlate::{Focus, find_peak, zncc_surface};
use sightline_vision::image::{PixelRect, patch};

/// The match of the designated window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DriftCorrection {
    /// The step of the designated window.
    pub template_step: usize,
    /// Scale applied to the window.
    pub scale: f64,
    /// Position of its match, px.
    pub pixel: Pixel,
    /// Score of its match.
    pub score: f64,
    /// Distance of that position from the match of the renewed template, px.
    pub shift_px: f64,
    /// Whether that position is used.
    pub accepted: bool,
}

/// Matches the designated window around `matched`; returns the record and the error of its position.
///
/// `None` before the first renewal, or if nothing can be compared.
pub(super) fn correct(
    input: &LocateInput<'_>,
    memory: &TemplateMemory,
    matched: Pixel,
    settings: &TemplateSettings,
) -> Option<(DriftCorrection, Drift)> {
    let first = memory.replaced.first()?;
    let now_from_first = now_from_kept(input, memory, first);
    let image = input.capture.pair.left.as_ref();
    let prepared =
        scale_roll(&first.appearance, &now_from_first, &input.pointing.left, settings, Preparation::Surface)
            .ok()?;
    let size = settings.template_size_px;
    // One position more than the reach, so that a peak at its end has neighbours.
    let side = size + 2 * (settings.drift_reach_px.ceil() as u32 + 1);
    let surface = zncc_surface(&prepared.rolled, image, PixelRect::centred(matched, side))?;
    let peak = find_peak(&surface, settings.sub_pixel)?;
    let focus = Focus::new(size, settings.focus_px);
    let focused = refine(&focus, &prepared.rolled, image, &peak, settings);
    let pixel = focused.map_or(peak.pixel, |(pixel, _)| pixel);
    let window = patch::extract(image, pixel, size / 2, settings.kernel);
    let noise = match_noise(&prepared.rolled, &window, &prepared.record.misfit(), &focus);
    let shift_px = pixel.distance(matched);
    let is_near = shift_px <= settings.drift_reach_px && !peak.at_edge;
    let is_alike = prepared.record.scale.max(1.0 / prepared.record.scale) <= settings.drift_scale_max;
    let record = DriftCorrection {
        template_step: first.appearance.step,
        scale: prepared.record.scale,
        pixel,
        score: peak.score,
        shift_px,
        accepted: is_near && is_alike && peak.score >= settings.drift_ncc_min,
    };
    let error = first.drift.after_match(
        &prepared.record.image_from_template,
        &noise.covariance_px2,
        noise.bias_px,
        settings.match_correlation,
    );
    Some((record, error))
}

impl Record for DriftCorrection {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("template_step", Unit::One, |d| d.template_step)
            .describe("The stop of the designated window.");
        r.quantity("scale", Unit::One, |d| d.scale).describe("Magnification of the designated window.");
        r.quantity("pixel", Unit::Pixel, |d| d.pixel).describe("The match of the designated window.");
        r.quantity("score", Unit::One, |d| d.score).describe("Its score.");
        r.quantity("shift_px", Unit::Pixel, |d| d.shift_px)
            .describe("Distance from the match of the renewed template.")
            .formula("│pixel − match│", &["pixel", "match_template.pixel"]);
        r.quantity("accepted", Unit::One, |d| d.accepted).describe("Whether its position is used.");
    }
}
