//! The notes of the session: a list in the order of a tour, and the window in which a note is written.

use egui::{Align, Id, Key, Layout, Modal, Modifiers, RichText, ScrollArea, TextEdit, Ui};
use sightline_session::notes::{Note, TEXT_LIMIT};

use crate::command::Command;
use crate::command::table::PIN_NOTE;
use crate::notes::markdown;
use crate::notes::{Draft, NotesCommand};
use crate::panels::pane::Pane;
use crate::panels::panel::Panel;
use crate::state::{State, run_letter};
use crate::{panels, theme};

/// Purpose of the panel, shown while it is empty.
const PURPOSE: &str = Pane::Notes.about().help;

/// The panel “Notes”.
pub(crate) struct Notes;

impl Panel for Notes {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        state.session.is_none().then(|| state.missing_target())
    }
}

/// Shows the list.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let mut emit = |command: NotesCommand| out.push(Command::Notes(command));
    let list = state.notes.list.as_deref();
    ui.horizontal(|ui| {
        if ui.button(format!("{}  ({})", PIN_NOTE.name, PIN_NOTE.keys())).clicked() {
            emit(NotesCommand::Pin);
        }
        let has_notes = list.is_some_and(|list| !list.is_empty());
        let previous = ui.add_enabled(has_notes, egui::Button::new("<"));
        if previous.on_hover_text("previous note of the tour").accessible_name("previous note").clicked() {
            emit(NotesCommand::Tour(-1));
        }
        let next = ui.add_enabled(has_notes, egui::Button::new(">"));
        if next.on_hover_text("next note of the tour").accessible_name("next note").clicked() {
            emit(NotesCommand::Tour(1));
        }
    });
    if let Some(note) = &state.notes.removed {
        ui.horizontal(|ui| {
            ui.label(theme::note(format!("A note at step {} was removed.", note.pin.step)));
            if ui.button("Undo").accessible_name("bring the removed note back").clicked() {
                emit(NotesCommand::Restore(note.id));
            }
        });
    }
    match list {
        None => panels::missing(ui, PURPOSE, "Loading the notes …"),
        Some([]) => panels::missing(
            ui,
            PURPOSE,
            "No notes yet. Go to a step that is worth a word and press M: the note is pinned there.",
        ),
        Some(list) => {
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                for (place, note) in list.iter().enumerate() {
                    show_note(ui, state, note, place, list.len(), &mut emit);
                }
            });
        }
    }
}

fn show_note(
    ui: &mut Ui,
    state: &State,
    note: &Note,
    place: usize,
    count: usize,
    emit: &mut dyn FnMut(NotesCommand),
) {
    let is_at = state.notes.at == Some(note.id);
    let fill = if is_at { theme::selected() } else { theme::bar() };
    egui::Frame::new().fill(fill).corner_radius(4).inner_margin(6).show(ui, |ui| {
        ui.set_width(ui.available_width());
        // Laid out from the right: the title gets the space that the buttons leave.
        ui.with_layout(Layout::right_to_left(Align::Center).with_main_wrap(false), |ui| {
            ui.set_height(24.0);
            buttons(ui, note, (place, count), emit);
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let title = format!("{}. {}", place + 1, whereabouts(state, note));
                let words = RichText::new(title).color(theme::accent());
                let button =
                    egui::Button::new(words).frame(false).min_size(egui::vec2(24.0, 24.0)).truncate();
                let name = format!("go to note {}: {}", place + 1, whereabouts(state, note));
                if ui.add(button).on_hover_text(&note.made).accessible_name(name).clicked() {
                    emit(NotesCommand::GoTo(note.id));
                }
            });
        });
        ui.add(egui::Label::new(markdown::layout(&note.text)).wrap().selectable(true));
    });
    ui.add_space(3.0);
}

/// Shows the buttons of a note, from right to left.
fn buttons(ui: &mut Ui, note: &Note, (place, count): (usize, usize), emit: &mut dyn FnMut(NotesCommand)) {
    let mut small = |words: &str, help: &str, is_on: bool| {
        let button = egui::Button::new(words).min_size(egui::vec2(24.0, 24.0));
        let name = format!("{help} note {}", place + 1);
        ui.add_enabled(is_on, button).on_hover_text(help).accessible_name(name).clicked()
    };
    if small("Remove", "remove", true) {
        emit(NotesCommand::Remove(note.id));
    }
    if small("Edit", "edit", true) {
        emit(NotesCommand::Edit(note.id));
    }
    if small("▼", "later in the tour:", place + 1 < count) {
        emit(NotesCommand::Move { id: note.id, place: place + 1 });
    }
    if small("▲", "earlier in the tour:", place > 0) {
        emit(NotesCommand::Move { id: note.id, place: place - 1 });
    }
}

/// A description of the position to which a note is pinned.
fn whereabouts(state: &State, note: &Note) -> String {
    let pin = &note.pin;
    let targets = state.session.iter().flat_map(|session| &session.targets);
    let of = pin.target.map_or_else(String::new, |number| {
        let label =
            targets.clone().find(|target| target.number == number).map_or("a removed target", |t| &t.label);
        format!(", {label}, run {}", run_letter(pin.run))
    });
    let stage = pin.stage.as_ref().map_or_else(String::new, |stage| format!(", {stage}"));
    format!("step {}{of}{stage}", pin.step)
}

/// Shows the window in which a note is written, while it is open.
pub(crate) fn editor(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(draft) = &state.notes.draft else { return };
    let mut emit = |command: NotesCommand| out.push(Command::Notes(command));
    let mut text = draft.text.clone();
    let modal = Modal::new(Id::unique("note")).backdrop_color(theme::shade()).show(ui.ctx(), |ui| {
        ui.set_width(460.0);
        ui.label(theme::title(&title(draft)));
        // Consumed before the field, which would insert a line break.
        let is_saved_by_key = ui.input_mut(|input| input.consume_key(Modifiers::COMMAND, Key::Enter));
        let field = TextEdit::multiline(&mut text).desired_rows(6).desired_width(f32::INFINITY);
        let field =
            ui.add(field.char_limit(TEXT_LIMIT).hint_text("What is worth knowing here? **Markdown** works."));
        field.request_focus();
        field.accessible_name("text of the note");
        ui.horizontal(|ui| {
            let can_save = !text.trim().is_empty();
            let save = ui.add_enabled(can_save, egui::Button::new("Save note")).clicked();
            let close = ui.button("Close").clicked();
            ui.label(theme::note("Ctrl+Enter saves, Esc closes"));
            (save || (is_saved_by_key && can_save), close)
        })
        .inner
    });
    let (save, close) = modal.inner;
    if text != draft.text {
        emit(NotesCommand::Write(text));
    }
    if save {
        emit(NotesCommand::Save);
    } else if close || modal.should_close() {
        emit(NotesCommand::Close);
    }
}

fn title(draft: &Draft) -> String {
    match draft.of {
        Some((id, _)) => format!("Note {id}"),
        None => {
            let stage = draft.pin.stage.as_ref().map_or_else(String::new, |stage| format!(", {stage}"));
            format!("New note at step {}{stage}", draft.pin.step)
        }
    }
}
