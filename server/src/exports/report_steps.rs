//! The steps that a report shows with pictures: where the target was lost first, and why, and the worst ones.

use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use sightline_session::step::{RunStep, StepRow};
use sightline_session::why::Book;

use super::source::{NamedRun, Source};
use super::{picture, sheet};
use crate::html::{escape, png_address};
use crate::problem::{ApiError, ApiResult};

/// How many steps are called the worst.
const WORST: usize = 5;

/// The headings, sentences and pictures of these steps.
///
/// # Errors
/// A problem when it is cancelled or a picture cannot be drawn.
pub(super) fn html(source: &Source, run: NamedRun<'_>, cancel: &AtomicBool) -> ApiResult<String> {
    let steps = &run.run.steps;
    let figure = |place: usize| -> ApiResult<String> {
        let drawn = sheet::picture_of(source, run, place, None, cancel)?;
        Ok(figure_of(&steps[place], &drawn.png().map_err(ApiError::internal)?))
    };
    let mut text = String::new();
    let lost = steps.iter().position(|step| is_lost(&step.row()));
    match lost {
        Some(place) => {
            let heading = format!("First loss: step {}", steps[place].step);
            let sentence = escape(&why(source, run, place)?);
            let _ = writeln!(text, "<h3>{heading}</h3>\n<p>{sentence}</p>\n{}", figure(place)?);
        }
        None => text.push_str("<p>The target was not lost at any step.</p>\n"),
    }
    let worst = worst(steps, lost);
    if worst.is_empty() {
        return Ok(text);
    }
    text.push_str("<h3>Worst steps</h3>\n<div class=\"row\">");
    for place in worst {
        text.push_str(&figure(place)?);
    }
    let _ = writeln!(text, "</div>\n<p class=\"at\">{}</p>", escape(picture::LEGEND));
    Ok(text)
}

/// The verdict of a step with its root cause, in the sentences that the page and REST give.
fn why(source: &Source, run: NamedRun<'_>, place: usize) -> ApiResult<String> {
    let trace = &run.run.steps[place];
    let book = Book {
        trace,
        before: place.checked_sub(1).map(|before| run.run.steps[before].as_ref()),
        settings: &run.run.settings,
        prediction_px: run.run.displaced_at(trace.step),
        sources: &source.open.traverse,
    };
    Ok(book.explain(None)?.sentence)
}

/// The picture of a step with its verdict.
fn figure_of(trace: &RunStep, png: &[u8]) -> String {
    let row = trace.row();
    let words = format!(
        "Step {}, {}: {}.",
        row.step,
        picture::state_words(trace).to_lowercase(),
        picture::numbers(&row)
    );
    let reason = row.reason.unwrap_or_else(|| "The update was accepted".to_owned());
    format!(
        "<figure><img src=\"{}\" width=\"320\" alt=\"{}\"><figcaption>{}</figcaption></figure>",
        png_address(png),
        escape(&format!("The target in the left image. {words}")),
        escape(&format!("Step {}. {}.", row.step, reason.trim_end_matches('.')))
    )
}

/// The worst steps of a run but `shown`, by their place in it, the worst first: by the error in the image where the truth is
/// known; otherwise those that are lost, then those with the least score.
fn worst(steps: &[Arc<RunStep>], shown: Option<usize>) -> Vec<usize> {
    let mut places: Vec<(usize, f64)> = steps
        .iter()
        .enumerate()
        .skip(usize::from(steps.len() > 1))
        .filter(|(place, _)| Some(*place) != shown)
        .map(|(place, trace)| (place, badness(&trace.row())))
        .collect();
    places.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    places.into_iter().take(WORST).map(|(place, _)| place).collect()
}

/// The badness of a step. Lost steps without a position are worst; scores order the steps without truth.
fn badness(row: &StepRow) -> f64 {
    let lost = if is_lost(row) { 1e6 } else { 0.0 };
    match row.err_px.or(row.err_m.map(|error| 100.0 * error)) {
        Some(error) => error,
        None => lost + 1.0 - row.ncc.or(row.confidence).unwrap_or(0.0),
    }
}

fn is_lost(row: &StepRow) -> bool {
    matches!(row.state.as_str(), "lost" | "failed")
}
