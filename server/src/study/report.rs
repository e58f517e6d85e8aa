//! The report of a study: one self-contained HTML file with its figures, which are also written as SVG files.

use std::fmt::Write;
use std::path::Path;

use sightline_geometry::error::{Error, Result};
use sightline_recordings::files::write_atomically;
use sightline_rover::version::tracker_version;
use sightline_study::plan::{Plan, Unit};
use sightline_study::row::{Row, rows};
use sightline_study::terrain_table;

use super::figure::{Figure, Series, SeriesPoint, figures, series};
use super::order::Order;
use super::step_figure::checkout;
use crate::version::VERSION;

/// The file name.
pub(crate) const NAME: &str = "report.html";

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:1000px;margin:2rem auto;padding:0 1rem;color:#222;\
background:#fff}h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}figure{margin:1rem 0}figure svg{max-width:100%;\
height:auto}figcaption{font-size:.9rem;color:#444}table{border-collapse:collapse;font-size:.85rem}th,td{padding:.2rem .6rem;\
border-bottom:1px solid #ddd;text-align:right}th:first-child,td:first-child{text-align:left}code,pre{font-size:.85rem;\
background:#f5f5f5;padding:.1rem .3rem;overflow-wrap:anywhere;white-space:pre-wrap}.wide{overflow-x:auto}";

/// Writes the report and its figures.
///
/// # Errors
/// A folder that cannot be written, or a figure that cannot be drawn.
pub(crate) fn write(folder: &Path, order: &Order, units: &[Unit]) -> Result<String> {
    let path = folder.join(NAME);
    let draw = if order.plan.study.is_by_step { checkout } else { figures };
    let figures =
        draw(&order.plan, units).map_err(|problem| Error::format(&path, format!("a figure: {problem}")))?;
    for figure in &figures {
        write_atomically(&folder.join(format!("{}.svg", figure.name)), figure.svg.as_bytes())?;
    }
    let html = html(order, units, &figures);
    write_atomically(&path, html.as_bytes())?;
    Ok(html)
}

fn html(order: &Order, units: &[Unit], figures: &[Figure]) -> String {
    let plan = &order.plan;
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Study {name}</title><style>{STYLE}</style>\
         </head><body>\n<h1>Study: {name}</h1>\n<p>{}</p>\n<p>{}</p>\n",
        escape(plan.study.question),
        escape(&extent(units)),
        name = plan.study.name,
    );
    for figure in figures {
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "<figure>{}<figcaption>{}</figcaption></figure>",
            figure.svg,
            escape(&figure.sentence)
        );
    }
    text.push_str(&table_ii(&units.iter().flat_map(|unit| rows(plan.study, unit)).collect::<Vec<_>>()));
    if plan.study.is_by_step {
        text.push_str(&step_table(plan, units));
    } else {
        text.push_str(&table(plan, &series(plan, units)));
    }
    text.push_str(&settings(order));
    text.push_str("</body></html>\n");
    text
}

/// Table II with our values next to it, for the study with odometry.
fn table_ii(rows: &[Row]) -> String {
    let table = terrain_table::table(rows);
    if table.is_empty() {
        return String::new();
    }
    let row = |tag: &str, cells: &[String]| {
        let cells = cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escape(cell)));
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    let head = row("th", &terrain_table::HEADINGS.map(str::to_owned));
    let body: String = table.iter().map(|line| row("td", &line.cells())).collect();
    format!(
        "<h2>Table II</h2>\n<p>Paper: 26 trials of one target each with visual odometry, 2 failures. Lost by the \
         pose: the target was out of reach of the search around its prediction (window), or was located but rejected as \
         too far from the prediction (correction). Not driven: slip ended the drive.</p>\n<div class=\"wide\"><table>\
         {head}{body}</table></div>\n"
    )
}

