//! What one step saw and decided: the return values of the six stages, side by side.
//!
//! The debugger is a view of this record. The fields bear the stages' names; arrays are left out of the
//! serialised form and fetched one by one under the names of [`ArrayName`].

mod arrays;

pub use arrays::{ArrayName, ArrayView};

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::estimate::error_budget::{Approach, ErrorBudget, StereoPair};
use crate::frames::{Pixel, Point3};
use crate::locate::Located;
use crate::locate::features::FeatureEvidence;
use crate::locate::shape_tracker::ShapeEvidence;
use crate::locate::template::TemplateEvidence;
use crate::stages::capture::Capture;
use crate::stages::judge::Verdict;
use crate::stages::point_mast::Pointing;
use crate::stages::predict::Prediction;
use crate::stages::update::Updated;

/// One step of a run. At the designation there is no `predict` and no `judge`; at a stop whose files are
/// damaged there is a `fault` and nothing after `point_mast`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StepTrace {
    /// The stop, from 0.
    pub step: usize,
    /// Time since the first stop, s.
    pub time_s: f64,
    /// What is wrong with the stop's files, as one sentence.
    pub fault: Option<String>,
    /// Stage 1.
    pub predict: Option<Prediction>,
    /// Stage 2.
    pub point_mast: Option<Pointing>,
    /// Stage 3.
    pub capture: Option<Capture>,
    /// Stage 4.
    pub locate: Option<Located>,
    /// Stage 5.
    pub judge: Option<Verdict>,
    /// Stage 6.
    pub update: Updated,
    /// The comparison with the truth, where that is known.
    pub truth: Option<StepTruth>,
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

/// One line of a run: the columns of plots, tables and `sightline track`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StepRow {
    /// The stop, from 0.
    pub step: usize,
    /// The tracking state's word.
    pub state: String,
    /// Scale by the ratio of distances.
    pub scale: Option<f64>,
    /// Roll, deg.
    pub roll_deg: Option<f64>,
    /// Score of the match.
    pub ncc: Option<f64>,
    /// Score of point stereo.
    pub stereo_score: Option<f64>,
    /// Features whose match agrees with the motion.
    pub inliers: Option<usize>,
    /// Confidence of the locator, 0 to 1.
    pub confidence: Option<f64>,
    /// Error against the truth in the left image, px.
    pub err_px: Option<f64>,
    /// Error against the truth, m.
    pub err_m: Option<f64>,
    /// Largest 1σ axis of the position covariance, m.
    pub sigma_m: Option<f64>,
    /// Squared Mahalanobis distance of the error.
    pub nees: Option<f64>,
    /// Whether the target is tracked against the truth.
    pub tracked: Option<bool>,
    /// Estimated position in the rover frame, m.
    pub position_in_rover: [f64; 3],
    /// Covariance of the estimated position, m².
    #[schema(value_type = Vec<f64>)]
    pub covariance_in_rover: Matrix3<f64>,
    /// Located position in the left image, px.
    pub left_pixel: Option<Pixel>,
    /// Estimated distance from the left camera, m.
    pub range_m: Option<f64>,
    /// Correction of the distance, m: criterion 3.
    pub distance_correction_m: Option<f64>,
    /// Tolerance of the distance's correction at this step, m.
    pub distance_tolerance_m: Option<f64>,
    /// Correction of the position since the designation, m: criterion 4.
    pub position_correction_m: Option<f64>,
    /// Tolerance of the position's correction at this step, m.
    pub position_tolerance_m: Option<f64>,
    /// What the paper's budget grants a drive without tracking at this range, m, 3σ (K-Eq 3).
    pub budget_without_m: Option<f64>,
    /// What the paper's budget grants tracking that drifts by half a pixel of the first image, m, 3σ (K-Eq 5, R40).
    pub budget_with_m: Option<f64>,
    /// Why an update was rejected, or what is wrong with the stop's files.
    pub reason: Option<String>,
    /// Whether the stop's files are damaged, so that nothing could be done.
    #[serde(default)]
    pub fault: bool,
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
    /// The evidence of the template locator, where something was located.
    pub fn template(&self) -> Option<&TemplateEvidence> {
        self.locate.as_ref().and_then(|located| located.evidence.template())
    }

    /// The evidence of the feature locator, where something was located.
    pub fn features(&self) -> Option<&FeatureEvidence> {
        self.locate.as_ref().and_then(|located| located.evidence.features())
    }

    /// The evidence of the shape tracker, where something was located.
    pub fn shape(&self) -> Option<&ShapeEvidence> {
        self.locate.as_ref().and_then(|located| located.evidence.shape())
    }

    /// This step as one line.
    pub fn row(&self) -> StepRow {
        let evidence = self.template();
        let scale_roll = evidence.and_then(|e| e.scale_roll.as_ref());
        let covariance = self.update.target.covariance_in_rover;
        let largest = covariance.symmetric_eigenvalues().max();
        let gate = |name: &str| self.judge.as_ref()?.gates.iter().find(|gate| gate.name == name);
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
            confidence: self.locate.as_ref().map(|located| located.confidence),
            err_px: self.truth.as_ref().and_then(|t| t.err_px),
            err_m: self.truth.as_ref().map(|t| t.err_m),
            sigma_m: largest.is_finite().then(|| largest.max(0.0).sqrt()),
            nees: self.truth.as_ref().and_then(|t| t.nees),
            tracked: self.truth.as_ref().and_then(|t| t.tracked),
            position_in_rover: self.update.target.position_in_rover.coords.into(),
            covariance_in_rover: covariance,
            left_pixel: self.locate.as_ref().and_then(|l| l.left_pixel),
            range_m: self.range_m(),
            distance_correction_m: distance.and_then(|gate| gate.value),
            distance_tolerance_m: distance.map(|gate| gate.limit),
            position_correction_m: position.and_then(|gate| gate.value),
            position_tolerance_m: position.map(|gate| gate.limit),
            budget_without_m: budget.map(|budget| budget.without_tracking_m),
            budget_with_m: budget.map(|budget| budget.with_tracking_m),
            fault: self.fault.is_some(),
            reason: self.fault.clone().or_else(|| self.judge.as_ref().and_then(|v| v.reason.clone())),
        }
    }

    /// Estimated distance from the left camera, m; null where the camera is not known.
    pub fn range_m(&self) -> Option<f64> {
        let centre = self.point_mast.as_ref()?.left.model.centre();
        Some((self.update.target.position_in_rover - centre).norm())
    }

    /// The paper's budget at this step's range, for tracking that drifts by half a pixel of the first image (R40).
    pub fn budget(&self) -> Option<ErrorBudget> {
        let pointing = self.point_mast.as_ref()?;
        let pixel = pointing.predicted_left.unwrap_or_else(|| pointing.left.centre_pixel());
        let pair = StereoPair::from_cameras(&pointing.left, &pointing.right, pixel)?;
        let (start_m, end_m) = (self.update.target.initial_distance_m, self.range_m()?);
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
