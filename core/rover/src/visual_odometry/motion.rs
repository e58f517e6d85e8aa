//! Step `fit_motion`: the maximum-likelihood motion of the inliers, and its covariance.
//!
//! The consistent set gives a first motion; the matches within `outlier_sigma` of it are fitted with their full
//! covariances (`estimate::weighted_motion`), until the inliers stay the same. Two errors common to all matches are added
//! to the covariance of the fit (multiplied by χ²/dof if that is above 1): a common shift of the matches by `common_px`,
//! and the error of the mast's angles at both stops.
//! ```text
//! Σ = max(1, χ²/dof) H⁻¹ + σ_c² Σ_k s_k s_kᵀ + Σ_stops σ_m² (a aᵀ + e eᵀ)
//! s_k = H⁻¹ Σ_i A_iᵀ W_i ∂q_i/∂k          k: shift along x, along y, of the disparity
//! ```
//! All are covariances of a small motion (τ, ω) about the rover's origin, applied after the motion.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | τ, ω | small translation and rotation | m, rad; rover frame after |
//! | a, e | small motion per 1 rad of the mast's azimuth and elevation | m per rad, – |
//!
//! Sources: domain.md 9.2, steps 6 to 8; the shared errors are ours.

use nalgebra::{Matrix3, Matrix6, Rotation3, SMatrix, Vector6};

use sightline_geometry::camera::{Mast, MastAngles};
use sightline_geometry::estimate::ransac::{self, Gate, RansacSettings, Weighting};
use sightline_geometry::estimate::weighted_motion::{
    Correspondence, Loss, UncertainMotion, rigid_motion_by_covariance,
};
use sightline_geometry::frames::{Pose, Vector3};

use super::matches::Match;
use super::rigidity::consistent_set;
use super::settings::{ConsistentSet, OdometrySettings};

/// Largest number of fits to the inliers.
const FITS_MAX: usize = 10;

/// A motion with its inliers.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    pub(super) after_from_before: Pose,
    /// Indices of the inliers.
    pub(super) inliers: Vec<usize>,
    /// Size of the consistent set from which the fit began.
    pub(super) consistent: usize,
    /// Covariance of a small motion (τ, ω) about the rover's origin, without the errors common to all matches.
    pub(super) covariance: Matrix6<f64>,
    /// Squared residuals over their variances, per degree of freedom.
    pub(super) chi2_per_dof: f64,
}

impl Fitted {
    /// Mean change of the view over the inliers.
    pub(super) fn change(&self, matches: &[Match]) -> f64 {
        let sum: f64 = self.inliers.iter().map(|&i| matches[i].change).sum();
        sum / self.inliers.len().max(1) as f64
    }
}

/// Fits the motion with the most inliers.
///
/// # Errors
/// A message that says why there is none.
pub(super) fn fit(matches: &[Match], settings: &OdometrySettings) -> Result<Fitted, String> {
    let pairs: Vec<Correspondence> = matches.iter().map(|found| found.pair).collect();
    let first = match settings.consistent_set {
        ConsistentSet::Rigidity => consistent_set(&pairs),
        ConsistentSet::Ransac => drawn(&pairs, settings)?,
    };
    if first.len() < 4 {
        return Err(format!(
            "only {} of {} matches are inliers of a rigid transform",
            first.len(),
            pairs.len()
        ));
    }
    let fit_to = |which: &[usize]| {
        let chosen: Vec<Correspondence> = which.iter().map(|&i| pairs[i]).collect();
        rigid_motion_by_covariance(&chosen, Loss::Huber).map_err(|problem| problem.to_string())
    };
    let consistent = first.len();
    let (mut inliers, mut motion) = (first.clone(), fit_to(&first)?);
    for _ in 0..FITS_MAX {
        let agree = |&i: &usize| {
            squared_distance(&pairs[i], &motion.after_from_before)
                .is_some_and(|square| square < settings.outlier_sigma.powi(2))
        };
        let now: Vec<usize> = (0..pairs.len()).filter(agree).collect();
        if now == inliers {
            break;
        }
        if now.len() < 4 {
            return Err(format!(
                "only {} of {} matches are inliers of the fitted transform",
                now.len(),
                pairs.len()
            ));
        }
        motion = fit_to(&now)?;
        inliers = now;
    }
    let squares = inliers.iter().filter_map(|&i| squared_distance(&pairs[i], &motion.after_from_before));
    let chi2_per_dof = squares.sum::<f64>() / (3.0 * inliers.len() as f64 - 6.0);
    let covariance = about_origin(&motion) * chi2_per_dof.max(1.0);
    Ok(Fitted { after_from_before: motion.after_from_before, inliers, consistent, covariance, chi2_per_dof })
}

