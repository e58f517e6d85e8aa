//! Step `consistent_set`: the largest set of matches whose mutual distances are the same before and after the motion.
//!
//! ```text
//! i, j agree:  | |p_i − p_j| − |q_i − q_j| | < 3 σ_ij
//! σ_ij² = eᵀ (C_pi + C_pj) e + fᵀ (C_qi + C_qj) f      e, f: directions of p_i − p_j and q_i − q_j
//! ```
//! The set grows from the match that agrees with most others, each time by the remaining match that agrees with most of
//! the others, until none agrees with all (the greedy clique of Hirschmüller 2002 and Howard 2008). It needs no motion and
//! no random samples.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | p, q; C_p, C_q | positions before and after, covariances | m, m²; rover frames |
//!
//! Source: domain.md 9.2, step 5.

use sightline_geometry::estimate::weighted_motion::Correspondence;

/// Number of standard deviations within which two distances agree.
const SIGMAS: f64 = 3.0;
/// Smallest distance of two points with a defined direction, m.
const NEAREST_M: f64 = 1e-6;

/// Indices of the matches of the largest consistent set found, in ascending order.
pub(super) fn consistent_set(pairs: &[Correspondence]) -> Vec<usize> {
    let count = pairs.len();
    let mut agrees = vec![false; count * count];
    for i in 0..count {
        for j in 0..i {
            let both = agree(&pairs[i], &pairs[j]);
            (agrees[i * count + j], agrees[j * count + i]) = (both, both);
        }
    }
    let mut candidates: Vec<usize> = (0..count).collect();
    let mut set = Vec::new();
    while !candidates.is_empty() {
        let friends = |i: usize| candidates.iter().filter(|&&j| agrees[i * count + j]).count();
        // Of equal ones, the first.
        let Some(&best) = candidates.iter().max_by_key(|&&i| (friends(i), count - i)) else { break };
        set.push(best);
        candidates.retain(|&j| agrees[best * count + j]);
    }
    set.sort_unstable();
    set
}

/// Whether the distance of two matches is the same before and after.
fn agree(a: &Correspondence, b: &Correspondence) -> bool {
    let (before, after) = (a.before - b.before, a.after - b.after);
    let (long, there) = (before.norm(), after.norm());
    if long < NEAREST_M || there < NEAREST_M {
        return false;
    }
    let (e, f) = (before / long, after / there);
    let variance = e.dot(&((a.before_covariance + b.before_covariance) * e))
        + f.dot(&((a.after_covariance + b.after_covariance) * f));
    (long - there).powi(2) < SIGMAS * SIGMAS * variance
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Translation3, UnitQuaternion};
    use rand::{RngExt, SeedableRng};
    use rand_pcg::Pcg64;
    use sightline_geometry::frames::{Point3, Pose, Vector3};

    use super::*;

    #[test]
    fn two_fifths_of_wrong_matches_are_left_out_and_nearly_all_right_ones_kept() {
        let mut random = Pcg64::seed_from_u64(5);
        let turn = UnitQuaternion::from_euler_angles(0.02, -0.03, 0.3);
        let motion = Pose::from_parts(Translation3::new(-0.6, 0.1, 0.02), turn);
        let mut any = |from: f64, to: f64| random.random_range(from..to);
        let pairs: Vec<Correspondence> = (0..100)
            .map(|i| {
                let before = Point3::new(any(2.0, 6.0), any(-2.0, 2.0), any(-0.3, 0.3));
                let noise = Vector3::new(any(-1.0, 1.0), any(-1.0, 1.0), any(-1.0, 1.0)) * 0.01;
                let wrong = Vector3::new(any(-1.0, 1.0), any(-1.0, 1.0), any(-0.3, 0.3));
                let after = motion * before + noise + if i < 40 { wrong } else { Vector3::zeros() };
                let covariance = Matrix3::identity() * (0.01f64.powi(2) / 3.0);
                Correspondence { before, after, before_covariance: covariance, after_covariance: covariance }
            })
            .collect();
        let set = consistent_set(&pairs);
        assert!(set.len() >= 55, "{}", set.len());
        assert!(set.iter().filter(|&&i| i < 40).count() <= 1, "{set:?}");
    }

    #[test]
    fn no_match_or_one_is_a_set_of_itself() {
        assert!(consistent_set(&[]).is_empty());
        let covariance = Matrix3::identity();
        let (before, after) = (Point3::origin(), Point3::origin());
        let pair =
            Correspondence { before, after, before_covariance: covariance, after_covariance: covariance };
        assert_eq!(consistent_set(&[pair]), [0]);
    }
}
