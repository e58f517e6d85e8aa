//! A report of a session: one self-contained HTML page with a light background, suitable for printing.

use std::fmt::Write;
use std::sync::atomic::AtomicBool;

use sightline_geometry::estimate::quantile::quantile;
use sightline_record::Unit;
use sightline_rover::version::tracker_version;
use sightline_session::metrics::{Metric, metrics};
use sightline_session::notes::Note;
use sightline_session::records::{self, StageQuantity};
use sightline_session::step::RunStep;
use sightline_session::{Fork, format};
use sightline_track::settings::Changes;

use super::kind::SessionPart;
use super::source::{NamedRun, Source};
use super::{bundle, report_steps, sheet};
use crate::html::{escape, markdown, number, table};
use crate::naming::hash;
use crate::problem::{ApiError, ApiResult};
use crate::study::chart::{Chart, Line};
use crate::version::VERSION;

/// Maximum number of runs with a chapter, first runs first.
const MOST_RUNS: usize = 20;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1080px;margin:2rem auto;padding:0 1rem;color:#222;\
background:#fff}h1{font-size:1.6rem;margin-bottom:.2rem}h2{font-size:1.25rem;margin-top:2.2rem;border-bottom:2px solid #222}\
h3{font-size:1.02rem;margin:1.6rem 0 .4rem}.sub{color:#444;margin-top:0}figure{margin:.6rem 0;break-inside:avoid}\
figure svg,figure img{max-width:100%;height:auto;display:block}figcaption{font-size:.86rem;color:#333}\
.row{display:flex;flex-wrap:wrap;gap:.8rem}.row figure{width:320px;margin:0}table{border-collapse:collapse;font-size:.82rem;\
font-variant-numeric:tabular-nums}caption{text-align:left;font-size:.86rem;color:#333;padding:.3rem 0}th,td{padding:.16rem .55rem;\
border-bottom:1px solid #ddd;text-align:right;vertical-align:top}thead th{border-bottom:2px solid #888}th{font-weight:600}\
th[scope=row]{font-weight:400}th:first-child,td:first-child{text-align:left}code,pre{font-size:.82rem;background:#f4f4f4;\
padding:.1rem .3rem;overflow-wrap:anywhere;white-space:pre-wrap}.wide{overflow-x:auto}.note{border-left:3px solid #0072b2;\
padding:.1rem .8rem;margin:.6rem 0;break-inside:avoid}.note p{margin:.3rem 0}.at{color:#444;font-size:.85rem}\
@media print{body{margin:0;max-width:none;font-size:11pt}h2{break-before:page}h2:first-of-type{break-before:auto}\
a{color:inherit;text-decoration:none}tr{break-inside:avoid}}";

/// Renders the report.
///
/// # Errors
/// A problem when it is cancelled or a figure cannot be drawn.
pub(crate) fn html(source: &Source, part: SessionPart, cancel: &AtomicBool) -> ApiResult<String> {
    let index = source.open.traverse.index();
    let name = escape(&index.name);
    let mut text = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width, \
         initial-scale=1\"><title>Sightline report: {name}</title><style>{STYLE}</style></head><body>\n\
         <h1>{name}</h1>\n<p class=\"sub\">Sightline report of session {}, {} stops. {}</p>\n",
        escape(&source.session.id),
        index.stops.len(),
        escape(&index.description)
    );
    let runs = source.runs(part);
    text.push_str(&overview(source, &runs));
    text.push_str(&notes(source, part));
    for run in runs.iter().take(MOST_RUNS) {
        chapter(&mut text, source, *run, cancel)?;
    }
    if runs.len() > MOST_RUNS {
        let _ = writeln!(
            text,
            "<p>{} more runs have no chapter here; export them one by one.</p>",
            runs.len() - MOST_RUNS
        );
    }
    text.push_str(&origin(source));
    text.push_str("</body></html>\n");
    Ok(text)
}

/// All runs in one table.
fn overview(source: &Source, runs: &[NamedRun<'_>]) -> String {
    let row = |run: &NamedRun<'_>| {
        let summary = sightline_session::summary::summarise(run.run.whole_steps().iter().map(AsRef::as_ref));
        let parent = run.run.fork.map_or_else(String::new, |fork| {
            format!("run {} at step {}", sheet::run_letter(fork.run), fork.from_step)
        });
        vec![
            format!("{}, run {}", run.record.label, sheet::run_letter(run.number)),
            run.run.settings.tracker.word().to_owned(),
            parent,
            summary.steps.to_string(),
            summary.steps_tracked.map_or_else(|| "–".to_owned(), |count| count.to_string()),
            summary.steps_lost.to_string(),
            summary.false_tracked.map_or_else(|| "–".to_owned(), |count| count.to_string()),
            number(summary.final_err_px, 2),
            number(summary.final_err_m.map(|m| 100.0 * m), 2),
            changed(&run.run.settings.changes(), run.run.fork),
        ]
    };
    let head = [
        "target and run",
        "tracker",
        "branched from",
        "steps",
        "tracked",
        "lost",
        "tracked falsely",
        "last error, px",
        "last error, cm",
        "changed",
    ];
    let rows: Vec<Vec<String>> = runs.iter().map(row).collect();
    let seed = bundle::scenario(source)
        .map_or_else(String::new, |scenario| format!(" The traverse is simulated, seed {}.", scenario.seed));
    format!(
        "<h2>Runs</h2>\n<p>{}</p>{}",
        escape(seed.trim()),
        table("Every run of this report; – where the truth is not known.", &head, &rows)
    )
}

/// Differences from the default run: changed settings, and a prediction moved by the user.
fn changed(settings: &Changes, fork: Option<Fork>) -> String {
    let settings = (!settings.is_empty()).then(|| serde_json::to_string(settings).unwrap_or_default());
    let moved = fork.and_then(|fork| Some((fork.from_step, fork.prediction_px?)));
    let moved =
        moved.map(|(step, to)| format!("prediction moved to ({:.1}, {:.1}) px at step {step}", to.x, to.y));
    let all: Vec<String> = settings.into_iter().chain(moved).collect();
    if all.is_empty() { "defaults".to_owned() } else { all.join("; ") }
}

/// The notes that belong to the part.
fn notes(source: &Source, part: SessionPart) -> String {
    let is_meant = |note: &&Note| {
        note.pin.target.is_none_or(|target| {
            part.target.is_none_or(|wanted| wanted == target)
                && part.run.is_none_or(|wanted| wanted == note.pin.run)
        })
    };
    let meant: Vec<&Note> = source.notes.list.iter().filter(is_meant).collect();
    if meant.is_empty() {
        return "<h2>Notes</h2>\n<p>There are no notes.</p>\n".to_owned();
    }
    let mut text = "<h2>Notes</h2>\n".to_owned();
    for (k, note) in meant.iter().enumerate() {
        text.push_str(&note_html(k + 1, note, &source.session));
    }
    text
}

/// A note with its step, target and run.
pub(crate) fn note_html(number: usize, note: &Note, session: &sightline_session::Session) -> String {
    let of = note.pin.target.map_or_else(String::new, |target| {
        let label = session.targets.get(target).map_or("a target", |record| record.label.as_str());
        format!("{label}, run {}, ", sheet::run_letter(note.pin.run))
    });
    let stage = note.pin.stage.as_ref().map_or_else(String::new, |stage| format!(", {stage}"));
    let pixel =
        note.pin.pixel.map_or_else(String::new, |pixel| format!(", pixel {:.1}, {:.1}", pixel.x, pixel.y));
    let at = format!("{of}step {}{stage}{pixel}", note.pin.step);
    format!(
        "<div class=\"note\"><p class=\"at\">{number}. {} · {}</p>\n{}</div>\n",
        escape(&at),
        escape(&note.made),
        markdown(&note.text)
    )
}

/// The metrics of a run, as in the page and in REST.
fn metrics_table(steps: &[std::sync::Arc<RunStep>]) -> String {
    let found = metrics(steps);
    let row = |metric: &Metric| {
        let value = metric.value.map(|value| metric.words(value));
        let note = metric.note.as_deref().filter(|_| value.is_none());
        let worst = metric.worst_step.map_or_else(String::new, |step| format!("step {step}"));
        vec![
            metric.name.clone(),
            value.or_else(|| note.map(str::to_owned)).unwrap_or_default(),
            metric.used.to_string(),
            worst,
        ]
    };
    let rows: Vec<Vec<String>> = found.metrics.iter().map(row).collect();
    let caption = format!("Metrics by the protocol “{}”, version {}.", found.protocol, found.version);
    table(&caption, &["metric", "value", "steps used", "worst at"], &rows)
}

/// The chapter of one run.
fn chapter(text: &mut String, source: &Source, run: NamedRun<'_>, cancel: &AtomicBool) -> ApiResult<()> {
    let steps = &run.run.steps;
    let _ = writeln!(text, "<h2>{}</h2>", escape(&sheet::title(source, run)));
    if let Some(why) = run.run.why_stopped() {
        let _ = writeln!(text, "<p>The run stopped before the last stop: {}.</p>", escape(&why));
    }
    text.push_str(&metrics_table(steps));
    for figure in figures(steps, &run)? {
        text.push_str(&figure);
    }
    text.push_str(&report_steps::html(source, run, cancel)?);
    text.push_str(&step_table(steps));
    text.push_str(&quantity_table(steps));
    text.push_str(&configuration(source, run));
    Ok(())
}

/// Scores and errors over the steps.
fn figures(steps: &[std::sync::Arc<RunStep>], run: &NamedRun<'_>) -> ApiResult<Vec<String>> {
    let rows: Vec<_> = steps.iter().map(|trace| trace.row()).collect();
    let points = |get: &dyn Fn(usize) -> Option<f64>| {
        (0..rows.len()).filter_map(|k| Some((rows[k].step as f64, get(k)?))).collect::<Vec<_>>()
    };
    let line = |label: &str, colour: usize, points: Vec<(f64, f64)>, is_thin: bool| Line {
        label: label.to_owned(),
        colour,
        points,
        is_thin,
        ..Line::default()
    };
    let column = |name: &str, unit: Unit, scale: f64| {
        points(&|k| Some(scale * records::row_value_in(&rows[k], name, unit)?))
    };
    let limit = run.run.settings.limits.ncc_min;
    let charts = [
        (
            "Match score (NCC)",
            "score",
            vec![
                line("score of the match", 0, column("ncc", Unit::One, 1.0), false),
                line("least that is accepted", 1, points(&|k| rows[k].ncc.map(|_| limit)), true),
            ],
        ),
        (
            "Error in the left image",
            "error, px",
            vec![
                line("error", 0, column("err_px", Unit::Pixel, 1.0), false),
                line("tolerance", 1, points(&|k| number_of("truth.tolerance_px", &steps[k])), true),
            ],
        ),
        (
            "Error and uncertainty in space",
            "cm",
            vec![
                line("error", 0, column("err_m", Unit::Centimetre, 1.0), false),
                line("3σ, largest axis", 2, column("sigma_m", Unit::Centimetre, 3.0), true),
            ],
        ),
    ];
    charts.into_iter().filter_map(|(title, unit, lines)| drawn(title, unit, lines).transpose()).collect()
}

/// One chart; `None` without data.
fn drawn(title: &str, unit: &str, lines: Vec<Line>) -> ApiResult<Option<String>> {
    let lines: Vec<Line> = lines.into_iter().filter(|line| !line.points.is_empty()).collect();
    // A gate without the gated quantity is not informative.
    if lines.first().is_none_or(|line| line.is_thin) {
        return Ok(None);
    }
    let axes = ["step".to_owned(), unit.to_owned()];
    let chart = Chart { title: title.to_owned(), axes, lines, ..Chart::default() };
    let svg = chart.svg().map_err(|why| ApiError::internal(format!("a figure: {why}")))?;
    let label = format!("{title} over the steps; the table of steps has the numbers");
    Ok(Some(format!("<figure role=\"img\" aria-label=\"{label}\">{svg}</figure>\n")))
}

fn number_of(name: &str, trace: &RunStep) -> Option<f64> {
    StageQuantity::named(name)?.number(trace)
}

/// The columns of the step table, each with its display unit and number of digits.
const COLUMNS: [(&str, Unit, usize); 8] = [
    ("ncc", Unit::One, 3),
    ("stereo_score", Unit::One, 3),
    ("inliers", Unit::One, 0),
    ("err_px", Unit::Pixel, 2),
    ("err_m", Unit::Centimetre, 2),
    ("sigma_m", Unit::Centimetre, 2),
    ("nees", Unit::One, 1),
    ("range_m", Unit::Metre, 2),
];

fn step_table(steps: &[std::sync::Arc<RunStep>]) -> String {
    let row = |trace: &std::sync::Arc<RunStep>| {
        let row = trace.row();
        let mut cells = vec![row.step.to_string(), row.state.clone()];
        cells.extend(
            COLUMNS
                .iter()
                .map(|(name, unit, digits)| number(records::row_value_in(&row, name, *unit), *digits)),
        );
        cells.push(row.reason.unwrap_or_default());
        cells
    };
    let heading = |(name, unit, _): &(&str, Unit, usize)| {
        let label = records::row_quantity(name).map_or(*name, |quantity| quantity.label.as_ref());
        if unit.symbol().is_empty() { label.to_owned() } else { format!("{label}, {}", unit.symbol()) }
    };
    let headings: Vec<String> = COLUMNS.iter().map(heading).collect();
    let mut head = vec!["step", "state"];
    head.extend(headings.iter().map(String::as_str));
    head.push("why rejected");
    let rows: Vec<Vec<String>> = steps.iter().map(row).collect();
    format!("<h3>Steps</h3>\n{}", table("Every step of the run.", &head, &rows))
}

/// Statistics of every declared stage quantity that occurs in the run.
fn quantity_table(steps: &[std::sync::Arc<RunStep>]) -> String {
    let row = |quantity: StageQuantity| {
        let values: Vec<f64> = steps.iter().filter_map(|trace| quantity.number(trace)).collect();
        let of = |share: f64| Some(format::number(quantile(&values, share)?));
        Some(vec![
            quantity.name(),
            quantity.declared().unit.symbol().to_owned(),
            values.len().to_string(),
            of(0.0)?,
            of(0.5)?,
            of(1.0)?,
            quantity.declared().description.to_string(),
        ])
    };
    let rows: Vec<Vec<String>> = StageQuantity::all().filter_map(row).collect();
    let head = ["quantity", "unit", "steps", "least", "median", "greatest", "meaning"];
    let caption = "Every number that the stages recorded, over the steps that have it.";
    format!("<h3>Recorded numbers</h3>\n{}", table(caption, &head, &rows))
}

fn configuration(source: &Source, run: NamedRun<'_>) -> String {
    let changes = run.run.settings.changes();
    let rows: Vec<Vec<String>> =
        changes.iter().map(|(key, value)| vec![key.clone(), value.to_string()]).collect();
    let changed = if rows.is_empty() {
        "<p>All settings are at their defaults.</p>".to_owned()
    } else {
        table("Settings that differ from the defaults.", &["setting", "value"], &rows)
    };
    let settings = serde_json::to_vec(run.run.settings.as_ref()).unwrap_or_default();
    let again = bundle::command(source, run).map_or_else(
        || "<p>The run is a branch; the reproduce bundle contains its parent, too.</p>".to_owned(),
        |command| format!("<p>Again:</p>\n<pre>{}</pre>", escape(&command)),
    );
    format!(
        "<h3>Configuration</h3>\n{changed}\n<p>SHA-256 of all settings: <code>{}</code></p>\n{again}\n",
        hash(&settings)
    )
}

/// Provenance of the numbers: program, tracker and data.
fn origin(source: &Source) -> String {
    let index = serde_json::to_vec(source.open.traverse.index()).unwrap_or_default();
    let rows = [
        ("program", format!("sightline {VERSION}")),
        ("tracker", tracker_version()),
        ("traverse", source.open.id.clone()),
        ("SHA-256 of the traverse's index", hash(&index)),
        ("pixels", "(0, 0) is the centre of the first pixel; x to the right, y down".to_owned()),
        (
            "err_px, err_m",
            "distance from the truth in the left image, and in the present rover frame".to_owned(),
        ),
    ];
    let rows: Vec<Vec<String>> = rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]).collect();
    format!("<h2>Origin</h2>\n{}", table("What made this report.", &["", ""], &rows))
}

#[cfg(test)]
mod tests {
    use serde_json::json;
    use sightline_geometry::frames::Pixel;

    use super::*;

    #[test]
    fn a_run_with_a_moved_prediction_is_not_reported_as_defaults() {
        let moved = Fork { prediction_px: Some(Pixel::new(271.25, 140.0)), ..Fork::new(0, 18) };
        assert_eq!(changed(&Changes::new(), None), "defaults");
        assert_eq!(changed(&Changes::new(), Some(Fork::new(0, 18))), "defaults");
        assert_eq!(changed(&Changes::new(), Some(moved)), "prediction moved to (271.2, 140.0) px at step 18");
        let both = changed(&Changes::from([("ncc_min".to_owned(), json!(0.4))]), Some(moved));
        assert!(both.starts_with("{\"ncc_min\":0.4}; prediction moved to "), "{both}");
    }
}
