//! Targets and their runs.

use egui::text::{CCursor, CCursorRange};
use egui::{Align, Layout, RichText, ScrollArea, Sense, Ui, vec2};
use sightline_session::view::{RunView, TargetView};

use crate::command::table::PICK;
use crate::command::{Command, Mode};
use crate::drawing::overlay::{Mark, paint_mark, run_mark};
use crate::layout::command::LayoutCommand;
use crate::panels::numbers::{counted, fixed};
use crate::panels::pane::Pane;
use crate::panels::panel::Panel;
use crate::panels::{run_tree, timeline};
use crate::state::targets::{Rename, Renaming};
use crate::state::{State, run_letter};
use crate::why::WhyCommand;
use crate::{panels, theme};

/// The purpose of the panel.
const PURPOSE: &str = Pane::Targets.about().help;

/// Minimum panel height at which the lines about the selected run are below the list, points; else they are at its end.
const LIST_MIN: f32 = 150.0;

/// Indentation of a branch against its parent, points.
const INDENT: f32 = 12.0;

/// Width of a run's state band, points.
const BAND_WIDTH: f32 = 56.0;

/// A panel narrower than this shows the buttons of a target below its name, points.
const BUTTONS_BESIDE: f32 = 300.0;

/// The colours of a target's marks: name and number.
const COLOURS: [(&str, Option<usize>); 5] =
    [("grey", None), ("blue", Some(0)), ("pink", Some(1)), ("violet", Some(2)), ("green", Some(3))];

/// Width beside the name field for “Remove”, points.
const NAME_BESIDE: f32 = 80.0;

/// The panel “Targets and runs”.
pub(crate) struct Targets;

impl Panel for Targets {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }
}

/// Shows the targets.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let is_picking = state.mode == Mode::Pick;
    let pick = format!("{}  ({})", PICK.name, PICK.keys());
    let words = if is_picking { "Cancel picking  (Esc)" } else { &pick };
    let button = egui::Button::new(words).selected(is_picking).min_size(vec2(ui.available_width(), 26.0));
    if ui.add_enabled(state.session.is_some(), button).clicked() {
        out.push(Command::SetMode(if is_picking { Mode::Look } else { Mode::Pick }));
    }
    ui.add_space(2.0);
    let targets = state.session.as_ref().map(|session| session.targets.as_slice()).unwrap_or_default();
    if targets.is_empty() {
        panels::missing(ui, PURPOSE, &state.missing_target());
        return;
    }
    let has_room = ui.available_height() >= LIST_MIN;
    if has_room {
        egui::Panel::bottom("the run that is looked at").frame(egui::Frame::new()).show(ui, |ui| {
            ui.add_space(2.0);
            selected_run(ui, state);
        });
    }
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for target in targets {
            show_target(ui, state, target, out);
            ui.add_space(6.0);
        }
        if !has_room {
            selected_run(ui, state);
        }
    });
}

/// The details of the selected run, for which its line in the list has no space.
fn selected_run(ui: &mut Ui, state: &State) {
    let (Some(target), Some(run)) = (state.target(), state.run()) else { return };
    let mut lines = vec![format!("run {}: {}", run_letter(run.number), summary(run))];
    lines.extend(about(target, run));
    for line in lines {
        ui.add(egui::Label::new(theme::note(line)).wrap());
    }
}

/// The parent of a run and the settings that it changes, one line each.
fn about(target: &TargetView, run: &RunView) -> Vec<String> {
    let from = run.fork.map(|fork| format!("from run {} at step {}", run_letter(fork.run), fork.from_step));
    from.into_iter().chain(run_tree::changed(&target.runs, run)).collect()
}