/// The inliers of a RANSAC hypothesis from a minimal sample of three.
fn drawn(pairs: &[Correspondence], settings: &OdometrySettings) -> Result<Vec<usize>, String> {
    let ransac = RansacSettings {
        draws: 50,
        adaptive: true,
        draws_max: 500,
        gate: Gate::Mahalanobis { limit: settings.outlier_sigma },
        weighting: Weighting::Range,
        seed: 1,
        ..RansacSettings::default()
    };
    let found = ransac::fit_motion(pairs, &ransac);
    found.missing.map_or(Ok(found.inliers), Err)
}

/// Squared residual of a match over its variance.
pub(super) fn squared_distance(pair: &Correspondence, motion: &Pose) -> Option<f64> {
    let residual = pair.residual(motion);
    let rotation = motion.rotation.to_rotation_matrix();
    let solved = pair.residual_covariance(rotation.matrix()).cholesky()?.solve(&residual);
    Some(residual.dot(&solved))
}

/// Moves the reference point of a covariance of a small motion to the rover's origin: `τ₀ = τ + c × ω`.
fn about_origin(motion: &UncertainMotion) -> Matrix6<f64> {
    let mut to_origin = Matrix6::identity();
    to_origin.fixed_view_mut::<3, 3>(0, 3).copy_from(&motion.about.coords.cross_matrix());
    to_origin * motion.covariance * to_origin.transpose()
}

/// Effect of a common shift of all matches by one pixel, as covariance of a small motion about the rover's origin, per
/// px².
pub(super) fn by_common_shift(matches: &[Match], fitted: &Fitted) -> Matrix6<f64> {
    let rotation = fitted.after_from_before.rotation.to_rotation_matrix();
    let mut information = Matrix6::zeros();
    let mut pulls = [Vector6::zeros(); 3];
    for found in fitted.inliers.iter().map(|&i| &matches[i]) {
        let covariance: Matrix3<f64> = found.pair.residual_covariance(rotation.matrix());
        let Some(weight) = covariance.cholesky().map(|factor| factor.inverse()) else { continue };
        let place = (fitted.after_from_before * found.pair.before).coords;
        // A = [1, −[place]×]
        let mut by_motion = SMatrix::<f64, 3, 6>::zeros();
        by_motion.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
        by_motion.fixed_view_mut::<3, 3>(0, 3).copy_from(&-place.cross_matrix());
        information += by_motion.transpose() * weight * by_motion;
        for (pull, shift) in pulls.iter_mut().zip(&found.by_shift) {
            *pull += by_motion.transpose() * weight * shift;
        }
    }
    let Some(factor) = information.cholesky() else { return Matrix6::zeros() };
    pulls.iter().map(|pull| factor.solve(pull)).map(|shift| shift * shift.transpose()).sum()
}

/// The covariance of a small motion about the rover's origin for an error of 1 rad of each mast angle at both stops.
pub(super) fn by_mast(
    mast: &Mast,
    [before, after]: [MastAngles; 2],
    after_from_before: &Pose,
) -> Matrix6<f64> {
    let origin = mast.origin_in_rover;
    let axes = |angles: MastAngles| {
        let pan = Vector3::z_axis();
        [pan.into_inner(), Rotation3::from_axis_angle(&pan, angles.azimuth_rad) * Vector3::y()]
    };
    let small = |axis: Vector3, origin: Vector3| {
        let shift = origin.cross(&axis);
        Vector6::new(shift.x, shift.y, shift.z, axis.x, axis.y, axis.z)
    };
    let there = axes(after).map(|axis| small(axis, origin.coords));
    let carried = (after_from_before * origin).coords;
    let here = axes(before).map(|axis| small(after_from_before.rotation * axis, carried));
    there.into_iter().chain(here).map(|motion| motion * motion.transpose()).sum()
}