/// The number of worlds and runs.
fn extent(units: &[Unit]) -> String {
    let mut worlds: Vec<(&str, u64)> = units.iter().map(|unit| (unit.scenario.as_str(), unit.seed)).collect();
    worlds.sort_unstable();
    worlds.dedup();
    let runs: usize = units.iter().map(|unit| unit.runs.len()).sum();
    let named: Vec<String> = worlds.iter().map(|(scenario, seed)| format!("{scenario} {seed}")).collect();
    format!(
        "Worlds: {}; runs: {runs}. Points pool all worlds; bars reach from the least to the greatest value of a single \
         world, whose targets are not independent. They are {}.",
        worlds.len(),
        named.join(", ")
    )
}

/// A column of the table: name, label, factor, decimals.
type Column = (&'static str, &'static str, f64, usize);

/// The pooled columns of the table.
const COLUMNS: [Column; 14] = [
    ("targets", "targets", 1.0, 0),
    ("refused", "refused", 1.0, 0),
    ("tracked_share", "tracked, %", 100.0, 1),
    ("false_tracked", "false tracking", 1.0, 0),
    ("false_lost", "false loss", 1.0, 0),
    ("false_tracked_steps", "false steps", 1.0, 0),
    ("err_px_median", "error median, px", 1.0, 2),
    ("err_px_p95", "95 %, px", 1.0, 2),
    ("err_m_median", "error median, cm", 100.0, 2),
    ("err_m_p95", "95 %, cm", 100.0, 2),
    ("err_all_m_rms", "RMS of all, cm", 100.0, 2),
    ("drift_m_median", "drift median, cm", 100.0, 2),
    ("drift_m_p95", "95 %, cm", 100.0, 2),
    ("uneven_px", "unevenness, px", 1.0, 2),
];

/// The columns of faults and of separately counted targets, if there are any.
const MORE: [Column; 13] = [
    ("uneven_true_px", "of the truth, px", 1.0, 2),
    ("boundary_targets", "boundary targets", 1.0, 0),
    ("boundary_tracked", "tracked", 1.0, 0),
    ("boundary_false_tracked", "false", 1.0, 0),
    ("passed_targets", "passed targets", 1.0, 0),
    ("passed_tracked", "tracked", 1.0, 0),
    ("passed_false_tracked", "false", 1.0, 0),
    ("cases", "cases", 1.0, 0),
    ("fault_tracked", "tracked at the fault", 1.0, 0),
    ("fault_lost", "lost at the fault", 1.0, 0),
    ("fault_false", "false at the fault", 1.0, 0),
    ("recovered", "recovered", 1.0, 0),
    ("failed", "failed", 1.0, 0),
];

fn table(plan: &Plan, series: &[Series]) -> String {
    let points = || series.iter().flat_map(|series| &series.points);
    // For faults, their columns come first.
    let (first, then): (&[Column], &[Column]) = if points().any(|point| point.value("cases").is_some()) {
        (&MORE, &COLUMNS)
    } else {
        (&COLUMNS, &MORE)
    };
    let known: Vec<_> = first
        .iter()
        .chain(then)
        .filter(|(name, ..)| points().any(|point| point.value(name).is_some()))
        .collect();
    let head: Vec<String> =
        known.iter().map(|(_, words, ..)| format!("<th>{}</th>", escape(words))).collect();
    let mut text = format!(
        "<h2>Table</h2>\n<div class=\"wide\"><table><tr><th>configuration</th><th>{}</th>{}<th>tracked by world, %</th></tr>\n",
        escape(plan.study.variable),
        head.concat()
    );
    for series in series {
        for point in &series.points {
            let cell = |(name, _, factor, digits): &Column| {
                point.value(name).map_or_else(String::new, |v| format!("{:.digits$}", factor * v))
            };
            let cells: Vec<String> =
                known.iter().map(|column| format!("<td>{}</td>", cell(column))).collect();
            let _ = writeln!(
                text,
                "<tr><td>{}</td><td>{}</td>{}<td>{}</td></tr>",
                escape(&series.label),
                escape(&point.word),
                cells.concat(),
                by_world(point)
            );
        }
    }
    text.push_str("</table></div>\n");
    text
}

