//! The updates of a replay beside the truth, and what they come to together.
//!
//! ```text
//! error of an update    δ = (τ, ω):  T_true = exp(δ) T           NEES per dof = δᵀ Σ⁻¹ δ / 6
//! silently wrong        accepted, while √(τᵀ Σ_τ⁻¹ τ) > 5 and |τ| > max(1 cm, 4 % of the true step),
//!                       or the turn's error > 0.2° and > 5 σ
//! resolved              accepted, and √(tᵀ Σ_τ⁻¹ t) > 3, t being the translation of T
//! ```
//! The study of odometry takes 4 % of the commanded step; the true one is stricter where wheels slip. A translation of three
//! coordinates exceeds 3 σ in this sense by chance in 2.9 % of updates without motion.
//!
//! Frame: rover after, m and rad. Source: `sightline_study::odometry`.

use nalgebra::{Matrix3, Matrix6, Vector6};
use serde::Serialize;

use sightline_geometry::estimate::quantile::median;
use sightline_geometry::frames::{Pose, PoseRecord, Vector3};
use sightline_rover::visual_odometry::OdometryUpdate;

/// Upper ends of the bins of true translations, m; the first holds counters without any.
const BINS_M: [f64; 7] = [0.0, 0.002, 0.005, 0.010, 0.030, 0.100, f64::INFINITY];

/// One update beside the truth.
#[derive(Clone, Debug, Serialize)]
pub struct SpiritStep {
    /// The drive counter after.
    pub drive: u32,
    /// Length of the true translation, m.
    pub true_m: f64,
    /// Angle of the true turn, deg.
    pub true_turn_deg: f64,
    /// Length of the translation by the wheels, m.
    pub wheels_m: f64,
    /// Whether the update was accepted.
    pub accepted: bool,
    /// Why not, as one sentence.
    pub refusal: Option<String>,
    /// Error of the translation, m; null without a motion.
    pub error_m: Option<f64>,
    /// Error of the turn, deg.
    pub error_deg: Option<f64>,
    /// The error of the translation in standard deviations.
    pub error_sigmas: Option<f64>,
    /// NEES per degree of freedom.
    pub nees_per_dof: Option<f64>,
    /// The translation that was found in standard deviations.
    pub motion_sigmas: Option<f64>,
    /// Whether it is silently wrong.
    pub silently_wrong: bool,
    /// Matches that agree with the motion.
    pub inliers: usize,
}

/// Counters whose true translations are of about one size.
#[derive(Clone, Debug, Serialize)]
pub struct SpiritBin {
    /// Greatest true translation, m, itself included; infinite (null) in the last bin.
    pub up_to_m: f64,
    /// Counters.
    pub counters: usize,
    /// Accepted updates.
    pub accepted: usize,
    /// Median error of their translations, m; null without one.
    pub median_error_m: Option<f64>,
    /// Those whose translation differs from none.
    pub resolved: usize,
}

/// A replay.
#[derive(Clone, Debug, Default, Serialize)]
pub struct SpiritReport {
    /// The world's seed.
    pub seed: u64,
    /// Drive counters.
    pub counters: usize,
    /// Length of the path in space and in the level, m.
    pub path_m: [f64; 2],
    /// Slope of the ground, deg, and its direction, deg.
    pub slope_deg: [f64; 2],
    /// Angle between the mean vertical of the rover and that of the site, deg.
    pub mean_tilt_deg: f64,
    /// Least and greatest height of the left camera above the ground, m.
    pub camera_height_m: [f64; 2],
    /// Accepted updates.
    pub accepted: usize,
    /// Refused updates.
    pub refused: usize,
    /// Distance of the estimated end from the true one, m, and as % of the path in space.
    pub end_error: [f64; 2],
    /// The same of wheels and gyro alone.
    pub wheels_end_error: [f64; 2],
    /// Greatest error of the translation of an accepted update, m; null without one.
    pub worst_error_m: Option<f64>,
    /// The drive counter after it.
    pub worst_drive: Option<u32>,
    /// Accepted updates that are silently wrong.
    pub silently_wrong: usize,
    /// Accepted updates whose translation is more than 5 σ off, however little that is.
    pub beyond_5_sigma: usize,
    /// Mean and median of the NEES per degree of freedom of the accepted updates; null without one.
    pub nees_per_dof: Option<[f64; 2]>,
    /// The true translations by size.
    pub bins: Vec<SpiritBin>,
    /// Smallest true translation, not none, that was resolved, m.
    pub smallest_resolved_m: Option<f64>,
    /// Greatest true translation of an accepted update that was not resolved, m.
    pub greatest_unresolved_m: Option<f64>,
    /// The updates.
    pub steps: Vec<SpiritStep>,
}

