//! The panel “Why”: a card with the root cause and its evidence, the origin of any number, the counterfactuals of the step,
//! and the gates by margin with limits that can be dragged.

mod gates;
mod saved;
mod tree;
mod view;

use egui::{CollapsingHeader, Frame, Id, Label, Margin, RichText, ScrollArea, Sense, Stroke, Ui, UiBuilder};
use sightline_session::why::sentence::Summary;

use crate::command::Command;
use crate::panels::pane::Need;
use crate::panels::panel::Panel;
use crate::state::State;
use crate::theme;
use crate::what_if::panel;
use crate::why::{WhyCommand, WhySection};

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
    let Some(poses) = state.poses() else { return };
    let Some(context) = state.step_context(&poses) else { return };
    let trace = context.trace;
    // The scroll position restarts at the headline for another run or target.
    let of = state.step_key(step).map(|key| (key.session, key.target, key.run));
    ScrollArea::vertical().id_salt(("why", of)).auto_shrink(false).show(ui, |ui| {
        crate::driving::why::show_here(ui, state, out);
        let top = ui.cursor().top();
        card(ui, state, &context.summary());
        view::scroll_to(ui, state.why.scroll_request, WhySection::Card, top, true);
        ui.horizontal_wrapped(|ui| {
            let explain =
                ui.button("Why this state?").on_hover_text("Where the tracking state of this step came from");
            if explain.clicked() {
                out.push(Command::Why(WhyCommand::Value { step, value: "state".to_owned() }));
            }
            saved::button(ui, state, out);
        });
        tree::show(ui, state, out);
        saved::show(ui, state, out);
        if let Some(verdict) = trace.verdict() {
            section(ui, "gates, worst margin first", |ui| gates::show(ui, state, verdict, out));
        }
        if panel::can_be_tried(trace) {
            section(ui, "what if, for this step", |ui| panel::form(ui, state, trace, out));
        }
    });
}

/// Shows the headline with its bullets, in a frame of the tracking state's colour.
fn card(ui: &mut Ui, state: &State, summary: &Summary) {
    let colour = match state.row() {
        Some(row) if row.not_searched => theme::weak(),
        Some(row) if row.state == "tracking" && row.tracked == Some(false) => theme::failed(),
        _ => theme::state(state.tracking().unwrap_or_default()),
    };
    let frame = Frame::new().stroke(Stroke::new(1.5, colour)).corner_radius(4).inner_margin(Margin::same(6));
    let shown = frame.show(ui, |ui| {
        ui.set_min_width(ui.available_width());
        ui.spacing_mut().item_spacing.y = 3.0;
        let headline = RichText::new(&summary.headline).size(14.0).strong().color(theme::strong());
        let headline = ui.add(Label::new(headline).wrap().sense(Sense::click()));
        for bullet in &summary.bullets {
            let words = RichText::new(format!("• {bullet}")).size(12.0).color(theme::text());
            ui.add(Label::new(words).wrap());
        }
        headline
    });
    shown.inner.context_menu(|ui| {
        if ui.button("Copy text").clicked() {
            ui.ctx().copy_text(summary.text());
            ui.close();
        }
    });
}

/// Shows a part of the panel below its title. Its controls keep their ids when content is inserted above them, so that a
/// drag of a slider continues.
fn section(ui: &mut Ui, title: &str, show: impl FnOnce(&mut Ui)) {
    ui.scope_builder(UiBuilder::new().scope_id(Id::unique(("why", title))), |ui| {
        CollapsingHeader::new(theme::title(title)).id_salt(title).default_open(true).show(ui, show);
    });
}
