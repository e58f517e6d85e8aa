//! The covariance of a motion, by a bootstrap over its inliers (D§2, R173–R175, D-Eq 5; domain.md 13.3).
//!
//! ```text
//! n_boot times: draw |J_in| of the matches J_in with replacement, fit the motion θ^b
//! P_θθ = 1/n_boot Σ_b (θ^b − θ*)(θ^b − θ*)ᵀ        about θ*, not about the mean; angles wrapped (E30)
//! ```
//!
//! A set with fewer than three different matches, or with all on a line, is drawn again (ours). A fit depends only on
//! how often each match was drawn, so sums that do not depend on the draw are computed once. The unweighted fit is
//! Horn's. The weighted one is a single Gauss–Newton step from θ*: for a motion with an uncertainty of milliradians,
//! further steps change it by a few thousandths of its error.
//!
//! The covariance is that of repeated experiments with points of their own. If one direction is ten times more
//! accurate than the others, such as the roll of stereo points fitted without weights (errors along the lines of
//! sight do not rotate the points about them), a drawn set mixes the directions slightly: with 150 matches that
//! variance is overestimated by half.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | θ*, θ^b | `parameters`, `samples` | m, rad; [`MotionParameters`] |
//! | P_θθ | `covariance` | m², m rad, rad² |
//! | n_boot | [`BootstrapSettings::sets`] | – |

use nalgebra::{Matrix6, Vector6};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::horn::{self, ACROSS_MIN_M, Sums};
use super::motion_parameters::MotionParameters;
use super::ransac::Weighting;
use super::weighted_motion::{Correspondence, Loss, Normal, followed_by};
use crate::frames::{Point3, Pose, Vector3};

/// Number of times that a set is drawn again before the bootstrap fails.
const TRIES: u32 = 50;

/// Settings of the bootstrap.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BootstrapSettings {
    /// n_boot. Too few: a noisy covariance; the standard deviations have a relative error of 1/√(2 n_boot).
    pub sets: u32,
    /// Weighting of the matches, as in the examined fit.
    pub weighting: Weighting,
    /// Robust loss of the residuals, with weighting by range.
    pub loss: Loss,
    /// Seed of the draws.
    pub seed: u64,
}

impl Default for BootstrapSettings {
    /// 200 sets (ours, R173), unweighted.
    fn default() -> Self {
        Self { sets: 200, weighting: Weighting::None, loss: Loss::Squares, seed: 0 }
    }
}

/// The uncertainty of a motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Bootstrap {
    /// θ*: the examined motion.
    pub parameters: MotionParameters,
    /// P_θθ of x, y, z (m), roll, pitch, yaw (rad), by columns.
    #[schema(value_type = Vec<f64>)]
    pub covariance: Matrix6<f64>,
    /// θ^b of every set, in the same order, the angles within a half turn of θ*.
    pub samples: Vec<[f64; 6]>,
}

/// Fits the drawn sets, using sums common to all draws.
enum Refitter {
    /// Offsets of the matches from two fixed points, for Horn's sums.
    Plain { from: Point3, to: Point3, offsets: Vec<(Vector3, Vector3)> },
    /// The contribution of each match to the normal equations at θ*.
    Weighted { motion: Pose, about: Point3, shares: Vec<Normal> },
}

impl Refitter {
    /// `None` if a match cannot be weighted.
    fn new(inliers: &[Correspondence], motion: &Pose, settings: &BootstrapSettings) -> Option<Self> {
        let (from, to) = (inliers.first()?.before, inliers.first()?.after);
        Some(match settings.weighting {
            Weighting::None => {
                let offsets = inliers.iter().map(|pair| (pair.before - from, pair.after - to)).collect();
                Self::Plain { from, to, offsets }
            }
            Weighting::Range => {
                let centre = inliers.iter().map(|pair| pair.after.coords).sum::<Vector3>();
                let about = Point3::from(centre / inliers.len() as f64);
                let share = |pair| Normal::of(pair, motion, &about, settings.loss);
                let shares = inliers.iter().map(share).collect::<Option<Vec<_>>>()?;
                Self::Weighted { motion: *motion, about, shares }
            }
        })
    }

    /// Fits the matches, each drawn `times`; `None` if they do not determine a motion.
    fn refit(&self, times: &[u32]) -> Option<Pose> {
        match self {
            Self::Plain { from, to, offsets } => {
                let mut sums = Sums::default();
                for ((before, after), &times) in offsets.iter().zip(times) {
                    sums.add(f64::from(times), before, after);
                }
                let fitted = sums.fit();
                (fitted.across_m >= ACROSS_MIN_M).then(|| horn::between(from, to, &fitted.motion))
            }
            Self::Weighted { motion, about, shares } => {
                let mut sum = Normal::default();
                for (share, &times) in shares.iter().zip(times) {
                    sum.add(share, f64::from(times));
                }
                sum.solve().map(|(step, _)| followed_by(motion, &step, about))
            }
        }
    }
}

/// Computes the covariance of a motion from its inliers.
///
/// `None` for fewer than three inliers, if hardly any drawn set determines the motion, or if a covariance that gives
/// a weight has no inverse.
pub fn bootstrap(
    inliers: &[Correspondence],
    after_from_before: &Pose,
    settings: &BootstrapSettings,
) -> Option<Bootstrap> {
    let blocks: Vec<u32> = (0..inliers.len() as u32).collect();
    block_bootstrap(inliers, &blocks, after_from_before, settings)
}

/// As [`bootstrap`], for correlated errors of neighbours: whole blocks are drawn; `blocks` has the block of each match.
///
/// Features of one stone have correlated errors, so that they are fewer independent observations than their number
/// (the block bootstrap of Künsch 1989, in the plane). The number of matches in a set then varies. `None` as for
/// [`bootstrap`].
pub fn block_bootstrap(
    inliers: &[Correspondence],
    blocks: &[u32],
    after_from_before: &Pose,
    settings: &BootstrapSettings,
) -> Option<Bootstrap> {
    let refitter = Refitter::new(inliers, after_from_before, settings)?;
    let parameters = MotionParameters::from(after_from_before);
    let mut random = Pcg64::seed_from_u64(settings.seed);
    let mut names = blocks.to_vec();
    names.sort_unstable();
    names.dedup();
    let blocks: Vec<usize> = blocks.iter().map(|name| names.partition_point(|other| other < name)).collect();
    let (mut drawn, mut times) = (vec![0; names.len()], vec![0; inliers.len()]);
    let mut covariance = Matrix6::zeros();
    let mut samples = Vec::with_capacity(settings.sets as usize);
    for _ in 0..settings.sets {
        let motion = (0..TRIES).find_map(|_| {
            draw(&mut drawn, &mut random);
            for (times, &block) in times.iter_mut().zip(&blocks) {
                *times = drawn[block];
            }
            let different = times.iter().filter(|&&times| times > 0).count();
            if different < 3 { None } else { refitter.refit(&times) }
        })?;
        let difference = MotionParameters::from(&motion).minus(parameters);
        covariance += difference * difference.transpose();
        let sample: Vector6<f64> = parameters.to_vector() + difference;
        samples.push(sample.into());
    }
    covariance /= f64::from(settings.sets.max(1));
    Some(Bootstrap { parameters, covariance, samples })
}

/// Draws as many blocks as there are, with replacement; counts how often each was drawn.
fn draw(times: &mut [u32], random: &mut Pcg64) {
    times.fill(0);
    for _ in 0..times.len() {
        times[random.random_range(0..times.len())] += 1;
    }
}

#[cfg(test)]
#[path = "bootstrap_tests.rs"]
mod tests;
