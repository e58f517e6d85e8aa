//! What one step saw and decided: the return values of the six stages, side by side.
//!
//! The debugger is a view of this record. The fields bear the stages' names, those of [`StepKind`] too; arrays are left out
//! of the serialised form (`serialised`) and fetched one by one under the names of [`ArrayName`].

mod arrays;
mod row;
mod serialised;

pub use self::row::StepRow;
pub use crate::array_name::ArrayName;
pub use sightline_record::ArrayView;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::locate::Located;
use crate::locate::features::FeatureEvidence;
use crate::locate::shape_tracker::ShapeEvidence;
use crate::locate::template::TemplateEvidence;
use crate::stages::capture::Capture;
use crate::stages::judge::{Gate, Verdict};
use crate::stages::point_mast::Pointing;
use crate::stages::predict::Prediction;
use crate::stages::update::Updated;
use sightline_geometry::estimate::error_budget::{Approach, ErrorBudget, StereoPair};
use sightline_geometry::frames::{Pixel, Point3};
use sightline_record::{Declaration, Record, Unit};

/// One step of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct StepTrace {
    /// The stop, from 0.
    pub step: usize,
    /// Time since the first stop, s.
    pub time_s: f64,
    /// Stage 2, which every step reaches.
    pub point_mast: Pointing,
    /// The results of the stages that not every step reaches.
    pub kind: StepKind,
    /// Stage 6.
    pub update: Updated,
    /// The comparison with the truth, where that is known.
    pub truth: Option<StepTruth>,
}

/// The kind of a step, with the results of the stages that it reached.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "nearly every step is tracked: the others waste little")]
pub enum StepKind {
    /// The stop at which a person designated the target: nothing is predicted or judged.
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
    /// A later stop whose files are damaged: the target is carried by the prediction.
    Damaged {
        /// Stage 1.
        predict: Prediction,
        /// The damage of the stop's files, as one sentence.
        fault: String,
    },
}

/// What the truth of a target is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TruthKind {
    /// The surface point under the designated pixel, seen through the true camera.
    Surface,
    /// The first estimate carried by the true poses: what remains is what tracking added (its drift).
    Carried,
}

/// The comparison of one step with the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StepTruth {
    /// What the truth is.
    pub kind: TruthKind,
    /// The true position in the true rover frame of this stop, m.
    #[schema(value_type = [f64; 3])]
    pub position_in_rover: Point3,
    /// The truth in the left image, px; null where it is not visible.
    pub left_pixel: Option<Pixel>,
    /// Distance between estimated and true position in the present rover frame, m.
    pub err_m: f64,
    /// Distance between located and true pixel, px; null where nothing was located or the truth is hidden.
    pub err_px: Option<f64>,
    /// Squared Mahalanobis distance of the error, 3 degrees of freedom; null without a covariance.
    pub nees: Option<f64>,
    /// Magnification since the designation.
    pub magnification: f64,
    /// The error up to which the target counts as tracked, px (R116).
    pub tolerance_px: f64,
    /// Whether the target is tracked: state `tracking` and within the tolerance; null where the truth is hidden.
    pub tracked: Option<bool>,
}

/// The verdict on a whole run against the truth.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Summary {
    /// Steps run, the designation included.
    pub steps: usize,
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
    /// Error of the last step, px.
    pub final_err_px: Option<f64>,
    /// Error of the last step, m.
    pub final_err_m: Option<f64>,
}

impl StepTrace {
    /// Stage 1; `None` at the designation.
    pub const fn prediction(&self) -> Option<&Prediction> {
        match &self.kind {
            StepKind::Designation { .. } => None,
            StepKind::Tracked { predict, .. } | StepKind::Damaged { predict, .. } => Some(predict),
        }
    }

    /// Stage 3; `None` where the stop's files are damaged.
    pub const fn capture(&self) -> Option<&Capture> {
        match &self.kind {
            StepKind::Designation { capture, .. } | StepKind::Tracked { capture, .. } => Some(capture),
            StepKind::Damaged { .. } => None,
        }
    }

