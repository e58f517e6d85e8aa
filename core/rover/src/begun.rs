//! A step that ends early: paused between two stages, or at a stop without images for the tracker.

use sightline_track::locate::Located;
use sightline_track::stages::capture::Capture;
use sightline_track::stages::judge::Verdict;
use sightline_track::stages::point_mast::Pointing;
use sightline_track::stages::predict::Prediction;
use sightline_track::stages::update::Updated;
use sightline_track::target::Target;
use sightline_track::trace::{StepKind, StepTrace};

/// Parts that every such step has.
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
        self.unseen(StepKind::Begun { predict, is_mast_pointed, capture, locate, judge })
    }

    /// The step of a stop at which only visual odometry runs.
    pub(crate) fn odometry_alone(&self) -> StepTrace {
        self.unseen(StepKind::OdometryAlone { predict: self.predict.clone() })
    }

    /// The step of a stop at which the mast is pointed at another target, and this one is out of view.
    pub(crate) fn out_of_view(&self) -> StepTrace {
        self.unseen(StepKind::OutOfView { predict: self.predict.clone() })
    }

    /// The step of a stop whose images are missing or damaged.
    pub(crate) fn damaged(&self, fault: String) -> StepTrace {
        self.unseen(StepKind::Damaged { predict: self.predict.clone(), fault })
    }

    /// A step without an update: the target is at its predicted position, the state is unchanged.
    fn unseen(&self, kind: StepKind) -> StepTrace {
        let update = Updated {
            target: self.carried.clone(),
            state: self.last.state,
            template_renewed: false,
            correction_m: None,
            correction_px: None,
        };
        let Self { step, time_s, .. } = *self;
        StepTrace { step, time_s, point_mast: self.point_mast.clone(), kind, update }
    }
}
