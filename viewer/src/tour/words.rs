//! The texts of the tour's bubbles.

use crate::panels::numbers::counted;
use crate::state::State;
use crate::tour::Bubble;

impl Bubble {
    /// The text of the bubble in this state.
    pub fn words(self, state: &State) -> String {
        match self {
            Self::Step => format!(
                "A rover drives towards a rock and finds one point of it again at each of {}. ← and → go from stop to \
                 stop, End to the last; the band shows the tracking state of each.",
                counted(state.stop_count(), "stop")
            ),
            Self::Lost => lost_words(state),
            Self::Why => "The panel Why (W) explains this step: why the match was rejected, the margin of every gate, and the \
                origin of any number."
                .to_owned(),
            Self::WhatIf => "The page now searches (C) for the smallest change of one setting that would have kept the target, and \
                tests each by computing the step. Run makes a branch with that change; the first run stays as it is."
                .to_owned(),
            Self::Compare => "Once there is a second run, choose it after vs in the top bar: its marks and \
                differences appear everywhere. D goes to where the two first differ, V to the next way of laying the images beside each \
                other; the arrangement Compare (Shift+5) lists the metrics of each run."
                .to_owned(),
            Self::Share => "Y copies a link to what you see, M pins a note to it, and Export (Ctrl+S) has recordings, \
                tables and a report. The sheet behind the question mark has all keys, and this tour."
                .to_owned(),
        }
    }
}

/// Where the target is lost, if known so far.
fn lost_words(state: &State) -> String {
    match (state.lost_step(), state.run_progress(), state.target()) {
        (Some(step), ..) => {
            format!(
                "The target is lost at step {step}, which is shown now. PgDn goes to the next event, PgUp to the previous one."
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
