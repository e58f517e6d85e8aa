//! The steps that a report shows with images: the first step at which the target was lost, with the cause, and the worst
//! steps.

use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use sightline_session::step::{RunStep, StepRow};
use sightline_session::why::Book;

use super::source::{NamedRun, Source};
use super::{sheet, step_image};
use crate::html::{escape, png_address};
use crate::problem::{ApiError, ApiResult};

/// Maximum number of worst steps.
const WORST: usize = 5;

/// The headings, sentences and images of these steps.
///
/// # Errors
/// A problem when it is cancelled or an image cannot be drawn.
pub(super) fn html(source: &Source, run: NamedRun<'_>, cancel: &AtomicBool) -> ApiResult<String> {
    let steps = &run.run.steps;
    let figure = |index: usize| -> ApiResult<String> {
        let drawn = sheet::draw_step(source, run, index, None, cancel)?;
        Ok(figure_of(&steps[index], &drawn.png().map_err(ApiError::internal)?))
    };
    let mut text = String::new();
    let lost = steps.iter().position(|step| is_lost(&step.row()));
    match lost {
        Some(index) => {
            let heading = format!("First loss: step {}", steps[index].step);
            let sentence = escape(&why(source, run, index)?);
            let _ = writeln!(text, "<h3>{heading}</h3>\n<p>{sentence}</p>\n{}", figure(index)?);
        }
        None => text.push_str("<p>The target was not lost at any step.</p>\n"),
    }
    let worst = worst(steps, lost);
    if worst.is_empty() {
        return Ok(text);
    }
    text.push_str("<h3>Worst steps</h3>\n<div class=\"row\">");
    for index in worst {
        text.push_str(&figure(index)?);
    }
    let _ = writeln!(text, "</div>\n<p class=\"at\">{}</p>", escape(step_image::LEGEND));
    Ok(text)
}

/// The verdict of a step with its root cause, in the same words as in the page and in REST.
fn why(source: &Source, run: NamedRun<'_>, index: usize) -> ApiResult<String> {
    let trace = &run.run.steps[index];
    let book = Book {
        trace,
        before: index.checked_sub(1).map(|before| run.run.steps[before].as_ref()),
        settings: &run.run.settings,
        prediction_px: run.run.displaced_at(trace.step),
        sources: &source.open.traverse,
    };
    Ok(book.explain(None)?.sentence)
}

/// The image of a step with its verdict.
fn figure_of(trace: &RunStep, png: &[u8]) -> String {
    let row = trace.row();
    let words = format!(
        "Step {}, {}: {}.",
        row.step,
        step_image::state_words(trace).to_lowercase(),
        step_image::numbers(&row)
    );
    let reason = row.reason.unwrap_or_else(|| "The update was accepted".to_owned());
    format!(
        "<figure><img src=\"{}\" width=\"320\" alt=\"{}\"><figcaption>{}</figcaption></figure>",
        png_address(png),
        escape(&format!("The target in the left image. {words}")),
        escape(&format!("Step {}. {}.", row.step, reason.trim_end_matches('.')))
    )
}

/// Indices of the worst steps of a run except `shown`, worst first: lost steps before tracked ones, each ordered by their
/// error if the ground truth is known, otherwise by ascending score.
fn worst(steps: &[Arc<RunStep>], shown: Option<usize>) -> Vec<usize> {
    let rows: Vec<(usize, StepRow)> = steps
        .iter()
        .enumerate()
        .skip(usize::from(steps.len() > 1))
        .filter(|(index, _)| Some(*index) != shown)
        .map(|(index, trace)| (index, trace.row()))
        .collect();
    worst_first(rows).into_iter().take(WORST).collect()
}

/// The indices of the rows, worst first.
fn worst_first(mut rows: Vec<(usize, StepRow)>) -> Vec<usize> {
    rows.sort_by(|(a_index, a), (b_index, b)| {
        let by_state = is_lost(b).cmp(&is_lost(a));
        by_state.then(badness(b).total_cmp(&badness(a))).then(a_index.cmp(b_index))
    });
    rows.into_iter().map(|(index, _)| index).collect()
}

/// The badness of a step among those of the same state: its error, px or cm, or 1 − score without ground truth.
fn badness(row: &StepRow) -> f64 {
    let error = row.err_px.or(row.err_m.map(|error| 100.0 * error));
    error.unwrap_or_else(|| 1.0 - row.ncc.or(row.confidence).unwrap_or(0.0))
}

fn is_lost(row: &StepRow) -> bool {
    matches!(row.state.as_str(), "lost" | "failed")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(step: usize, state: &str, err_px: Option<f64>, ncc: Option<f64>) -> (usize, StepRow) {
        let json = serde_json::json!({ "step": step, "state": state, "err_px": err_px, "ncc": ncc,
            "position_in_rover": [1, 2, 3], "covariance_in_rover": [1, 0, 0, 0, 1, 0, 0, 0, 1] });
        (step, serde_json::from_value(json).unwrap())
    }

    #[test]
    fn lost_steps_rank_worse_than_tracked_ones() {
        let rows = vec![
            row(0, "tracking", Some(40.0), None),
            row(1, "lost", Some(0.3), None),
            row(2, "tracking", None, Some(0.9)),
            row(3, "failed", None, Some(0.2)),
            row(4, "tracking", Some(2.0), None),
        ];
        assert_eq!(worst_first(rows), [3, 1, 0, 4, 2]);
    }
}
