//! The playback controls: play, pause, direction, rate and loop.

use egui::{Button, DragValue, RichText, Ui, vec2};

use crate::breakpoints::BreakpointCommand;
use crate::breakpoints::play::{RATES, Shuttle};
use crate::command::Command;
use crate::panels::numbers::counted;
use crate::state::State;
use crate::theme;

/// Shows the controls in a row.
pub(crate) fn controls(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let play = &state.breakpoints.play;
    ui.add_space(6.0);
    let (words, name) = if play.is_playing() { ("||", "pause") } else { ("▶", "play") };
    for (words, name, help, command) in [
        ("◀", "play backwards", "play backwards, again: twice as fast (J)", Shuttle::Reverse),
        (words, name, "play, pause (Space)", Shuttle::Toggle),
        ("▶▶", "play faster", "play forwards, again: twice as fast (L)", Shuttle::Forward),
    ] {
        if button(ui, words, name, help) {
            out.push(Command::Breakpoints(BreakpointCommand::Shuttle(command)));
        }
    }
    let mut rate = play.rate;
    let field = DragValue::new(&mut rate).range(RATES).speed(0.1).max_decimals(1).suffix(" /s");
    let field = ui.add(field).accessible_name("steps a second");
    if field.on_hover_text("playback speed at 1×, steps/s").changed() {
        out.push(Command::Breakpoints(BreakpointCommand::Shuttle(Shuttle::Rate(rate))));
    }
    ui.label(theme::note(play.in_words()));
    ui.add_space(4.0);
    for (words, name, help, command) in [
        ("[", "loop in", "the loop begins at this step ([)", Shuttle::LoopIn),
        ("]", "loop out", "the loop ends at this step (])", Shuttle::LoopOut),
    ] {
        if button(ui, words, name, help) {
            out.push(Command::Breakpoints(BreakpointCommand::Shuttle(command)));
        }
    }
    if play.loop_in.is_some() || play.loop_out.is_some() {
        let end = |end: Option<usize>| end.map_or_else(|| "…".to_owned(), |step| step.to_string());
        ui.label(theme::note(format!("loop {} to {}", end(play.loop_in), end(play.loop_out))));
        if button(ui, "x", "no loop", "Clear loop (Backspace)") {
            out.push(Command::Breakpoints(BreakpointCommand::Shuttle(Shuttle::ClearLoop)));
        }
    }
    others(ui, state, out);
}

/// The switch for the state bands of the other targets, if there are any.
fn others(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let count = state.session.as_ref().map_or(0, |session| session.targets.len().saturating_sub(1));
    if count == 0 || state.target().is_none() {
        return;
    }
    let mut shown = state.breakpoints.shows_others;
    let words = RichText::new(counted(count, "other target")).small();
    if ui.checkbox(&mut shown, words).on_hover_text("their state bands on the timeline").changed() {
        out.push(Command::Breakpoints(BreakpointCommand::ShowOthers(shown)));
    }
}

fn button(ui: &mut Ui, words: &str, name: &str, help: &str) -> bool {
    let button = Button::new(RichText::new(words).monospace()).min_size(vec2(26.0, 24.0));
    ui.add(button).accessible_name(name).on_hover_text(help).clicked()
}
