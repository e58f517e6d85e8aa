//! Marks of steps on plots over the steps: the cursor's step, and the step under the pointer, here or in another panel.

use egui_plot::{LineStyle, PlotResponse, PlotUi, VLine};

use crate::command::Command;
use crate::hovered::Hovered;
use crate::state::State;
use crate::theme;

/// The cursor's step, and the step under the pointer in another panel.
pub(crate) fn cursors(plot: &mut PlotUi<'_>, state: &State) {
    let line = |step: usize| VLine::new("", step as f64).color(theme::accent()).allow_hover(false);
    plot.vline(line(state.cursor.step).width(1.5));
    if let Some(step) = state.hovered_step() {
        plot.vline(line(step).width(1.0).style(LineStyle::dotted_dense()));
    }
}

/// Reports the step under the pointer to the other panels.
pub(crate) fn point<T>(response: &PlotResponse<T>, last: f64, out: &mut Vec<Command>) {
    if let Some(at) = response.response.hover_pos() {
        let step = response.transform.value_from_position(at).x.round().clamp(0.0, last) as usize;
        out.push(Command::Hover(Hovered::Step(step)));
    }
}
