//! Stage 7, `set_goal`: the goal position from the target, the standoff and the offset (R6–R8).
//!
//! ```text
//! goal = target + standoff · (start − target)/|start − target| + offset      horizontally, site frame
//! ```
//! `start` is the rover's position at the time of the command, and `standoff` is the final one after an approach has
//! begun.
//!
//! Frame: site, m. Source: papers.md R6, R7.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::{Point3, Pose};

use super::command::DriveCommand;

/// The position at which the rover is to stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = DriveGoal)]
pub struct Goal {
    /// The goal, x and y of the site frame, m.
    pub in_site_m: [f64; 2],
    /// The same relative to the rover's origin, ahead and to the right, m.
    pub in_rover_m: [f64; 2],
    /// Horizontal distance of the rover's origin from it, m.
    pub distance_m: f64,
    /// Whether the distance is within the command's tolerance.
    pub arrived: bool,
}

/// Horizontal goal position for a target, x and y of the site frame, m; `start_m` is the rover's position at the time of
/// the command, `actions` the number of begun actions after arrival.
pub fn goal_position_m(
    command: &DriveCommand,
    actions: u32,
    target_in_site: &Point3,
    start_m: [f64; 2],
) -> [f64; 2] {
    let back = [start_m[0] - target_in_site.x, start_m[1] - target_in_site.y];
    let length_m = back[0].hypot(back[1]);
    let scale = if length_m > 0.0 { command.standoff_after_m(actions) / length_m } else { 0.0 };
    [
        target_in_site.x + scale * back[0] + command.offset_m[0],
        target_in_site.y + scale * back[1] + command.offset_m[1],
    ]
}

/// The goal relative to the rover.
pub fn set_goal(
    command: &DriveCommand,
    actions: u32,
    target_in_site: &Point3,
    start_m: [f64; 2],
    site_from_rover: &Pose,
) -> Goal {
    let in_site_m = goal_position_m(command, actions, target_in_site, start_m);
    let origin = site_from_rover.translation.vector;
    let (dx, dy) = (in_site_m[0] - origin.x, in_site_m[1] - origin.y);
    let (sine, cosine) = site_from_rover.rotation.euler_angles().2.sin_cos();
    let distance_m = dx.hypot(dy);
    Goal {
        in_site_m,
        in_rover_m: [cosine * dx + sine * dy, cosine * dy - sine * dx],
        distance_m,
        arrived: distance_m <= command.tolerance_m,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::frames::attitude_from_roll_pitch_yaw;

    #[test]
    fn the_goal_lies_on_the_line_to_the_start_and_moves_with_the_target() {
        let command = DriveCommand { standoff_m: 2.0, offset_m: [0.5, -0.25], ..DriveCommand::default() };
        let target = Point3::new(6.0, 8.0, 1.0);
        let pose = Pose::from_parts(
            [3.0, 4.0, 0.1].into(),
            attitude_from_roll_pitch_yaw(0.1, -0.05, std::f64::consts::FRAC_PI_2),
        );
        let goal = set_goal(&command, 0, &target, [0.0, 0.0], &pose);
        // Ten metres away along (0.6, 0.8): two metres back is eight along it.
        assert!((goal.in_site_m[0] - (4.8 + 0.5)).abs() < 1e-12);
        assert!((goal.in_site_m[1] - (6.4 - 0.25)).abs() < 1e-12);
        // Heading along y of the site: y of the site is ahead, x to the left.
        assert!((goal.in_rover_m[0] - 2.15).abs() < 1e-12 && (goal.in_rover_m[1] + 2.3).abs() < 1e-12);
        assert!(!goal.arrived);
        let moved =
            set_goal(&command, 0, &(target + sightline_geometry::frames::Vector3::x()), [0.0, 0.0], &pose);
        assert!(moved.in_site_m[0] > goal.in_site_m[0] + 0.5);
    }

    #[test]
    fn a_rover_within_the_tolerance_has_arrived() {
        let command = DriveCommand { tolerance_m: 0.05, ..DriveCommand::default() };
        let at = |x: f64| {
            let pose = Pose::translation(x, 0.0, 0.0);
            set_goal(&command, 0, &Point3::new(10.0, 0.0, 0.0), [0.0, 0.0], &pose).arrived
        };
        assert!(at(7.96) && at(8.04) && !at(7.9) && !at(8.1));
    }
}
