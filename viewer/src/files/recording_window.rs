//! The part of the window “Open” for recordings and scenarios: lists, the contents of a recording, and its import.

use std::sync::LazyLock;

use egui::{Button, CollapsingHeader, Label, ProgressBar, RichText, ScrollArea, Ui, vec2};
use sightline_api::recording::{ImportJob, ImportState, RecordingView};
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_world::library;

use crate::files::FilesCommand;
use crate::files::recording::{RecordingCommand, Sending};
use crate::files::window::{Pressed, row};
use crate::state::State;
use crate::theme;

/// The scenarios of the library with their descriptions.
static SCENARIOS: LazyLock<Vec<(&str, String)>> = LazyLock::new(|| {
    let described = |name| {
        let description = library::scenario(name).map(|scenario| scenario.description);
        (name, without_references(&description.unwrap_or_default()))
    };
    library::names().map(described).collect()
});

/// Maximum height of the list of recordings, and height of its lines, points.
const LIST_HEIGHT: f32 = 260.0;
const LINE_HEIGHT: f32 = 30.0;

/// Shows the recordings and an input field for a path.
pub(super) fn list(ui: &mut Ui, state: &State, emit: &mut dyn FnMut(FilesCommand)) {
    let recordings = &state.files.recordings;
    ui.label(theme::title("your own recording: KITTI odometry, PDS3, or a Sightline drive"));
    match &recordings.list {
        None => {
            ui.label(theme::note("Reading the folders of recordings …"));
        }
        Some(list) if list.folders.is_empty() => {
            let words = "To open a recording on the server's machine, start the server with its folder: \
                         sightline serve --recordings FOLDER";
            ui.add(Label::new(theme::note(words)).wrap());
        }
        Some(list) => {
            let height = (list.recordings.len() as f32 * LINE_HEIGHT).min(LIST_HEIGHT);
            ScrollArea::vertical().id_salt("recordings").max_height(height).min_scrolled_height(height).show(
                ui,
                |ui| {
                    for entry in &list.recordings {
                        let short = short(&entry.path, &list.folders);
                        let name = format!("recording {short}");
                        let pressed = row(ui, [short, &entry.format], false, &name, None);
                        if matches!(pressed, Some(Pressed::Row)) {
                            emit(FilesCommand::Recording(RecordingCommand::Examine(entry.path.clone())));
                        }
                    }
                },
            );
            if list.recordings.is_empty() {
                ui.label(theme::note(format!("No recording was found in {}.", list.folders.join(", "))));
            }
            if !list.is_complete {
                ui.label(theme::note("There are more; enter the path of another one."));
            }
            path(ui, state, emit);
        }
    }
    if cfg!(any(test, target_arch = "wasm32")) {
        send(ui, state, emit);
    }
    if let Some(path) = &recordings.examining {
        ui.horizontal(|ui| {
            ui.spinner();
            ui.label(theme::label(format!("Examining {path} …")));
        });
    }
    problem(ui, state);
}

/// The path relative to the folder given at the server's start.
fn short<'a>(path: &'a str, folders: &[String]) -> &'a str {
    let below = folders.iter().find_map(|folder| path.strip_prefix(folder.as_str()));
    below.map(|below| below.trim_start_matches('/')).filter(|below| !below.is_empty()).unwrap_or(path)
}

fn path(ui: &mut Ui, state: &State, emit: &mut dyn FnMut(FilesCommand)) {
    ui.horizontal(|ui| {
        let mut text = state.files.recordings.path.clone();
        let hint = "path of a folder on the server's machine";
        let field = egui::TextEdit::singleline(&mut text).desired_width(440.0).hint_text(hint);
        let field = ui.add(field).accessible_name("path of a recording");
        let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        let can_examine = !text.trim().is_empty();
        let button = ui.add_enabled(can_examine, Button::new("Examine").min_size(vec2(24.0, 24.0)));
        if text != state.files.recordings.path {
            emit(FilesCommand::Recording(RecordingCommand::Type(text.clone())));
        }
        if (is_entered || button.clicked()) && can_examine {
            emit(FilesCommand::Recording(RecordingCommand::Examine(text.trim().to_owned())));
        }
    });
}

