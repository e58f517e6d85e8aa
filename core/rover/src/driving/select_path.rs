//! Stage 9, `select_path`: the next motion towards the goal.
//!
//! [`ArcNavigator`] knows no obstacles: the circle that is tangent to the heading and passes through the goal, driven as far as
//! a step may go, or a turn in place where the circle is too tight. Navigators with a hazard map implement the same trait.
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

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// One motion of the rover.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Motion {
    /// Along a circle or straight ahead.
    Arc {
        /// Length of the path of the rover's origin, m; negative: backwards.
        length_m: f64,
        /// Curvature, 1/m; positive to the right, 0 straight ahead.
        curvature_per_m: f64,
    },
    /// On the spot.
    Turn {
        /// Angle, rad, positive to the right.
        angle_rad: f64,
    },
}

impl Motion {
    /// Where the rover is after a part of the motion, 0 to 1, on level ground without slip: ahead and to the right of its
    /// start, m, and turned to the right, rad.
    pub fn after(&self, part: f64) -> ([f64; 2], f64) {
        match *self {
            Self::Turn { angle_rad } => ([0.0; 2], part * angle_rad),
            Self::Arc { length_m, curvature_per_m } => {
                let (length_m, turn_rad) = (part * length_m, part * length_m * curvature_per_m);
                // Of a circle so wide the difference from a straight line is below rounding.
                if turn_rad.abs() < 1e-9 {
                    return ([length_m, 0.0], turn_rad);
                }
                ([turn_rad.sin() / curvature_per_m, (1.0 - turn_rad.cos()) / curvature_per_m], turn_rad)
            }
        }
    }
}

/// Chooses the next motion.
pub trait Navigator {
    /// A motion towards a goal ahead and to the right of the rover, m, of at most `step_m`; the goal is not reached yet.
    fn select_path(&self, goal_m: [f64; 2], step_m: f64) -> Motion;
}

/// A navigator without a hazard map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArcNavigator {
    /// Tightest circle, 1/m.
    pub curvature_max_per_m: f64,
    /// A goal behind is reached backwards up to this distance, m; farther away the rover turns.
    pub reverse_max_m: f64,
}

impl Default for ArcNavigator {
    fn default() -> Self {
        Self { curvature_max_per_m: 0.5, reverse_max_m: 0.5 }
    }
}

impl Navigator for ArcNavigator {
    fn select_path(&self, [x, y]: [f64; 2], step_m: f64) -> Motion {
        let distance_m = x.hypot(y);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_end_of_a_motion_is_that_of_many_small_ones() {
        for motion in [
            Motion::Arc { length_m: 2.0, curvature_per_m: 0.4 },
            Motion::Arc { length_m: -1.0, curvature_per_m: -0.3 },
            Motion::Arc { length_m: 1.5, curvature_per_m: 0.0 },
            Motion::Turn { angle_rad: -0.8 },
        ] {
            let (length_m, turn_rad) = match motion {
                Motion::Arc { length_m, curvature_per_m } => (length_m, length_m * curvature_per_m),
                Motion::Turn { angle_rad } => (0.0, angle_rad),
            };
            let (mut place, mut heading_rad) = ([0.0f64; 2], 0.0f64);
            for _ in 0..100_000 {
                let half = heading_rad + 0.5e-5 * turn_rad;
                place = [place[0] + 1e-5 * length_m * half.cos(), place[1] + 1e-5 * length_m * half.sin()];
                heading_rad += 1e-5 * turn_rad;
            }
            let (end, turned_rad) = motion.after(1.0);
            assert!((end[0] - place[0]).hypot(end[1] - place[1]) < 1e-9, "{motion:?}: {end:?} {place:?}");
            assert!((turned_rad - heading_rad).abs() < 1e-9);
        }
    }

    #[test]
    fn an_arc_that_is_long_enough_ends_in_the_goal() {
        for goal in [[3.0, 0.4], [0.8, -0.1], [5.0, 0.0], [-0.3, 0.001], [-0.2, 0.0]] {
            let motion = ArcNavigator::default().select_path(goal, 100.0);
            let ([x, y], _) = motion.after(1.0);
            assert!((x - goal[0]).hypot(y - goal[1]) < 1e-12, "{goal:?}: {motion:?} ends at {x} {y}");
        }
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
            let motion = ArcNavigator::default().select_path(seen, 0.3);
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
            let Motion::Turn { angle_rad } = ArcNavigator::default().select_path(goal, 1.0) else {
                panic!("no turn for {goal:?}");
            };
            assert!((angle_rad.to_degrees() - deg).abs() < 0.1, "{}", angle_rad.to_degrees());
        }
    }
}