    /// The same, to be changed.
    pub const fn capture_mut(&mut self) -> Option<&mut Capture> {
        match &mut self.kind {
            StepKind::Designation { capture, .. } | StepKind::Tracked { capture, .. } => Some(capture),
            StepKind::Damaged { .. } => None,
        }
    }

    /// Stage 4; `None` where the stop's files are damaged.
    pub const fn located(&self) -> Option<&Located> {
        match &self.kind {
            StepKind::Designation { locate, .. } | StepKind::Tracked { locate, .. } => Some(locate),
            StepKind::Damaged { .. } => None,
        }
    }

    /// The same, to be changed.
    pub const fn located_mut(&mut self) -> Option<&mut Located> {
        match &mut self.kind {
            StepKind::Designation { locate, .. } | StepKind::Tracked { locate, .. } => Some(locate),
            StepKind::Damaged { .. } => None,
        }
    }

    /// Stage 5; `None` at the designation and where the stop's files are damaged.
    pub const fn verdict(&self) -> Option<&Verdict> {
        match &self.kind {
            StepKind::Tracked { judge, .. } => Some(judge),
            StepKind::Designation { .. } | StepKind::Damaged { .. } => None,
        }
    }

    /// The damage of the stop's files, as one sentence.
    pub fn fault(&self) -> Option<&str> {
        match &self.kind {
            StepKind::Damaged { fault, .. } => Some(fault),
            StepKind::Designation { .. } | StepKind::Tracked { .. } => None,
        }
    }

    /// The evidence of the template locator, where something was located.
    pub fn template(&self) -> Option<&TemplateEvidence> {
        self.located().and_then(|located| located.evidence.template())
    }

    /// The evidence of the feature locator, where something was located.
    pub fn features(&self) -> Option<&FeatureEvidence> {
        self.located().and_then(|located| located.evidence.features())
    }

    /// The evidence of the shape tracker, where something was located.
    pub fn shape(&self) -> Option<&ShapeEvidence> {
        self.located().and_then(|located| located.evidence.shape())
    }

    /// This step as one line.
    pub fn row(&self) -> StepRow {
        let evidence = self.template();
        let scale_roll = evidence.and_then(|e| e.scale_roll.as_ref());
        let covariance = self.update.target.covariance_in_rover;
        let largest = covariance.symmetric_eigenvalues().max();
        let gate = |name: &str| self.verdict()?.gates.iter().find(|gate| gate.name == name);
        let (distance, position) = (gate("distance_correction_m"), gate("position_correction_m"));
        let budget = self.budget();
        StepRow {
            step: self.step,
            state: self.update.state.word().to_owned(),
            scale: scale_roll.map(|s| s.scale),
            roll_deg: scale_roll.map(|s| s.roll_rad.to_degrees()),
            ncc: evidence.and_then(|e| e.match_template.as_ref()).map(|m| m.score),
            stereo_score: evidence.and_then(|e| e.point_stereo.as_ref()).map(|s| s.score),
            inliers: self.features().and_then(|e| e.fit_motion.as_ref()).map(|motion| motion.inliers),
            confidence: self.located().map(|located| located.confidence),
            err_px: self.truth.as_ref().and_then(|t| t.err_px),
            err_m: self.truth.as_ref().map(|t| t.err_m),
            sigma_m: largest.is_finite().then(|| largest.max(0.0).sqrt()),
            nees: self.truth.as_ref().and_then(|t| t.nees),
            tracked: self.truth.as_ref().and_then(|t| t.tracked),
            position_in_rover: self.update.target.position_in_rover.coords.into(),
            covariance_in_rover: covariance,
            left_pixel: self.located().and_then(|l| l.left_pixel),
            range_m: Some(self.range_m()),
            distance_correction_m: distance.and_then(|gate| gate.value),
            distance_tolerance_m: distance.map(|gate| gate.limit),
            position_correction_m: position.and_then(|gate| gate.value),
            position_tolerance_m: position.map(|gate| gate.limit),
            budget_without_m: budget.map(|budget| budget.without_tracking_m),
            budget_with_m: budget.map(|budget| budget.with_tracking_m),
            fault: self.fault().is_some(),
            lost_count: match self.update.state {
                crate::target::TrackingState::Lost { count } => Some(count),
                _ => None,
            },
            failed_gates: self.failed_gates(),
            reason: self.fault().or_else(|| self.verdict()?.reason.as_deref()).map(str::to_owned),
        }
    }

