//! The quantities of a stage that have a value: name, value, unit and formula, with a link to the explanation of the
//! value.

use egui::{RichText, Ui};
use sightline_record::{Kind, Quantity, Unit, Value as Recorded, label};
use sightline_session::step::RunStep;

use super::RecordedStage;
use crate::command::Command;
use crate::panels::{digits, numbers};
use crate::theme;

/// Shows the quantities of a stage that have a value, grouped by part; then the names of those without.
pub(super) fn show(ui: &mut Ui, trace: &RunStep, stage: RecordedStage, out: &mut Vec<Command>) {
    let schema = stage.schema();
    let all: Vec<(&Quantity, Recorded)> =
        schema.quantities.iter().enumerate().map(|(k, quantity)| (quantity, stage.value(trace, k))).collect();
    let mut groups: Vec<(&str, Vec<&(&Quantity, Recorded)>)> = vec![("", Vec::new())];
    for entry in all.iter().filter(|(_, value)| *value != Recorded::Missing) {
        let group = group_of(&entry.0.name);
        match groups.iter_mut().find(|(known, _)| *known == group) {
            Some((_, entries)) => entries.push(entry),
            None => groups.push((group, vec![entry])),
        }
    }
    for (group, entries) in groups.iter().filter(|(_, entries)| !entries.is_empty()) {
        if !group.is_empty() {
            ui.label(theme::note(label(group, Unit::One)).color(theme::text()));
        }
        egui::Grid::new(ui.next_auto_id()).num_columns(2).spacing([10.0, 2.0]).show(ui, |ui| {
            for (quantity, value) in entries {
                let name = format!("{}.{}", schema.stage, quantity.name);
                show_quantity(ui, trace.step, (&name, *quantity), value, out);
                ui.end_row();
            }
        });
    }
    let missing: Vec<&str> = all
        .iter()
        .filter(|(_, value)| *value == Recorded::Missing)
        .map(|(quantity, _)| quantity.label.as_ref())
        .collect();
    if !missing.is_empty() {
        ui.add(egui::Label::new(theme::note(format!("no value: {}", missing.join(", ")))).wrap());
    }
}

/// The part of the evidence to which a quantity belongs; empty for the stage itself.
fn group_of(name: &str) -> &str {
    name.split_once('.').map_or("", |(group, _)| group)
}

/// A quantity: its name, which links to its origin, and its value with unit and formula.
fn show_quantity(
    ui: &mut Ui,
    step: usize,
    (name, quantity): (&str, &Quantity),
    value: &Recorded,
    out: &mut Vec<Command>,
) {
    let words = in_words(quantity, value);
    let mut help = quantity.description.to_string();
    if !quantity.formula.is_empty() {
        help += &format!("\n= {}", theme::formula(&quantity.formula));
    }
    let link = ui.link(RichText::new(quantity.label.as_ref()).size(12.0)).on_hover_text(help);
    numbers::explain_on_click(&link, step, name, &words, out);
    ui.vertical(|ui| {
        let unit = quantity.unit_label();
        match matrix_of(quantity.kind, value) {
            Some(rows) => {
                matrix(ui, &rows);
                if !unit.is_empty() {
                    ui.label(theme::note(unit));
                }
            }
            None => {
                ui.horizontal_wrapped(|ui| {
                    ui.spacing_mut().item_spacing.x = 4.0;
                    ui.label(theme::number(words));
                    if !unit.is_empty() {
                        ui.label(theme::note(unit));
                    }
                });
            }
        }
        // On its own lines: a formula that wraps beside the value would extend into the next row of the table.
        if !quantity.formula.is_empty() {
            let formula = format!("= {}", theme::formula(&quantity.formula));
            ui.add(egui::Label::new(theme::note(formula)).wrap());
        }
    });
}

