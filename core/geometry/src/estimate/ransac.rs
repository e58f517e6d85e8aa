//! The rigid motion with the largest consensus among matches with outliers (D§2, R164–R167; domain.md 13.2).
//!
//! ```text
//! M times: sample 3 matches, fit the motion T (Horn), count the inliers                   R164
//! gate:    | q − T p | < τ                                                                 R165, D-Eq 2
//!     or   (q − T p)ᵀ (C_q + R C_p Rᵀ)⁻¹ (q − T p) < limit²                                R167, ours
//! keep the largest consensus; of two equal ones, that with the smaller sum of squared distances
//! fit to all inliers; repeat while the set of inliers changes                              R166
//! ```
//!
//! A minimal sample that is nearly collinear does not determine the rotation about its line: it is drawn again. The
//! criterion is the smallest altitude of its triangle; the least area of 1e-4 m² that domain.md 13.1 names as well
//! follows from an altitude of 2 cm, whose smallest triangle has 2.3e-4 m². The repeated fit may return to an earlier
//! set of inliers: it then ends (ours), as it does after a maximum number of fits. With `adaptive`, iterations
//! continue until a sample without outliers is probable enough, 1 − (1 − w³)^M, with w the largest share of inliers so far.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | p, q; C_p, C_q | [`Correspondence`] | m, m²; frames before and after |
//! | T | `after_from_before` | – |
//! | τ | [`RansacSettings::inlier_m`] | m |
//! | M | [`RansacSettings::draws`] | – |

use nalgebra::Matrix3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::horn::{self, Degenerate, Sums, rigid_motion, shape_of};
use super::quantile::median;
use super::weighted_motion::{Correspondence, Loss, rigid_motion_by_covariance};
use crate::frames::{Point3, Pose, PoseRecord};

/// Number of times that a nearly collinear sample is drawn again in one iteration.
const TRIES: u32 = 20;
/// Spread across the main axis below which a sample has no motion, m: its two triangles have opposite shapes.
const DRAWN_ACROSS_M: f64 = 1e-4;

/// The inlier test of a match.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[schema(as = InlierGate)]
pub enum Gate {
    /// The residual is shorter than `inlier_m`, as in the paper.
    #[default]
    Distance,
    /// The residual is within `limit` standard deviations of its own covariance.
    Mahalanobis {
        /// In standard deviations; 3 accepts 97.1 % of correct matches, 3.37 accepts 99 %.
        limit: f64,
    },
}

/// The weights of the inliers in the fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Weighting {
    /// Equal weights: Horn's closed form, as in the paper.
    #[default]
    None,
    /// By their covariance, which grows with range.
    Range,
}

/// Settings of the motion estimate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RansacSettings {
    /// τ: largest residual of an inlier, m. Too small: far matches are lost; too large: wrong ones pass.
    pub inlier_m: f64,
    /// M: number of iterations, the smallest one if `adaptive`. Too few: no sample is free of outliers.
    pub draws: u32,
    /// Whether iterations continue until success is probable enough.
    pub adaptive: bool,
    /// Required probability of a sample without outliers, if `adaptive`.
    pub success: f64,
    /// Largest number of iterations, if `adaptive`.
    pub draws_max: u32,
    /// Largest number of fits to the inliers.
    pub refits_max: u32,
    /// Smallest altitude of the triangle of a minimal sample, before and after, m.
    pub altitude_min_m: f64,
    /// The inlier test.
    pub gate: Gate,
    /// The weights of the inliers in the fit.
    pub weighting: Weighting,
    /// Robust loss of the residuals; only with weighting by range.
    pub loss: Loss,
    /// Seed of the samples.
    pub seed: u64,
}

impl Default for RansacSettings {
    /// The paper's values: 100 iterations, 3 cm, unweighted (R164, R165); the rest is ours (R166, domain.md 13).
    fn default() -> Self {
        Self {
            inlier_m: 0.03,
            draws: 100,
            adaptive: false,
            success: 0.999,
            draws_max: 2000,
            refits_max: 20,
            altitude_min_m: 0.02,
            gate: Gate::Distance,
            weighting: Weighting::None,
            loss: Loss::Squares,
            seed: 0,
        }
    }
}

