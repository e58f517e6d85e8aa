//! In the top bar: which run is looked at, and with which ones it is compared.

use egui::{ComboBox, RichText, Ui};
use sightline_session::compare::{RUNS_MAX, RunName};

use crate::command::Command;
use crate::compare::Ask;
use crate::compare::panel::mark;
use crate::panels;
use crate::state::State;
use crate::theme;

/// What the choosers are called.
const NAMES: [&str; RUNS_MAX] =
    ["run looked at", "compared with", "third run compared", "fourth run compared"];

/// Shows the choosers, where there is a run.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(own) = state.own_name() else { return };
    ui.spacing_mut().item_spacing.x = 4.0;
    mark(ui, state.own_look());
    chooser(ui, state, 0, Some(own), |ui, label, name| {
        if panels::entry(ui, name == own, label).clicked() {
            out.push(Command::Look { target: name.target, run: name.run });
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
    // One more place than is taken, so that there is always one to add.
    let places = (others.len() + 1).min(RUNS_MAX - 1);
    for place in 0..places {
        let chosen = others.get(place);
        if let Some(other) = chosen {
            mark(ui, other.look);
        }
        let present = chosen.map(|other| other.name);
        let mut asked = None;
        chooser(ui, state, place + 1, present, |ui, label, name| {
            if name != own && panels::entry(ui, present == Some(name), label).clicked() {
                asked = Some(Some(name));
            }
        });
        if present.is_some()
            && ui.small_button("×").accessible_name(format!("take {} out", NAMES[place + 1])).clicked()
        {
            asked = Some(None);
        }
        if let Some(run) = asked {
            // A place is one of the runs that exist, which need not be all that are remembered.
            let place = present.and_then(|name| state.compare.others.iter().position(|&other| other == name));
            let place = place.unwrap_or(state.compare.others.len());
            out.push(Command::Compare(Ask::With { place, run }));
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
