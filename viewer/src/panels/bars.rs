//! The bars: title and status at the top; stages, progress and the newest message at the bottom; and the connection
//! banner.

use egui::scroll_area::ScrollBarVisibility;
use egui::{Align, Button, Color32, ComboBox, Layout, Response, RichText, ScrollArea, Ui};
use sightline_record::Unit;
use sightline_session::records;
use sightline_session::step::{RunStep, StepRow};
use sightline_track::target::TrackingState;

use crate::command::table::{
    EXPORT, FIRST_STEP, HELP, LAST_STEP, NEXT_EVENT, NEXT_STEP, OPEN, OPEN_RERUN, PREVIOUS_EVENT,
    PREVIOUS_STEP, UserCommand,
};
use crate::command::{Command, Stage};
use crate::compare::panel::{choosers, readouts};
use crate::net::events::Connection;
use crate::panels::{inspector, messages, numbers, playing, view_menu};
use crate::state::messages::Weight;
use crate::state::tracker::confidence_of;
use crate::state::{State, run_letter};
use crate::{panels, theme};

/// Assumed width of the buttons on the right before their first layout, points.
const BUTTONS: f32 = 320.0;

/// Page width below which the title is omitted, points.
const NARROW: f32 = 900.0;

/// The columns of a row that the status line shows, each with its display unit and number of decimals.
const STATUS: [(&str, Unit, usize); 5] = [
    ("ncc", Unit::One, 2),
    ("inliers", Unit::One, 0),
    ("confidence", Unit::One, 2),
    ("err_px", Unit::Pixel, 1),
    ("sigma_m", Unit::Centimetre, 1),
];

/// The top bar: traverse, cursor and status, and the commands for the whole page.
pub(crate) fn top(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ui.horizontal_centered(|ui| {
        // In a narrow window the target's state takes the title's space.
        if ui.available_width() >= NARROW {
            ui.label(RichText::new("Sightline").size(16.0).strong().color(theme::accent()));
            ui.separator();
        }
        traverse_choice(ui, state, out);
        ui.separator();
        // The buttons keep their width; the status scrolls within the rest if it does not fit, as with four runs.
        let id = ui.scope_id().with("the buttons' width");
        let buttons = ui.data(|data| data.get_temp::<f32>(id)).unwrap_or(BUTTONS);
        let room = ui.available_width() - buttons - 2.0 * ui.spacing().item_spacing.x;
        let middle =
            ScrollArea::horizontal().id_salt("status").max_width(room.max(60.0)).auto_shrink([true, false]);
        middle.scroll_bar_visibility(ScrollBarVisibility::AlwaysHidden).show(ui, |ui| {
            ui.horizontal_centered(|ui| {
                choosers::show(ui, state, out);
                status(ui, state, out);
            });
        });
        let right = ui.max_rect().right();
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let sheet = ui.add(Button::new(HELP.icon).min_size(egui::vec2(26.0, 24.0)));
            give(&HELP, sheet.accessible_name(HELP.name), state, out);
            view_menu::show(ui, state, out);
            let has_targets = state.session.as_ref().is_some_and(|session| !session.targets.is_empty());
            give(&OPEN_RERUN, ui.add_enabled(has_targets, Button::new(OPEN_RERUN.icon)), state, out);
            give(&EXPORT, ui.add_enabled(state.session.is_some(), Button::new(EXPORT.icon)), state, out);
            let open = ui.add(Button::new(OPEN.icon));
            give(&OPEN, open.clone(), state, out);
            ui.data_mut(|data| data.insert_temp(id, right - open.rect.left()));
        });
    });
}

/// Explains a button by the tooltip of its command, and gives the command when it is clicked.
fn give(command: &UserCommand, button: Response, state: &State, out: &mut Vec<Command>) {
    if button.on_hover_text(command.tooltip()).clicked() {
        out.push((command.command)(state));
    }
}

fn traverse_choice(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let open = state.traverse.as_ref();
    let name = open.map_or_else(|| "no traverse".to_owned(), |traverse| traverse.name.clone());
    let list = state.traverses.as_deref().unwrap_or_default();
    let choice = ComboBox::from_id_salt("traverse").width(170.0).selected_text(name).show_ui(ui, |ui| {
        for entry in list {
            let is_open = open.is_some_and(|traverse| traverse.id == entry.id);
            // A commanded drive has the name of the traverse from which it started.
            let is_only = list.iter().filter(|other| other.name == entry.name).count() == 1;
            let words = if is_only { entry.name.clone() } else { format!("{} ({})", entry.name, entry.id) };
            if panels::entry(ui, is_open, &words).clicked() {
                out.push(Command::OpenTraverse(entry.id.clone()));
            }
        }
    });
    let response = choice.response.accessible_name("traverse");
    if let Some(traverse) = open {
        let mut words = traverse.description.clone();
        for warning in &traverse.warnings {
            words += &format!("\n! {warning}");
        }
        response.on_hover_text(words);
    }
}

