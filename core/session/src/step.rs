//! One step of a run: the results of its stages and their comparison with the truth.
//!
//! ```text
//! StepTrace (stages) + StepTruth (world) ──► RunStep ──► StepRow
//! ```
//! Stage crates do not depend on these types: [`crate::track`] adds the comparison after the last stage. Viewer, REST and
//! files use the serialised form (`serialised`), which omits arrays.

mod row;
mod serialised;

pub use self::row::StepRow;

use std::ops::{Deref, DerefMut};

use crate::times::Took;
use sightline_rover::visual_odometry::MeasuredMotion;
use sightline_track::gate::Gate;
use sightline_track::target::TrackingState;
use sightline_track::trace::StepTrace;
use sightline_world::target_truth::StepTruth;

/// One step of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunStep {
    /// The results of the stages.
    pub trace: StepTrace,
    /// The comparison with the truth; `None` if the truth is unknown.
    pub truth: Option<StepTruth>,
    /// The motion to this stop as measured by visual odometry; `None` if it was not measured.
    pub odometry: Option<Box<MeasuredMotion>>,
    /// The measured times of the stages; not part of the record, and empty if they were not measured.
    pub took: Took,
}

impl Deref for RunStep {
    type Target = StepTrace;

    fn deref(&self) -> &StepTrace {
        &self.trace
    }
}

impl DerefMut for RunStep {
    fn deref_mut(&mut self) -> &mut StepTrace {
        &mut self.trace
    }
}

impl RunStep {
    /// The row of this step.
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
            not_searched: self.why_not_searched().is_some(),
            lost_count: match self.update.state {
                TrackingState::Lost { count } => Some(count),
                _ => None,
            },
            failed_gates: self.failed_gates(),
            paused_before: self.paused_before(),
            reason: self.reason(),
        }
    }

    /// Why an update was rejected, the fault of the stop's files, or where the drive is paused.
    fn reason(&self) -> Option<String> {
        self.why_incomplete().or_else(|| self.verdict()?.reason.clone())
    }

    fn failed_gates(&self) -> Vec<Gate> {
        let gates = self.verdict().into_iter().flat_map(|verdict| &verdict.gates);
        gates.filter(|gate| !gate.passed).cloned().collect()
    }

    /// Whether the state is `lost` or `failed` although the located pixel was within tolerance of the truth.
    pub fn is_false_loss(&self) -> bool {
        let within = |t: &StepTruth| t.err_px.is_some_and(|e| e <= t.tolerance_px);
        self.update.state.is_lost() && self.truth.as_ref().is_some_and(within)
    }
}
