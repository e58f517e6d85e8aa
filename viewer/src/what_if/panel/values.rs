//! The values at the step: of the trial, otherwise of the run.

use sightline_geometry::frames::Pixel;
use sightline_track::trace::StepTrace;

use crate::state::State;

/// The predicted pixel, of the trial or as recorded.
pub(super) fn predicted(state: &State, trace: &StepTrace) -> Option<Pixel> {
    let tried = state.trial().and_then(|trial| trial.what_if.prediction_px);
    tried.or(trace.point_mast.predicted_left)
}

/// A side length of the template settings, of the trial or of the run, px.
pub(super) fn side(state: &State, key: &str) -> Option<u64> {
    state.trial_setting("template", key).and_then(|value| value.as_u64())
}
