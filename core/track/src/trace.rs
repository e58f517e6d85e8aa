//! The results of one step: the return values of the six stages, side by side.
//!
//! The debugger is a view of this record. The fields, also those of [`StepKind`], have the names of the stages;
//! arrays are fetched one by one by [`ArrayName`]. `session::step` adds the comparison with the truth and the
//! serialised form.

mod arrays;
mod memory;

pub use crate::array_name::ArrayName;
pub use sightline_record::ArrayView;

use crate::cycle_stage::CycleStage;
use crate::locate::Located;
use crate::locate::features::FeatureEvidence;
use crate::locate::shape_tracker::ShapeEvidence;
use crate::locate::template::TemplateEvidence;
use crate::stages::capture::Capture;
use crate::stages::judge::Verdict;
use crate::stages::point_mast::Pointing;
use crate::stages::predict::Prediction;
use crate::stages::update::Updated;
use sightline_geometry::estimate::error_budget::{Approach, ErrorBudget, StereoPair};

/// The results of the stages at one step of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct StepTrace {
    /// The stop, from 0.
    pub step: usize,
    /// Time since the first stop, s.
    pub time_s: f64,
    /// Stage 2; at a step that is paused before it, the cameras with the mast as it is (see [`StepTrace::pointing`]).
    pub point_mast: Pointing,
    /// The results of the stages that not every step reaches.
    pub kind: StepKind,
    /// Stage 6; at a step that is paused before it, the target carried by the prediction (see [`StepTrace::updated`]).
    pub update: Updated,
}

/// The kind of a step, with the results of the stages that it reached.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "nearly every step is tracked: the others waste little")]
pub enum StepKind {
    /// The stop at which a user designated the target: nothing is predicted or judged.
    Designation {
        /// Stage 3.
        capture: Capture,
        /// Stage 4.
        locate: Located,
    },
    /// A later stop, at which every stage has a result.
    Tracked {
        /// Stage 1.
        predict: Prediction,
        /// Stage 3.
        capture: Capture,
        /// Stage 4.
        locate: Located,
        /// Stage 5.
        judge: Verdict,
    },
    /// A later stop of a drive at which visual odometry runs alone: the target is carried by the prediction.
    OdometryAlone {
        /// Stage 1.
        predict: Prediction,
    },
    /// A later stop of a drive at which the mast is pointed at another target, and this one is out of view: it is carried by the
    /// prediction.
    OutOfView {
        /// Stage 1.
        predict: Prediction,
    },
    /// A later stop whose files are damaged, or that lacks the target's pair: the target is carried by the prediction.
    Damaged {
        /// Stage 1.
        predict: Prediction,
        /// The damage of the stop's files, or the missing pair, as one sentence.
        fault: String,
    },
    /// A later stop at which a commanded drive is paused between two stages: the results of the stages before the pause.
    ///
    /// The whole step, computed from the same inputs, replaces it when the drive continues.
    Begun {
        /// Stage 1.
        predict: Prediction,
        /// Whether stage 2 was reached.
        is_mast_pointed: bool,
        /// Stage 3.
        capture: Option<Capture>,
        /// Stage 4.
        locate: Option<Located>,
        /// Stage 5.
        judge: Option<Verdict>,
    },
}

/// Why a stop for odometry alone has no match.
const ODOMETRY_ALONE: &str = "visual odometry ran alone, and the position is the prediction";

/// Why a stop at which the mast is pointed at another target has no match.
const OUT_OF_VIEW: &str =
    "the mast is pointed at another target and this one is out of view; the position is the prediction";

impl StepTrace {
    /// Stage 1; `None` at the designation.
    pub const fn prediction(&self) -> Option<&Prediction> {
        match &self.kind {
            StepKind::Designation { .. } => None,
            StepKind::Tracked { predict, .. }
            | StepKind::OdometryAlone { predict }
            | StepKind::OutOfView { predict }
            | StepKind::Damaged { predict, .. }
            | StepKind::Begun { predict, .. } => Some(predict),
        }
    }

    /// The first stage that is not computed, at a step of a paused drive; `None` for a whole step.
    pub const fn paused_before(&self) -> Option<CycleStage> {
        let StepKind::Begun { is_mast_pointed, capture, locate, judge, .. } = &self.kind else { return None };
        Some(match (is_mast_pointed, capture, locate, judge) {
            (false, ..) => CycleStage::PointMast,
            (true, None, ..) => CycleStage::Capture,
            (true, Some(_), None, _) => CycleStage::Locate,
            (true, Some(_), Some(_), None) => CycleStage::Judge,
            (true, Some(_), Some(_), Some(_)) => CycleStage::Update,
        })
    }

    /// Whether visual odometry ran alone at the stop, so that the tracker did not search for the target.
    pub const fn is_odometry_alone(&self) -> bool {
        matches!(self.kind, StepKind::OdometryAlone { .. })
    }

    /// Whether the mast is pointed at another target and this one is out of view.
    pub const fn is_out_of_view(&self) -> bool {
        matches!(self.kind, StepKind::OutOfView { .. })
    }