/// Buttons that choose a recording on the user's machine, and the progress of sending it.
fn send(ui: &mut Ui, state: &State, emit: &mut dyn FnMut(FilesCommand)) {
    ui.horizontal(|ui| {
        if let Some(Sending { chosen, sent }) = &state.files.recordings.sending {
            let megabytes = chosen.bytes as f64 / 1e6;
            let words =
                format!("{}: sent {sent} of {} files, {megabytes:.1} MB", chosen.name, chosen.file_count);
            let share = *sent as f32 / chosen.file_count.max(1) as f32;
            ui.add(ProgressBar::new(share).desired_width(440.0).text(words));
            let cancel = Button::new("Cancel").min_size(vec2(24.0, 24.0));
            if ui.add(cancel).accessible_name("Cancel sending").clicked() {
                emit(FilesCommand::Recording(RecordingCommand::StopSending));
            }
            return;
        }
        ui.label(theme::label("on this machine:"));
        for (label, is_archive) in [("Choose a folder …", false), ("Choose a zip archive …", true)] {
            if ui.add(Button::new(label).min_size(vec2(24.0, 24.0))).clicked() {
                emit(FilesCommand::Recording(RecordingCommand::Choose { is_archive }));
            }
        }
    });
}

fn problem(ui: &mut Ui, state: &State) {
    if let Some(problem) = &state.files.recordings.problem {
        ui.add(Label::new(RichText::new(&problem.detail).color(theme::lost())).wrap());
        if let Some(hint) = &problem.hint {
            ui.add(Label::new(theme::note(hint)).wrap());
        }
    }
}

/// Shows the contents of a recording, or the progress of its import, instead of the lists. Returns whether there is one.
pub(super) fn card(ui: &mut Ui, state: &State, emit: &mut dyn FnMut(FilesCommand)) -> bool {
    let recordings = &state.files.recordings;
    let Some(view) = &recordings.shown else { return false };
    ui.label(RichText::new(&view.name).size(15.0).strong().color(theme::strong()));
    contents(ui, view, &recordings.folder_name);
    problem(ui, state);
    ui.add_space(6.0);
    if let Some(job) = &recordings.import {
        progress(ui, job, emit);
        return true;
    }
    ui.horizontal(|ui| {
        let label = if view.is_opened_in_place { "Open" } else { "Import" };
        let button = Button::new(label).min_size(vec2(80.0, 26.0));
        let button = ui.add_enabled(!recordings.is_starting, button);
        if button.accessible_name(format!("{label} the recording {}", view.name)).clicked() {
            emit(FilesCommand::Recording(RecordingCommand::Import));
        }
        if ui.add(Button::new("Back").min_size(vec2(24.0, 26.0))).clicked() {
            emit(FilesCommand::Recording(RecordingCommand::Back));
        }
        if !view.is_opened_in_place {
            ui.label(theme::note(format!(
                "copies {} images; the recording stays as it is",
                view.image_count
            )));
        }
    });
    true
}