fn show_target(ui: &mut Ui, state: &State, target: &TargetView, out: &mut Vec<Command>) {
    let is_selected = state.cursor.target == Some(target.number);
    let is_narrow = ui.available_width() < BUTTONS_BESIDE;
    ui.horizontal(|ui| {
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if !is_narrow {
                buttons_of(ui, state, target, out);
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| title_of(ui, state, target, out));
        });
    });
    if is_narrow {
        ui.horizontal_wrapped(|ui| buttons_of(ui, state, target, out));
    }
    let at = target.designation;
    let place = format!("designated at step {}, pixel {:.1}, {:.1}", at.step, at.pixel.x, at.pixel.y);
    ui.horizontal(|ui| {
        let is_elsewhere = is_selected && state.cursor.step != at.step;
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let help = "Designates a new target here with the same settings";
            if is_elsewhere && ui.small_button("Re-pick here").on_hover_text(help).clicked() {
                out.push(Command::Repick(target.number));
            }
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                ui.add(egui::Label::new(theme::note(place)).truncate());
            });
        });
    });
    for sentence in warnings(state, target) {
        ui.add(egui::Label::new(RichText::new(format!("! {sentence}")).small().color(theme::lost())).wrap())
            .on_hover_text("A warning about this designation; the target can be tracked all the same.");
    }
    for (depth, run) in run_tree::order(&target.runs) {
        ui.horizontal(|ui| {
            ui.add_space(INDENT * depth as f32);
            ui.vertical(|ui| show_run(ui, state, target, run, out));
        });
    }
}

/// The switch of a target's marks, their colour, and its name.
fn title_of(ui: &mut Ui, state: &State, target: &TargetView, out: &mut Vec<Command>) {
    let mut is_shown = !state.hidden_targets.contains(&target.number);
    let check = ui.checkbox(&mut is_shown, "").accessible_name(format!("marks of {}", target.label));
    if check.on_hover_text("Shows or hides its marks in the images").changed() {
        out.push(Command::ToggleTarget(target.number));
    }
    colour_menu(ui, state, target, out);
    let renaming = state.renaming.as_ref().filter(|renaming| renaming.target == target.number);
    match renaming {
        Some(renaming) => name_field(ui, renaming, out),
        None => name(ui, target, state.cursor.target == Some(target.number), out),
    }
}

/// The buttons of a target.
fn buttons_of(ui: &mut Ui, state: &State, target: &TargetView, out: &mut Vec<Command>) {
    let is_renamed = state.renaming.as_ref().is_some_and(|renaming| renaming.target == target.number);
    if ui.small_button("Remove").on_hover_text("Takes the target and its runs out of the session").clicked() {
        out.push(Command::RemoveTarget(target.number));
    }
    if is_renamed {
        return;
    }
    let is_simulated = state.traverse.as_ref().is_some_and(|traverse| traverse.simulated);
    if is_simulated && state.cursor.target == Some(target.number) {
        let help = "Shows the panel Drive: the rover drives to this target on its own estimates";
        if ui.small_button("Drive …").on_hover_text(help).clicked() {
            out.push(Command::Layout(LayoutCommand::Show(Pane::Drive)));
        }
    }
    let help = "Gives the target another name (double-click the name)";
    if ui.small_button("Rename").on_hover_text(help).clicked() {
        out.push(Command::Rename(Rename::Begin(target.number)));
    }
}

/// The mark of a target in its colour; a click opens the colour choice.
fn colour_menu(ui: &mut Ui, state: &State, target: &TargetView, out: &mut Vec<Command>) {
    let button = ui.add(egui::Button::new("").frame(false).min_size(vec2(16.0, 16.0)));
    let colour = state.colour_of(target.number);
    paint_mark(ui.painter(), button.rect.center(), Mark::Diamond, colour, 6.0);
    let button = button
        .accessible_name(format!("colour of {}", target.label))
        .on_hover_text("Chooses the colour of its marks while another target is selected");
    egui::Popup::menu(&button).show(|ui| {
        for (name, number) in COLOURS {
            let is_chosen = state.target_colours.get(&target.number).copied() == number;
            let sample = RichText::new(name).color(number.map_or_else(theme::weak, theme::run));
            if ui.selectable_label(is_chosen, sample).clicked() {
                out.push(Command::ColourTarget { target: target.number, colour: number });
            }
        }
    });
}

