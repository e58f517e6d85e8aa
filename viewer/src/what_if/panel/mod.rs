//! What-if: the handles in the left image, the form in the panel “Why”, and the ghost of the result.

mod card;
mod form;
mod handles;
mod place;
mod values;
pub(crate) mod scores;

use sightline_track::trace::StepTrace;

pub(crate) use self::form::form;
use self::place::CardPlacement;

use egui::Ui;

use crate::command::{Command, Mode};
use crate::drawing::view2d::Canvas;
use crate::state::State;

/// Shows handles and ghost over the left image.
pub(crate) fn over_image(ui: &mut Ui, canvas: &Canvas, state: &State, out: &mut Vec<Command>) {
    let Some(trace) = state.trace().filter(|_| state.marks && state.mode == Mode::Look) else { return };
    if can_be_tried(trace) {
        handles::show(ui, canvas, state, trace, out);
    }
    if let Some(trial) = state.trial() {
        card::ghost(canvas, trial);
        match place::of(ui, state, &canvas.transform) {
            Some(CardPlacement::Over(at)) => card::over(ui, canvas, at, state, out),
            Some(CardPlacement::Strip(edge)) => card::strip(ui, canvas, edge, state, out),
            None => {}
        }
    }
}

/// Whether a step has a prediction that can be moved and settings that can be tried.
pub(crate) fn can_be_tried(trace: &StepTrace) -> bool {
    trace.prediction().is_some() && trace.fault().is_none() && trace.why_not_searched().is_none()
}