    fn failed_gates(&self) -> Vec<Gate> {
        let gates = self.verdict().into_iter().flat_map(|verdict| &verdict.gates);
        gates.filter(|gate| !gate.passed).cloned().collect()
    }

    /// Estimated distance from the left camera, m.
    pub fn range_m(&self) -> f64 {
        (self.update.target.position_in_rover - self.point_mast.left.model.centre()).norm()
    }

    /// The paper's budget at this step's range, for tracking that drifts by half a pixel of the first image (R40).
    pub fn budget(&self) -> Option<ErrorBudget> {
        let pointing = &self.point_mast;
        let pixel = pointing.predicted_left.unwrap_or_else(|| pointing.left.centre_pixel());
        let pair = StereoPair::from_cameras(&pointing.left, &pointing.right, pixel)?;
        let (start_m, end_m) = (self.update.target.initial_distance_m, self.range_m());
        let drift_px = 0.5 * start_m / end_m;
        Some(pair.budget(&Approach { start_m, end_m, drift_px, ..Approach::default() }))
    }

    /// Whether the step was lost although its evidence was right.
    pub fn is_false_loss(&self) -> bool {
        let within = |t: &StepTruth| t.err_px.is_some_and(|e| e <= t.tolerance_px);
        self.update.state.is_lost() && self.truth.as_ref().is_some_and(within)
    }
}

/// Sums up a run.
pub fn summarise<'a>(steps: impl IntoIterator<Item = &'a StepTrace>) -> Summary {
    let mut summary = Summary::default();
    for trace in steps {
        summary.steps += 1;
        summary.steps_lost += usize::from(trace.update.state.is_lost());
        let Some(truth) = &trace.truth else { continue };
        let tracking = trace.update.state == crate::target::TrackingState::Tracking;
        *summary.steps_tracked.get_or_insert(0) += usize::from(truth.tracked == Some(true));
        *summary.false_tracked.get_or_insert(0) += usize::from(tracking && truth.tracked == Some(false));
        *summary.false_lost.get_or_insert(0) += usize::from(trace.is_false_loss());
        summary.run_tracked = truth.tracked;
        summary.final_err_px = truth.err_px;
        summary.final_err_m = Some(truth.err_m);
    }
    summary
}

impl Record for StepTruth {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("position_in_rover", Unit::Metre, |t| t.position_in_rover)
            .describe("The true position in the true rover frame of this stop.");
        r.quantity("left_pixel", Unit::Pixel, |t| t.left_pixel)
            .describe("The truth in the left image; missing where it is hidden.");
        r.quantity("err_m", Unit::Metre, |t| t.err_m)
            .describe("Distance between estimated and true position in the present rover frame.");
        r.quantity("err_px", Unit::Pixel, |t| t.err_px)
            .describe("Distance between located and true pixel.")
            .formula("│located − true│", &["locate.left_pixel", "left_pixel"]);
        r.quantity("nees", Unit::One, |t| t.nees)
            .describe("Squared Mahalanobis distance of the error, 3 degrees of freedom.");
        r.quantity("magnification", Unit::One, |t| t.magnification)
            .describe("Magnification since the designation.");
        r.quantity("tolerance_px", Unit::Pixel, |t| t.tolerance_px)
            .describe("The error up to which the target counts as tracked.");
        r.quantity("tracked", Unit::One, |t| t.tracked)
            .describe("Whether the target is tracked; missing where the truth is hidden.");
    }
}
