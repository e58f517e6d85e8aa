//! The page of one step: the state in a sentence, the images, the verdict, every stage's record, the ground truth and the
//! notes.

use std::fmt::Write;
use std::sync::atomic::AtomicBool;

use sightline_geometry::error::Error;
use sightline_session::Run;
use sightline_session::records;
use sightline_session::step::{RunStep, StepRow};

use super::{arrays, page, step_path, values};
use crate::exports::{SessionPart, Source, note_html, run_letter, step_image};
use crate::html::{escape, png_address, table};
use crate::problem::{ApiError, ApiResult};
use crate::routes::notes;

/// The HTML of the page.
///
/// # Errors
/// A problem if the step does not exist or was not computed yet.
pub(super) fn html(
    source: &Source,
    target: usize,
    run: usize,
    step: usize,
    cancel: &AtomicBool,
) -> ApiResult<String> {
    let session = &source.session;
    let found = session.run(target, run).map_err(|error| ApiError::from(error).about_path())?;
    let missing = || {
        ApiError::not_found(format!("Step {step} of this run was not computed, or does not exist."))
            .hint("The page of the session lists the steps that there are.")
    };
    let trace = found.step(step).ok_or_else(missing)?;
    let label = &session.targets[target].label;
    let name = format!("{label}, run {}", run_letter(run));
    let last = session.stop_count.saturating_sub(1);
    let mut html = navigation(source, target, run, found, step);
    let _ = writeln!(
        html,
        "<h1>{}: step {step} of {last}</h1>\n<p class=\"lead\">{}</p>",
        escape(&name),
        sentence(trace)
    );
    if let Some(why) = trace.why_incomplete() {
        let _ = writeln!(html, "<p class=\"bad\">{}</p>", escape(&why));
    }
    html.push_str(&pictures(source, found, trace, cancel)?);
    html.push_str(&verdict(trace));
    html.push_str("<h2>Templates and maps</h2>\n");
    html.push_str(&arrays::figures(trace));
    html.push_str(&stages(trace));
    html.push_str(&truth(trace));
    html.push_str("<h2>Notes</h2>\n");
    let here = notes::at_step(&source.notes, target, run, step);
    if here.is_empty() {
        html.push_str("<p>There are no notes at this step.</p>\n");
    }
    for (k, note) in here.iter().enumerate() {
        html.push_str(&note_html(k + 1, note, session));
    }
    Ok(page(&format!("{name}: step {step}"), &html))
}

/// Links to the neighbours, the events, the other runs and the viewer.
fn navigation(source: &Source, target: usize, run: usize, found: &Run, step: usize) -> String {
    let id = &source.session.id;
    let path = |step: usize| step_path(id, target, run, step);
    let mut links = Vec::new();
    let mut link = |words: &str, to: Option<usize>| {
        if let Some(to) = to {
            links.push(format!("<li><a href=\"{}\">{words}: step {to}</a></li>", path(to)));
        }
    };
    let rows: Vec<StepRow> = found.steps.iter().map(|trace| trace.row()).collect();
    let events = events(&rows);
    let has = |step: usize| found.step(step).map(|trace| trace.step);
    link("Previous step", step.checked_sub(1).and_then(has));
    link("Next step", has(step + 1));
    link("Previous event", events.iter().copied().rev().find(|event| *event < step));
    link("Next event", events.iter().copied().find(|event| *event > step));
    for other in source.runs(SessionPart { target: Some(target), run: None }) {
        if other.number != run && other.run.step(step).is_some() {
            let to = step_path(id, target, other.number, step);
            let letter = run_letter(other.number);
            links.push(format!("<li><a href=\"{to}\">The same step of run {letter}</a></li>"));
        }
    }
    links.push(format!("<li><a href=\"/api/v1/sessions/{id}/page\">Session {id}</a></li>"));
    links.push(format!("<li><a href=\"/#session={id}\">Viewer</a></li>"));
    format!("<nav aria-label=\"Steps and runs\"><ul>{}</ul></nav>\n", links.concat())
}

/// The steps at which the state changes, including the designation and faults.
fn events(rows: &[StepRow]) -> Vec<usize> {
    let changed = |pair: &&[StepRow]| pair[0].state != pair[1].state || pair[1].fault;
    let first = rows.first().map(|row| row.step);
    first.into_iter().chain(rows.windows(2).filter(changed).map(|pair| pair[1].step)).collect()
}

/// The state and the main numbers in a sentence.
fn sentence(trace: &RunStep) -> String {
    let row = trace.row();
    let good = if trace.update.state.is_lost() { "bad" } else { "good" };
    let state = step_image::state_words(trace).to_lowercase();
    let numbers = [
        row.ncc.map(|score| format!("NCC {score:.2}")),
        row.inliers.map(|count| format!("{count} inliers")),
        row.confidence.map(|confidence| format!("confidence {confidence:.2}")),
        row.err_px.map(|error| format!("error {error:.2} pixels")),
        row.err_m.map(|error| format!("error {:.1} centimetres", 100.0 * error)),
        row.sigma_m.map(|sigma| format!("standard deviation {:.1} centimetres", 100.0 * sigma)),
        row.range_m.map(|range| format!("distance {range:.2} metres")),
    ];
    let numbers: Vec<String> = numbers.into_iter().flatten().collect();
    let reason =
        row.reason.map_or_else(String::new, |reason| format!(" {}.", escape(reason.trim_end_matches('.'))));
    format!("Step {}, <span class=\"{good}\">{state}</span>: {}.{reason}", row.step, numbers.join(", "))
}