fn by_world(point: &SeriesPoint) -> String {
    point
        .range("tracked_share")
        .map_or_else(String::new, |[low, high]| format!("{:.0}–{:.0}", 100.0 * low, 100.0 * high))
}

/// Every step of every run of a checkout, with the ground truth and the paper's values.
fn step_table(plan: &Plan, units: &[Unit]) -> String {
    let paper = plan.study.paper();
    let mut text = "<h2>Table</h2>\n<div class=\"wide\"><table><tr><th>configuration</th><th>seed</th><th>position</th><th>state</th>\
                    <th>magnification</th><th>true</th><th>paper</th><th>roll, °</th><th>true</th><th>paper</th>\
                    <th>azimuth change, °</th><th>true</th><th>paper</th><th>bearing, °</th><th>NCC</th><th>paper</th>\
                    <th>stereo</th><th>correction, px</th><th>since designation, cm</th><th>error, px</th><th>error, cm</th>\
                    </tr>\n"
        .to_owned();
    for unit in units {
        for step in unit.runs.iter().flat_map(|run| &run.steps) {
            let number =
                |v: Option<f64>, digits: usize| v.map_or_else(String::new, |v| format!("{v:.digits$}"));
            let printed = |column: &str| {
                let at = |value: &&_| is_at(value, column, step.position);
                number(paper.iter().find(at).map(|value| value.value), 2)
            };
            let cells = [
                escape(&unit.configuration),
                unit.seed.to_string(),
                step.position.to_string(),
                step.state.clone(),
                number(step.magnification, 3),
                number(step.magnification_true, 3),
                printed("magnification"),
                number(step.roll_deg, 2),
                number(step.roll_true_deg, 2),
                printed("roll_deg"),
                number(step.azimuth_change_deg, 2),
                number(step.azimuth_change_true_deg, 2),
                printed("azimuth_change_deg"),
                number(step.bearing_deg, 1),
                number(step.ncc, 2),
                printed("ncc"),
                number(step.stereo_score, 2),
                number(step.correction_px, 1),
                number(Some(100.0 * step.total_correction_m), 1),
                number(step.err_px, 2),
                number(step.err_m.map(|m| 100.0 * m), 2),
            ];
            let cells: Vec<String> = cells.iter().map(|cell| format!("<td>{cell}</td>")).collect();
            let _ = writeln!(text, "<tr>{}</tr>", cells.concat());
        }
    }
    text.push_str("</table></div>\n");
    text
}

fn is_at(value: &sightline_study::paper::PaperValue, column: &str, position: usize) -> bool {
    value.column == column && value.at == position as f64
}

/// The exact settings, and how to reproduce the study.
fn settings(order: &Order) -> String {
    let mut text = format!(
        "<h2>Settings</h2>\n<p>sightline {}, tracker {}. Each configuration changes the defaults so:</p>\n<table>",
        escape(VERSION),
        escape(&tracker_version())
    );
    for configuration in &order.plan.configurations {
        let changes = serde_json::to_string(&configuration.settings.changes()).unwrap_or_default();
        let _ = writeln!(
            text,
            "<tr><td>{}</td><td><code>{}</code></td></tr>",
            escape(&configuration.name),
            escape(&changes)
        );
    }
    let own: Vec<String> = order
        .plan
        .points
        .iter()
        .filter(|point| !point.changes.is_empty())
        .map(|point| point.changes.join(" "))
        .collect();
    let of_points = if own.is_empty() {
        String::new()
    } else {
        format!("<p>Points of the grid set {}.</p>", escape(&own.join(", ")))
    };
    let _ = writeln!(text, "</table>\n{of_points}<p>Again:</p>\n<pre>{}</pre>", escape(&order.command));
    text
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn external_text_is_escaped() {
        assert_eq!(escape("<b a=\"1\">&"), "&lt;b a=&quot;1&quot;&gt;&amp;");
    }
}