fn contents(ui: &mut Ui, view: &RecordingView, folder: &str) {
    let size = |[width, height]: [u32; 2]| format!("{width} × {height} px");
    let sizes = if view.left_size == view.right_size {
        size(view.left_size)
    } else {
        format!("left {}, right {}", size(view.left_size), size(view.right_size))
    };
    let stereo = match view.stereo {
        StereoGeometry::Lateral => "left and right camera side by side",
        StereoGeometry::Convergent => "two views that converge",
    };
    let stops = if view.stop_count == 1 { "1 stop".to_owned() } else { format!("{} stops", view.stop_count) };
    let truth = if view.has_truth { "known" } else { "not known" };
    let further = view.further_cameras.join(", ");
    let mut rows = vec![
        ("format", view.format.as_str()),
        ("folder", folder),
        ("stops", stops.as_str()),
        ("images", sizes.as_str()),
        ("stereo", stereo),
        ("true poses", truth),
    ];
    if !further.is_empty() {
        rows.push(("further cameras", further.as_str()));
    }
    egui::Grid::new("recording").num_columns(2).spacing([14.0, 4.0]).show(ui, |ui| {
        for (name, value) in rows {
            ui.label(theme::label(name));
            ui.add(Label::new(RichText::new(value).color(theme::text())).wrap());
            ui.end_row();
        }
    });
    ui.add_space(4.0);
    egui::Grid::new("pairs").num_columns(3).spacing([14.0, 3.0]).striped(true).show(ui, |ui| {
        for title in ["stop", "left image", "right image"] {
            ui.label(theme::label(title));
        }
        ui.end_row();
        for pair in &view.pairs {
            ui.label(theme::number(pair.step.to_string()));
            for image in [&pair.left, &pair.right] {
                ui.add(Label::new(RichText::new(image).color(theme::text())).extend());
            }
            ui.end_row();
        }
    });
    for note in &view.notes {
        ui.add(Label::new(theme::note(note)).wrap());
    }
}

fn progress(ui: &mut Ui, job: &ImportJob, emit: &mut dyn FnMut(FilesCommand)) {
    ui.horizontal(|ui| {
        let words = match job.state {
            ImportState::Waiting => "waiting for another import".to_owned(),
            _ => format!("{} of {} images", job.k, job.n),
        };
        let share = job.k as f32 / job.n.max(1) as f32;
        ui.add(ProgressBar::new(share).desired_width(420.0).text(words));
        if ui
            .add(Button::new("Cancel").min_size(vec2(24.0, 26.0)))
            .accessible_name("Cancel the import")
            .clicked()
        {
            emit(FilesCommand::Recording(RecordingCommand::Cancel));
        }
    });
}

/// Shows the scenarios of the library.
pub(super) fn scenarios(ui: &mut Ui, emit: &mut dyn FnMut(FilesCommand)) {
    let title = theme::title("a scenario that comes with Sightline");
    CollapsingHeader::new(title).id_salt("scenarios").show(ui, |ui| {
        for (name, description) in SCENARIOS.iter() {
            let pressed = row(ui, [name, description], false, &format!("scenario {name}"), None);
            if matches!(pressed, Some(Pressed::Row)) {
                emit(FilesCommand::Recording(RecordingCommand::Scenario(name)));
            }
        }
    });
}

/// A description without parentheses that only cite requirements, such as “ (R104, R106)”.
fn without_references(description: &str) -> String {
    let mut text = String::new();
    let mut rest = description;
    while let Some((before, after)) = rest.split_once(" (R")
        && let Some((inside, behind)) = after.split_once(')')
    {
        text.push_str(before);
        if !inside.starts_with(|c: char| c.is_ascii_digit()) {
            text.push_str(&format!(" (R{inside})"));
        }
        rest = behind;
    }
    [", R", " of R"].iter().fold(text + rest, |text, mark| without_numbers(&text, mark))
}

/// Removes `mark` and the number after it, wherever a number follows it.
fn without_numbers(text: &str, mark: &str) -> String {
    let mut parts = text.split(mark);
    let mut whole = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let behind = part.trim_start_matches(|c: char| c.is_ascii_digit());
        if behind.len() == part.len() {
            whole.push_str(mark);
        }
        whole.push_str(behind);
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_scenario_is_described_by_the_number_of_a_requirement() {
        let described = "Straight on (R104, R106): slow (all slip, R126), as far as of R1.";
        assert_eq!(without_references(described), "Straight on: slow (all slip), as far as.");
        for (name, description) in SCENARIOS.iter() {
            let numbers = description
                .split(|c: char| !c.is_ascii_alphanumeric())
                .filter(|word| word.strip_prefix('R').is_some_and(|rest| rest.parse::<u32>().is_ok()));
            assert_eq!(numbers.count(), 0, "{name}: {description}");
        }
    }
}
