//! Marks of the compared runs on the left image, each in the run's colour and shape.

use egui::vec2;
use sightline_session::step::RunStep;
use sightline_session::view::RunView;

use crate::cache::ImageSide;
use crate::command::Layer;
use crate::compare::state::{Other, RunStyle};
use crate::drawing::overlay::Overlay;
use crate::panels::camera_choice::word;
use crate::panels::image_marks::{self, Of};
use crate::panels::legend::Entry;
use crate::state::State;

/// The legend entry of the compared runs.
pub(crate) fn entries(state: &State) -> Vec<Entry> {
    let others = state.others();
    let Some(first) = others.first() else { return Vec::new() };
    let names: Vec<String> = others.iter().map(|other| state.run_label(other.name)).collect();
    vec![Entry::new(
        Layer::Compared,
        first.style.mark,
        first.style.colour,
        format!("compared: {}", names.join(", ")),
    )]
}

/// Paints the marks of all compared runs.
pub(crate) fn paint_all(overlay: &Overlay<'_>, state: &State) {
    if !state.shows(Layer::Compared) {
        return;
    }
    for other in state.others() {
        if let Some(trace) = here(state, &other) {
            paint(overlay, trace, other.run, other.style, state);
            name(overlay, trace, other.style, &state.run_label(other.name));
        }
    }
}

/// Paints where the compared runs located the target in the right image, and their search areas there.
pub(crate) fn paint_right(overlay: &Overlay<'_>, state: &State) {
    if !state.shows(Layer::Compared) {
        return;
    }
    for other in state.others() {
        let Some(trace) = here(state, &other) else { continue };
        let side_px = other.run.settings.template.template_size_px;
        let of = Of::Compared(other.style.colour, other.style.mark);
        image_marks::paint(overlay, trace, side_px, ImageSide::Right, of, state);
        if let Some(pixel) = trace.located().and_then(|l| l.right_pixel).filter(|_| state.shows(Layer::Match))
        {
            overlay.words(pixel, vec2(12.0, 16.0), &state.run_label(other.name), other.style.colour);
        }
    }
}

/// The record of a compared run, if it is of this stop and camera; pixels of other images are not comparable.
fn here<'a>(state: &'a State, other: &Other<'_>) -> Option<&'a RunStep> {
    if state.camera_of(other.name) != state.camera() {
        return None;
    }
    state.other_trace(other.name).ready().filter(|trace| trace.step == state.cursor.step)
}

/// Why the marks of a compared run are not on this image, as a sentence; `None` if all are shown.
pub(crate) fn elsewhere(state: &State) -> Option<String> {
    let others = state.others();
    others.iter().find_map(|other| {
        let step = state.aligned_step(other.name, state.cursor.step);
        let label = state.run_label(other.name);
        let camera = state.camera_of(other.name);
        if camera != state.camera() {
            return Some(format!("{label} is tracked in {}: choose that camera", word(camera)));
        }
        match step {
            Some(step) if step == state.cursor.step => None,
            Some(step) => Some(format!("{label} is at step {step}: press V for its own image")),
            None => Some(format!("{label} has no stop aligned with this one")),
        }
    })
}

/// Paints the marks of one step of a run over its left image.
pub(crate) fn paint(overlay: &Overlay<'_>, trace: &RunStep, run: &RunView, style: RunStyle, state: &State) {
    let side_px = run.settings.template.template_size_px;
    let of = Of::Compared(style.colour, style.mark);
    image_marks::paint(overlay, trace, side_px, ImageSide::Left, of, state);
}

/// Paints the run's name beside its mark.
fn name(overlay: &Overlay<'_>, trace: &RunStep, style: RunStyle, words: &str) {
    if let Some(pixel) = crate::compare::state::place_of_target(trace) {
        overlay.words(pixel, vec2(12.0, 16.0), words, style.colour);
    }
}
