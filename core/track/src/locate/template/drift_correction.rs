//! A match corrected against the designated window (R71, `template_update = drift_corrected`).
//!
//! Renewing the template at every update keeps it like what is seen, and chains the errors of all matches. Here the
//! designated window, prepared by the geometry from its own stop, is looked for within `drift_reach_px` of the match (Matthews,
//! Ishikawa & Baker 2004). Where it scores `drift_ncc_min`, stays that near and need not be magnified by more than
//! `drift_scale_max`, its place is taken instead, and its error starts from the designation's. Else the match stands with
//! the error it had. The last condition is there because a window magnified fivefold shows four of its pixels: what is left
//! is a ramp that scores well anywhere.

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

/// The designated window's own match.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct DriftCorrection {
    /// The stop of the designated window.
    pub template_step: usize,
    /// By how much it was magnified.
    pub scale: f64,
    /// Where it matched, px.
    pub pixel: Pixel,
    /// Its score.
    pub score: f64,
    /// How far that lies from the match of the renewed template, px.
    pub shift_px: f64,
    /// Whether that place is taken.
    pub accepted: bool,
}

/// Looks for the designated window about `matched`; with the record the error of its place.
///
/// `None` before the first renewal, and where nothing can be compared.
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