/// The name of a target: a click shows its newest run, a double click renames it.
fn name(ui: &mut Ui, target: &TargetView, is_selected: bool, out: &mut Vec<Command>) {
    let colour = if is_selected { theme::strong() } else { theme::text() };
    let text = RichText::new(&target.label).strong().color(colour);
    let label = ui.add(egui::Label::new(text).truncate().sense(Sense::click()));
    if label.double_clicked() {
        out.push(Command::Rename(Rename::Begin(target.number)));
    } else if label.clicked() {
        let run = target.runs.last().map_or(0, |run| run.number);
        out.push(Command::SelectRun { target: target.number, run });
    }
}

/// The input field of a name: Enter or leaving it saves, Esc cancels.
fn name_field(ui: &mut Ui, renaming: &Renaming, out: &mut Vec<Command>) {
    let mut text = renaming.text.clone();
    let width = (ui.available_width() - NAME_BESIDE).max(60.0);
    let field = ui.add(egui::TextEdit::singleline(&mut text).desired_width(width).char_limit(100));
    let field = field.accessible_name("name of the target");
    if field.changed() {
        out.push(Command::Rename(Rename::Type(text)));
    }
    if field.gained_focus() {
        // Typing replaces the old name.
        let mut cursor = egui::TextEdit::load_state(ui.ctx(), field.id).unwrap_or_default();
        let end = CCursor::new(renaming.text.chars().count());
        cursor.cursor.set_char_range(Some(CCursorRange::two(CCursor::new(0), end)));
        cursor.store(ui.ctx(), field.id);
    }
    if field.lost_focus() {
        let is_cancelled = ui.input(|input| input.key_pressed(egui::Key::Escape));
        out.push(Command::Rename(if is_cancelled { Rename::Cancel } else { Rename::Save }));
    } else if !field.has_focus() {
        field.request_focus();
    }
}

/// Warnings about the designation of the selected target (R21).
fn warnings<'a>(state: &'a State, target: &TargetView) -> Vec<&'a str> {
    let is_selected = state.cursor.target == Some(target.number);
    let pick = state.trace_at(target.designation.step).ready().filter(|_| is_selected);
    let evidence = pick.and_then(|trace| trace.template());
    evidence.map_or_else(Vec::new, |e| e.warnings.iter().map(|warning| warning.sentence.as_str()).collect())
}

fn show_run(ui: &mut Ui, state: &State, target: &TargetView, run: &RunView, out: &mut Vec<Command>) {
    let is_selected = state.cursor.target == Some(target.number) && state.cursor.run == run.number;
    let fill = if is_selected { theme::selected() } else { egui::Color32::TRANSPARENT };
    let frame = egui::Frame::new().fill(fill).corner_radius(4).inner_margin(egui::Margin::symmetric(6, 1));
    // The line is added before its contents, so that it receives only clicks that no button in it takes.
    let line = egui::UiBuilder::new().id_salt(("run", target.number, run.number)).sense(Sense::click());
    let inside = ui.scope_builder(line, |ui| {
        frame.show(ui, |ui| line_of(ui, state, target, run, out));
    });
    let response = inside.response;
    if is_selected {
        scroll_to_new(ui, &response, (target.number, run.number));
    }
    response.widget_info(|| {
        egui::WidgetInfo::selected(
            egui::Role::Button,
            true,
            is_selected,
            format!("run {}", run_letter(run.number)),
        )
    });
    if response.clicked() {
        out.push(Command::SelectRun { target: target.number, run: run.number });
    }
}

/// Scrolls to the selected run after the selection changed: a new branch may be below the visible part of the list.
fn scroll_to_new(ui: &Ui, line: &egui::Response, run: (usize, usize)) {
    let id = egui::Id::unique("selected run of the list");
    let before = ui.ctx().data_mut(|data| data.get_temp_mut_or(id, run).to_owned());
    if before != run {
        line.scroll_to_me(None);
        ui.ctx().data_mut(|data| data.insert_temp(id, run));
    }
}

