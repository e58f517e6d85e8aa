//! The expression box: completion, the type of the expression, and errors marked at their position.

use egui::text::LayoutJob;
use egui::{
    Button, CompletionPopup, Event, FontFamily, FontId, Id, Key, RectAlign, RichText, Stroke, Suggestion,
    TextEdit, TextFormat, Ui,
};
use sightline_session::expression::complete::complete;
use sightline_session::expression::{Answers, Expression, LENGTH_LIMIT, Refused};

use crate::breakpoints::BreakpointCommand;
use crate::command::Command;
use crate::state::State;
use crate::theme;

/// The accessible name of the box.
const NAME: &str = "expression";

/// Maximum length of a suggestion with its meaning, characters; longer ones would wrap in the narrowest panel.
const SUGGESTION_LETTERS: usize = 42;

/// Whether a character ends the word to complete; all characters of names continue it.
fn ends_word(c: char) -> bool {
    !(c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '[' | ']'))
}

/// Shows the box with its buttons, and below it the type of the expression or its error.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let before = state.breakpoints.text.as_str();
    let mut text = before.to_owned();
    let read = Expression::read(before);
    let id = Id::unique("expression box");
    one_tab_a_frame(ui, id);
    let is_entered = ui.input(|input| input.key_pressed(Key::Enter));
    // Enter sets a complete expression; for an incomplete one, it accepts the suggestion.
    let is_whole = Expression::read(&with_typed(ui, before)).is_ok();
    let keys = if is_whole { vec![Key::Tab] } else { vec![Key::Tab, Key::Enter] };
    let field = TextEdit::singleline(&mut text)
        .hint_text("ncc < 0.6 && step > 10")
        .font(FontId::new(12.5, FontFamily::Monospace))
        .char_limit(LENGTH_LIMIT)
        .desired_width(f32::INFINITY);
    let popup =
        CompletionPopup::new(id).word_boundary(ends_word).align(RectAlign::BOTTOM_START).accept_keys(keys);
    let shown = popup.show(ui, field, |query| suggestions(query.text, query.word_range.end.0));
    let response = shown.text_edit.response.response.accessible_name(NAME);
    if state.breakpoints.wants_focus && !response.has_focus() {
        response.request_focus();
    }
    let had_focus = response.has_focus() || response.lost_focus();
    if state.breakpoints.wants_focus || text != before {
        out.push(Command::Breakpoints(BreakpointCommand::Type(text.clone())));
    }
    if is_entered && had_focus && shown.accepted.is_none() {
        // An invalid expression keeps the focus, to be corrected.
        if Expression::condition(&text).is_err() {
            response.request_focus();
        } else {
            response.surrender_focus();
        }
        out.push(Command::Breakpoints(BreakpointCommand::Set));
    }
    buttons(ui, state, &read, out);
    if !before.trim().is_empty() {
        verdict(ui, before, &read);
    }
}

/// Delays the events after Tab to the next frame. Tab accepts the suggestion for the text at that moment, and a fast typist
/// sends the following letters in the same frame.
fn one_tab_a_frame(ui: &Ui, field: Id) {
    let id = field.with("held back");
    let held = ui.data_mut(|data| data.remove_temp::<Vec<Event>>(id)).unwrap_or_default();
    let has_focus = ui.memory(|memory| memory.has_focus(field));
    let is_tab = |event: &Event| matches!(event, Event::Key { key: Key::Tab, pressed: true, .. });
    let behind = ui.input_mut(|input| {
        input.events.splice(0..0, held);
        let tab = input.events.iter().position(is_tab).filter(|_| has_focus);
        let mut behind = tab.map(|tab| input.events.split_off(tab + 1)).unwrap_or_default();
        if !behind.iter().any(|event| matches!(event, Event::Text(_)) || is_tab(event)) {
            input.events.append(&mut behind);
        }
        behind
    });
    if !behind.is_empty() {
        ui.data_mut(|data| data.insert_temp(id, behind));
        ui.ctx().request_repaint();
    }
}

/// The text followed by the letters of this frame, because a fast typist sends the last letters together with Enter.
fn with_typed(ui: &Ui, before: &str) -> String {
    let typed = ui.input(|input| {
        let texts = input.events.iter().filter_map(|event| match event {
            Event::Text(text) => Some(text.as_str()),
            _ => None,
        });
        texts.collect::<String>()
    });
    before.to_owned() + &typed
}

