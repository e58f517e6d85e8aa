//! A step that is paused between two stages.

use sightline_track::locate::Located;
use sightline_track::stages::capture::Capture;
use sightline_track::stages::judge::Verdict;
use sightline_track::stages::point_mast::Pointing;
use sightline_track::stages::predict::Prediction;
use sightline_track::stages::update::Updated;
use sightline_track::target::{Target, TrackingState};
use sightline_track::trace::{StepKind, StepTrace};

/// What every step has that is paused between two stages.
pub(crate) struct Begun<'a> {
    pub(crate) step: usize,
    pub(crate) time_s: f64,
    pub(crate) predict: &'a Prediction,
    pub(crate) point_mast: &'a Pointing,
    pub(crate) carried: &'a Target,
    pub(crate) last: &'a Updated,
}

impl Begun<'_> {
    /// The step with the results so far.
    pub(crate) fn trace(
        &self,
        is_mast_pointed: bool,
        capture: Option<Capture>,
        locate: Option<Located>,
        judge: Option<Verdict>,
    ) -> StepTrace {
        let predict = self.predict.clone();
        StepTrace {
            step: self.step,
            time_s: self.time_s,
            point_mast: self.point_mast.clone(),
            kind: StepKind::Begun { predict, is_mast_pointed, capture, locate, judge },
            update: unseen(self.carried.clone(), self.last.state),
        }
    }
}

/// The update of a stop without images: the target is where the prediction puts it, the state stays.
pub(crate) fn unseen(carried: Target, state: TrackingState) -> Updated {
    Updated { target: carried, state, template_renewed: false, correction_m: None, correction_px: None }
}