/// One fit to the inliers of the previous motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Refit {
    /// Number of inliers.
    pub inliers: u32,
    /// Root mean square of their residuals under the fitted motion, m.
    pub rms_m: f64,
}

/// The end of the repeated fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// The set of inliers did not change.
    Settled,
    /// The set of inliers was that of an earlier fit, so that the sets would repeat for ever.
    Repeating,
    /// The largest number of fits was reached.
    UsedUp,
}

/// The estimated motion, with its inliers and fits.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MotionFit {
    /// T; `None` with a reason in `missing`.
    pub after_from_before: Option<PoseRecord>,
    /// Why there is no motion, as one sentence.
    pub missing: Option<String>,
    /// Indices of the inliers, ascending.
    pub inliers: Vec<usize>,
    /// Residuals of all matches after the motion, m; empty without a motion.
    pub residuals_m: Vec<f64>,
    /// Number of inliers of each iteration; 0 if all its samples were collinear.
    pub consensus_by_draw: Vec<u32>,
    /// The fits to the inliers, in order.
    pub refits: Vec<Refit>,
    /// The end of the fits.
    pub ending: Option<Ending>,
    /// Root mean square of the inliers' residuals, m.
    pub rms_m: Option<f64>,
    /// Median of the inliers' residuals, m.
    pub median_m: Option<f64>,
}

impl MotionFit {
    /// The estimated motion.
    pub fn motion(&self) -> Option<Pose> {
        self.after_from_before.map(PoseRecord::to_pose)
    }

    fn without_motion(mut self, reason: impl ToString) -> Self {
        self.missing = Some(reason.to_string());
        self
    }
}

/// The matches in columns, so that several residuals are computed at a time.
struct Matches<'a> {
    pairs: &'a [Correspondence],
    before: [Vec<f64>; 3],
    after: [Vec<f64>; 3],
    gate: Gate,
    /// Upper bound of an inlier's squared residual, m².
    outer_m2: Vec<f64>,
}

impl<'a> Matches<'a> {
    fn new(pairs: &'a [Correspondence], settings: &RansacSettings) -> Self {
        let column =
            |of: fn(&Correspondence) -> &Point3, axis: usize| pairs.iter().map(|p| of(p)[axis]).collect();
        // The trace of a covariance is at least its largest variance, and is invariant to rotation.
        let outer_m2 = |pair: &Correspondence| match settings.gate {
            Gate::Distance => settings.inlier_m * settings.inlier_m,
            Gate::Mahalanobis { limit } => {
                (pair.before_covariance.trace() + pair.after_covariance.trace()) * limit * limit
            }
        };
        Self {
            pairs,
            before: [0, 1, 2].map(|axis| column(|pair| &pair.before, axis)),
            after: [0, 1, 2].map(|axis| column(|pair| &pair.after, axis)),
            gate: settings.gate,
            outer_m2: pairs.iter().map(outer_m2).collect(),
        }
    }

    /// Squared lengths of all residuals under a motion, m².
    fn squares_m2(&self, motion: &Pose, into: &mut Vec<f64>) {
        let r = motion.rotation.to_rotation_matrix();
        let (r, t) = (r.matrix(), motion.translation.vector);
        let ([x, y, z], [u, v, w]) = (&self.before, &self.after);
        let matches = x.iter().zip(y).zip(z).zip(u).zip(v).zip(w);
        into.clear();
        into.extend(matches.map(|(((((x, y), z), u), v), w)| {
            let du = u - (r.m11 * x + r.m12 * y + r.m13 * z + t.x);
            let dv = v - (r.m21 * x + r.m22 * y + r.m23 * z + t.y);
            let dw = w - (r.m31 * x + r.m32 * y + r.m33 * z + t.z);
            du * du + dv * dv + dw * dw
        }));
    }

