//! The list of breakpoints with their marks and hits, and of derived plots.

use egui::{Button, Color32, RichText, Sense, Ui, vec2};
use sightline_session::breakpoints::BreakpointView;

use crate::breakpoints::{BreakpointCommand, BreakpointState};
use crate::command::{Command, Go};
use crate::drawing::overlay::{Mark, paint_mark};
use crate::state::{State, run_letter};
use crate::theme;

/// Shape and colour of a breakpoint by its index in the list, here and on the timeline.
pub(crate) fn mark(at: usize) -> (Mark, Color32) {
    let shapes = [Mark::Diamond, Mark::Square, Mark::Ring, Mark::Cross, Mark::Plus];
    (shapes[at % shapes.len()], theme::breakpoint(at))
}

/// Shows the list.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let list = &state.breakpoints.list;
    if list.is_empty() {
        let words = "No breakpoints yet. Write a condition above, press B to break at this step, or click above the timeline.";
        ui.add(egui::Label::new(theme::note(words)).wrap());
    } else {
        summary(ui, state, out);
    }
    for (at, breakpoint) in list.iter().enumerate() {
        show_one(ui, state, at, breakpoint, out);
    }
    if !state.breakpoints.derived.is_empty() {
        ui.add_space(6.0);
        ui.label(theme::title("Plotted"));
    }
    for (at, derived) in state.breakpoints.derived.iter().enumerate() {
        ui.horizontal(|ui| {
            ui.label(RichText::new(&derived.expression).monospace());
            let unit = derived.answer.as_ref().map_or("", |answer| answer.unit.as_str());
            ui.label(theme::note(unit));
            let remove = ui.small_button("Remove plot");
            if remove.accessible_name(format!("remove plot {} from the list", derived.expression)).clicked() {
                out.push(Command::Breakpoints(BreakpointCommand::Unplot(at)));
            }
        });
    }
}

/// Shows the number of hits in all runs, and buttons to the previous and the next hit in the selected run.
fn summary(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        let count: usize = state.breakpoints.watched().map(|(_, breakpoint)| breakpoint.count).sum();
        ui.label(theme::note(format!("{count} hits in all runs")));
        for (words, is_forward, command) in [
            ("Previous hit", false, BreakpointCommand::PreviousHit),
            ("Next hit", true, BreakpointCommand::NextHit),
        ] {
            let is_there = state.hit_from(state.cursor.step, is_forward).is_some();
            let button = ui.add_enabled(is_there, Button::new(words).min_size(vec2(0.0, 24.0)));
            if button.on_hover_text(if is_forward { "(N)" } else { "(Shift+N)" }).clicked() {
                out.push(Command::Breakpoints(command));
            }
        }
    });
}

fn show_one(ui: &mut Ui, state: &State, at: usize, breakpoint: &BreakpointView, out: &mut Vec<Command>) {
    let BreakpointView { number, expression, on, count, .. } = breakpoint;
    ui.horizontal_wrapped(|ui| {
        let (rect, _) = ui.allocate_exact_size(vec2(18.0, 24.0), Sense::hover());
        let (shape, colour) = mark(at);
        let colour = if *on { colour } else { theme::unknown() };
        paint_mark(ui.painter(), rect.center(), shape, colour, 5.0);
        let mut is_on = *on;
        let check = ui.checkbox(&mut is_on, RichText::new(expression).monospace());
        if check.on_hover_text("on or off").changed() {
            out.push(Command::Breakpoints(BreakpointCommand::Switch { number: *number, on: is_on }));
        }
        let words = match (on, &breakpoint.problem) {
            (_, Some(problem)) => format!("cannot be read any more: {problem}"),
            (false, None) => "off".to_owned(),
            (true, None) => hits_in_words(state, breakpoint, *count),
        };
        let is_bad = breakpoint.problem.is_some();
        ui.label(theme::note(words).color(if is_bad { theme::lost() } else { theme::weak() }));
        if ui.small_button("Edit").accessible_name(format!("edit breakpoint {expression}")).clicked() {
            out.push(Command::Breakpoints(BreakpointCommand::Edit(*number)));
        }
        if ui.small_button("Remove").accessible_name(format!("remove breakpoint {expression}")).clicked() {
            out.push(Command::Breakpoints(BreakpointCommand::Remove(*number)));
        }
    });
    other_runs(ui, state, breakpoint, out);
}

fn hits_in_words(state: &State, breakpoint: &BreakpointView, count: usize) -> String {
    let here = state
        .cursor
        .target
        .map_or(0, |target| BreakpointState::hits(breakpoint, target, state.cursor.run).len());
    match (count, here) {
        (0, _) => "no hits".to_owned(),
        (1, 1) => "1 hit".to_owned(),
        (count, here) if count == here => format!("{count} hits"),
        (1, _) => "1 hit, not in this run".to_owned(),
        (count, here) => format!("{count} hits, {here} in this run"),
    }
}

/// Shows links to the first hit in each other run.
fn other_runs(ui: &mut Ui, state: &State, breakpoint: &BreakpointView, out: &mut Vec<Command>) {
    let is_here = |target: usize, run: usize| state.cursor.target == Some(target) && state.cursor.run == run;
    let others = breakpoint.hits.iter().filter(|hits| breakpoint.on && !is_here(hits.target, hits.run));
    let others: Vec<_> = others.take(12).collect();
    if others.is_empty() {
        return;
    }
    ui.horizontal_wrapped(|ui| {
        ui.add_space(18.0);
        for hits in others {
            let Some(first) = hits.steps.first() else { continue };
            let target =
                state.session.as_ref().and_then(|s| s.targets.iter().find(|t| t.number == hits.target));
            let label = target.map_or_else(|| format!("target {}", hits.target + 1), |t| t.label.clone());
            let words = format!("{label} {}: {}", run_letter(hits.run), hits.steps.len());
            if ui.small_button(words).on_hover_text(format!("go to its first hit, step {first}")).clicked() {
                out.push(Command::SelectRun { target: hits.target, run: hits.run });
                out.push(Command::Go(Go::Step(*first)));
            }
        }
    });
}
