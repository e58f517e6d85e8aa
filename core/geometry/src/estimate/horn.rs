//! The rigid motion between two sets of matched points, in closed form (Horn 1987; R163, E33; domain.md 13.1).
//!
//! Minimises Σ w |q − R p − t|² over R and t. With p' = p − p̄ and q' = q − q̄ about the weighted centroids
//!
//! ```text
//! S = Σ w p' q'ᵀ
//!     ⎡ Sxx+Syy+Szz   Syz−Szy       Szx−Sxz        Sxy−Syx      ⎤
//! N = ⎢      ·        Sxx−Syy−Szz   Sxy+Syx        Szx+Sxz      ⎥   symmetric
//!     ⎢      ·             ·       −Sxx+Syy−Szz    Syz+Szy      ⎥
//!     ⎣      ·             ·             ·        −Sxx−Syy+Szz  ⎦
//! R = rotation of the quaternion (s, x, y, z) that is N's eigenvector of the largest eigenvalue
//! t = q̄ − R p̄
//! ```
//!
//! A quaternion is never a reflection. With the singular values σ1 ≥ σ2 ≥ σ3 of S (σ3 negative for mirrored sets) the
//! two largest eigenvalues of N are σ1 + σ2 + σ3 and σ1 − σ2 − σ3. Half their difference over Σw is the mean square
//! spread across the main axis: if the two are equal, the rotation about it is undetermined. The spread is computed
//! from N rather than from one set, so that noise, which the two sets do not share, does not count as spread.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | p, q | `before`, `after` | m, each in its own frame |
//! | R, t | `after_from_before` | –, m |
//! | w | `weights` | –; inverse variances up to a factor |
//! | √((e1 − e2)/2Σw) of N's largest eigenvalues e1, e2 | `across_m` | m |

use nalgebra::{Matrix3, Matrix4, Quaternion, SymmetricEigen, Translation3, UnitQuaternion};

use crate::frames::{Point3, Pose, Vector3};

/// Smallest spread across the main axis, root mean square, m: that of a triangle with an altitude of 2 cm (domain.md
/// 13.1). Below it, noise of a few millimetres rotates the motion by tens of degrees about the axis.
pub const ACROSS_MIN_M: f64 = 0.01;
/// Spread below which points count as identical, m.
const IDENTICAL_M: f64 = 1e-6;

/// Why points do not determine a motion; its text is a sentence for a person.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Degenerate {
    /// Three matches are needed.
    #[error("there are fewer than three matches ({matches})")]
    TooFew {
        /// Number of matches.
        matches: usize,
    },
    /// The two sets, or the sets and their weights, differ in length.
    #[error("{before} points cannot be matched with {after}")]
    Unpaired {
        /// Number of points of one set.
        before: usize,
        /// Number of points, or weights, of the other.
        after: usize,
    },
    /// All matches are at one point.
    #[error("all matches are at the same point")]
    Identical,
    /// All matches are near one point.
    #[error("the spread of the matches is only {along_m:.4} m (RMS): too small for a rotation")]
    Close {
        /// Their spread along the main axis, m.
        along_m: f64,
    },
    /// All matches are on or near a line, so that the rotation about it is undetermined.
    #[error("all matches are on a line: their spread across it is only {across_m:.4} m (RMS)")]
    OnALine {
        /// Their spread across the line, m.
        across_m: f64,
    },
    /// The sets have different shapes, for example if one is the mirror image of the other.
    #[error(
        "the rotation is ambiguous: the matched points have different shapes before and after the motion"
    )]
    Unlike,
    /// A coordinate, a weight or a covariance is not finite, or there is no positive weight.
    #[error("a coordinate, weight or covariance is not finite, or no weight is positive")]
    NotANumber,
    /// A match has no error in some direction, so that it cannot be weighted.
    #[error("a match has a covariance that is not positive definite")]
    Covariance,
}

/// Sums over weighted pairs of points, as offsets from a fixed point in each frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sums {
    weight: f64,
    before: Vector3,
    after: Vector3,
    products: Matrix3<f64>,
}

/// The motion fitted to such sums.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fitted {
    /// The motion that maps the offsets before to those after.
    pub(super) motion: Pose,
    /// Spread across the main axis, root mean square, m; 0 if the rotation about it is undetermined.
    pub(super) across_m: f64,
    /// The eigenvalues of N, ascending, m².
    #[cfg(test)]
    eigenvalues: [f64; 4],
}

impl Sums {
    /// Adds a pair.
    pub(super) fn add(&mut self, weight: f64, before: &Vector3, after: &Vector3) {
        self.weight += weight;
        self.before += before * weight;
        self.after += after * weight;
        self.products += before * (after * weight).transpose();
    }

