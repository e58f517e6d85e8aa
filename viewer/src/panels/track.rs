//! The target's track on the left image: the pixels of the tracked steps before and after the current one.

use sightline_geometry::frames::Pixel;
use sightline_track::target::TrackingState;

use crate::command::Layer;
use crate::drawing::overlay::{Overlay, StrokeStyle};
use crate::state::{State, state_of};
use crate::theme;

/// Number of steps shown before and after the current one.
const STEPS: usize = 40;

/// Whether the run located its target at another step as well.
pub(crate) fn is_there(state: &State) -> bool {
    let [past, future] = pixels(state);
    past.len().max(future.len()) > 1
}

/// Paints the past steps as a thin solid line and the future ones as a dotted line, both from the current step.
pub(crate) fn paint(overlay: &Overlay<'_>, state: &State) {
    if !state.shows(Layer::Track) {
        return;
    }
    let colour = theme::run(state.cursor.run).gamma_multiply(0.8);
    for (pixels, line) in pixels(state).iter().zip([StrokeStyle::Solid, StrokeStyle::Dotted]) {
        overlay.thin_line(pixels, colour, line);
    }
}

/// The located pixels up to the current step, and from it onwards, px of the left image.
fn pixels(state: &State) -> [Vec<Pixel>; 2] {
    let Some(run) = state.run().filter(|_| state.shows_targets_camera()) else { return Default::default() };
    let here = state.cursor.step;
    let found = |from: usize, to: usize| -> Vec<Pixel> {
        let rows = run.rows.iter().filter(|row| (from..=to).contains(&row.step));
        rows.filter(|row| state_of(row) == TrackingState::Tracking).filter_map(|row| row.left_pixel).collect()
    };
    [found(here.saturating_sub(STEPS), here), found(here, here + STEPS)]
}
