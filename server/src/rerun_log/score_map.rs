//! The score map of `match_template` with its two peaks, in its own space: one position of the template is one pixel.
//!
//! The archetype is rerun's depth image, because it preserves the scores and displays them with a colour map and fixed
//! limits: viridis, at every step between the same limits of the similarity measure (−1 and 1 for a correlation).

use rerun::components::Colormap;
use sightline_geometry::frames::Pixel;
use sightline_vision::correlate::zncc::Surface;

use super::Logged;
use super::convert::{dot, mapped};
use super::palette::{MEASUREMENT, SECOND_PEAK};
use super::step::Step;

/// The score map.
pub(super) fn log_score_map(step: &Step<'_>) -> Logged {
    let image = step.matched().and_then(|m| {
        let surface = m.surface.get()?;
        let limits = m.measure.shown_limits().map(f64::from);
        mapped([surface.width, surface.height], &surface.scores, limits, Colormap::Viridis)
    });
    step.log("/{target}/locate/match_template/surface", image)
}

/// The best match on the score map.
pub(super) fn log_score_map_peak(step: &Step<'_>) -> Logged {
    let peak = step
        .matched()
        .and_then(|m| Some(dot(to_score_map(m.surface.get()?, m.peak.pixel), MEASUREMENT, "peak")));
    step.log("/{target}/locate/match_template/surface/peak", peak)
}

/// The second peak on the score map.
pub(super) fn log_score_map_second_peak(step: &Step<'_>) -> Logged {
    let second = step.matched().and_then(|m| {
        let second = m.second_peak.as_ref()?;
        Some(dot(to_score_map(m.surface.get()?, second.pixel), SECOND_PEAK, "second peak"))
    });
    step.log("/{target}/locate/match_template/surface/second_peak", second)
}

/// Converts a position in the left image to one in the score map.
fn to_score_map(surface: &Surface, pixel: Pixel) -> Pixel {
    pixel.offset(-f64::from(surface.origin[0]), -f64::from(surface.origin[1]))
}
