//! The result of a study as a plot: the percentage of tracked targets against the study's variable, for each configuration.

use std::collections::BTreeMap;

use egui::Ui;
use egui_plot::{GridMark, HoverPosition, Line, Plot, Points};
use sightline_study::row::Row;

use crate::drawing::overlay::Mark;
use crate::panels::chart::{few_marks, plain};
use crate::panels::chart_legend;
use crate::theme;

/// The curve of one configuration: index of the variable's value on the x axis, and tracked targets, %.
type Curve = Vec<[f64; 2]>;

/// Curves by configuration, with the tick labels of the x axis.
#[derive(Debug, Default, PartialEq)]
struct Curves {
    values: Vec<String>,
    lines: Vec<(String, Curve)>,
}

/// Shows the plot; nothing if the rows do not count targets.
pub(super) fn show(ui: &mut Ui, rows: &[Row], variable: &str, id: &str) {
    let Curves { values, lines } = curves(rows, variable);
    if lines.is_empty() {
        return;
    }
    let legend: Vec<_> =
        lines.iter().enumerate().map(|(at, (name, _))| (Mark::Ring, theme::run(at), name.clone())).collect();
    chart_legend::wrapped(ui, "targets tracked, %", &legend);
    let axis = variable.replace('_', " ");
    let (of_axis, of_hover, name) = (values.clone(), values.clone(), axis.clone());
    let plot = Plot::new(("study", id.to_owned()))
        .height(180.0)
        .allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .include_y(0.0)
        .include_y(100.0)
        .include_x(-0.3)
        .include_x(values.len() as f64 - 0.7)
        .x_axis_label(axis)
        .y_axis_min_width(30.0)
        .grid_color(theme::line())
        .y_grid_spacer(few_marks)
        .y_axis_formatter(plain)
        .x_grid_spacer(|input| {
            let (low, high) = (input.bounds.0.ceil() as i64, input.bounds.1.floor() as i64);
            (low..=high).map(|i| GridMark { value: i as f64, step_size: 1.0 }).collect()
        })
        .x_axis_formatter(move |mark, _| named(&of_axis, mark.value))
        .label_formatter(move |near| match near {
            HoverPosition::NearDataPoint { plot_name, position, .. } => {
                Some(format!("{plot_name}\n{name} {}: {:.0} %", named(&of_hover, position.x), position.y))
            }
            HoverPosition::Elsewhere { .. } => None,
        });
    plot.show(ui, |plot| {
        for (at, (name, curve)) in lines.into_iter().enumerate() {
            let colour = theme::run(at);
            plot.line(Line::new("", curve.clone()).color(colour).width(1.5).allow_hover(false));
            plot.points(Points::new(name, curve).color(colour).radius(3.0));
        }
    });
}

/// The tick label at a position on the x axis; empty between two values.
fn named(values: &[String], place: f64) -> String {
    let at = place.round();
    let is_whole = (place - at).abs() < 1e-6 && at >= 0.0;
    if is_whole { values.get(at as usize).cloned().unwrap_or_default() } else { String::new() }
}

/// The curves, summed over all worlds.
fn curves(rows: &[Row], variable: &str) -> Curves {
    let value_of = |row: &Row| match row.columns.get(variable) {
        Some(serde_json::Value::String(word)) => word.clone(),
        Some(other) => other.to_string(),
        None => row.scenario.clone(),
    };
    let mut found = Curves::default();
    let mut sums: BTreeMap<(usize, usize), [f64; 2]> = BTreeMap::new();
    for row in rows {
        let (Some(tracked), Some(targets)) = (row.number("tracked"), row.number("targets")) else { continue };
        let value = value_of(row);
        let x = found.values.iter().position(|known| *known == value).unwrap_or_else(|| {
            found.values.push(value);
            found.values.len() - 1
        });
        let line = found.lines.iter().position(|(name, _)| *name == row.configuration).unwrap_or_else(|| {
            found.lines.push((row.configuration.clone(), Vec::new()));
            found.lines.len() - 1
        });
        let sum = sums.entry((line, x)).or_default();
        *sum = [sum[0] + tracked, sum[1] + targets];
    }
    for ((line, x), [tracked, targets]) in sums {
        if targets > 0.0 {
            found.lines[line].1.push([x as f64, 100.0 * tracked / targets]);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_has_the_share_of_all_worlds_at_each_value() {
        let row = |configuration: &str, seed, n_skip: u64, tracked: u64| Row {
            study: "straight".to_owned(),
            configuration: configuration.to_owned(),
            scenario: "approach-5".to_owned(),
            seed,
            columns: serde_json::from_value(
                serde_json::json!({ "n_skip": n_skip, "targets": 20, "tracked": tracked }),
            )
            .unwrap(),
        };
        let rows = [row("ncc", 1, 0, 20), row("ncc", 2, 0, 10), row("ncc", 1, 4, 5), row("sdog", 1, 4, 20)];
        let found = curves(&rows, "n_skip");
        assert_eq!(found.values, ["0", "4"]);
        assert_eq!(found.lines[0], ("ncc".to_owned(), vec![[0.0, 75.0], [1.0, 25.0]]));
        assert_eq!(found.lines[1], ("sdog".to_owned(), vec![[1.0, 100.0]]));
        assert_eq!((named(&found.values, 1.0).as_str(), named(&found.values, 0.5).as_str()), ("4", ""));
    }
}
