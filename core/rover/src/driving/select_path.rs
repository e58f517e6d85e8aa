//! Stage 9, `select_path`: the next motion towards the goal.
//!
//! [`ArcNavigator`] ignores obstacles: it drives along the circle that is tangent to the heading and passes through the
//! goal, by at most one step, or turns in place if the circle is too tight. Navigators with a hazard map implement the
//! same trait.
//!
//! ```text
//! β = atan2(y, x)      κ = 2 sin β / d      length to the goal = d β / sin β
//! ```
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | x, y | `goal_m`: goal ahead and to the right | m, rover |
//! | d, β | distance and bearing of the goal | m, rad |
//! | κ | curvature, positive to the right | 1/m |
//!
//! Frame: rover, horizontal. Sources: papers.md R104, R107; the rule is ours.

use sightline_geometry::frames::Pose;

use super::motion::Motion;
use super::path_choice::{Candidate, PathChoice};
use crate::hazards::goodness::GoodnessMap;
use crate::navigation::counterfactual::LimitChange;

/// Inputs of a navigator.
#[derive(Clone, Copy, Debug)]
pub struct PathInput<'a> {
    /// The goal ahead and to the right of the rover, m; not reached yet.
    pub goal_m: [f64; 2],
    /// Largest length of the motion, m.
    pub step_m: f64,
    /// The motion that led here; `None` at the first stop and if the rover stayed.
    pub before: Option<Motion>,
    /// The goodness map of this stop; `None` without range data.
    pub map: Option<&'a GoodnessMap>,
    /// The pose estimate.
    pub site_from_rover: &'a Pose,
}

/// Chooses the next motion.
pub trait Navigator {
    /// The motion towards the goal, with every considered path; no motion if no path is safe.
    fn select_path(&self, input: &PathInput<'_>) -> PathChoice;

    /// The smallest raised limit that opens a vetoed path of a choice; `None` if no single one does, and for a navigator
    /// without limits.
    fn smallest_change(&self, _input: &PathInput<'_>, _choice: &PathChoice) -> Option<LimitChange> {
        None
    }
}

/// A navigator without a hazard map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArcNavigator {
    /// Curvature of the tightest circle, 1/m.
    pub curvature_max_per_m: f64,
    /// A goal behind is approached backwards up to this distance, m; beyond it the rover turns.
    pub reverse_max_m: f64,
}

impl Default for ArcNavigator {
    fn default() -> Self {
        Self { curvature_max_per_m: 0.5, reverse_max_m: 0.5 }
    }
}

impl ArcNavigator {
    /// The motion towards a goal ahead and to the right of the rover, m, of at most `step_m`.
    pub fn motion(&self, [x, y]: [f64; 2], step_m: f64) -> Motion {
        let distance_m = x.hypot(y);
        if distance_m == 0.0 {
            return Motion::Arc { length_m: 0.0, curvature_per_m: 0.0 };
        }
        let is_reverse = x < 0.0 && distance_m <= self.reverse_max_m;
        // Backwards, the circle is that of the mirrored goal.
        let bearing_rad = y.atan2(if is_reverse { -x } else { x });
        let curvature_per_m = 2.0 * bearing_rad.sin() / distance_m;
        let is_behind = bearing_rad.abs() >= std::f64::consts::FRAC_PI_2;
        if is_behind || curvature_per_m.abs() > self.curvature_max_per_m {
            // The line to the goal, by the nearer end of the rover.
            let angle_rad = if is_reverse { -bearing_rad } else { bearing_rad };
            return Motion::Turn { angle_rad };
        }
        let stretch = if bearing_rad == 0.0 { 1.0 } else { bearing_rad / bearing_rad.sin() };
        let length_m = (distance_m * stretch).min(step_m);
        let sign = if is_reverse { -1.0 } else { 1.0 };
        Motion::Arc { length_m: sign * length_m, curvature_per_m }
    }
}

impl Navigator for ArcNavigator {
    fn select_path(&self, input: &PathInput<'_>) -> PathChoice {
        PathChoice::only(Candidate::unjudged(self.motion(input.goal_m, input.step_m)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arc_that_is_long_enough_ends_in_the_goal() {
        for goal in [[3.0, 0.4], [0.8, -0.1], [5.0, 0.0], [-0.3, 0.001], [-0.2, 0.0]] {
            let motion = ArcNavigator::default().motion(goal, 100.0);
            let ([x, y], _) = motion.after(1.0);
            assert!((x - goal[0]).hypot(y - goal[1]) < 1e-12, "{goal:?}: {motion:?} ends at {x} {y}");
        }
        let nowhere = Motion::Arc { length_m: 0.0, curvature_per_m: 0.0 };
        assert_eq!(ArcNavigator::default().motion([0.0, 0.0], 1.0), nowhere);
    }

    #[test]
    fn steps_are_no_longer_than_allowed_and_approach_the_goal() {
        let (mut place, mut heading_rad) = ([0.0f64; 2], 0.4f64);
        let goal = [6.0, -1.5];
        let mut steps = 0;
        loop {
            let (dx, dy) = (goal[0] - place[0], goal[1] - place[1]);
            let distance_m = dx.hypot(dy);
            if distance_m < 0.01 || steps > 60 {
                break;
            }
            let (sine, cosine) = heading_rad.sin_cos();
            let seen = [cosine * dx + sine * dy, cosine * dy - sine * dx];
            let motion = ArcNavigator::default().motion(seen, 0.3);
            if let Motion::Arc { length_m, .. } = motion {
                assert!(length_m.abs() <= 0.3);
            }
            let ([x, y], turned_rad) = motion.after(1.0);
            place = [place[0] + cosine * x - sine * y, place[1] + sine * x + cosine * y];
            heading_rad += turned_rad;
            steps += 1;
        }
        assert!(steps < 30, "{steps}");
    }

    #[test]
    fn a_goal_beside_or_far_behind_is_faced_first() {
        for (goal, deg) in [([0.0, 2.0], 90.0), ([-3.0, 0.1], 178.1), ([1.0, -1.0], -45.0)] {
            let Motion::Turn { angle_rad } = ArcNavigator::default().motion(goal, 1.0) else {
                panic!("no turn for {goal:?}");
            };
            assert!((angle_rad.to_degrees() - deg).abs() < 0.1, "{}", angle_rad.to_degrees());
        }
    }
}
