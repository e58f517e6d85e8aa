//! Numbers: a link from a value to its origin, an input field with limits, and a count with its noun.

use std::cell::RefCell;

use egui::{DragValue, Response, RichText, Ui};

use crate::command::Command;
use crate::why::WhyCommand;

/// Shows a number as a link to its origin; `name` identifies it in the panel “Why”.
pub(crate) fn show(ui: &mut Ui, text: RichText, step: usize, name: &str, out: &mut Vec<Command>) {
    let words = text.text().to_owned();
    let response = ui.link(text).on_hover_text(format!("Why? Where {name} comes from"));
    explain_on_click(&response, step, name, &words, out);
}

/// Adds a field for a number from `low` to `high`; input that is not such a number shows a note at the field.
pub(crate) fn field(ui: &mut Ui, field: DragValue<'_>, low: f64, high: f64) -> Response {
    let wrong = RefCell::new(None);
    let read = |text: &str| {
        let plain: String = text.chars().filter(|letter| !letter.is_whitespace()).collect();
        let number = plain.replace('−', "-").parse::<f64>().ok();
        let is_within = number.is_some_and(|number| (low..=high).contains(&number));
        *wrong.borrow_mut() = (!is_within).then(|| match number {
            Some(number) => format!("{number} is outside {low} to {high}: the nearest limit is taken"),
            None => format!("“{}” is no number; give one from {low} to {high}", text.trim()),
        });
        number
    };
    let response = ui.add(field.range(low..=high).custom_parser(read));
    if let Some(why) = wrong.into_inner() {
        response.show_tooltip_text(why);
    }
    response
}

/// A number with its noun: `1 step`, `2 steps`.
pub(crate) fn counted(n: usize, noun: &str) -> String {
    if n == 1 { format!("1 {noun}") } else { format!("{n} {noun}s") }
}

/// Formats a number with fixed decimals; zero after rounding has no sign.
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    let words = format!("{value:.decimals$}");
    let is_zero = words.bytes().all(|byte| matches!(byte, b'-' | b'0' | b'.'));
    if is_zero { words.trim_start_matches('-').to_owned() } else { words }
}

/// Adds a link from a value to its origin: by click, and in the context menu.
pub(crate) fn explain_on_click(
    response: &Response,
    step: usize,
    name: &str,
    copied: &str,
    out: &mut Vec<Command>,
) {
    let why = || Command::Why(WhyCommand::Value { step, value: name.to_owned() });
    if response.clicked() {
        out.push(why());
    }
    response.context_menu(|ui| {
        if ui.button("Why").clicked() {
            out.push(why());
            ui.close();
        }
        if ui.button("Copy value").clicked() {
            ui.ctx().copy_text(copied.to_owned());
            ui.close();
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_has_no_plural_and_zero_no_sign() {
        assert_eq!(
            [counted(0, "step"), counted(1, "step"), counted(2, "step")],
            ["0 steps", "1 step", "2 steps"]
        );
        assert_eq!([fixed(-0.004, 2), fixed(-0.006, 2), fixed(1.0, 0)], ["0.00", "-0.01", "1"]);
    }
}
