//! The patches of `locate`: the prepared template and the matched windows.
//!
//! The four patches that should look the same share their limits, their smallest and largest value. The difference is in
//! standard deviations and has fixed, symmetric limits.

use rerun::components::Colormap;
use rerun::{ColorModel, DepthImage, Image};
use sightline_record::Unsent;
use sightline_vision::image::Patch;

use super::Logged;
use super::convert::mapped;
use super::palette::of_difference;
use super::step::Step;

/// Limit of the difference colours, standard deviations of a patch.
const DIFFERENCE_LIMIT: f32 = 3.0;

/// The original template.
pub(super) fn log_reference(step: &Step<'_>) -> Logged {
    let patch = step.template().and_then(|e| e.scale_roll.as_ref()?.reference.get());
    step.log("/{target}/locate/scale_roll/reference", patch.and_then(|p| grey(p, shared_limits(step))))
}

/// The scaled template.
pub(super) fn log_scaled(step: &Step<'_>) -> Logged {
    let patch = step.template().and_then(|e| e.scale_roll.as_ref()?.scaled.get());
    step.log("/{target}/locate/scale_roll/scaled", patch.and_then(|p| grey(p, shared_limits(step))))
}

/// The scaled and rolled template, which was matched.
pub(super) fn log_rolled(step: &Step<'_>) -> Logged {
    let patch = step.template().and_then(|e| e.scale_roll.as_ref()?.rolled.get());
    step.log("/{target}/locate/scale_roll/rolled", patch.and_then(|p| grey(p, shared_limits(step))))
}

/// The left image at the match.
pub(super) fn log_matched(step: &Step<'_>) -> Logged {
    let patch = step.matched().and_then(|m| m.matched.get());
    step.log("/{target}/locate/match_template/matched", patch.and_then(|p| grey(p, shared_limits(step))))
}

/// Matched window minus rolled template, both normalised.
pub(super) fn log_difference(step: &Step<'_>) -> Logged {
    let patch = step.matched().and_then(|m| m.difference.get());
    step.log("/{target}/locate/match_template/difference", patch.map(signed))
}

/// The right image at the stereo match, resampled to the left view.
pub(super) fn log_right_window(step: &Step<'_>) -> Logged {
    let patch = step.template().and_then(|e| e.point_stereo.as_ref()?.right_window.get());
    step.log("/{target}/locate/point_stereo/right_window", patch.and_then(|p| grey(p, limits([p]))))
}

fn shared_limits(step: &Step<'_>) -> [f64; 2] {
    let prepared = step.template().and_then(|e| e.scale_roll.as_ref());
    let prepared =
        prepared.into_iter().flat_map(|s| [&s.reference, &s.scaled, &s.rolled]).filter_map(Unsent::get);
    limits(prepared.chain(step.matched().and_then(|m| m.matched.get())))
}

/// The smallest and largest valid value; never equal, so that a flat patch has a valid colour range.
fn limits<'a>(patches: impl IntoIterator<Item = &'a Patch>) -> [f64; 2] {
    let values = patches.into_iter().flat_map(|p| p.as_raw()).filter(|v| v.is_finite());
    let [low, high] = values.fold([f32::MAX, f32::MIN], |[low, high], &v| [low.min(v), high.max(v)]);
    if low < high { [f64::from(low), f64::from(high)] } else { [0.0, 1.0] }
}

fn grey(patch: &Patch, limits: [f64; 2]) -> Option<DepthImage> {
    mapped(patch.dimensions().into(), patch.as_raw(), limits, Colormap::Grayscale)
}

/// Blue below zero, white at zero, red above; invalid pixels are transparent.
fn signed(patch: &Patch) -> Image {
    let rgba = patch.as_raw().iter().flat_map(|v| {
        let [r, g, b] = of_difference(v / DIFFERENCE_LIMIT);
        if v.is_finite() { [r, g, b, 255] } else { [0; 4] }
    });
    Image::from_elements(&rgba.collect::<Vec<u8>>(), patch.dimensions().into(), ColorModel::RGBA)
}
