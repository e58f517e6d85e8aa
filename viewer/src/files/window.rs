//! The window in which a file, a recent session or a drive is opened, and the overlay while a file is dragged over the
//! page.

use egui::{
    Align2, Area, Button, Id, Label, Modal, Order, RichText, ScrollArea, Sense, Ui, WidgetInfo, vec2,
};
use sightline_api::wire::{SessionEntry, TraverseEntry};

use crate::command::Command;
use crate::files::FilesCommand;
use crate::files::documents::OPENABLE;
use crate::files::recording_window;
use crate::state::State;
use crate::theme;

/// Maximum number of listed sessions.
const LISTED: usize = 30;

/// Maximum height of the window, points. It does not depend on the contents, so that lines do not move under the pointer.
const MAX_HEIGHT: f32 = 640.0;

/// Width of the small button beside a line, points.
const BESIDE_WIDTH: f32 = 84.0;

/// Shows the window, while it is open.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    if !state.files.is_open {
        return;
    }
    let mut emit = |command: FilesCommand| out.push(Command::Files(command));
    let modal = Modal::new(Id::unique("open")).backdrop_color(theme::shade()).show(ui.ctx(), |ui| {
        ui.set_width(600.0);
        let height = (ui.ctx().content_rect().height() - 150.0).clamp(200.0, MAX_HEIGHT);
        ui.label(RichText::new("Open").size(16.0).strong().color(theme::strong()));
        let list = ScrollArea::vertical().max_height(height).min_scrolled_height(height).auto_shrink(false);
        list.show(ui, |ui| {
            if recording_window::card(ui, state, &mut emit) {
                return;
            }
            recording_window::list(ui, state, &mut emit);
            ui.add_space(8.0);
            recent(ui, state, &mut emit);
            ui.add_space(8.0);
            drives(ui, state, &mut emit);
            ui.add_space(8.0);
            recording_window::scenarios(ui, &mut emit);
            ui.add_space(8.0);
            file(ui, state, &mut emit);
        });
        ui.separator();
        ui.add(Button::new("Close").min_size(vec2(24.0, 24.0))).clicked()
    });
    if modal.inner || modal.should_close() {
        emit(FilesCommand::Close);
    }
}

fn file(ui: &mut Ui, state: &State, emit: &mut dyn FnMut(FilesCommand)) {
    ui.label(theme::title("a file: drop it anywhere on the page, or"));
    if cfg!(target_arch = "wasm32") {
        if ui.add(Button::new("Choose a file …").min_size(vec2(24.0, 24.0))).clicked() {
            emit(FilesCommand::Choose);
        }
    } else {
        path(ui, state, emit);
    }
    for (what, comes_of_it) in OPENABLE {
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.label(RichText::new(what).color(theme::text()));
            ui.label(theme::note(comes_of_it));
        });
    }
    if let Some(file) = &state.files.opening {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.label(theme::label(format!("The server opens {file} …")));
        });
    }
}

/// The native program has no browser dialog and takes a path instead.
fn path(ui: &mut Ui, state: &State, emit: &mut dyn FnMut(FilesCommand)) {
    ui.horizontal(|ui| {
        let mut text = state.files.path.clone();
        let field = egui::TextEdit::singleline(&mut text).desired_width(420.0).hint_text("path of a file");
        let field = ui.add(field).accessible_name("path of a file");
        let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        let can_open = !text.trim().is_empty();
        let button = ui.add_enabled(can_open, Button::new("Open this file").min_size(vec2(24.0, 24.0)));
        if text != state.files.path {
            emit(FilesCommand::Type(text.clone()));
        }
        if (is_entered || button.clicked()) && can_open {
            emit(FilesCommand::Path(text.trim().to_owned()));
        }
    });
}

