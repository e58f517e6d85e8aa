//! The rigid motion between matched points with individual covariances, and the motion's covariance.
//!
//! The error of a stereo point is elongated along the line of sight and grows with the range squared. Horn's closed
//! form weights all points and directions equally; here the residuals are weighted by their covariance (R167 requires
//! the range; the method is ours, Gauss–Newton from Horn's motion):
//!
//! ```text
//! y = R p + t        r = q − y        C = C_q + R C_p Rᵀ        minimise  Σ ρ(rᵀ C⁻¹ r)
//! a small motion about c:   y → exp(ω)(y − c) + c + τ,          δ = (τ, ω)
//! A = [I, −[y − c]×]     W = ρ'(rᵀ C⁻¹ r) C⁻¹     H = Σ Aᵀ W A     δ = H⁻¹ Σ Aᵀ W r     cov(δ) = H⁻¹
//! ```
//!
//! ρ(d²) is d² (least squares), or grows more slowly beyond k standard deviations: Huber's and Cauchy's losses with
//! the constants for 95 % efficiency with normal errors. H⁻¹ is then the covariance as long as few matches are
//! down-weighted. R in C is that of the previous step, which changes the result by less than the next step.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | p, q | `before`, `after` | m, each in its own frame |
//! | C_p, C_q | `before_covariance`, `after_covariance` | m² |
//! | c | [`UncertainMotion::about`], the centroid of q | m, frame after |
//! | τ, ω | translation and rotation vector | m, rad, frame after |

use nalgebra::{Matrix3, Matrix6, Translation3, UnitQuaternion, Vector6};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::horn::{Degenerate, rigid_motion};
use crate::frames::{Point3, Pose, Vector3};

/// Largest number of Gauss–Newton steps; three or four suffice if Horn's motion is a good start.
const STEPS_MAX: u32 = 20;
/// A step shorter than this, in m and rad, ends the iteration.
const STEP_SETTLED: f64 = 1e-10;
/// Standard deviations from which Huber's loss grows linearly.
const HUBER: f64 = 1.345;
/// Standard deviations at which Cauchy's loss halves a match's weight.
const CAUCHY: f64 = 2.385;

/// One surface point, measured before and after the motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correspondence {
    /// Position in the frame before, m.
    pub before: Point3,
    /// Position in the frame after, m.
    pub after: Point3,
    /// Covariance of `before`, m².
    pub before_covariance: Matrix3<f64>,
    /// Covariance of `after`, m².
    pub after_covariance: Matrix3<f64>,
}

impl Correspondence {
    /// Residual of the match under a motion, m, in the frame after.
    pub fn residual(&self, after_from_before: &Pose) -> Vector3 {
        self.after - after_from_before * self.before
    }

    /// Covariance of the residual under a motion with this rotation, m², in the frame after.
    pub fn residual_covariance(&self, rotation: &Matrix3<f64>) -> Matrix3<f64> {
        self.after_covariance + rotation * self.before_covariance * rotation.transpose()
    }
}

/// The decrease of a match's weight with its residual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Loss {
    /// No decrease: least squares.
    #[default]
    Squares,
    /// 1/d from 1.345 standard deviations on (Huber).
    Huber,
    /// 1/(1 + d²/2.385²) (Cauchy).
    Cauchy,
}

impl Loss {
    /// ρ': the weight of a match of squared distance d².
    pub fn weight(self, squared_distance: f64) -> f64 {
        match self {
            Self::Squares => 1.0,
            Self::Huber => (HUBER / squared_distance.sqrt()).min(1.0),
            Self::Cauchy => 1.0 / (1.0 + squared_distance / (CAUCHY * CAUCHY)),
        }
    }
}

/// A motion with its covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UncertainMotion {
    /// The motion.
    pub after_from_before: Pose,
    /// The centre c of the small motions of `covariance`, in the frame after, m.
    pub about: Point3,
    /// Covariance of a small motion (τ, ω) after `after_from_before`, m², m rad and rad².
    pub covariance: Matrix6<f64>,
}

