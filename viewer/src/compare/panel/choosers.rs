//! Combo boxes in the top bar: the selected run, and the runs that it is compared with.

use egui::{ComboBox, RichText, Ui};
use sightline_session::compare::{RUNS_MAX, RunName};

use crate::command::Command;
use crate::compare::CompareCommand;
use crate::compare::panel::mark;
use crate::panels;
use crate::state::State;
use crate::theme;

/// Accessible names of the combo boxes.
const NAMES: [&str; RUNS_MAX] =
    ["selected run", "compared with", "third run compared", "fourth run compared"];

/// Shows the combo boxes, if a run is selected.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(own) = state.own_name() else { return };
    ui.spacing_mut().item_spacing.x = 4.0;
    mark(ui, state.own_style());
    chooser(ui, state, 0, Some(own), |ui, label, name| {
        if panels::entry(ui, name == own, label).clicked() {
            out.push(Command::SelectRun { target: name.target, run: name.run });
        }
    });
    ui.label(theme::label("vs"));
    let others = state.others();
    if others.is_empty() && state.all_runs().count() < 2 {
        let why = "There is no other run yet: change a setting and press “Run from here”.";
        let button = ui.add_enabled(false, egui::Button::new("none"));
        button.accessible_name("compared with none").on_disabled_hover_text(why);
        return;
    }
    // One more box than there are compared runs, so that another can be added.
    let places = (others.len() + 1).min(RUNS_MAX - 1);
    for place in 0..places {
        let chosen = others.get(place);
        if let Some(other) = chosen {
            mark(ui, other.style);
        }
        let present = chosen.map(|other| other.name);
        let mut selection = None;
        chooser(ui, state, place + 1, present, |ui, label, name| {
            if name != own && panels::entry(ui, present == Some(name), label).clicked() {
                selection = Some(Some(name));
            }
        });
        if present.is_some()
            && ui.small_button("×").accessible_name(format!("take {} out", NAMES[place + 1])).clicked()
        {
            selection = Some(None);
        }
        if let Some(run) = selection {
            // The box shows an existing run; its index among the stored runs may differ.
            let place = present.and_then(|name| state.compare.others.iter().position(|&other| other == name));
            let place = place.unwrap_or(state.compare.others.len());
            out.push(Command::Compare(CompareCommand::With { place, run }));
        }
    }
}

fn chooser(
    ui: &mut Ui,
    state: &State,
    place: usize,
    present: Option<RunName>,
    mut entry: impl FnMut(&mut Ui, &str, RunName),
) {
    let label = present
        .map_or_else(|| if place == 1 { "none" } else { "+" }.to_owned(), |name| state.run_label(name));
    let width = if present.is_some() || place == 1 { 62.0 } else { 30.0 };
    let choice = ComboBox::from_id_salt(("compare", place))
        .width(width)
        .selected_text(RichText::new(&label).size(12.0));
    let shown = choice.show_ui(ui, |ui| {
        for (name, ..) in state.all_runs() {
            entry(ui, &state.run_label(name), name);
        }
    });
    shown.response.accessible_name(format!("{}: {label}", NAMES[place]));
}
