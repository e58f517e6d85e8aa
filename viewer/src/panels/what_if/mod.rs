//! What if: the handles in the left image, the form in the panel “Why”, and the ghost of what came of it.

mod card;
mod form;
mod handles;
mod place;
pub mod scores;

use sightline_core::frames::Pixel;
use sightline_core::trace::StepTrace;

pub use self::form::form;
use self::place::Place;

use egui::Ui;

use crate::command::{Command, Mode};
use crate::state::State;
use crate::view2d::Canvas;

/// Shows handles and ghost over the left image.
pub fn over_image(ui: &mut Ui, canvas: &Canvas, state: &State, out: &mut Vec<Command>) {
    let Some(trace) = state.trace().filter(|_| state.marks && state.mode == Mode::Look) else { return };
    if can_be_tried(trace) {
        handles::show(ui, canvas, state, trace, out);
    }
    if let Some(trial) = state.trial() {
        card::ghost(canvas, trial);
        match place::of(ui, state, &canvas.transform) {
            Some(Place::Over(at)) => card::over(ui, canvas, at, state, out),
            Some(Place::Strip(edge)) => card::strip(ui, canvas, edge, state, out),
            None => {}
        }
    }
}

/// Whether a step has a prediction that can be put elsewhere and settings that can be tried.
pub fn can_be_tried(trace: &StepTrace) -> bool {
    trace.predict.is_some() && trace.fault.is_none()
}

/// Where the prediction is, tried or recorded.
fn predicted(state: &State, trace: &StepTrace) -> Option<Pixel> {
    let tried = state.trial().and_then(|trial| trial.what_if.prediction_px);
    tried.or_else(|| trace.point_mast.as_ref().and_then(|pointing| pointing.predicted_left))
}

/// An odd setting of the template, tried or as in the run.
fn side(state: &State, key: &str) -> Option<u64> {
    state.tried_setting("template", key).and_then(|value| value.as_u64())
}