    /// Whether a match whose squared residual is below the bound is an inlier.
    fn is_inside(&self, match_: usize, motion: &Pose, rotation: &Matrix3<f64>) -> bool {
        let Gate::Mahalanobis { limit } = self.gate else { return true };
        let pair = &self.pairs[match_];
        let residual = pair.residual(motion);
        let solved = pair.residual_covariance(rotation).cholesky().map(|factor| factor.solve(&residual));
        solved.is_some_and(|solved| residual.dot(&solved) < limit * limit)
    }

    /// Number of inliers of a motion with the squared residuals `squares_m2`.
    fn count(&self, motion: &Pose, squares_m2: &[f64]) -> u32 {
        match self.gate {
            Gate::Distance => {
                squares_m2.iter().zip(&self.outer_m2).map(|(square, limit)| u32::from(square < limit)).sum()
            }
            Gate::Mahalanobis { .. } => self.inliers(motion, squares_m2).len() as u32,
        }
    }

    /// Indices of these inliers.
    fn inliers(&self, motion: &Pose, squares_m2: &[f64]) -> Vec<usize> {
        let rotation = motion.rotation.to_rotation_matrix();
        let outer = squares_m2.iter().zip(&self.outer_m2).enumerate();
        let near = outer.filter(|(_, (square, limit))| square < limit).map(|(i, _)| i);
        near.filter(|&i| self.is_inside(i, motion, rotation.matrix())).collect()
    }
}

/// Estimates the motion with the largest consensus.
pub fn fit_motion(pairs: &[Correspondence], settings: &RansacSettings) -> MotionFit {
    let mut fit = MotionFit::default();
    if pairs.len() < 3 {
        return fit.without_motion(Degenerate::TooFew { matches: pairs.len() });
    }
    let matches = Matches::new(pairs, settings);
    let Some((motion, inliers)) = draw(&matches, settings, &mut fit.consensus_by_draw) else {
        let [before, after] = [|pair: &Correspondence| pair.before, |pair: &Correspondence| pair.after]
            .map(|of| shape_of(&pairs.iter().map(of).collect::<Vec<_>>()));
        return match before.or(after) {
            Some(degenerate) => fit.without_motion(degenerate),
            None => fit.without_motion("no minimal sample of three matches spans a triangle"),
        };
    };
    if inliers.len() < 3 {
        return fit.without_motion("no draw found three matches that agree on a motion");
    }
    refit(fit, &matches, settings, motion, inliers)
}

/// The sampled motion with the largest consensus, and its inliers; `None` if all samples were collinear.
fn draw(
    matches: &Matches<'_>,
    settings: &RansacSettings,
    consensus_by_draw: &mut Vec<u32>,
) -> Option<(Pose, Vec<usize>)> {
    let mut random = Pcg64::seed_from_u64(settings.seed);
    let mut squares = Vec::with_capacity(matches.pairs.len());
    let mut best: Option<(u32, f64, Pose)> = None;
    while is_to_draw(consensus_by_draw.len(), best.map_or(0, |best| best.0), matches.pairs.len(), settings) {
        let Some(motion) = (0..TRIES).find_map(|_| drawn_motion(matches.pairs, settings, &mut random)) else {
            consensus_by_draw.push(0);
            continue;
        };
        matches.squares_m2(&motion, &mut squares);
        let count = matches.count(&motion, &squares);
        consensus_by_draw.push(count);
        if best.is_some_and(|(most, ..)| count < most) {
            continue;
        }
        let sum_m2: f64 = matches.inliers(&motion, &squares).iter().map(|&i| squares[i]).sum();
        if best.is_none_or(|(most, least_m2, _)| count > most || sum_m2 < least_m2) {
            best = Some((count, sum_m2, motion));
        }
    }
    best.map(|(_, _, motion)| {
        matches.squares_m2(&motion, &mut squares);
        (motion, matches.inliers(&motion, &squares))
    })
}

/// Probability that none of `draws` minimal samples of three is free of outliers, at a share of inliers (R226).
fn failure_probability(share: f64, draws: usize) -> f64 {
    (1.0 - share.powi(3)).powf(draws as f64)
}

