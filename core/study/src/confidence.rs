//! Reliability of a locator's confidence, and errors of the motions that it measured (R178, R182–R184).
//!
//! A step is *sure* if the confidence exceeds 0.9, and *surely wrong* if the drift then exceeds 5 cm: the case that must
//! not happen, because it goes unnoticed. The error of a motion is that of the pose `T_true⁻¹ T`: its angle, and the
//! displacement of the target.

use serde::{Deserialize, Serialize};

use sightline_session::track::Drive;
use sightline_track::trace::StepTrace;

/// Confidence above which a step counts as sure.
const SURE: f64 = 0.9;

/// Drift above which a step counts as wrong, m.
const WRONG_M: f64 = 0.05;

/// Statistics of a run's steps by confidence and drift.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Trust {
    /// Number of steps with a confidence.
    pub steps: usize,
    /// Number of sure steps.
    pub sure: usize,
    /// Number of sure steps that were wrong.
    pub surely_wrong: usize,
    /// Lowest confidence; `None` without a step.
    pub lowest: Option<f64>,
    /// Error of each measured motion at the target, m.
    pub motion_errors_m: Vec<f64>,
    /// Rotation error of each measured motion, rad.
    pub motion_errors_rad: Vec<f64>,
}

impl Trust {
    /// Adds a step after the designation with the drift up to it.
    pub fn add<D: Drive>(&mut self, drive: &D, trace: &StepTrace, drift_m: Option<f64>) {
        let Some(located) = trace.located() else { return };
        let is_sure = located.confidence > SURE;
        self.steps += 1;
        self.sure += usize::from(is_sure);
        self.surely_wrong += usize::from(is_sure && drift_m.is_some_and(|drift| drift > WRONG_M));
        self.lowest = Some(self.lowest.map_or(located.confidence, |lowest| lowest.min(located.confidence)));
        if let Some([metres, radians]) = motion_error(drive, trace) {
            self.motion_errors_m.push(metres);
            self.motion_errors_rad.push(radians);
        }
    }
}

/// Error of a step's motion at the target, m, and of its rotation, rad; `None` without a measured motion.
fn motion_error<D: Drive>(drive: &D, trace: &StepTrace) -> Option<[f64; 2]> {
    let evidence = trace.features()?;
    let (fitted, matched) = (evidence.fit_motion.as_ref()?, evidence.match_features.as_ref()?);
    let site_from_then = drive.true_site_from_rover(matched.from_step)?;
    let site_from_now = drive.true_site_from_rover(trace.step)?;
    let truly = site_from_now.inverse() * site_from_then;
    let now_from_then = fitted.now_from_then();
    let then = now_from_then.inverse() * trace.located()?.position_in_rover?;
    let error = truly.inverse() * now_from_then;
    Some([(now_from_then * then - truly * then).norm(), error.rotation.angle()])
}