/// H and Σ Aᵀ W r of the normal equations, for one match or several.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Normal {
    pub(super) information: Matrix6<f64>,
    pub(super) pull: Vector6<f64>,
}

impl Normal {
    /// The contribution of one match under a motion; `None` if its covariance has no inverse.
    pub(super) fn of(pair: &Correspondence, motion: &Pose, about: &Point3, loss: Loss) -> Option<Self> {
        let rotation = motion.rotation.to_rotation_matrix();
        let inverse = pair.residual_covariance(rotation.matrix()).cholesky()?.inverse();
        let moved = motion * pair.before;
        let residual = pair.after - moved;
        let weight = inverse * loss.weight(residual.dot(&(inverse * residual)));
        // −[l]× and its transpose [l]×.
        let lever = (moved - about).cross_matrix();
        let across = -weight * lever;
        let force = weight * residual;
        let mut information = Matrix6::zeros();
        information.fixed_view_mut::<3, 3>(0, 0).copy_from(&weight);
        information.fixed_view_mut::<3, 3>(0, 3).copy_from(&across);
        information.fixed_view_mut::<3, 3>(3, 0).copy_from(&across.transpose());
        information.fixed_view_mut::<3, 3>(3, 3).copy_from(&(lever * across));
        let mut pull = Vector6::zeros();
        pull.fixed_rows_mut::<3>(0).copy_from(&force);
        pull.fixed_rows_mut::<3>(3).copy_from(&(lever * force));
        Some(Self { information, pull })
    }

    /// Adds another contribution, `times` over.
    pub(super) fn add(&mut self, other: &Self, times: f64) {
        self.information += other.information * times;
        self.pull += other.pull * times;
    }

    /// The step (τ, ω) and its covariance; `None` if the matches leave a direction undetermined.
    pub(super) fn solve(&self) -> Option<(Vector6<f64>, Matrix6<f64>)> {
        let covariance = self.information.cholesky()?.inverse();
        Some((covariance * self.pull, covariance))
    }
}

/// The motion followed by the small motion `step` = (τ, ω) about a point of the frame after.
pub(super) fn followed_by(motion: &Pose, step: &Vector6<f64>, about: &Point3) -> Pose {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[3], step[4], step[5]));
    let translation =
        turn * (motion.translation.vector - about.coords) + about.coords + step.fixed_rows::<3>(0);
    let mut rotation = turn * motion.rotation;
    rotation.renormalize();
    Pose::from_parts(Translation3::from(translation), rotation)
}

/// The motion with the least sum of losses, and its covariance.
///
/// # Errors
/// As [`rigid_motion`], and if a match's covariance is not positive definite.
pub fn rigid_motion_by_covariance(
    pairs: &[Correspondence],
    loss: Loss,
) -> Result<UncertainMotion, Degenerate> {
    let (before, after): (Vec<_>, Vec<_>) = pairs.iter().map(|pair| (pair.before, pair.after)).unzip();
    let mut motion = rigid_motion(&before, &after, None)?;
    let about = Point3::from(after.iter().map(|point| point.coords).sum::<Vector3>() / after.len() as f64);
    let mut covariance = Matrix6::zeros();
    for _ in 0..STEPS_MAX {
        let mut normal = Normal::default();
        for pair in pairs {
            normal.add(&Normal::of(pair, &motion, &about, loss).ok_or(Degenerate::Covariance)?, 1.0);
        }
        let step;
        (step, covariance) = normal.solve().ok_or(Degenerate::Covariance)?;
        motion = followed_by(&motion, &step, &about);
        if step.amax() < STEP_SETTLED {
            break;
        }
    }
    Ok(UncertainMotion { after_from_before: motion, about, covariance })
}

#[cfg(test)]
#[path = "weighted_motion_tests.rs"]
mod tests;
