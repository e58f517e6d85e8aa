//! What a compared run saw, in its own colour and shape, on the left image.

use egui::vec2;
use sightline_session::step::RunStep;
use sightline_session::view::RunView;

use crate::command::Layer;
use crate::compare::state::{Look, Other};
use crate::drawing::overlay::{Line, Mark, Overlay, template_quad};
use crate::panels::legend::Entry;
use crate::state::State;
use crate::theme;

/// The entry of the legend for the runs that are compared.
pub(crate) fn entries(state: &State) -> Vec<Entry> {
    let others = state.others();
    let Some(first) = others.first() else { return Vec::new() };
    let names: Vec<String> = others.iter().map(|other| state.run_label(other.name)).collect();
    vec![Entry::new(
        Layer::Compared,
        first.look.mark,
        first.look.colour,
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
            paint(overlay, trace, other.run, other.look, state);
            name(overlay, trace, other.look, &state.run_label(other.name));
        }
    }
}

/// Paints where the compared runs see the target in the right image, and where they searched for it.
pub(crate) fn paint_right(overlay: &Overlay<'_>, state: &State) {
    if !state.shows(Layer::Compared) || !state.marks {
        return;
    }
    for other in state.others() {
        let Some(trace) = here(state, &other) else { continue };
        if let Some(stereo) = trace.template().and_then(|evidence| evidence.point_stereo.as_ref()) {
            if state.shows(Layer::Curve) {
                let searched: Vec<_> = stereo.curve.iter().map(|point| point.pixel).collect();
                overlay.thin_line(&searched, other.look.colour, Line::Dashed);
            }
            if state.shows(Layer::Match) {
                overlay.ellipse(
                    stereo.right_pixel,
                    &stereo.covariance_px2,
                    3.0,
                    other.look.colour,
                    Line::Solid,
                );
            }
        }
        let predicted = trace.point_mast.predicted_right.filter(|_| trace.prediction().is_some());
        if let Some(pixel) = predicted.filter(|_| state.shows(Layer::Prediction)) {
            overlay.mark(pixel, Mark::Cross, other.look.colour);
        }
        if let Some(pixel) = trace.located().and_then(|l| l.right_pixel).filter(|_| state.shows(Layer::Match))
        {
            overlay.mark(pixel, other.look.mark, other.look.colour);
            overlay.words(pixel, vec2(12.0, 16.0), &state.run_label(other.name), other.look.colour);
        }
    }
}

/// The record of another run at this very stop: pixels of another stop mean nothing on its image.
fn here<'a>(state: &'a State, other: &Other<'_>) -> Option<&'a RunStep> {
    state.other_trace(other.name).ready().filter(|trace| trace.step == state.cursor.step)
}

/// What keeps the marks of compared runs off this image, as a sentence; none where all of them are on it.
pub(crate) fn elsewhere(state: &State) -> Option<String> {
    let others = state.others();
    others.iter().find_map(|other| {
        let step = state.beside(other.name, state.cursor.step);
        let label = state.run_label(other.name);
        match step {
            Some(step) if step == state.cursor.step => None,
            Some(step) => Some(format!("{label} stands at step {step}: press V to see its own image")),
            None => Some(format!("{label} has no stop beside this one")),
        }
    })
}

/// Paints what one step of a run saw: search window, prediction with its gate, template window and match.
pub(crate) fn paint(overlay: &Overlay<'_>, trace: &RunStep, run: &RunView, look: Look, state: &State) {
    let matched = trace.template().and_then(|evidence| evidence.match_template.as_ref());
    if let Some(matched) = matched.filter(|_| state.shows(Layer::SearchWindow)) {
        overlay.rectangle(matched.search_window, look.colour, Line::Dashed);
    }
    let pointing = &trace.point_mast;
    if let Some(pixel) = pointing.predicted_left
        && trace.prediction().is_some()
        && state.shows(Layer::Prediction)
    {
        if let Some(covariance) = &pointing.predicted_covariance_px2 {
            overlay.ellipse(pixel, covariance, 3.0, look.colour, Line::Dotted);
        }
        overlay.mark(pixel, Mark::Cross, look.colour);
    }
    if let Some(matched) = matched.filter(|_| state.shows(Layer::Template)) {
        let side = run.settings.template.template_size_px;
        let quad = template_quad(matched.pixel, side, &nalgebra::Matrix2::identity());
        overlay.outline(&quad, look.colour, Line::Solid);
    }
    let located = trace.located().filter(|_| state.shows(Layer::Match));
    if let Some((located, pixel)) = located.and_then(|located| Some((located, located.left_pixel?))) {
        overlay.ellipse(pixel, &located.left_error.mean_square_px2(), 3.0, look.colour, Line::Solid);
        overlay.mark(pixel, look.mark, look.colour);
    }
    if let Some(pixel) = trace.truth.as_ref().and_then(|t| t.left_pixel).filter(|_| state.shows(Layer::Truth))
    {
        overlay.mark(pixel, Mark::Plus, theme::truth());
    }
}

/// The run's name beside its mark.
fn name(overlay: &Overlay<'_>, trace: &RunStep, look: Look, words: &str) {
    if let Some(pixel) = crate::compare::state::place_of_target(trace) {
        overlay.words(pixel, vec2(12.0, 16.0), words, look.colour);
    }
}