/// The completions at the cursor.
fn suggestions(text: &str, cursor: usize) -> Vec<Suggestion> {
    if text.trim().is_empty() {
        return Vec::new();
    }
    let suggest = |candidate: sightline_session::expression::complete::Candidate| {
        let unit = if candidate.unit.is_empty() { String::new() } else { format!("{}  ", candidate.unit) };
        let room = SUGGESTION_LETTERS.saturating_sub(candidate.text.chars().count());
        let meaning = shortened(&format!("{unit}{}", candidate.meaning), room);
        Suggestion::new(candidate.text).description(theme::note(meaning))
    };
    complete(text, cursor).candidates.into_iter().map(suggest).collect()
}

/// A text shortened to this many letters, with an ellipsis if it was cut.
fn shortened(text: &str, letters: usize) -> String {
    if text.chars().count() <= letters {
        return text.to_owned();
    }
    let shortened: String = text.chars().take(letters.saturating_sub(2)).collect();
    shortened.trim_end().to_owned() + " …"
}

fn buttons(ui: &mut Ui, state: &State, read: &Result<Expression, Refused>, out: &mut Vec<Command>) {
    let answers = read.as_ref().ok().map(Expression::answers);
    ui.horizontal_wrapped(|ui| {
        let words =
            if state.breakpoints.edited.is_some() { "Change the condition" } else { "Break when true" };
        let set = ui
            .add_enabled(answers == Some(Answers::Truth), Button::new(words).min_size(egui::vec2(0.0, 24.0)));
        if set.on_hover_text("at every step of every run (Enter)").clicked() {
            out.push(Command::Breakpoints(BreakpointCommand::Set));
        }
        let can_plot = matches!(answers, Some(Answers::Truth | Answers::Number));
        let plot =
            ui.add_enabled(can_plot, Button::new("Plot over the steps").min_size(egui::vec2(0.0, 24.0)));
        if plot.on_hover_text("in the panel Over the steps; the run is not computed again").clicked() {
            out.push(Command::Breakpoints(BreakpointCommand::Plot(state.breakpoints.text.clone())));
        }
        if state.breakpoints.edited.is_some() && ui.button("Leave it").clicked() {
            out.push(Command::Breakpoints(BreakpointCommand::CancelEdit));
        }
        let step = state.cursor.step;
        if state.stop_count() > 0 && ui.button(format!("Break at step {step}")).on_hover_text("(B)").clicked()
        {
            out.push(Command::Breakpoints(BreakpointCommand::BreakAt(step)));
        }
    });
}

/// Shows the type of the expression, or its error with its position.
fn verdict(ui: &mut Ui, text: &str, read: &Result<Expression, Refused>) {
    match read {
        Ok(read) => {
            let what = match (read.answers(), read.unit()) {
                (Answers::Truth, _) => "a condition: yes or no at every step".to_owned(),
                (Answers::Word, _) => "a word: compare it to break, for example == lost".to_owned(),
                (Answers::Number, "") => {
                    "a number without a unit: plot it, or compare it to break".to_owned()
                }
                (Answers::Number, unit) => format!("a number in {unit}: plot it, or compare it to break"),
            };
            ui.add(egui::Label::new(theme::note(what)).wrap());
        }
        Err(refused) => {
            ui.add(egui::Label::new(marked(text, refused)).wrap());
            let sentence = RichText::new(format!("At character {}: {}.", refused.from + 1, refused.sentence));
            ui.add(egui::Label::new(sentence.small().color(theme::lost())).wrap());
            if let Some(hint) = &refused.hint {
                ui.add(egui::Label::new(theme::note(hint)).wrap());
            }
        }
    }
}

/// The text with the error underlined; an error at the end is marked by an extra character.
fn marked(text: &str, refused: &Refused) -> LayoutJob {
    let font = FontId::new(12.5, FontFamily::Monospace);
    let plain = TextFormat::simple(font.clone(), theme::weak());
    let fault =
        TextFormat { underline: Stroke::new(2.0, theme::lost()), ..TextFormat::simple(font, theme::lost()) };
    let part =
        |from: usize, to: usize| text.chars().skip(from).take(to.saturating_sub(from)).collect::<String>();
    let length = text.chars().count();
    let mut job = LayoutJob::default();
    job.append(&part(0, refused.from), 0.0, plain.clone());
    let at_fault = part(refused.from, refused.to.max(refused.from + 1));
    job.append(if at_fault.is_empty() { "_" } else { &at_fault }, 0.0, fault);
    job.append(&part(refused.to.max(refused.from + 1), length), 0.0, plain);
    job
}