impl SpiritStep {
    /// An update beside the true motion; `truth` and `predicted` lead from the rover frame before to that after.
    pub fn new(drive: u32, found: &OdometryUpdate, truth: &Pose, predicted: &Pose) -> Self {
        let true_m = truth.translation.vector.norm();
        let motion = found.after_from_before.map(PoseRecord::to_pose);
        let error = motion.map(|motion| {
            let wrong = truth * motion.inverse();
            (wrong.translation.vector, wrong.rotation.scaled_axis())
        });
        let block = |at: usize| found.covariance.map(|all| all.fixed_view::<3, 3>(at, at).into_owned());
        let sigmas = |at: usize, vector: Option<Vector3>| distance(&block(at)?, &vector?);
        let [shift, turn] = [error.map(|(shift, _)| shift), error.map(|(_, turn)| turn)];
        let error_sigmas = sigmas(0, shift);
        let [error_m, error_deg] = [shift.map(|v| v.norm()), turn.map(|v| v.norm().to_degrees())];
        let is_far = |distance: Option<f64>| distance.is_none_or(|distance| distance > 5.0);
        let by_shift = error_m.is_some_and(|m| m > f64::max(0.01, 0.04 * true_m)) && is_far(error_sigmas);
        let by_turn = error_deg.is_some_and(|deg| deg > 0.2) && is_far(sigmas(3, turn));
        Self {
            drive,
            true_m,
            true_turn_deg: truth.rotation.angle().to_degrees(),
            wheels_m: predicted.translation.vector.norm(),
            accepted: found.accepted,
            refusal: found.refusal(),
            error_m,
            error_deg,
            error_sigmas,
            nees_per_dof: error.zip(found.covariance).and_then(|(error, all)| nees_per_dof(error, &all)),
            motion_sigmas: sigmas(0, motion.map(|motion| motion.translation.vector)),
            silently_wrong: found.accepted && (by_shift || by_turn),
            inliers: found.inliers,
        }
    }

    /// Whether the translation that was found differs from none.
    pub(crate) fn is_resolved(&self) -> bool {
        self.accepted && self.motion_sigmas.is_some_and(|sigmas| sigmas > 3.0)
    }
}

impl SpiritReport {
    /// Adds what the updates come to together.
    #[must_use]
    pub(crate) fn with_steps(self, steps: Vec<SpiritStep>) -> Self {
        let accepted = || steps.iter().filter(|step| step.accepted);
        let nees: Vec<f64> = accepted().filter_map(|step| step.nees_per_dof).collect();
        let worst = accepted().filter(|step| step.error_m.is_some()).max_by(|a, b| {
            let error = |step: &SpiritStep| step.error_m.unwrap_or(0.0);
            error(a).total_cmp(&error(b))
        });
        let mean = nees.iter().sum::<f64>() / nees.len() as f64;
        let moved = || accepted().filter(|step| step.true_m > 0.0);
        let lengths = |resolved: bool| {
            moved().filter(move |step| step.is_resolved() == resolved).map(|step| step.true_m)
        };
        Self {
            accepted: accepted().count(),
            refused: steps.len() - accepted().count(),
            worst_error_m: worst.and_then(|step| step.error_m),
            worst_drive: worst.map(|step| step.drive),
            silently_wrong: accepted().filter(|step| step.silently_wrong).count(),
            beyond_5_sigma: accepted().filter(|step| step.error_sigmas.is_none_or(|s| s > 5.0)).count(),
            nees_per_dof: median(&nees).map(|median| [mean, median]),
            bins: bins(&steps),
            smallest_resolved_m: lengths(true).min_by(f64::total_cmp),
            greatest_unresolved_m: lengths(false).max_by(f64::total_cmp),
            steps,
            ..self
        }
    }
}

/// The updates by the size of the true translation.
fn bins(steps: &[SpiritStep]) -> Vec<SpiritBin> {
    let bin = |(number, &up_to_m): (usize, &f64)| {
        let above_m = number.checked_sub(1).map_or(-1.0, |before| BINS_M[before]);
        let within = || steps.iter().filter(move |step| step.true_m > above_m && step.true_m <= up_to_m);
        let accepted = || within().filter(|step| step.accepted);
        let errors: Vec<f64> = accepted().filter_map(|step| step.error_m).collect();
        SpiritBin {
            up_to_m,
            counters: within().count(),
            accepted: accepted().count(),
            median_error_m: median(&errors),
            resolved: accepted().filter(|step| step.is_resolved()).count(),
        }
    };
    BINS_M.iter().enumerate().map(bin).collect()
}

/// NEES per degree of freedom; none where the covariance has no inverse.
fn nees_per_dof((shift, turn): (Vector3, Vector3), covariance: &Matrix6<f64>) -> Option<f64> {
    let all = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
    covariance.cholesky().map(|factor| all.dot(&factor.solve(&all)) / 6.0)
}

/// Mahalanobis distance of a vector; none where the covariance has no inverse.
fn distance(covariance: &Matrix3<f64>, vector: &Vector3) -> Option<f64> {
    covariance.cholesky().map(|factor| vector.dot(&factor.solve(vector)).max(0.0).sqrt())
}