/// One line: the run's mark, its states over the steps, its settings, its progress and its buttons.
fn line_of(ui: &mut Ui, state: &State, target: &TargetView, run: &RunView, out: &mut Vec<Command>) {
    ui.set_width(ui.available_width());
    ui.horizontal(|ui| {
        let (mark, _) = ui.allocate_exact_size(vec2(14.0, 14.0), Sense::hover());
        paint_mark(ui.painter(), mark.center(), run_mark(run.number), theme::run(run.number), 6.0);
        ui.label(RichText::new(run_letter(run.number)).color(theme::strong()));
        let (band, _) = ui.allocate_exact_size(vec2(BAND_WIDTH, 6.0), Sense::hover());
        timeline::thin_band(ui.painter(), band, target, run, state.stop_count());
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if target.runs.len() > 1 {
                let name = format!("remove run {}", run_letter(run.number));
                let help = "Removes the run; its branches keep their steps. Ctrl+Z undoes it";
                let button = ui.small_button("×").accessible_name(name).on_hover_text(help);
                if button.clicked() {
                    out.push(Command::Why(WhyCommand::RemoveRun { target: target.number, run: run.number }));
                }
            }
            how_far(ui, state, target, run, out);
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| settings_of(ui, state, target, run));
        });
    });
}

/// The preset of a run, or the settings that it changes.
fn settings_of(ui: &mut Ui, state: &State, target: &TargetView, run: &RunView) {
    let named = state.configurations.named(&run.settings);
    let is_branch = run_tree::parent(&target.runs, run).is_some();
    if let Some(preset) = named.filter(|_| !is_branch) {
        let text = RichText::new(preset.name).small().color(theme::accent());
        ui.add(egui::Label::new(text).truncate()).on_hover_text(preset.description);
    } else {
        let lines = about(target, run);
        ui.add(egui::Label::new(theme::note(lines.join(", "))).truncate()).on_hover_text(lines.join("\n"));
    }
}

/// The progress of a run, with a button to cancel or resume it.
fn how_far(ui: &mut Ui, state: &State, target: &TargetView, run: &RunView, out: &mut Vec<Command>) {
    if let Some(progress) = state.progress.get(&(target.number, run.number)) {
        if ui.small_button("Cancel").clicked() {
            out.push(Command::CancelRun { target: target.number, run: run.number });
        }
        let words = match state.way_left_m((target.number, run.number)) {
            Some([left_m, _]) => {
                format!("stop {}, {} m to the goal", progress.k.saturating_sub(1), fixed(left_m, 2))
            }
            None => format!("{} of {}", progress.k, progress.n),
        };
        ui.label(theme::number(words).size(11.0));
    } else if let Some(why) = &run.stopped {
        if ui.small_button("Resume").clicked() {
            out.push(Command::ResumeRun { target: target.number, run: run.number });
        }
        ui.add(egui::Label::new(RichText::new(why).small().color(theme::lost())).truncate())
            .on_hover_text(why);
    } else if run.complete {
        ui.label(theme::note("complete"));
    } else if let Some(before) = run.rows.last().and_then(|row| row.paused_before) {
        ui.label(theme::note(format!("paused before {}", before.word())));
    } else {
        ui.label(theme::note(counted(run.rows.len(), "step")));
    }
}

fn summary(run: &RunView) -> String {
    let summary = &run.summary;
    let mut words = Vec::new();
    if let Some(tracked) = summary.steps_tracked {
        words.push(format!("{tracked} of {} tracked", summary.steps - summary.steps_not_searched));
    }
    if summary.steps_lost > 0 {
        words.push(format!("{} lost", summary.steps_lost));
    }
    if summary.steps_not_searched > 0 {
        words.push(format!("{} not searched", summary.steps_not_searched));
    }
    if let Some(false_tracked) = summary.false_tracked.filter(|&n| n > 0) {
        words.push(format!("{false_tracked} false tracking"));
    }
    if let Some(err_px) = summary.final_err_px {
        words.push(format!("last {err_px:.1} px"));
    }
    if words.is_empty() { counted(summary.steps, "step") } else { words.join(", ") }
}
