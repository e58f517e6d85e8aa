//! Rows of a run, and the words for them.

use sightline_session::step::StepRow;
use sightline_session::view::RunView;
use sightline_track::target::TrackingState;

/// The row of a step of a run.
pub(crate) fn row_of(run: &RunView, step: usize) -> Option<&StepRow> {
    let first = run.rows.first()?.step;
    run.rows.get(step.checked_sub(first)?)
}

/// The steps at which a run's state changes, its designation and its faults included.
pub(crate) fn events(run: &RunView) -> Vec<usize> {
    let mut events: Vec<usize> = run.rows.first().map(|row| row.step).into_iter().collect();
    for pair in run.rows.windows(2) {
        if pair[0].state != pair[1].state || pair[1].fault {
            events.push(pair[1].step);
        }
    }
    events
}

/// The tracking state of a row, with its recorded count of rejected updates.
pub(crate) fn state_of(row: &StepRow) -> TrackingState {
    match row.state.as_str() {
        "tracking" => TrackingState::Tracking,
        // Rows of sessions that were stored without the count have at least one rejected update.
        "lost" => TrackingState::Lost { count: row.lost_count.unwrap_or(1) },
        "failed" => TrackingState::Failed,
        _ => TrackingState::Cleared,
    }
}

/// The letter of a run.
pub(crate) fn run_letter(number: usize) -> String {
    let letter = char::from(b'A' + (number % 26) as u8);
    if number < 26 { letter.to_string() } else { format!("{letter}{}", number / 26) }
}
