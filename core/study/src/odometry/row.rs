//! Rows of the study: a drive, its updates, and the summary of the drives of one scene.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use sightline_geometry::estimate::quantile::quantile;

use super::Scene;

/// Least fraction of the previous view that must be visible again for an update to count, 0 to 1.
pub(super) const OVERLAP_MIN: f64 = 0.6;

/// Row of one drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OdometryRow {
    /// Name of the settings.
    pub configuration: String,
    /// Seed of the world.
    pub seed: u64,
    /// Ground of the drive.
    pub scene: Scene,
    /// Slope of the ground, deg.
    pub slope_deg: f64,
    /// Mean slip along the motion.
    pub slip: f64,
    /// Number of updates with views that overlap by 60 % or more.
    pub updates: usize,
    /// Number of accepted ones.
    pub converged: usize,
    /// Number of rejected ones.
    pub refused: usize,
    /// Number of accepted updates that are wrong beyond their covariance, at any overlap.
    pub silently_wrong: usize,
    /// True path length of the rover, m.
    pub distance_m: f64,
    /// Distance between the estimated and the true end, % of the true path length.
    pub drift_percent: f64,
    /// 95th percentile of the error of the slip, percentage points; null without an accepted update.
    pub slip_error_points: Option<f64>,
    /// Mean NEES per degree of freedom of the accepted updates; null without one.
    pub nees_per_dof: Option<f64>,
    /// Reason why the drive ended early; null if it did not.
    pub problem: Option<String>,
    /// All updates.
    #[serde(skip)]
    pub steps: Vec<OdometryStep>,
}

/// Summary of the drives with one scene and configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OdometrySummary {
    /// Name of the settings.
    pub configuration: String,
    /// Ground of the drives.
    pub scene: Scene,
    /// Number of drives.
    pub drives: usize,
    /// Number of updates with views that overlap by 60 % or more.
    pub updates: usize,
    /// Percentage of accepted updates among them.
    pub converged_percent: f64,
    /// Number of accepted updates that are wrong beyond their covariance.
    pub silently_wrong: usize,
    /// Upper bound of their percentage with 95 % confidence, 3/n, if there is none; null otherwise.
    pub silently_wrong_below_percent: Option<f64>,
    /// Median and 95th percentile of the drift, % of the path length.
    pub drift_percent: [f64; 2],
    /// 95th percentile of the error of the slip, percentage points; null without an accepted update.
    pub slip_error_points: Option<f64>,
    /// Mean NEES per degree of freedom over drives, and its standard deviation; null without an accepted update.
    pub nees_per_dof: Option<[f64; 2]>,
    /// Number of rejected updates, by the beginning of their message.
    pub refusals: BTreeMap<String, usize>,
}

/// Summarises the drives of one scene and configuration; `None` without any.
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
    /// Index of the stop after the motion.
    pub stop: usize,
    /// Length of the commanded path, m.
    pub commanded_m: f64,
    /// Commanded rotation, deg.
    pub turn_deg: f64,
    /// True slip along the motion of the wheels.
    pub slip: f64,
    /// Fraction of the previous view that is visible again.
    pub overlap: f64,
    /// Whether the update was accepted.
    pub accepted: bool,
    /// Reason of the rejection, as one sentence.
    pub refusal: Option<String>,
    /// Whether it was accepted although it is wrong beyond its covariance.
    pub silently_wrong: bool,
    /// Error of the translation, m; null without a motion.
    pub error_m: Option<f64>,
    /// Error of the rotation, deg; null without a motion.
    pub error_deg: Option<f64>,
    /// Mahalanobis distance of the translation.
    pub distance: Option<f64>,
    /// NEES per degree of freedom.
    pub nees_per_dof: Option<f64>,
    /// Error of the slip, percentage points.
    pub slip_error_points: Option<f64>,
    /// Number of matches consistent with the motion.
    pub inliers: usize,
    /// χ² per degree of freedom of the residuals.
    pub chi2_per_dof: Option<f64>,
    /// Mean change of scale of the inliers' windows.
    pub change: Option<f64>,
    /// Inliers of a competing motion over those of the motion; 0 without one.
    pub ambiguity: f64,
    /// Fit of another translation along the motion over that of the motion; near 1 on periodic ground.
    pub repetition: f64,
}