    /// Why the tracker did not search for the target, which is no failure; `None` if it did.
    pub const fn why_not_searched(&self) -> Option<&'static str> {
        match self.kind {
            StepKind::OdometryAlone { .. } => Some(ODOMETRY_ALONE),
            StepKind::OutOfView { .. } => Some(OUT_OF_VIEW),
            _ => None,
        }
    }

    /// Whether a step of a paused drive lacks stages.
    pub const fn is_begun(&self) -> bool {
        matches!(self.kind, StepKind::Begun { .. })
    }

    /// Stage 2; `None` at a step that is paused before it.
    pub const fn pointing(&self) -> Option<&Pointing> {
        match &self.kind {
            StepKind::Begun { is_mast_pointed: false, .. } => None,
            _ => Some(&self.point_mast),
        }
    }

    /// Stage 6; `None` at a step that is paused before it.
    pub const fn updated(&self) -> Option<&Updated> {
        if self.is_begun() { None } else { Some(&self.update) }
    }

    /// Stage 3; `None` if the stop's files are damaged, no search was made, or the drive is paused before it.
    pub const fn capture(&self) -> Option<&Capture> {
        match &self.kind {
            StepKind::Designation { capture, .. } | StepKind::Tracked { capture, .. } => Some(capture),
            StepKind::Begun { capture, .. } => capture.as_ref(),
            StepKind::OdometryAlone { .. } | StepKind::OutOfView { .. } | StepKind::Damaged { .. } => None,
        }
    }

    /// Mutable result of stage 3; see [`StepTrace::capture`].
    pub const fn capture_mut(&mut self) -> Option<&mut Capture> {
        match &mut self.kind {
            StepKind::Designation { capture, .. } | StepKind::Tracked { capture, .. } => Some(capture),
            StepKind::Begun { capture, .. } => capture.as_mut(),
            StepKind::OdometryAlone { .. } | StepKind::OutOfView { .. } | StepKind::Damaged { .. } => None,
        }
    }

    /// Stage 4; `None` if the stop's files are damaged, no search was made, or the drive is paused before it.
    pub const fn located(&self) -> Option<&Located> {
        match &self.kind {
            StepKind::Designation { locate, .. } | StepKind::Tracked { locate, .. } => Some(locate),
            StepKind::Begun { locate, .. } => locate.as_ref(),
            StepKind::OdometryAlone { .. } | StepKind::OutOfView { .. } | StepKind::Damaged { .. } => None,
        }
    }

    /// Mutable result of stage 4; see [`StepTrace::located`].
    pub const fn located_mut(&mut self) -> Option<&mut Located> {
        match &mut self.kind {
            StepKind::Designation { locate, .. } | StepKind::Tracked { locate, .. } => Some(locate),
            StepKind::Begun { locate, .. } => locate.as_mut(),
            StepKind::OdometryAlone { .. } | StepKind::OutOfView { .. } | StepKind::Damaged { .. } => None,
        }
    }

    /// Stage 5; `None` at the designation, and in the cases of [`StepTrace::capture`].
    pub const fn verdict(&self) -> Option<&Verdict> {
        match &self.kind {
            StepKind::Tracked { judge, .. } => Some(judge),
            StepKind::Begun { judge, .. } => judge.as_ref(),
            StepKind::Designation { .. }
            | StepKind::OdometryAlone { .. }
            | StepKind::OutOfView { .. }
            | StepKind::Damaged { .. } => None,
        }
    }

    /// The damage of the stop's files, or the missing pair, as one sentence; `None` without a fault.
    pub fn fault(&self) -> Option<&str> {
        match &self.kind {
            StepKind::Damaged { fault, .. } => Some(fault),
            _ => None,
        }
    }

    /// Why the step lacks stages: the damage of the stop's files, the pause of the drive, or a stop without a search;
    /// `None` for a complete step.
    pub fn why_incomplete(&self) -> Option<String> {
        let paused =
            |before: CycleStage| format!("not computed yet: the drive is paused before `{}`", before.word());
        let not_searched = self.why_not_searched().map(str::to_owned);
        self.fault().map(str::to_owned).or_else(|| self.paused_before().map(paused)).or(not_searched)
    }

    /// The evidence of the template locator; `None` without stage 4.
    pub fn template(&self) -> Option<&TemplateEvidence> {
        self.located().and_then(|located| located.evidence.template())
    }

    /// The evidence of the feature locator; `None` without stage 4, or if the tracker does not use features.
    pub fn features(&self) -> Option<&FeatureEvidence> {
        self.located().and_then(|located| located.evidence.features())
    }

    /// The evidence of the shape tracker; `None` without stage 4, or if the tracker does not use the shape.
    pub fn shape(&self) -> Option<&ShapeEvidence> {
        self.located().and_then(|located| located.evidence.shape())
    }

    /// Estimated distance from the left camera, m.
    pub fn range_m(&self) -> f64 {
        (self.update.target.position_in_rover - self.point_mast.left.model.centre()).norm()
    }

    /// The paper's error budget at this step's range, for tracking that drifts by half a pixel of the first image (R40).
    pub fn budget(&self) -> Option<ErrorBudget> {
        let pointing = &self.point_mast;
        let pixel = pointing.predicted_left.unwrap_or_else(|| pointing.left.centre_pixel());
        let pair = StereoPair::from_cameras(&pointing.left, &pointing.right, pixel)?;
        let (start_m, end_m) = (self.update.target.initial_distance_m, self.range_m());
        let drift_px = 0.5 * start_m / end_m;
        Some(pair.budget(&Approach { start_m, end_m, drift_px, ..Approach::default() }))
    }
}
