//! The figures of a study, each with a caption.
//!
//! A *series* is one configuration at one value of all variables except the first. Its points pool the runs of all worlds;
//! error bars show the minimum and maximum over single worlds. Squares show the paper's values.

use std::collections::BTreeMap;

use serde_json::Value;
use sightline_study::paper::PaperValue;
use sightline_study::plan::{Plan, Unit};
use sightline_study::row::{columns, is_tracked};
use sightline_study::run::Run;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::chart::{Chart, Line, merged};

/// A figure of a report.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    /// Name, also of the file.
    pub name: &'static str,
    /// The figure as SVG.
    pub svg: String,
    /// Caption, one sentence.
    pub sentence: String,
}

/// One configuration over the study's first variable.
pub(crate) struct Series {
    /// Configuration and values of the other variables.
    pub label: String,
    /// Name of the configuration.
    pub configuration: String,
    /// The points, in the order of the grid.
    pub points: Vec<SeriesPoint>,
}

/// A series at one value of the first variable.
pub(crate) struct SeriesPoint {
    /// Position on the horizontal axis.
    pub x: f64,
    /// The value of the variable as text.
    pub word: String,
    /// Columns pooled over all worlds.
    pub pooled: BTreeMap<String, Value>,
    /// Columns of each world, with its seed.
    pub worlds: Vec<(u64, BTreeMap<String, Value>)>,
}

impl SeriesPoint {
    /// A column pooled over all worlds.
    pub(crate) fn value(&self, column: &str) -> Option<f64> {
        self.pooled.get(column)?.as_f64()
    }

    /// Minimum and maximum of a column over single worlds.
    pub(crate) fn range(&self, column: &str) -> Option<[f64; 2]> {
        let values = self.worlds.iter().filter_map(|(_, columns)| columns.get(column)?.as_f64());
        values.fold(None, |range, v| {
            let [low, high] = range.unwrap_or([v, v]);
            Some([f64::min(low, v), f64::max(high, v)])
        })
    }
}

/// The series of a study whose rows are points of a grid.
pub(crate) fn series(plan: &Plan, units: &[Unit]) -> Vec<Series> {
    let mut found: Vec<Series> = Vec::new();
    let mut words: Vec<String> = Vec::new();
    for configuration in &plan.configurations {
        for point in &plan.points {
            let of_point: Vec<&Unit> = units
                .iter()
                .filter(|unit| unit.configuration == configuration.name && unit.point == *point)
                .collect();
            let others: Vec<String> = point
                .variables
                .iter()
                .skip(1)
                .map(|(name, value)| format!(", {name} {}", words_in(value)))
                .collect();
            let label = format!("{}{}", configuration.name, others.concat());
            let (x, word) = position(point.variables.first().map(|(_, value)| value), &mut words);
            let runs: Vec<&Run> = of_point.iter().flat_map(|unit| &unit.runs).collect();
            let worlds = of_point
                .iter()
                .map(|unit| (unit.seed, columns(&unit.runs.iter().collect::<Vec<_>>(), 1)))
                .collect();
            let here = SeriesPoint { x, word, pooled: columns(&runs, of_point.len()), worlds };
            match found.iter_mut().find(|series| series.label == label) {
                Some(series) => series.points.push(here),
                None => found.push(Series {
                    label,
                    configuration: configuration.name.clone(),
                    points: vec![here],
                }),
            }
        }
    }
    found
}