/// The close-up with its marks, and both images of the stop.
fn pictures(source: &Source, run: &Run, trace: &RunStep, cancel: &AtomicBool) -> ApiResult<String> {
    let left = match source.images(trace, cancel) {
        Err(Error::Cancelled) => return Err(Error::Cancelled.into()),
        images => images.ok().map(|[left, _]| left),
    };
    let mut html = "<h2>Pictures</h2>\n".to_owned();
    let close = step_image::png(trace, left.as_deref(), &run.settings).map_err(ApiError::internal)?;
    let [width, height] = step_image::plain_size();
    let words = format!("{}. {}", step_image::numbers(&trace.row()), step_image::LEGEND);
    let _ = writeln!(
        html,
        "<figure><img src=\"{}\" width=\"{width}\" height=\"{height}\" alt=\"{}\"><figcaption>The target in the left image. {}</figcaption></figure>",
        png_address(&close),
        escape(&format!(
            "Close-up of the target, {}. {words}",
            step_image::state_words(trace).to_lowercase()
        )),
        escape(step_image::LEGEND)
    );
    let (pointing, located) = (&trace.point_mast, trace.located());
    let eyes = [
        ("left", &pointing.left, located.and_then(|l| l.left_pixel)),
        ("right", &pointing.right, located.and_then(|l| l.right_pixel)),
    ];
    let camera = trace.update.target.designation.camera;
    let query = camera.map_or_else(String::new, |camera| format!("?camera={camera}"));
    html.push_str("<div class=\"pair\">\n");
    for (eye, camera, found) in eyes {
        let [width, height] = camera.size;
        let path =
            format!("/api/v1/traverses/{}/steps/{}/images/{eye}.png{query}", source.open.id, trace.step);
        let position_text = found.map_or_else(
            || "the target was not found in it".to_owned(),
            |pixel| format!("the target is at pixel {:.1}, {:.1}", pixel.x, pixel.y),
        );
        let words = format!("The {eye} image of the stop, {width} × {height} pixels; {position_text}.");
        let _ = writeln!(
            html,
            "<figure><img src=\"{path}\" width=\"{width}\" height=\"{height}\" loading=\"lazy\" alt=\"{words}\"><figcaption>{words}</figcaption></figure>"
        );
    }
    html.push_str("</div>\n");
    Ok(html)
}

/// Every gate with value, limit and margin.
fn verdict(trace: &RunStep) -> String {
    let mut html = "<h2>Verdict</h2>\n".to_owned();
    let Some(verdict) = trace.verdict() else {
        html.push_str(
            "<p>Nothing was judged: the target was designated here, or the stop's files are damaged.</p>\n",
        );
        return html;
    };
    let word = if verdict.accepted {
        "<span class=\"good\">accepted</span>"
    } else {
        "<span class=\"bad\">rejected</span>"
    };
    let reason = verdict.reason.as_ref().map_or_else(String::new, |reason| format!(": {}", escape(reason)));
    let _ = writeln!(
        html,
        "<p>The update was {word}{reason}. The state was {} and is {}.</p>",
        verdict.state_before.word(),
        verdict.state.word()
    );
    let number = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), sightline_session::format::number);
    let rows: Vec<Vec<String>> = verdict
        .gates
        .iter()
        .map(|gate| {
            vec![
                format!("{}. {}", gate.criterion, gate.name.replace('_', " ")),
                number(gate.value),
                format!(
                    "{} {}",
                    if gate.at_least { "at least" } else { "at most" },
                    sightline_session::format::number(gate.limit)
                ),
                number(gate.margin),
                gate.unit.clone(),
                if gate.passed { "pass".to_owned() } else { "fail".to_owned() },
            ]
        })
        .collect();
    html.push_str(&table(
        "Gates; a positive margin is the distance by which the value passes its limit.",
        &["criterion", "value", "limit", "margin", "unit", "verdict"],
        &rows,
    ));
    html
}

/// Fields omitted from the tables of stages: camera models, and the gates, which have their own table.
const LEFT_OUT: [&str; 4] = ["left", "right", "camera", "gates"];

/// The record of every stage; of the stages of `locate`, those that were reached.
fn stages(trace: &RunStep) -> String {
    let mut html = "<h2>Stages</h2>\n".to_owned();
    for stage in records::stages() {
        let schema = stage.schema();
        if schema.path.is_empty() || schema.stage == "truth" {
            continue;
        }
        let is_step = schema.path.starts_with("locate.");
        let name = if is_step { format!("locate: {}", schema.stage) } else { schema.stage.to_string() };
        if stage.is_reached(trace) {
            let caption = format!("{name}: {}", schema.question);
            let rows = values::rows(stage, trace, &LEFT_OUT);
            let _ = write!(html, "<h3>{name}</h3>\n{}", table(&caption, &["name", "value", "unit"], &rows));
        } else if !is_step {
            let _ = writeln!(
                html,
                "<h3>{name}</h3>\n<p class=\"weak\">{} This stage was not reached.</p>",
                schema.question
            );
        }
    }
    html
}

/// The comparison with the ground truth.
fn truth(trace: &RunStep) -> String {
    let mut html = "<h2>Error against the truth</h2>\n".to_owned();
    match records::stage("truth").filter(|truth| truth.is_reached(trace)) {
        Some(truth) => {
            let caption = "The estimate against the truth; positions in the rover frame.";
            let rows = values::rows(truth, trace, &[]);
            html.push_str(&table(caption, &["name", "value", "unit"], &rows));
        }
        None => html.push_str("<p>The truth of this step is not known.</p>\n"),
    }
    html
}
