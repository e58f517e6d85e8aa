//! What the bubbles of the tour say of what is there.

use crate::state::{State, events};
use crate::tour::Bubble;

impl Bubble {
    /// What it says of what is there.
    pub fn words(self, state: &State) -> String {
        match self {
            Self::Step => format!(
                "A rover drives towards a rock and finds one point of it again at each of {} stops. Right and Left go \
                 from stop to stop, End to the last; the band shows how each ended.",
                state.stop_count()
            ),
            Self::Lost => lost_words(state),
            Self::Why => "Go there and press W: the panel Why says in one sentence why the match was rejected, \
                lists every criterion with its margin, and follows any number back to where it came from."
                .to_owned(),
            Self::WhatIf => "Press C there: the page looks for the smallest change of one setting that would have \
                kept the target, and tries each by computing the step. Run from here makes a branch with it; nothing \
                that was recorded is overwritten."
                .to_owned(),
            Self::Compare => "Choose the other run after vs in the top bar: its marks and differences appear \
                everywhere. D goes to where the two first differ, V to the next way of laying the images beside each \
                other; the panel Runs has what each is worth."
                .to_owned(),
            Self::Share => "Y copies a link to what you see, M pins a note to it, and Export (Ctrl+S) has recordings, \
                tables and a report. The sheet behind the question mark has all keys, and this tour."
                .to_owned(),
        }
    }
}

/// Where the target is lost, as far as that is known.
fn lost_words(state: &State) -> String {
    let lost = state.run().and_then(|run| {
        let is_lost = |step: &usize| state.row_at(*step).is_some_and(|row| row.state == "lost");
        events(run).into_iter().find(is_lost)
    });
    match (lost, state.run_progress(), state.target()) {
        (Some(step), ..) => {
            format!(
                "The target is lost at step {step}. PgDn goes to the next event, PgUp back to the one before."
            )
        }
        (None, Some(progress), _) => format!(
            "The run is still being computed ({} of {} stops). A loss appears in the band in another colour and \
             pattern; PgDn goes to the next event.",
            progress.k, progress.n
        ),
        (None, None, Some(_)) => {
            "No loss in this run. PgDn goes from event to event, wherever a state changes.".to_owned()
        }
        (None, None, None) => {
            "Without a target there is nothing to lose: press T and click a rock in the left image."
                .to_owned()
        }
    }
}