/// The status line: step, state, score and error.
pub(crate) fn status(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(last) = state.stop_count().checked_sub(1) else {
        ui.label(theme::label(state.missing_target()));
        return;
    };
    ui.label(theme::label("step"));
    ui.label(theme::number(format!("{}/{last}", state.cursor.step)).size(13.0));
    let of_what = |ui: &mut Ui| {
        if let Some(target) = state.target() {
            ui.label(theme::label(format!("{} · run {}", target.label, run_letter(state.cursor.run))));
        }
    };
    let Some(row) = state.row() else {
        of_what(ui);
        ui.label(theme::label(if state.target().is_some() { "not computed" } else { "no target" }));
        return;
    };
    let tracking = state.tracking().unwrap_or_default();
    let is_not_searched = row.not_searched;
    let (word, colour) = state_word(tracking, row);
    let shown = ui.label(RichText::new(word).strong().color(colour));
    match tracking {
        _ if is_not_searched => {
            shown.on_hover_text(
                "Visual odometry ran alone at this stop: the tracker did not look for the target.",
            );
        }
        TrackingState::Lost { count } => {
            shown.on_hover_text(format!("Bad updates in a row: {count}"));
        }
        _ => {}
    }
    of_what(ui);
    let has_confidence = state.run().and_then(|run| confidence_of(run, row)).is_some();
    for (column, unit, decimals) in STATUS {
        let value = records::row_value_in(row, column, unit);
        let is_shown = column != "confidence" || has_confidence;
        if let (Some(value), Some(declared), true) = (value, records::row_quantity(column), is_shown) {
            ui.label(theme::label(declared.label.as_ref()));
            let words = theme::number(format!("{value:.decimals$}")).size(13.0);
            numbers::show(ui, words, state.cursor.step, column, out);
            ui.label(theme::note(unit.symbol()));
            readouts::after(ui, state, column, unit);
        }
    }
    readouts::states(ui, state);
}

/// The tracking state of a step in capitals, checked against the ground truth if available, and its colour.
pub(crate) fn state_word(tracking: TrackingState, row: &StepRow) -> (String, Color32) {
    match tracking {
        _ if row.not_searched => ("NOT SEARCHED".to_owned(), theme::weak()),
        TrackingState::Tracking if row.tracked == Some(false) => {
            ("FALSE TRACKING".to_owned(), theme::failed())
        }
        other => (other.word().to_uppercase(), theme::state(other)),
    }
}

/// The banner shown while the server is unreachable.
pub(crate) fn banner(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    if let Connection::Gone { attempts } = state.connection {
        ui.horizontal(|ui| {
            let words =
                format!("The server is gone. Steps that are loaded stay browsable; retrying ({attempts}) …");
            ui.label(RichText::new(words).color(theme::lost()));
            if ui.small_button("Retry now").clicked() {
                out.push(Command::Reconnect);
            }
        });
    }
}

/// The playback buttons, and the progress of runs and rendering.
pub(crate) fn transport(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        for command in [FIRST_STEP, PREVIOUS_EVENT, PREVIOUS_STEP, NEXT_STEP, NEXT_EVENT, LAST_STEP] {
            let words = RichText::new(command.icon).monospace();
            let button = ui.add(Button::new(words).min_size(egui::vec2(30.0, 22.0)));
            give(&command, button, state, out);
        }
        playing::controls(ui, state, out);
        ui.add_space(8.0);
        run_progress(ui, state, out);
        if let Some((k, n)) = state.rendering {
            progress_bar(ui, &format!("rendering {k} of {n} stops"), k as f64 / n.max(1) as f64);
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| newest_message(ui, state, out));
    });
}

