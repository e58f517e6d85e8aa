//! Rows of a run and the words for them.

use sightline_core::session::view::RunView;
use sightline_core::target::TrackingState;
use sightline_core::trace::StepRow;

/// A step of a run as one line.
pub fn row_of(run: &RunView, step: usize) -> Option<&StepRow> {
    let first = run.rows.first()?.step;
    run.rows.get(step.checked_sub(first)?)
}

/// The steps at which a run's state changes, its designation and its faults included.
pub fn events(run: &RunView) -> Vec<usize> {
    let mut events: Vec<usize> = run.rows.first().map(|row| row.step).into_iter().collect();
    for pair in run.rows.windows(2) {
        if pair[0].state != pair[1].state || pair[1].fault {
            events.push(pair[1].step);
        }
    }
    events
}

/// The state that a row's word names.
pub fn state_of_word(word: &str) -> TrackingState {
    match word {
        "tracking" => TrackingState::Tracking,
        "lost" => TrackingState::Lost { count: 1 },
        "failed" => TrackingState::Failed,
        _ => TrackingState::Cleared,
    }
}

/// The letter of a run.
pub fn run_letter(number: usize) -> String {
    let letter = char::from(b'A' + (number % 26) as u8);
    if number < 26 { letter.to_string() } else { format!("{letter}{}", number / 26) }
}