fn recent(ui: &mut Ui, state: &State, emit: &mut dyn FnMut(FilesCommand)) {
    ui.label(theme::title("a recent session"));
    let list = match (&state.files.recent, &state.files.refused) {
        (_, Some(why)) => {
            ui.add(Label::new(RichText::new(why).color(theme::lost())).wrap());
            return;
        }
        (None, None) => {
            ui.label(theme::note("Asking the server for its sessions …"));
            return;
        }
        (Some(list), None) => list,
    };
    if list.is_empty() {
        ui.label(theme::note(
            "No session yet. Open a drive below, or drop a scenario: the session is kept from then on.",
        ));
    }
    for entry in list.iter().take(LISTED) {
        let is_open = state.session.as_ref().is_some_and(|open| open.id == entry.id);
        let words = format!("{}: {}", entry.id, about(entry, is_open));
        let name = format!("remove session {}", entry.id);
        let remove = (!is_open).then_some(("Remove", name.as_str()));
        match row(ui, [&entry.traverse_name, &words], is_open, &session_name(entry), remove) {
            Some(Pressed::Row) => emit(FilesCommand::Resume(entry.id.clone())),
            Some(Pressed::Beside) => emit(FilesCommand::RemoveSession(Box::new(entry.clone()))),
            None => {}
        }
    }
    for entry in state.files.removed.iter().rev() {
        ui.horizontal(|ui| {
            ui.label(theme::note(format!("{} on {} was removed.", entry.id, entry.traverse_name)));
            let undo = Button::new("Undo").min_size(vec2(24.0, 24.0));
            if ui.add(undo).accessible_name(format!("restore session {}", entry.id)).clicked() {
                emit(FilesCommand::RestoreSession(entry.id.clone()));
            }
        });
    }
    if list.len() > LISTED {
        ui.label(theme::note(format!("and {} older ones", list.len() - LISTED)));
    }
}

fn drives(ui: &mut Ui, state: &State, emit: &mut dyn FnMut(FilesCommand)) {
    ui.label(theme::title("a new session on a drive of this server"));
    let list = state.traverses.as_deref().unwrap_or_default();
    if list.is_empty() {
        ui.label(theme::note("The server has no drive: open a recording above, or a scenario below."));
    }
    for entry in list {
        let kind = if entry.simulated { "simulated" } else { "recorded" };
        let words = format!("{kind}, {} stops", entry.stop_count);
        let name = format!("remove the drive {}", entry.name);
        let remove = entry.removable.then_some(("Remove …", name.as_str()));
        match row(ui, [&entry.name, &words], false, &format!("new session on {}", entry.name), remove) {
            Some(Pressed::Row) => emit(FilesCommand::Begin(entry.id.clone())),
            Some(Pressed::Beside) => emit(FilesCommand::ConfirmDrive(Some(entry.id.clone()))),
            None => {}
        }
        if state.files.confirming.as_ref() == Some(&entry.id) {
            confirm(ui, entry, emit);
        }
    }
}

/// Asks the user to confirm the removal of a drive, because its images must be rendered again when it is reopened.
fn confirm(ui: &mut Ui, entry: &TraverseEntry, emit: &mut dyn FnMut(FilesCommand)) {
    ui.horizontal(|ui| {
        let words = format!("Remove {} and its rendered images? Its scenario opens it again.", entry.name);
        ui.label(RichText::new(words).color(theme::text()));
        let remove = Button::new("Remove").min_size(vec2(24.0, 24.0));
        if ui.add(remove).accessible_name(format!("really remove the drive {}", entry.name)).clicked() {
            emit(FilesCommand::RemoveDrive(entry.id.clone()));
        }
        if ui.add(Button::new("Keep").min_size(vec2(24.0, 24.0))).clicked() {
            emit(FilesCommand::ConfirmDrive(None));
        }
    });
}

/// The button of a line that was pressed.
pub(super) enum Pressed {
    /// The line itself.
    Row,
    /// The small button beside it.
    Beside,
}

/// A line that is one button (title and details), optionally with a small one beside it (label and accessible name).
pub(super) fn row(
    ui: &mut Ui,
    [title, words]: [&str; 2],
    is_on: bool,
    name: &str,
    beside: Option<(&str, &str)>,
) -> Option<Pressed> {
    let mut job = egui::text::LayoutJob::default();
    let style = ui.style().clone();
    let normal = egui::FontSelection::Default;
    RichText::new(format!("{title}   ")).color(theme::strong()).append_to(
        &mut job,
        &style,
        normal.clone(),
        egui::Align::Center,
    );
    theme::note(words).append_to(&mut job, &style, normal, egui::Align::Center);
    ui.horizontal(|ui| {
        let width = ui.available_width() - if beside.is_some() { BESIDE_WIDTH } else { 0.0 };
        let size = vec2(width, 26.0);
        let button = Button::selectable(is_on, (job, egui::Atom::grow())).truncate().min_size(size);
        let is_pressed = ui.add_sized(size, button).accessible_name(name).clicked();
        let is_beside = beside.is_some_and(|(label, name)| {
            let button = Button::new(label).min_size(vec2(24.0, 24.0));
            ui.add(button).accessible_name(name).clicked()
        });
        match (is_beside, is_pressed) {
            (true, _) => Some(Pressed::Beside),
            (false, true) => Some(Pressed::Row),
            (false, false) => None,
        }
    })
    .inner
}

