//! The verdict on a whole run against the truth.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::step::RunStep;
use sightline_track::target::TrackingState;

/// The verdict on a whole run against the truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Summary {
    /// Number of steps, the designation included.
    pub steps: usize,
    /// Steps at which the tracker did not search for the target: visual odometry ran alone, or the mast was pointed at
    /// another target and this one was out of view.
    pub steps_not_searched: usize,
    /// Steps that were tracked; null without truth.
    pub steps_tracked: Option<usize>,
    /// Steps in state `lost` or `failed`.
    pub steps_lost: usize,
    /// Steps in state `tracking` that were not tracked; null without truth.
    pub false_tracked: Option<usize>,
    /// Steps lost or failed whose evidence was right; null without truth.
    pub false_lost: Option<usize>,
    /// Whether the last step was tracked; null without truth.
    pub run_tracked: Option<bool>,
    /// Error of the last searched step, px; null without truth or position.
    pub final_err_px: Option<f64>,
    /// Error of the last searched step, m; null without truth.
    pub final_err_m: Option<f64>,
}

/// Computes the verdict on a run.
pub fn summarise<'a>(steps: impl IntoIterator<Item = &'a RunStep>) -> Summary {
    let mut summary = Summary::default();
    for step in steps {
        summary.steps += 1;
        if step.why_not_searched().is_some() {
            summary.steps_not_searched += 1;
            continue;
        }
        summary.steps_lost += usize::from(step.update.state.is_lost());
        let Some(truth) = &step.truth else { continue };
        let tracking = step.update.state == TrackingState::Tracking;
        *summary.steps_tracked.get_or_insert(0) += usize::from(truth.tracked == Some(true));
        *summary.false_tracked.get_or_insert(0) += usize::from(tracking && truth.tracked == Some(false));
        *summary.false_lost.get_or_insert(0) += usize::from(step.is_false_loss());
        summary.run_tracked = truth.tracked;
        summary.final_err_px = truth.err_px;
        summary.final_err_m = Some(truth.err_m);
    }
    summary
}