/// The value of a quantity on one line.
fn in_words(quantity: &Quantity, value: &Recorded) -> String {
    match value {
        Recorded::Missing => "none".to_owned(),
        Recorded::Flag(is) => if *is { "yes" } else { "no" }.to_owned(),
        Recorded::Count(count) => digits(*count as f64),
        Recorded::Number(number) => with_degrees(*number, quantity.unit),
        Recorded::Word(word) => word.clone(),
        Recorded::Components(parts) if quantity.kind == Kind::Pixel => {
            parts.iter().copied().map(coordinate).collect::<Vec<_>>().join(", ")
        }
        Recorded::Components(parts) => parts.iter().copied().map(digits).collect::<Vec<_>>().join("  "),
    }
}

/// An angle in radians with its degrees; other numbers alone.
pub(super) fn with_degrees(number: f64, unit: Unit) -> String {
    if unit == Unit::Radian {
        format!("{} ({:.2}°)", digits(number), number.to_degrees())
    } else {
        digits(number)
    }
}

/// An image coordinate: two decimals, also far from the origin.
fn coordinate(value: f64) -> String {
    if value.abs() >= 10.0 && value.fract() != 0.0 { format!("{value:.2}") } else { digits(value) }
}

/// The rows of a matrix; `None` for other kinds of values.
fn matrix_of(kind: Kind, value: &Recorded) -> Option<Vec<Vec<f64>>> {
    let Recorded::Components(parts) = value else { return None };
    let at = |rows: &[&[usize]]| -> Option<Vec<Vec<f64>>> {
        let row = |row: &&[usize]| row.iter().map(|&part| parts.get(part).copied()).collect();
        rows.iter().map(row).collect()
    };
    match kind {
        Kind::Symmetric3 => at(&[&[0, 1, 2], &[1, 3, 4], &[2, 4, 5]]),
        Kind::Matrix2 => at(&[&[0, 1], &[2, 3]]),
        Kind::Matrix3x2 => at(&[&[0, 1], &[2, 3], &[4, 5]]),
        _ => None,
    }
}

/// A matrix in rows and columns with the names of its axes.
pub(super) fn matrix(ui: &mut Ui, rows: &[Vec<f64>]) {
    let columns = rows.first().map_or(0, Vec::len);
    egui::Grid::new(ui.next_auto_id()).spacing([14.0, 1.0]).show(ui, |ui| {
        ui.label("");
        for name in axes(columns) {
            ui.label(theme::note(*name));
        }
        ui.end_row();
        for (row, name) in rows.iter().zip(axes(rows.len())) {
            ui.label(theme::note(*name));
            for value in row {
                ui.label(theme::number(format!("{value:+.2e}")).size(11.0));
            }
            ui.end_row();
        }
    });
}

/// The names of the axes of a matrix with `count` rows or columns.
fn axes(count: usize) -> &'static [&'static str] {
    const ALL: [&str; 6] = ["x", "y", "z", "roll", "pitch", "yaw"];
    &ALL[..count.min(ALL.len())]
}

#[cfg(test)]
mod tests {
    use sightline_session::records;

    use super::*;

    #[test]
    fn quantities_read_like_values_and_matrices_have_rows() {
        let quantity = |name: &str| {
            let quantity = records::StageQuantity::named(name).unwrap();
            (quantity.declared(), move |value: Recorded| in_words(quantity.declared(), &value))
        };
        assert_eq!(quantity("scale_roll.roll_rad").1(Recorded::Number(0.1)), "0.100 (5.73°)");
        let pixel = Recorded::Components(vec![349.834, 2.0]);
        assert_eq!(quantity("match_template.pixel").1(pixel), "349.83, 2");
        assert_eq!(quantity("match_template.peak.at_edge").1(Recorded::Flag(true)), "yes");
        assert_eq!(quantity("match_template.second_peak.ratio").1(Recorded::Missing), "none");
        let covariance = quantity("locate.covariance_in_rover").0;
        let parts = Recorded::Components(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let rows = vec![vec![1.0, 2.0, 3.0], vec![2.0, 4.0, 5.0], vec![3.0, 5.0, 6.0]];
        assert_eq!(matrix_of(covariance.kind, &parts), Some(rows));
        assert_eq!(covariance.unit_label(), "m², rover");
    }
}