/// A value as text, without quotation marks.
fn words_in(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// The position of a value on the horizontal axis: the number itself, or the index of a word in the order of the grid.
fn position(value: Option<&Value>, words: &mut Vec<String>) -> (f64, String) {
    if let Some(number) = value.and_then(Value::as_f64) {
        return (number, number.to_string());
    }
    let word = value.and_then(Value::as_str).unwrap_or_default().to_owned();
    let known = words.iter().position(|other| *other == word).unwrap_or_else(|| {
        words.push(word.clone());
        words.len() - 1
    });
    (known as f64, word)
}

/// The figures of a study of whole runs.
///
/// # Errors
/// The message of the drawing library.
pub(crate) fn figures(plan: &Plan, units: &[Unit]) -> Result<Vec<Figure>, String> {
    let series = series(plan, units);
    let variable = plan.study.variable;
    let shares: (f64, f64) = (1.0, 100.0);
    let targets = (shares.1, "share of targets, %");
    let mut drawn = Vec::new();
    let mut add = |name, column: &str, title: &str, unit: (f64, &str)| -> Result<(), String> {
        drawn.push(over_grid(plan, &series, (name, column), title, unit)?);
        Ok(())
    };
    match plan.study.name {
        "faults" => {
            let cases = (shares.1, "share of cases, %");
            add("false", "false_share", "cases that say tracked at the fault and are not", cases)?;
            add("kept", "kept_share", "cases that are still tracked at the fault", cases)?;
        }
        "recovery" => {
            let title = "targets found again by the shape of their surroundings";
            add("found", "first_view_found_share", title, targets)?;
        }
        "claim" | "approach" => {
            add("tracked", "tracked_share", "targets tracked to the end", targets)?;
            drawn.push(nees(plan, units)?);
        }
        _ => {
            let title = format!("targets tracked to the end, over {variable}");
            add("tracked", "tracked_share", &title, targets)?;
            add(
                "error",
                "err_px_median",
                "median error of the tracked targets at the end",
                (1.0, "error, px"),
            )?;
            add(
                "drift",
                "drift_m_median",
                "median drift of the tracked targets at the end",
                (shares.1, "drift, cm"),
            )?;
        }
    }
    if plan.study.name == "straight" {
        drawn.push(over_grid(
            plan,
            &series,
            ("evenness", "uneven_px"),
            "unevenness of the two rows at the end",
            (1.0, "residual of a cubic, px"),
        )?);
    }
    Ok(drawn)
}

/// A column over the grid, one line per series.
fn over_grid(
    plan: &Plan,
    series: &[Series],
    (name, column): (&'static str, &str),
    title: &str,
    (factor, unit): (f64, &str),
) -> Result<Figure, String> {
    let is_share = column.ends_with("share");
    let words = words_of(series);
    let mut lines: Vec<Line> = Vec::new();
    let all = series.len() as f64;
    for (colour, series) in series.iter().enumerate() {
        // Points at the same word are drawn side by side.
        let aside = if words.is_empty() { 0.0 } else { 0.6 * ((colour as f64 + 0.5) / all - 0.5) };
        let value = |point: &SeriesPoint| {
            share_or_column(&point.pooled, column).map(|v| (point.x + aside, factor * v))
        };
        let range = |point: &SeriesPoint| {
            let values = point.worlds.iter().filter_map(|(_, columns)| share_or_column(columns, column));
            let ends = values.fold(None, |range: Option<[f64; 2]>, v| {
                let [low, high] = range.unwrap_or([v, v]);
                Some([low.min(v), high.max(v)])
            });
            ends.map(|[low, high]| (point.x + aside, [factor * low, factor * high]))
        };
        lines.push(Line {
            label: series.label.clone(),
            colour,
            points: series.points.iter().filter_map(value).collect(),
            ranges: series.points.iter().filter_map(range).collect(),
            is_apart: !words.is_empty(),
            ..Line::default()
        });
    }
    if words.is_empty() {
        lines = merged(lines);
    }
    let paper = plan.study.paper();
    let marks = paper_lines(&paper, column, factor, &lines);
    lines.extend(marks);
    let sentence = sentence(series, column, factor, unit, &paper);
    let chart = Chart {
        title: title.to_owned(),
        axes: [axis(plan), unit.to_owned()],
        words,
        y_range: is_share.then_some([0.0, 104.0]),
        lines,
    };
    Ok(Figure { name, svg: chart.svg()?, sentence })
}

/// A column, or the ratio of two columns.
fn share_or_column(columns: &BTreeMap<String, Value>, column: &str) -> Option<f64> {
    let number = |name: &str| columns.get(name).and_then(Value::as_f64);
    match column {
        "false_share" => Some(number("fault_false")? / number("cases")?),
        "kept_share" => Some(number("fault_tracked")? / number("cases")?),
        _ => number(column),
    }
}

fn words_of(series: &[Series]) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    for point in series.iter().flat_map(|series| &series.points) {
        if point.word.parse::<f64>().is_err() && !words.contains(&point.word) {
            words.push(point.word.clone());
        }
    }
    words
}

pub(super) fn axis(plan: &Plan) -> String {
    let unit = if plan.study.unit.is_empty() { String::new() } else { format!(", {}", plan.study.unit) };
    format!("{}{unit}", plan.study.variable)
}

/// The paper's values, each in the colour of the line with its configuration.
fn paper_lines(paper: &[PaperValue], column: &str, factor: f64, lines: &[Line]) -> Vec<Line> {
    let mut marks: Vec<Line> = Vec::new();
    for value in paper.iter().filter(|value| value.column == column) {
        let point = (value.at, factor * value.value);
        let label = format!("paper: {}", value.configuration);
        match marks.iter_mut().find(|line| line.label == label) {
            Some(line) => line.points.push(point),
            None => {
                let is_own =
                    |line: &&Line| line.label.split([',', ' ']).any(|name| name == value.configuration);
                let colour = lines.iter().find(is_own).map_or(0, |line| line.colour);
                marks.push(Line { label, colour, points: vec![point], is_marks: true, ..Line::default() });
            }
        }
    }
    marks
}

/// The values of a column at both ends of the grid for each series, with the paper's values if available.
fn sentence(series: &[Series], column: &str, factor: f64, unit: &str, paper: &[PaperValue]) -> String {
    let unit = unit.rsplit(", ").next().unwrap_or_default();
    let at = |series: &Series, point: &SeriesPoint| {
        let value = factor * share_or_column(&point.pooled, column)?;
        let printed = paper.iter().find(|value| {
            value.configuration == series.configuration && value.column == column && value.at == point.x
        });
        let printed = printed.map_or_else(String::new, |p| format!(" (paper {:.0})", factor * p.value));
        let digits = if unit == "%" || value.abs() >= 10.0 { 0 } else { 2 };
        Some(format!("{value:.digits$} {unit}{printed} at {}", point.word))
    };
    let parts = series.iter().filter_map(|series| {
        // For numbers, both ends of the grid; for words, all values.
        let last = series.points.len().saturating_sub(1);
        let is_listed = |&(position, point): &(usize, &SeriesPoint)| {
            position == 0 || position == last || point.word.parse::<f64>().is_err()
        };
        let sentences: Vec<String> = series
            .points
            .iter()
            .enumerate()
            .filter(is_listed)
            .filter_map(|(_, point)| at(series, point))
            .collect();
        (!sentences.is_empty()).then(|| format!("{}: {}", series.label, sentences.join(", ")))
    });
    let parts: Vec<String> = parts.collect();
    if parts.is_empty() {
        "No target was left to measure.".to_owned()
    } else {
        format!("{}.", parts.join("; "))
    }
}

/// The distribution of NEES over the tracked runs of each configuration, against χ² with three degrees of freedom.
fn nees(plan: &Plan, units: &[Unit]) -> Result<Figure, String> {
    let mut lines: Vec<Line> = Vec::new();
    let mut sentences: Vec<String> = Vec::new();
    for (colour, configuration) in plan.configurations.iter().enumerate() {
        let own: Vec<&Unit> = units.iter().filter(|unit| unit.configuration == configuration.name).collect();
        let runs: Vec<&Run> = own.iter().flat_map(|unit| &unit.runs).collect();
        let mut values: Vec<f64> =
            runs.iter().filter(|run| is_tracked(run)).filter_map(|run| run.nees).collect();
        values.sort_by(f64::total_cmp);
        let count = values.len() as f64;
        let steps = values.iter().enumerate().map(|(i, &v)| (v, (i + 1) as f64 / count));
        lines.push(Line {
            label: configuration.name.clone(),
            colour,
            points: steps.filter(|(v, _)| *v <= 16.0).collect(),
            ..Line::default()
        });
        let pooled = columns(&runs, own.len());
        let number = |name: &str| pooled.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN);
        sentences.push(format!(
            "{}: mean NEES {:.2} (95 % band {:.2} to {:.2} for {} runs), {:.0} % inside 3σ, 3 × RMS of the error of all \
             targets {:.2} cm",
            configuration.name,
            number("nees_mean"),
            number("nees_low"),
            number("nees_high"),
            values.len(),
            100.0 * number("inside_3_sigma"),
            300.0 * number("err_all_m_rms"),
        ));
    }
    let chi_squared = ChiSquared::new(3.0).map_err(|e| e.to_string())?;
    let points = (0..=160).map(|i| f64::from(i) / 10.0).map(|x| (x, chi_squared.cdf(x))).collect();
    lines.push(Line {
        label: "χ² with 3 d.o.f.".to_owned(),
        colour: 6,
        points,
        is_thin: true,
        ..Line::default()
    });
    let chart = Chart {
        title: "NEES of the tracked targets at the end".to_owned(),
        axes: ["NEES".to_owned(), "share of runs below".to_owned()],
        y_range: Some([0.0, 1.02]),
        lines,
        ..Chart::default()
    };
    let sentence = format!(
        "A correct covariance follows the thin line. {}. The paper's formula [Kim09 Eq. 5] (3σ, its navcam) gives 1.60 cm with a drift of \
         2.5 px and 2.19 cm with 10 px at 2 m.",
        sentences.join("; ")
    );
    Ok(Figure { name: "nees", svg: chart.svg()?, sentence })
}
