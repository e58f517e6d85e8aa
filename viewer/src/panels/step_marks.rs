//! Steps on plots over the steps: the cursor's, and the one that is pointed at, here or in another panel.

use egui_plot::{LineStyle, PlotResponse, PlotUi, VLine};

use crate::command::Command;
use crate::pointed::Pointed;
use crate::state::State;
use crate::theme;

/// The cursor's step, and the one that is pointed at in another panel.
pub(crate) fn cursors(plot: &mut PlotUi<'_>, state: &State) {
    let line = |step: usize| VLine::new("", step as f64).color(theme::accent()).allow_hover(false);
    plot.vline(line(state.cursor.step).width(1.5));
    if let Some(step) = state.pointed_step() {
        plot.vline(line(step).width(1.0).style(LineStyle::dotted_dense()));
    }
}

/// Tells the other panels at which step the pointer is.
pub(crate) fn point<T>(response: &PlotResponse<T>, last: f64, out: &mut Vec<Command>) {
    if let Some(at) = response.response.hover_pos() {
        let step = response.transform.value_from_position(at).x.round().clamp(0.0, last) as usize;
        out.push(Command::Point(Pointed::Step(step)));
    }
}