    /// The motion with the least sum of weighted squares.
    pub(super) fn fit(&self) -> Fitted {
        let (before, after) = (self.before / self.weight, self.after / self.weight);
        let s = self.products - self.before * after.transpose();
        let eigen = SymmetricEigen::new(quaternion_form(&s));
        let mut order = [0, 1, 2, 3];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let [first, second] = [order[0], order[1]].map(|i| eigen.eigenvalues[i]);
        let q = eigen.eigenvectors.column(order[0]);
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]));
        Fitted {
            motion: Pose::from_parts(Translation3::from(after - rotation * before), rotation),
            across_m: ((first - second) / (2.0 * self.weight)).max(0.0).sqrt(),
            #[cfg(test)]
            eigenvalues: [order[3], order[2], order[1], order[0]].map(|i| eigen.eigenvalues[i]),
        }
    }
}

/// Horn's matrix N of the sums of products S.
fn quaternion_form(s: &Matrix3<f64>) -> Matrix4<f64> {
    let skew = Vector3::new(s.m23 - s.m32, s.m31 - s.m13, s.m12 - s.m21);
    let both = s + s.transpose() - Matrix3::identity() * s.trace();
    let mut form = Matrix4::zeros();
    form[(0, 0)] = s.trace();
    form.fixed_view_mut::<3, 1>(1, 0).copy_from(&skew);
    form.fixed_view_mut::<1, 3>(0, 1).copy_from(&skew.transpose());
    form.fixed_view_mut::<3, 3>(1, 1).copy_from(&both);
    form
}

/// Converts a motion between offsets from two points to a motion between the frames of those points.
pub(super) fn between(before: &Point3, after: &Point3, motion: &Pose) -> Pose {
    let translation = after.coords + motion.translation.vector - motion.rotation * before.coords;
    Pose::from_parts(Translation3::from(translation), motion.rotation)
}

/// The rigid motion that maps `before` to `after` with the least sum of (weighted) squared distances, m².
///
/// # Errors
/// If the points do not determine it: fewer than three, all at or near one point or line, or two different shapes.
pub fn rigid_motion(
    before: &[Point3],
    after: &[Point3],
    weights: Option<&[f64]>,
) -> Result<Pose, Degenerate> {
    let unpaired = |other: usize| Degenerate::Unpaired { before: before.len(), after: other };
    if before.len() != after.len() {
        return Err(unpaired(after.len()));
    }
    if let Some(weights) = weights.filter(|weights| weights.len() != before.len()) {
        return Err(unpaired(weights.len()));
    }
    if before.len() < 3 {
        return Err(Degenerate::TooFew { matches: before.len() });
    }
    let weight = |i: usize| weights.map_or(1.0, |weights| weights[i]);
    let total: f64 = (0..before.len()).map(weight).sum();
    let usable =
        |i: usize| weight(i) >= 0.0 && (before[i].coords + after[i].coords).iter().all(|v| v.is_finite());
    if !(total.is_finite() && total > 0.0 && (0..before.len()).all(usable)) {
        return Err(Degenerate::NotANumber);
    }
    let centre = |points: &[Point3]| {
        let sum = points
            .iter()
            .enumerate()
            .fold(Vector3::zeros(), |sum, (i, point)| sum + point.coords * weight(i));
        Point3::from(sum / total)
    };
    let (from, to) = (centre(before), centre(after));
    let mut sums = Sums::default();
    for (i, (p, q)) in before.iter().zip(after).enumerate() {
        sums.add(weight(i), &(p - from), &(q - to));
    }
    let fitted = sums.fit();
    if fitted.across_m < ACROSS_MIN_M {
        return Err(shape_of(before).or_else(|| shape_of(after)).unwrap_or(Degenerate::Unlike));
    }
    Ok(between(&from, &to, &fitted.motion))
}

/// The degeneracy of a set of points, by the principal axes of their scatter; `None` for a broad set.
pub(super) fn shape_of(points: &[Point3]) -> Option<Degenerate> {
    if points.len() < 3 {
        return Some(Degenerate::TooFew { matches: points.len() });
    }
    let count = points.len() as f64;
    let centre = points.iter().map(|point| point.coords).sum::<Vector3>() / count;
    let scatter = points.iter().map(|point| point.coords - centre).map(|offset| offset * offset.transpose());
    let mut variances = (scatter.sum::<Matrix3<f64>>() / count).symmetric_eigenvalues();
    variances.as_mut_slice().sort_by(f64::total_cmp);
    let [along_m, across_m] = [variances[2], variances[1]].map(|variance| variance.max(0.0).sqrt());
    // Noise widens a line, so that a set without a motion may have slightly more scatter than required.
    if along_m < IDENTICAL_M {
        Some(Degenerate::Identical)
    } else if along_m < 2.0 * ACROSS_MIN_M {
        Some(Degenerate::Close { along_m })
    } else {
        (across_m < 2.0 * ACROSS_MIN_M).then_some(Degenerate::OnALine { across_m })
    }
}

#[cfg(test)]
#[path = "horn_tests.rs"]
mod tests;
