//! The window of exports: every file with its size, every action as a command to copy, and panels as figures.

use egui::{Id, Modal, RichText, ScrollArea, Ui};
use sightline_session::exports::ExportEntry;

use crate::command::Command;
use crate::exports::as_text;
use crate::exports::figure_menu;
use crate::exports::{ExportScope, ExportsCommand};
use crate::figure::request::{FigureFormat, FigureRequest};
use crate::panels::pane::Pane;
use crate::state::State;
use crate::theme;

/// Shows the window, while it is open.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    if !state.exports.is_open {
        return;
    }
    let modal = Modal::new(Id::unique("export")).backdrop_color(theme::shade()).show(ui.ctx(), |ui| {
        ui.set_width(640.0);
        let height = (ui.ctx().content_rect().height() - 150.0).max(200.0);
        ui.label(RichText::new("Export").size(16.0).strong().color(theme::strong()));
        parts(ui, state, out);
        // The list has its full height from the first frame, so that it does not move under the pointer when files are
        // listed.
        let list = ScrollArea::vertical().max_height(height).min_scrolled_height(height).auto_shrink(false);
        list.show(ui, |ui| {
            files(ui, state, out);
            ui.add_space(8.0);
            pictures(ui, state, out);
            ui.add_space(8.0);
            actions(ui, state);
        });
        ui.separator();
        ui.horizontal(|ui| {
            let is_closed = ui.button("Close").clicked();
            // The status bar with the newest message is behind the window.
            if let Some(message) = state.newest_message() {
                ui.add(egui::Label::new(theme::note(&message.text)).truncate());
            }
            is_closed
        })
        .inner
    });
    if modal.inner || modal.should_close() {
        out.push(Command::Exports(ExportsCommand::Close));
    }
}

fn parts(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        ui.label(theme::label("of"));
        let has_target = state.target().is_some();
        for (part, words, is_on) in [
            (ExportScope::Session, "the whole session", true),
            (ExportScope::Target, "this target", has_target),
            (ExportScope::Run, "this run", has_target),
        ] {
            let button =
                egui::Button::selectable(state.exports.scope == part, words).min_size(egui::vec2(24.0, 24.0));
            if ui.add_enabled(is_on, button).clicked() {
                out.push(Command::Exports(ExportsCommand::Scope(part)));
            }
        }
    });
}

fn files(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    match (&state.exports.entries, &state.exports.refused) {
        (_, Some(sentence)) => {
            ui.add(egui::Label::new(RichText::new(sentence).color(theme::lost())).wrap());
        }
        (None, None) => {
            ui.label(theme::note("Asking the server what there is …"));
        }
        (Some(entries), None) => {
            for entry in entries {
                file(ui, state, entry, out);
            }
        }
    }
}

fn file(ui: &mut Ui, state: &State, entry: &ExportEntry, out: &mut Vec<Command>) {
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        ui.label(RichText::new(&entry.title).strong().color(theme::strong()));
        ui.label(theme::note(&entry.name).monospace());
        ui.label(theme::note(entry.size.words()));
    });
    ui.add(egui::Label::new(&entry.sentence).wrap());
    ui.horizontal(|ui| {
        let named = |words: &str| format!("{words}: {}", entry.title);
        if ui.button("Download").accessible_name(named("download")).clicked() {
            out.push(Command::Exports(ExportsCommand::Download(entry.path.clone())));
        }
        copy(ui, "Copy as command", &named("copy as command"), Some(entry.command.clone()));
        let http = as_text::download(&state.origin, entry);
        copy(ui, "Copy as HTTP (curl)", &named("copy as HTTP"), Some(http));
    });
}

/// Shows a button that copies a text and shows it as a tooltip; disabled without a text.
fn copy(ui: &mut Ui, words: &str, name: &str, text: Option<String>) {
    let button = ui.add_enabled(text.is_some(), egui::Button::new(words)).accessible_name(name);
    if let Some(text) = text {
        if button.clicked() {
            ui.ctx().copy_text(text.clone());
        }
        button.on_hover_text(RichText::new(text).monospace());
    } else {
        button.on_disabled_hover_text("The command line has no such command; HTTP has.");
    }
}

fn pictures(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ui.label(theme::title("A panel as a figure"));
    ui.horizontal_wrapped(|ui| {
        ui.label(theme::label("as"));
        for kind in FigureFormat::ALL {
            let button = egui::Button::selectable(state.exports.format == kind, kind.word());
            if ui.add(button.min_size(egui::vec2(24.0, 24.0))).clicked() {
                out.push(Command::Exports(ExportsCommand::Format(kind)));
            }
        }
        figure_menu::burn_in(ui, state, out);
    });
    ui.horizontal_wrapped(|ui| figure_menu::sheets(ui, state, out));
    let seen = |pane: &Pane| state.exports.panes.contains(pane);
    for (words, is_seen) in [("on the screen", true), ("not on the screen", false)] {
        ui.label(theme::note(words));
        ui.horizontal_wrapped(|ui| {
            for pane in Pane::ALL.into_iter().filter(|pane| seen(pane) == is_seen) {
                let button = ui.button(pane.title()).accessible_name(format!("figure of {}", pane.title()));
                if button.clicked() {
                    let kind = state.exports.format;
                    out.push(Command::Exports(ExportsCommand::Figure(FigureRequest { pane, kind })));
                }
            }
        });
    }
    ui.add_space(4.0);
    if ui.button("Open this step as a plain page").clicked() {
        out.push(Command::Exports(ExportsCommand::PlainPage));
    }
    ui.label(theme::note(
        "Without WebGL and JavaScript, with described pictures and tables; it can be saved and printed.",
    ));
}

fn actions(ui: &mut Ui, state: &State) {
    let actions = as_text::actions(state);
    ui.label(theme::title("This view and its actions, as commands"));
    if actions.is_empty() {
        ui.label(theme::note("Open a session first."));
    }
    for action in actions {
        ui.horizontal_wrapped(|ui| {
            ui.label(&action.words);
            let name = |way: &str| format!("copy as {way}: {}", action.words);
            copy(ui, "Command", &name("command"), action.command.clone());
            copy(ui, "curl", &name("HTTP"), Some(action.http.clone()));
        });
    }
}
