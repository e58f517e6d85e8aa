//! The tracking state of every step: as a band over time, and as a line of the log with the reason.

use rerun::{RecordingStream, StateChange, StateConfiguration, TextDocument, TextLog, TextLogLevel};
use sightline_track::target::TrackingState;
use sightline_track::trace::StepTrace;

use super::Logged;
use super::palette::{FAILED, color, of_state};
use super::step::{Step, path};

/// The state after the step.
pub(super) fn log_state(step: &Step<'_>) -> Logged {
    step.log("/{target}/judge/state", Some(StateChange::single(step.trace.update.state.word())))
}

/// The verdict in words, with the reason of a rejection.
pub(super) fn log_verdict(step: &Step<'_>) -> Logged {
    let rgb = if step.trace.fault().is_some() { FAILED } else { of_state(step.trace.update.state) };
    let words = format!("{}, {}", step.label, sentence(step.trace));
    let line = TextLog::new(words).with_level(level(step.trace)).with_color(color(rgb));
    step.log("/{target}/judge/verdict", Some(line))
}

/// The colours of the states.
pub(super) fn log_styles(stream: &RecordingStream, root: &str) -> Logged {
    let states = [
        TrackingState::Cleared,
        TrackingState::Tracking,
        TrackingState::Lost { count: 1 },
        TrackingState::Failed,
    ];
    let configuration = StateConfiguration::new()
        .with_values(states.map(TrackingState::word))
        .with_colors(states.map(|state| color(of_state(state))));
    stream.log_static(path("/{target}/judge/state", root), &configuration)
}

/// The label of the run and the designation of its target.
pub(super) fn log_run(stream: &RecordingStream, root: &str, label: &str, first: &StepTrace) -> Logged {
    let at = first.update.target.designation;
    let text = format!(
        "# {label}\nDesignated at step {} at pixel ({:.2}, {:.2}) of the left image, {:.2} m away.",
        at.step, at.pixel.x, at.pixel.y, first.update.target.initial_distance_m
    );
    stream.log_static(path("/{target}", root), &TextDocument::from_markdown(text))
}

fn sentence(trace: &StepTrace) -> String {
    let state = match trace.update.state {
        TrackingState::Lost { count } => format!("lost ({count} in a row)"),
        state => state.word().to_owned(),
    };
    let why = trace.why_incomplete().or_else(|| trace.verdict().and_then(|v| v.reason.clone()));
    match why {
        Some(why) => format!("step {}: {state}: {why}", trace.step),
        None if trace.verdict().is_none() => format!("step {}: designated", trace.step),
        None => format!("step {}: {state}", trace.step),
    }
}

/// A fault of the files is an error in any state, because it can be repaired.
fn level(trace: &StepTrace) -> &'static str {
    match trace.update.state {
        _ if trace.fault().is_some() => TextLogLevel::ERROR,
        TrackingState::Cleared => TextLogLevel::DEBUG,
        TrackingState::Tracking => TextLogLevel::INFO,
        TrackingState::Lost { .. } => TextLogLevel::WARN,
        TrackingState::Failed => TextLogLevel::ERROR,
    }
}
