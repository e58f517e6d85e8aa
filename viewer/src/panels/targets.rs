//! Targets and their runs.

use egui::{Align, Layout, RichText, ScrollArea, Sense, Ui, vec2};
use sightline_session::view::{RunView, TargetView};

use crate::command::table::PICK;
use crate::command::{Command, Mode};
use crate::drawing::overlay::{paint_mark, run_mark};
use crate::panels::pane::Pane;
use crate::panels::panel::Panel;
use crate::panels::{run_tree, timeline};
use crate::state::{State, run_letter};
use crate::why::Ask;
use crate::{panels, theme};

/// What the panel is for.
const PURPOSE: &str = Pane::Targets.about().help;

/// How much a branch stands in from what it left, points.
const INDENT: f32 = 12.0;

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
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        for target in targets {
            show_target(ui, state, target, out);
            ui.add_space(6.0);
        }
    });
}

fn show_target(ui: &mut Ui, state: &State, target: &TargetView, out: &mut Vec<Command>) {
    let is_selected = state.cursor.target == Some(target.number);
    ui.horizontal(|ui| {
        let text = RichText::new(&target.label).strong().color(if is_selected {
            theme::strong()
        } else {
            theme::text()
        });
        if ui.add(egui::Label::new(text).sense(Sense::click())).clicked() {
            let run = target.runs.last().map_or(0, |run| run.number);
            out.push(Command::Look { target: target.number, run });
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui
                .small_button("Remove")
                .on_hover_text("Takes the target and its runs out of the session")
                .clicked()
            {
                out.push(Command::RemoveTarget(target.number));
            }
        });
    });
    let at = target.designation;
    ui.label(theme::note(format!("picked at step {}, pixel {:.1}, {:.1}", at.step, at.pixel.x, at.pixel.y)));
    for sentence in warnings(state, target) {
        ui.add(egui::Label::new(RichText::new(format!("! {sentence}")).small().color(theme::lost())).wrap())
            .on_hover_text("A warning about the pick; it can be tracked all the same.");
    }
    for (depth, run) in run_tree::order(&target.runs) {
        ui.horizontal(|ui| {
            ui.add_space(INDENT * depth as f32);
            ui.vertical(|ui| show_run(ui, state, target, run, out));
        });
    }
}

/// Why the target that is looked at may be badly picked (R21).
fn warnings<'a>(state: &'a State, target: &TargetView) -> Vec<&'a str> {
    let is_selected = state.cursor.target == Some(target.number);
    let pick = state.trace_at(target.designation.step).ready().filter(|_| is_selected);
    let evidence = pick.and_then(|trace| trace.template());
    evidence.map_or_else(Vec::new, |e| e.warnings.iter().map(|warning| warning.sentence.as_str()).collect())
}

fn show_run(ui: &mut Ui, state: &State, target: &TargetView, run: &RunView, out: &mut Vec<Command>) {
    let is_selected = state.cursor.target == Some(target.number) && state.cursor.run == run.number;
    let fill = if is_selected { theme::selected() } else { egui::Color32::TRANSPARENT };
    let frame = egui::Frame::new().fill(fill).corner_radius(4).inner_margin(egui::Margin::symmetric(6, 3));
    // The card hears of a click only where no button in it does: it comes before what is in it.
    let card = egui::UiBuilder::new().id_salt(("run", target.number, run.number)).sense(Sense::click());
    let inside = ui.scope_builder(card, |ui| {
        frame.show(ui, |ui| card_of(ui, state, target, run, out));
    });
    let response = inside.response;
    response.widget_info(|| {
        egui::WidgetInfo::selected(
            egui::Role::Button,
            true,
            is_selected,
            format!("run {}", run_letter(run.number)),
        )
    });
    if response.clicked() {
        out.push(Command::Look { target: target.number, run: run.number });
    }
}

/// What a run's card says, and what can be done with the run.
fn card_of(ui: &mut Ui, state: &State, target: &TargetView, run: &RunView, out: &mut Vec<Command>) {
    ui.set_width(ui.available_width());
    ui.horizontal(|ui| {
        let (mark, _) = ui.allocate_exact_size(vec2(14.0, 14.0), Sense::hover());
        paint_mark(ui.painter(), mark.center(), run_mark(run.number), theme::run(run.number), 6.0);
        ui.label(RichText::new(format!("run {}", run_letter(run.number))).color(theme::strong()));
        if let Some(preset) = state.configurations.named(&run.settings) {
            ui.label(RichText::new(preset.name).color(theme::accent())).on_hover_text(preset.description);
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| how_far(ui, state, target, run, out));
    });
    sparkline(ui, target, run, state.stop_count());
    if let Some(fork) = run.fork {
        ui.label(theme::note(format!("from run {} at step {}", run_letter(fork.run), fork.from_step)));
    }
    ui.label(theme::note(summary(run)));
    // A preset's name says them all.
    let unnamed = state.configurations.named(&run.settings).is_none();
    let is_branch = run_tree::parent(&target.runs, run).is_some();
    let lines = if unnamed || is_branch { run_tree::changed(&target.runs, run) } else { Vec::new() };
    for line in lines {
        ui.add(egui::Label::new(theme::note(line).monospace()).wrap());
    }
    if target.runs.len() > 1 {
        let name = format!("remove run {}", run_letter(run.number));
        let help = "Hides the run; what left it keeps its steps. Ctrl+Z takes it back";
        let button = ui.small_button("Remove run").accessible_name(name).on_hover_text(help);
        if button.clicked() {
            out.push(Command::Why(Ask::RemoveRun { target: target.number, run: run.number }));
        }
    }
}

/// How far a run is, with a way to stop it.
fn how_far(ui: &mut Ui, state: &State, target: &TargetView, run: &RunView, out: &mut Vec<Command>) {
    if let Some(progress) = state.progress.get(&(target.number, run.number)) {
        if ui.small_button("Cancel").clicked() {
            out.push(Command::CancelRun { target: target.number, run: run.number });
        }
        ui.label(theme::number(format!("{} of {}", progress.k, progress.n)).size(11.0));
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
        ui.label(theme::note(format!("{} steps", run.rows.len())));
    }
}

/// The states of a run as a thin band.
fn sparkline(ui: &mut Ui, target: &TargetView, run: &RunView, stop_count: usize) {
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 5.0), Sense::hover());
    timeline::thin_band(ui.painter(), rect, target, run, stop_count);
}

fn summary(run: &RunView) -> String {
    let summary = &run.summary;
    let mut words = Vec::new();
    if let Some(tracked) = summary.steps_tracked {
        words.push(format!("{tracked} of {} tracked", summary.steps));
    }
    if summary.steps_lost > 0 {
        words.push(format!("{} lost", summary.steps_lost));
    }
    if let Some(false_tracked) = summary.false_tracked.filter(|&n| n > 0) {
        words.push(format!("{false_tracked} false"));
    }
    if let Some(err_px) = summary.final_err_px {
        words.push(format!("last {err_px:.1} px"));
    }
    if words.is_empty() { format!("{} steps", summary.steps) } else { words.join(", ") }
}
