//! All runs of the session as a table: states, metrics, and only the settings that differ; below it every metric of the
//! runs that are compared. Each number leads to the step at which its run does worst by it.

mod metrics;
pub mod table;

use egui::{ScrollArea, TextEdit, Ui};

use crate::command::Command;
use crate::compare::Ask;
use crate::panels;
use crate::state::State;
use crate::theme;

/// What the panel is for.
const PURPOSE: &str = "What each run is worth, and which settings make the difference.";

/// Shows the table and the metrics.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    if state.all_runs().next().is_none() {
        panels::missing(ui, PURPOSE, &state.missing_target());
        return;
    }
    ui.horizontal(|ui| {
        let label = ui.label(theme::label("show runs with"));
        let mut words = state.compare.filter.clone();
        let field =
            TextEdit::singleline(&mut words).hint_text("target, run, preset or setting").desired_width(180.0);
        if ui.add(field).labelled_by(label.id).changed() {
            out.push(Command::Compare(Ask::Filter(words)));
        }
        ui.label(theme::note(table::count(state)));
    });
    ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        table::show(ui, state, out);
        ui.add_space(8.0);
        metrics::show(ui, state, out);
    });
}