/// Whether another iteration follows `done` iterations, of which the best had `most` inliers among all matches.
fn is_to_draw(done: usize, most: u32, all: usize, settings: &RansacSettings) -> bool {
    let share = f64::from(most) / all as f64;
    let failure = failure_probability(share, done);
    done < settings.draws as usize
        || (settings.adaptive && done < settings.draws_max as usize && failure > 1.0 - settings.success)
}

/// The motion of a random minimal sample; `None` if its matches coincide or are nearly collinear.
fn drawn_motion(pairs: &[Correspondence], settings: &RansacSettings, random: &mut Pcg64) -> Option<Pose> {
    let drawn = [(); 3].map(|()| &pairs[random.random_range(0..pairs.len())]);
    let (before, after) = (drawn.map(|pair| pair.before), drawn.map(|pair| pair.after));
    if altitude_m(&before).min(altitude_m(&after)) < settings.altitude_min_m {
        return None;
    }
    let mut sums = Sums::default();
    for (p, q) in before.iter().zip(&after) {
        sums.add(1.0, &(p - before[0]), &(q - after[0]));
    }
    let fitted = sums.fit();
    (fitted.across_m > DRAWN_ACROSS_M).then(|| horn::between(&before[0], &after[0], &fitted.motion))
}

/// The smallest altitude of a triangle: twice its area over its longest side, m; 0 if all points coincide.
fn altitude_m([a, b, c]: &[Point3; 3]) -> f64 {
    let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared()).sqrt();
    if longest > 0.0 { (b - a).cross(&(c - a)).norm() / longest } else { 0.0 }
}

/// Repeats the fit to the inliers until their set no longer changes.
fn refit(
    mut fit: MotionFit,
    matches: &Matches<'_>,
    settings: &RansacSettings,
    mut motion: Pose,
    mut inliers: Vec<usize>,
) -> MotionFit {
    let mut squares = Vec::with_capacity(matches.pairs.len());
    let mut seen = vec![inliers.clone()];
    let mut ending = Ending::UsedUp;
    for _ in 0..settings.refits_max {
        motion = match fit_to(matches.pairs, &inliers, settings) {
            Ok(motion) => motion,
            Err(reason) => return fit.without_motion(format!("refit to the inliers: {reason}")),
        };
        matches.squares_m2(&motion, &mut squares);
        fit.refits.push(Refit { inliers: inliers.len() as u32, rms_m: rms(&squares, &inliers) });
        let now = matches.inliers(&motion, &squares);
        let is_same = now == inliers;
        inliers = now;
        if seen.contains(&inliers) {
            ending = if is_same { Ending::Settled } else { Ending::Repeating };
            break;
        }
        seen.push(inliers.clone());
    }
    if inliers.len() < 3 {
        return fit.without_motion("fewer than three inliers are left after the refit");
    }
    matches.squares_m2(&motion, &mut squares);
    fit.after_from_before = Some(PoseRecord::from(&motion));
    fit.ending = Some(ending);
    fit.rms_m = Some(rms(&squares, &inliers));
    fit.residuals_m = squares.iter().map(|square| square.sqrt()).collect();
    let residuals: Vec<f64> = inliers.iter().map(|&i| fit.residuals_m[i]).collect();
    fit.median_m = median(&residuals);
    fit.inliers = inliers;
    fit
}

/// Fits the motion to some of the matches.
fn fit_to(pairs: &[Correspondence], which: &[usize], settings: &RansacSettings) -> Result<Pose, Degenerate> {
    match settings.weighting {
        Weighting::None => {
            let (before, after): (Vec<_>, Vec<_>) =
                which.iter().map(|&i| (pairs[i].before, pairs[i].after)).unzip();
            rigid_motion(&before, &after, None)
        }
        Weighting::Range => {
            let pairs: Vec<_> = which.iter().map(|&i| pairs[i]).collect();
            Ok(rigid_motion_by_covariance(&pairs, settings.loss)?.after_from_before)
        }
    }
}

/// Root mean square of some residuals by their squares.
fn rms(squares: &[f64], which: &[usize]) -> f64 {
    (which.iter().map(|&i| squares[i]).sum::<f64>() / which.len() as f64).sqrt()
}

#[cfg(test)]
#[path = "ransac_tests.rs"]
mod tests;