fn run_progress(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    for ((target, run), progress) in &state.progress {
        let name = run_letter(*run);
        let (words, part) = match state.way_left_m((*target, *run)) {
            Some([left_m, first_m]) => {
                let stop = progress.k.saturating_sub(1);
                let left = numbers::fixed(left_m, 2);
                let words = format!("run {name}: stop {stop}, {left} m to the goal");
                (words, 1.0 - left_m / first_m.max(left_m))
            }
            None => {
                let words = format!("run {name}: {} of {}, {}", progress.k, progress.n, progress.doing);
                (words, progress.k as f64 / progress.n.max(1) as f64)
            }
        };
        progress_bar(ui, &words, part);
        if ui.small_button("Cancel").clicked() {
            out.push(Command::CancelRun { target: *target, run: *run });
        }
        ui.add_space(6.0);
    }
}

/// A thin progress bar with its label; `part` is in 0..1.
fn progress_bar(ui: &mut Ui, words: &str, part: f64) {
    let (rect, _) = ui.allocate_exact_size(egui::vec2(90.0, 6.0), egui::Sense::hover());
    ui.painter().rect_filled(rect, 3.0, theme::unknown());
    let done = egui::Rect::from_min_size(rect.min, egui::vec2(rect.width() * part as f32, rect.height()));
    ui.painter().rect_filled(done, 3.0, theme::accent());
    ui.label(theme::note(words));
}

fn newest_message(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    if let Some(message) = state.newest_message() {
        messages::undo(ui, state, message, out);
        let colour = if message.weight == Weight::Problem { theme::lost() } else { theme::weak() };
        let words = RichText::new(&message.text).small().color(colour);
        ui.add(egui::Label::new(words).truncate()).on_hover_text(&message.text);
    }
}

/// The stages in execution order; the steps of `locate` follow it in brackets.
pub(crate) fn stages(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        let paused_before = state.paused_before(state.cursor.step);
        for (i, stage) in state.stages().enumerate() {
            if i > 0 {
                let between = match stage {
                    Stage::JUDGE => ")  ›",
                    step if step.is_first_step(state.tracker()) => "(",
                    _ => "›",
                };
                if paused_before.is_some_and(|before| stage.word() == before.word()) {
                    pause_mark(ui, stage, between);
                } else {
                    ui.label(theme::note(between));
                }
            }
            stage_button(ui, state, stage, out);
        }
    });
}

/// The mark between two stages at which a commanded drive is paused.
fn pause_mark(ui: &mut Ui, next: Stage, between: &str) {
    let words = RichText::new(format!("{between} ||")).strong().color(theme::accent());
    let name = format!("paused before {}", next.word());
    let help = "The drive is paused here: the stages on the left are done, the others are not computed yet.";
    let mark = ui.label(words).on_hover_text(help);
    mark.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &name));
}

fn stage_button(ui: &mut Ui, state: &State, stage: Stage, out: &mut Vec<Command>) {
    let reached = match stage.is_of_drive() {
        true => Some(state.is_decided(stage)),
        false => state.trace().map(|trace| inspector::is_reached(trace, stage)),
    };
    let colour = match (reached, has_failed(state.trace(), stage)) {
        (_, true) => theme::failed(),
        (Some(true), _) => theme::text(),
        _ => theme::weak().gamma_multiply(0.7),
    };
    let size = if stage.is_step_of_locate() { 11.5 } else { 12.5 };
    let words = RichText::new(stage.word()).size(size).color(colour);
    let button = Button::selectable(state.stage() == stage, words);
    let is_done = reached == Some(true);
    let note = match state.paused_before(state.cursor.step).filter(|before| stage.in_cycle() >= *before) {
        Some(before) if stage.in_cycle() == before => {
            "\nNext: the drive is paused before this stage.".to_owned()
        }
        Some(before) => format!("\nNot computed yet: the drive is paused before {}.", before.word()),
        None if is_done || reached.is_none() => String::new(),
        None => "\nNot reached at this step.".to_owned(),
    };
    if ui.add(button).on_hover_text(format!("{}{note}", stage.question())).clicked() {
        out.push(Command::SelectStage(stage));
    }
}

/// Whether the step failed at this stage.
fn has_failed(trace: Option<&RunStep>, stage: Stage) -> bool {
    let Some(trace) = trace else { return false };
    match stage {
        Stage::VISUAL_ODOMETRY => trace.odometry.as_ref().is_some_and(|measured| !measured.update.accepted),
        Stage::CAPTURE => trace.fault().is_some(),
        Stage::LOCATE => trace.located().is_some_and(|located| located.missing.is_some()),
        Stage::JUDGE => trace.verdict().is_some_and(|verdict| !verdict.good),
        _ => false,
    }
}