/// The accessible name of a recent session, with the contents of its line.
fn session_name(entry: &SessionEntry) -> String {
    format!("session {} on {}: {}", entry.id, entry.traverse_name, about(entry, false))
}

/// Targets, runs, step and time of the last use.
fn about(entry: &SessionEntry, is_open: bool) -> String {
    let count = |n: usize, one: &str| if n == 1 { format!("1 {one}") } else { format!("{n} {one}s") };
    let when = if is_open { "open now".to_owned() } else { ago(entry.idle_s) };
    let (targets, runs) = (count(entry.target_count, "target"), count(entry.run_count, "run"));
    format!("{targets}, {runs}, at step {} of {}, {when}", entry.step, entry.stop_count.saturating_sub(1))
}

/// The time since the last use, in words.
pub(crate) fn ago(idle_s: Option<f64>) -> String {
    let Some(s) = idle_s else { return "used before this was noted".to_owned() };
    let (count, unit) = match s {
        _ if s < 60.0 => return "used just now".to_owned(),
        _ if s < 3600.0 => (s / 60.0, "minute"),
        _ if s < 86_400.0 => (s / 3600.0, "hour"),
        _ => (s / 86_400.0, "day"),
    };
    let count = count.floor();
    format!("used {count} {unit}{} ago", if count == 1.0 { "" } else { "s" })
}

/// Covers the page with the list of accepted files while a file is dragged over it.
pub(crate) fn veil(ui: &mut Ui, state: &State) {
    if !state.files.is_hovered {
        return;
    }
    let page = ui.ctx().content_rect();
    let area = Area::new(Id::unique("drop veil")).order(Order::Tooltip).interactable(false);
    area.anchor(Align2::LEFT_TOP, [0.0, 0.0]).show(ui.ctx(), |ui| {
        let (whole, response) = ui.allocate_exact_size(page.size(), Sense::hover());
        ui.painter().rect_filled(whole, 0.0, theme::shade());
        let border = whole.shrink(14.0);
        let stroke = egui::Stroke::new(2.0, theme::accent());
        ui.painter().rect_stroke(border, 8.0, stroke, egui::StrokeKind::Inside);
        let mut lines = vec!["Drop one file to open it".to_owned()];
        lines.extend(OPENABLE.map(|(what, comes_of_it)| format!("{what} {comes_of_it}")));
        let middle = whole.center() - vec2(0.0, 14.0 * lines.len() as f32);
        let room = vec2(680.0, 28.0 * lines.len() as f32 + 28.0);
        let behind = egui::Rect::from_center_size(whole.center() - vec2(0.0, 14.0), room);
        ui.painter().rect_filled(behind, 8.0, theme::panel());
        for (place, line) in lines.iter().enumerate() {
            let (size, colour) = if place == 0 { (24.0, theme::strong()) } else { (15.0, theme::text()) };
            let at = middle + vec2(0.0, 28.0 * place as f32);
            ui.painter().text(at, Align2::CENTER_CENTER, line, egui::FontId::proportional(size), colour);
        }
        response.widget_info(|| WidgetInfo::labeled(egui::Role::Label, true, lines.join(". ")));
    });
}

#[cfg(test)]
mod tests {
    use crate::files::window::ago;

    #[test]
    fn times_are_said_as_a_person_says_them() {
        assert_eq!(ago(Some(3.0)), "used just now");
        assert_eq!(ago(Some(60.0)), "used 1 minute ago");
        assert_eq!(ago(Some(7300.0)), "used 2 hours ago");
        assert_eq!(ago(Some(86_400.0 * 3.5)), "used 3 days ago");
        assert_eq!(ago(None), "used before this was noted");
    }
}
