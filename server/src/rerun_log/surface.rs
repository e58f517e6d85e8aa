//! The surface of scores of `match_template`, with its two peaks, in a space of its own: one position of the
//! template is one pixel.
//!
//! It is what rerun calls a depth image, because that archetype keeps the scores and shows them under a colour
//! map with fixed limits: viridis, at every step between the same limits of the measure (−1 and 1 for a correlation).

use rerun::components::Colormap;
use sightline_geometry::frames::Pixel;
use sightline_vision::correlate::zncc::Surface;

use super::Logged;
use super::border::{dot, mapped};
use super::palette::{MEASUREMENT, SECOND_PEAK};
use super::step::Step;

/// The scores of all positions.
pub(super) fn log_surface(step: &Step<'_>) -> Logged {
    let image = step.matched().and_then(|m| {
        let surface = m.surface.get()?;
        let limits = m.measure.shown_limits().map(f64::from);
        mapped([surface.width, surface.height], &surface.scores, limits, Colormap::Viridis)
    });
    step.log("/{target}/locate/match_template/surface", image)
}

/// The best match on the surface.
pub(super) fn log_surface_peak(step: &Step<'_>) -> Logged {
    let peak = step
        .matched()
        .and_then(|m| Some(dot(on_surface(m.surface.get()?, m.peak.pixel), MEASUREMENT, "peak")));
    step.log("/{target}/locate/match_template/surface/peak", peak)
}

/// The next best match on the surface.
pub(super) fn log_surface_second_peak(step: &Step<'_>) -> Logged {
    let second = step.matched().and_then(|m| {
        let second = m.second_peak.as_ref()?;
        Some(dot(on_surface(m.surface.get()?, second.pixel), SECOND_PEAK, "second peak"))
    });
    step.log("/{target}/locate/match_template/surface/second_peak", second)
}

/// A position of the left image as a position on the surface.
fn on_surface(surface: &Surface, pixel: Pixel) -> Pixel {
    pixel.offset(-f64::from(surface.origin[0]), -f64::from(surface.origin[1]))
}
