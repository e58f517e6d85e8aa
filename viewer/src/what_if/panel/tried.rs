//! What is tried at the step, else what the run had there.

use sightline_geometry::frames::Pixel;
use sightline_track::trace::StepTrace;

use crate::state::State;

/// Where the prediction is, tried or recorded.
pub(super) fn predicted(state: &State, trace: &StepTrace) -> Option<Pixel> {
    let tried = state.trial().and_then(|trial| trial.what_if.prediction_px);
    tried.or(trace.point_mast.predicted_left)
}

/// An odd setting of the template, tried or as in the run.
pub(super) fn side(state: &State, key: &str) -> Option<u64> {
    state.tried_setting("template", key).and_then(|value| value.as_u64())
}
