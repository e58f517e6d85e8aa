//! The rows of the study: a drive, its updates, and the drives of one ground together.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use sightline_geometry::estimate::quantile::quantile;

use super::Scene;

/// Share of the view before that must be in view again for an update to count, 0 to 1.
pub(super) const OVERLAP_MIN: f64 = 0.6;

/// One drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OdometryRow {
    /// Name of the settings.
    pub configuration: String,
    /// The world's seed.
    pub seed: u64,
    /// The ground.
    pub scene: Scene,
    /// Slope of the ground, deg.
    pub slope_deg: f64,
    /// Mean slip along the motion.
    pub slip: f64,
    /// Updates whose views overlap by 60 % or more.
    pub updates: usize,
    /// Those that were accepted.
    pub converged: usize,
    /// Those that were refused.
    pub refused: usize,
    /// Accepted ones that are wrong beyond their covariance, with little overlap too.
    pub silently_wrong: usize,
    /// True way of the rover, m.
    pub distance_m: f64,
    /// Distance of the estimated end from the true one, % of the true way.
    pub drift_percent: f64,
    /// 95th percentile of the error of the slip, percentage points; null without an accepted update.
    pub slip_error_points: Option<f64>,
    /// Mean NEES per degree of freedom of the accepted updates; null without one.
    pub nees_per_dof: Option<f64>,
    /// Why the drive ended before its last step; null where it did not.
    pub problem: Option<String>,
    /// The updates, one by one.
    #[serde(skip)]
    pub steps: Vec<OdometryStep>,
}

/// The drives of one ground and one set of settings together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OdometrySummary {
    /// Name of the settings.
    pub configuration: String,
    /// The ground.
    pub scene: Scene,
    /// Drives.
    pub drives: usize,
    /// Updates whose views overlap by 60 % or more.
    pub updates: usize,
    /// Accepted ones of them, %.
    pub converged_percent: f64,
    /// Accepted updates that are wrong beyond their covariance.
    pub silently_wrong: usize,
    /// Bound of their share with 95 % confidence where there is none, %: 3/n; null where there is one.
    pub silently_wrong_below_percent: Option<f64>,
    /// Median and 95th percentile of the drift, % of the way.
    pub drift_percent: [f64; 2],
    /// 95th percentile of the error of the slip, percentage points; null without an accepted update.
    pub slip_error_points: Option<f64>,
    /// Mean NEES per degree of freedom over drives, and its standard deviation; null without an accepted update.
    pub nees_per_dof: Option<[f64; 2]>,
    /// Updates refused, by the beginning of their sentence.
    pub refusals: BTreeMap<String, usize>,
}

/// Sums up the drives of one ground and one set of settings; `None` without any.
pub fn summary(rows: &[OdometryRow]) -> Option<OdometrySummary> {
    let first = rows.first()?;
    let steps = || rows.iter().flat_map(|row| &row.steps);
    let updates: usize = rows.iter().map(|row| row.updates).sum();
    let converged: usize = rows.iter().map(|row| row.converged).sum();
    let accepted = steps().filter(|step| step.accepted).count();
    let silently_wrong: usize = rows.iter().map(|row| row.silently_wrong).sum();
    let drifts: Vec<f64> = rows.iter().map(|row| row.drift_percent).collect();
    let slips: Vec<f64> =
        steps().filter(|step| step.accepted).filter_map(|step| step.slip_error_points).collect();
    let nees: Vec<f64> = rows.iter().filter_map(|row| row.nees_per_dof).collect();
    let mean = nees.iter().sum::<f64>() / nees.len() as f64;
    let spread = (nees.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / nees.len() as f64).sqrt();
    let mut refusals = BTreeMap::new();
    for refusal in steps().filter(|step| step.overlap >= OVERLAP_MIN).filter_map(|step| step.refusal.as_ref())
    {
        let beginning = refusal.split(" is ").next().unwrap_or(refusal);
        let words: String = beginning.chars().filter(|c| !c.is_ascii_digit()).collect();
        *refusals.entry(words).or_insert(0) += 1;
    }
    Some(OdometrySummary {
        configuration: first.configuration.clone(),
        scene: first.scene,
        drives: rows.len(),
        updates,
        converged_percent: 100.0 * converged as f64 / updates.max(1) as f64,
        silently_wrong,
        silently_wrong_below_percent: (silently_wrong == 0 && accepted > 0).then(|| 300.0 / accepted as f64),
        drift_percent: [0.5, 0.95].map(|share| quantile(&drifts, share).unwrap_or(f64::NAN)),
        slip_error_points: quantile(&slips, 0.95),
        nees_per_dof: (!nees.is_empty()).then_some([mean, spread]),
        refusals,
    })
}

/// One update compared with the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OdometryStep {
    /// The stop after.
    pub stop: usize,
    /// Length of the commanded path, m.
    pub commanded_m: f64,
    /// Commanded turn, deg.
    pub turn_deg: f64,
    /// True slip along the motion of the wheels.
    pub slip: f64,
    /// Share of the view before that is in view again.
    pub overlap: f64,
    /// Whether the update was accepted.
    pub accepted: bool,
    /// Why not, as one sentence.
    pub refusal: Option<String>,
    /// Whether it is wrong beyond its covariance although it was accepted.
    pub silently_wrong: bool,
    /// Error of the translation, m, and of the turn, deg; null without a motion.
    pub error_m: Option<f64>,
    /// Error of the turn, deg.
    pub error_deg: Option<f64>,
    /// Mahalanobis distance of the translation.
    pub distance: Option<f64>,
    /// NEES per degree of freedom.
    pub nees_per_dof: Option<f64>,
    /// Error of the slip, percentage points.
    pub slip_error_points: Option<f64>,
    /// Matches that agree with the motion.
    pub inliers: usize,
    /// χ² per degree of freedom of the residuals.
    pub chi2_per_dof: Option<f64>,
    /// Mean change of the view.
    pub change: Option<f64>,
    /// Inliers of another motion as a part of those of the motion.
    pub ambiguity: f64,
    /// How well another way along the motion fits, as a part of how well the motion fits.
    pub repetition: f64,
}
