//! The figures of a checkout: columns of its steps over the rover's positions.

use std::collections::BTreeMap;

use sightline_study::plan::{Plan, Unit};
use sightline_study::row::{Row, rows};

use super::chart::{Chart, Line};
use super::figure::{Figure, axis};

/// Columns of a checkout over the rover's positions: each configuration, the ground truth of the staged drive, and the
/// paper.
pub(super) fn checkout(plan: &Plan, units: &[Unit]) -> Result<Vec<Figure>, String> {
    let columns: &[(&'static str, &str, &str)] = match plan.study.name {
        "checkout-1" => &[
            ("magnification", "magnification_true", "magnification of one update"),
            ("roll_deg", "roll_true_deg", "size of the roll of one update, °"),
            ("azimuth_change_deg", "azimuth_change_true_deg", "change of the viewing azimuth, °"),
            ("ncc", "", "score of the match"),
        ],
        _ => &[
            ("magnification", "magnification_true", "magnification of one update"),
            ("correction_px", "", "correction of the prediction, px"),
            ("total_correction_m", "", "correction of the target since its designation, m"),
            ("ncc", "", "score of the match"),
            ("err_px", "", "error against the truth, px"),
        ],
    };
    let draw = |&(column, truth, words): &(&'static str, &str, &str)| {
        step_figure(plan, units, (column, truth), words)
    };
    columns.iter().map(draw).collect()
}

fn step_figure(
    plan: &Plan,
    units: &[Unit],
    (column, truth): (&'static str, &str),
    words: &str,
) -> Result<Figure, String> {
    let mut lines: Vec<Line> = Vec::new();
    let mut sentences: Vec<String> = Vec::new();
    for (colour, configuration) in plan.configurations.iter().enumerate() {
        let own = units.iter().filter(|unit| unit.configuration == configuration.name);
        let rows: Vec<_> = own.flat_map(|unit| rows(plan.study, unit)).collect();
        let (points, ranges) = over_positions(&rows, column);
        let [low, high] =
            points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], p| [l.min(p.1), h.max(p.1)]);
        sentences.push(format!("{}: {low:.2} to {high:.2}", configuration.name));
        lines.push(Line { label: configuration.name.clone(), colour, points, ranges, ..Line::default() });
        if colour == 0 && !truth.is_empty() {
            let (points, _) = over_positions(&rows, truth);
            lines.push(Line {
                label: "by the true geometry".to_owned(),
                colour: 6,
                points,
                is_thin: true,
                ..Line::default()
            });
        }
    }
    let printed: Vec<(f64, f64)> = plan
        .study
        .paper()
        .iter()
        .filter(|value| value.column == column)
        .map(|value| (value.at, value.value))
        .collect();
    if !printed.is_empty() {
        lines.push(Line {
            label: "paper, Table III".to_owned(),
            colour: 6,
            points: printed,
            is_marks: true,
            ..Line::default()
        });
    }
    let chart =
        Chart { title: words.to_owned(), axes: [axis(plan), words.to_owned()], lines, ..Chart::default() };
    let sentence = format!("Means over the worlds, {words}: {}.", sentences.join("; "));
    Ok(Figure { name: column, svg: chart.svg()?, sentence })
}

/// Points of a line, and for each the minimum and maximum over single worlds.
type PointsAndRanges = (Vec<(f64, f64)>, Vec<(f64, [f64; 2])>);

/// The mean of a column over the worlds at each position, with its range; for rolls, the mean absolute value, as printed in
/// Table III.
fn over_positions(rows: &[Row], column: &str) -> PointsAndRanges {
    let mut at: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
    for row in rows {
        if let (Some(position), Some(value)) = (row.number("position"), row.number(column)) {
            let value = if column.starts_with("roll") { value.abs() } else { value };
            at.entry(position as u64).or_default().push(value);
        }
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let ends = |values: &[f64]| {
        values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(*v), h.max(*v)])
    };
    let points = at.iter().map(|(x, values)| (*x as f64, mean(values))).collect();
    (points, at.iter().map(|(x, values)| (*x as f64, ends(values))).collect())
}
