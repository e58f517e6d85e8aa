//! All runs of the session as a table: states, metrics, and only the settings that differ; below it every metric of the
//! compared runs. Each number links to the run's worst step by that metric.

mod metrics;
pub(crate) mod table;

use egui::{ScrollArea, TextEdit, Ui};

use crate::command::Command;
use crate::compare::CompareCommand;
use crate::panels::pane::Need;
use crate::panels::panel::Panel;
use crate::state::State;
use crate::theme;

/// The panel “Runs”.
pub(crate) struct Runs;

impl Panel for Runs {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        state.all_runs().next().is_none().then(|| state.missing_target())
    }

    fn needs(&self) -> &'static [Need] {
        &[Need::Metrics]
    }
}

/// Shows the table and the metrics.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        let label = ui.label(theme::label("show runs with"));
        let mut words = state.compare.filter.clone();
        let field =
            TextEdit::singleline(&mut words).hint_text("target, run, preset or setting").desired_width(180.0);
        if ui.add(field).labelled_by(label.id).changed() {
            out.push(Command::Compare(CompareCommand::Filter(words)));
        }
        ui.label(theme::note(table::count(state)));
    });
    ScrollArea::both().auto_shrink(false).show(ui, |ui| {
        table::show(ui, state, out);
        ui.add_space(8.0);
        metrics::show(ui, state, out);
    });
}
