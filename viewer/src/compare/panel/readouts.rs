//! The difference from the first compared run in every readout: Δ is the selected run minus the other.

use egui::{CollapsingHeader, Grid, RichText, Ui};
use serde_json::Value;
use sightline_record::Unit;
use sightline_session::compare::Difference;
use sightline_session::compare::differ::{differences, told_apart, words_of};
use sightline_session::records;
use sightline_session::step::{RunStep, StepRow};
use sightline_track::stages::judge::Gate;

use crate::compare::ToleranceLevel;
use crate::compare::panel::{chip, mark};
use crate::compare::state::Other;
use crate::panels::digits;
use crate::state::{State, state_of};
use crate::theme;

/// Maximum number of listed values of a stage.
const VALUES_MAX: usize = 60;

/// A number with its sign, as differences are displayed.
fn signed(value: f64) -> String {
    if value == 0.0 {
        "±0".to_owned()
    } else {
        format!("{}{}", if value > 0.0 { "+" } else { "−" }, digits(value.abs()))
    }
}

/// The first compared run; `None` without one.
fn first(state: &State) -> Option<Other<'_>> {
    state.others().into_iter().next()
}

/// Shows the difference of a value in the status line, in its unit.
pub(crate) fn after(ui: &mut Ui, state: &State, column: &str, unit: Unit) {
    let Some(other) = first(state) else { return };
    let value = |row: &StepRow| records::row_value_in(row, column, unit);
    let values = state.row().and_then(value).zip(state.other_row(&other).and_then(value));
    let (Some((own, there)), Some(declared)) = (values, records::row_quantity(column)) else { return };
    let (delta, name) = (own - there, &declared.label);
    let words = RichText::new(format!("Δ{}", signed(delta))).monospace().size(11.0).color(other.style.colour);
    let help = format!("{name}: this run less {}", state.run_label(other.name));
    ui.label(words).on_hover_text(help);
}

/// Shows the states of the compared runs at the end of the status line.
pub(crate) fn states(ui: &mut Ui, state: &State) {
    for other in state.others() {
        let row = state.other_row(&other);
        let word = row.map_or_else(|| "not computed".to_owned(), |row| row.state.to_uppercase());
        let colour = row.map_or(theme::weak(), |row| theme::state(state_of(row)));
        mark(ui, other.style);
        ui.label(RichText::new(word).strong().size(11.0).color(colour))
            .on_hover_text(format!("the state of {} here", state.run_label(other.name)));
    }
}

/// Shows value, limit and verdict of the first compared run, below a gate.
pub(crate) fn gate(ui: &mut Ui, state: &State, gate: &Gate) {
    let Some(other) = first(state) else { return };
    let trace = state.other_trace(other.name).ready();
    let found = trace.and_then(|trace| trace.verdict()?.gates.iter().find(|found| found.name == gate.name));
    let label = state.run_label(other.name);
    let words = match found {
        None => format!("{label} has no such gate here"),
        Some(found) => {
            let by = |own: Option<f64>, other: Option<f64>| {
                own.zip(other).map_or_else(|| "none".to_owned(), |(own, other)| signed(own - other))
            };
            let verdict = if found.passed { "passes" } else { "FAILS" };
            let limit = by(Some(gate.limit), Some(found.limit));
            let limit = if limit == "±0" { String::new() } else { format!(", limit Δ {limit}") };
            format!("Δ vs {label}: {}{limit}; it {verdict} there", by(gate.value, found.value))
        }
    };
    ui.horizontal(|ui| {
        mark(ui, other.style);
        ui.add(egui::Label::new(theme::note(words)).truncate());
    });
}

/// Shows, in the inspector, the values of the selected stage that differ from those of the first compared run; `record`
/// reads them from a step.
pub(crate) fn record(ui: &mut Ui, state: &State, record: impl Fn(&RunStep) -> Option<Value>) {
    let Some(other) = first(state) else { return };
    let label = state.run_label(other.name);
    let (own, there) = (state.trace(), state.other_trace(other.name).ready());
    let (Some(own), Some(there)) = (own, there) else {
        ui.horizontal(|ui| chip(ui, other.style, &format!("{label}: no record of this step yet")));
        return;
    };
    let (own, there) = (record(own).unwrap_or_default(), record(there).unwrap_or_default());
    let found = differences(&there, &own, &state.tolerance());
    let title = match found.len() {
        0 if state.compare.tolerance == ToleranceLevel::Exact => format!("Δ vs {label}: identical"),
        0 => format!("Δ vs {label}: equal within {}", state.compare.tolerance.word()),
        1 => format!("Δ vs {label}: 1 value differs"),
        count => format!("Δ vs {label}: {count} values differ"),
    };
    ui.horizontal(|ui| chip(ui, other.style, &title));
    if found.is_empty() {
        return;
    }
    let header = CollapsingHeader::new(theme::note("the values that differ"))
        .id_salt("differing")
        .default_open(found.len() <= 12);
    header.show(ui, |ui| {
        Grid::new("differences").num_columns(4).spacing([8.0, 2.0]).show(ui, |ui| {
            for (name, colour) in [
                ("value", theme::weak()),
                ("this", state.own_style().colour),
                (label.as_str(), other.style.colour),
                ("Δ", theme::weak()),
            ] {
                ui.label(RichText::new(name).small().color(colour));
            }
            ui.end_row();
            found.iter().take(VALUES_MAX).for_each(|difference| row(ui, difference));
        });
        if found.len() > VALUES_MAX {
            ui.label(theme::note(format!("and {} more", found.len() - VALUES_MAX)));
        }
    });
    ui.separator();
}

/// Shows one value: `a` of the other run, `b` of the selected one.
fn row(ui: &mut Ui, difference: &Difference) {
    let [there, own] = told_apart(&difference.a, &difference.b);
    let unit = &difference.unit;
    let words = format!(
        "{} {}",
        words_of(&difference.path),
        if unit.is_empty() { String::new() } else { format!("({unit})") }
    );
    ui.add(egui::Label::new(theme::label(words.trim_end()).size(11.5)).truncate())
        .on_hover_text(&difference.path);
    ui.label(theme::number(own).size(11.0));
    ui.label(theme::number(there).size(11.0));
    // For a list, the difference is a length, which has no sign.
    let is_list = matches!(difference.a, Value::Array(_));
    let delta = difference.delta.map(|delta| if is_list { digits(delta) } else { signed(delta) });
    ui.label(theme::number(delta.unwrap_or_default()).size(11.0));
    ui.end_row();
}

#[cfg(test)]
mod tests {
    use crate::compare::panel::readouts::signed;

    #[test]
    fn a_difference_always_has_its_sign() {
        assert_eq!([0.25, -0.25, 0.0].map(signed), ["+0.250", "−0.250", "±0"]);
    }
}
