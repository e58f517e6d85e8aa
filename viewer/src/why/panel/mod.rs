//! Why: the verdict in a sentence, the criteria by margin with limits that can be dragged, what would have saved the step,
//! and where any number came from.

mod criteria;
mod saved;
mod tree;

use egui::{CollapsingHeader, Id, RichText, ScrollArea, Ui, UiBuilder};
use sightline_session::why::sentence;

use crate::command::Command;
use crate::panels::pane::Need;
use crate::panels::panel::Panel;
use crate::state::State;
use crate::theme;
use crate::what_if::panel;
use crate::why::Ask;

/// The panel “Why”.
pub(crate) struct Why;

impl Panel for Why {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        (state.trace().is_none() || state.run().is_none()).then(|| state.missing_step())
    }

    fn needs(&self) -> &'static [Need] {
        &[Need::Explanation]
    }
}

/// Shows the panel.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let step = state.cursor.step;
    let (Some(trace), Some(run)) = (state.trace(), state.run()) else { return };
    let before = step.checked_sub(1).and_then(|before| state.trace_at(before).ready());
    let words = sentence::verdict(trace, before, &run.settings);
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let said = ui.add(
            egui::Label::new(RichText::new(&words).color(theme::strong())).wrap().sense(egui::Sense::click()),
        );
        said.context_menu(|ui| {
            if ui.button("Copy sentence").clicked() {
                ui.ctx().copy_text(words.clone());
                ui.close();
            }
        });
        ui.horizontal_wrapped(|ui| {
            let explain =
                ui.button("Why this state?").on_hover_text("Where the tracking state of this step came from");
            if explain.clicked() {
                out.push(Command::Why(Ask::Value { step, value: "state".to_owned() }));
            }
            saved::button(ui, state, out);
        });
        saved::show(ui, state, out);
        tree::show(ui, state, out);
        if let Some(verdict) = trace.verdict() {
            section(ui, "criteria, worst margin first", |ui| criteria::show(ui, state, verdict, out));
        }
        if panel::can_be_tried(trace) {
            section(ui, "what if, for this step", |ui| panel::form(ui, state, trace, out));
        }
    });
}

/// A part of the panel under its title. Its controls stay the same ones when something comes in above them: a slider that is
/// held is not let go because a value was explained.
fn section(ui: &mut Ui, title: &str, show: impl FnOnce(&mut Ui)) {
    ui.scope_builder(UiBuilder::new().scope_id(Id::unique(("why", title))), |ui| {
        CollapsingHeader::new(theme::title(title)).id_salt(title).default_open(true).show(ui, show);
    });
}
