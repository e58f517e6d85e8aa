//! The target's track on the left image: the pixels where it was tracked at the steps before, and at those after.

use sightline_geometry::frames::Pixel;
use sightline_track::target::TrackingState;

use crate::command::Layer;
use crate::drawing::overlay::{Line, Overlay};
use crate::state::{State, state_of};
use crate::theme;

/// How many steps before and after the present one are shown.
const STEPS: usize = 40;

/// Whether the run found its target at another step, too.
pub(crate) fn is_there(state: &State) -> bool {
    let [past, future] = pixels(state);
    past.len().max(future.len()) > 1
}

/// Paints the steps before as a thin line, those after as a dotted one, each from the present step.
pub(crate) fn paint(overlay: &Overlay<'_>, state: &State) {
    if !state.shows(Layer::Track) {
        return;
    }
    let colour = theme::run(state.cursor.run).gamma_multiply(0.8);
    for (pixels, line) in pixels(state).iter().zip([Line::Solid, Line::Dotted]) {
        overlay.thin_line(pixels, colour, line);
    }
}

/// Where the target was found up to the present step, and from it on, px of the left image.
fn pixels(state: &State) -> [Vec<Pixel>; 2] {
    let Some(run) = state.run().filter(|_| state.shows_targets_camera()) else { return Default::default() };
    let here = state.cursor.step;
    let found = |from: usize, to: usize| -> Vec<Pixel> {
        let rows = run.rows.iter().filter(|row| (from..=to).contains(&row.step));
        rows.filter(|row| state_of(row) == TrackingState::Tracking).filter_map(|row| row.left_pixel).collect()
    };
    [found(here.saturating_sub(STEPS), here), found(here, here + STEPS)]
}
