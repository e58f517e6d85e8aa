//! The panel “Breakpoints”: the expression box, and the list of breakpoints with their hits.

mod entry;
mod list;

use egui::{Response, ScrollArea, Ui};
use sightline_session::expression::{Answers, Expression};

pub(crate) use self::list::mark;
use crate::breakpoints::BreakpointCommand;
use crate::command::Command;
use crate::panels::panel::Panel;
use crate::state::State;

/// The panel “Breakpoints”.
pub(crate) struct Breakpoints;

impl Panel for Breakpoints {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        state.session.is_none().then(|| state.missing_target())
    }
}

/// Shows the panel.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        entry::show(ui, state, out);
        ui.add_space(6.0);
        list::show(ui, state, out);
    });
}

/// The context menu of plotted values: proposes conditions about them.
pub(crate) fn menu(response: &Response, plotted: &[(&str, f64)], out: &mut Vec<Command>) {
    if plotted.is_empty() {
        return;
    }
    response.context_menu(|ui| {
        for text in plotted.iter().flat_map(|(expression, value)| proposals(expression, *value)) {
            if ui.button(format!("Break when {text}")).clicked() {
                out.push(Command::Breakpoints(BreakpointCommand::Propose(text)));
                ui.close();
            }
        }
    });
}

/// Proposed conditions about an expression with this value.
fn proposals(expression: &str, value: f64) -> Vec<String> {
    let changes = format!("changes({expression})");
    if Expression::read(expression).is_ok_and(|read| read.answers() == Answers::Number) {
        let compared = |sign: &str| format!("{} {sign} {}", in_parentheses(expression), short(value));
        vec![compared("<"), compared(">"), changes]
    } else {
        vec![expression.to_owned(), changes]
    }
}

/// The expression in a form that a comparison can follow: in parentheses if necessary.
fn in_parentheses(expression: &str) -> String {
    let is_plain = expression.chars().all(|c| c.is_ascii_alphanumeric() || "_.[]()".contains(c));
    if is_plain { expression.to_owned() } else { format!("({expression})") }
}

/// A value rounded to three significant digits, in the syntax of expressions.
fn short(value: f64) -> String {
    let scale = 10_f64.powf(2.0 - value.abs().max(1e-12).log10().floor());
    let rounded = (value * scale).round() / scale;
    if rounded.is_finite() { format!("{rounded}") } else { format!("{value}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn proposed_conditions_parse() {
        for (expression, value) in
            [("ncc", 0.83456), ("sigma_m * 100", 1e-7), ("prev(err_px)", -412.77), ("step", 0.0)]
        {
            for text in proposals(expression, value) {
                Expression::condition(&text).unwrap_or_else(|refused| panic!("{text}: {refused}"));
            }
        }
        assert_eq!(short(0.83456), "0.835");
    }
}
