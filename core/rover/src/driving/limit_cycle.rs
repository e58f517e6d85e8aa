//! Limit cycles: a rover that returns to one place again and again will not arrive.
//!
//! A visit is a sequence of consecutive stops near the current pose estimate: within 5 cm, horizontally, and 5°. Motions
//! are functions of the pose, the map and the goal, which hardly change between visits, so that the decisions repeat.
//!
//! Frame: site. Source: Spirit on sol 206 (driving.md 3); the rule is ours.

use sightline_geometry::frames::Pose;

/// Largest distance and heading difference of poses at the same place, m and rad.
const NEAR_M: f64 = 0.05;
const NEAR_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// The visit to one place at which the drive ends.
pub(super) const VISITS_MAX: usize = 4;

/// The first index of each visit to the last of `poses`, which is one of them.
pub(super) fn visits(poses: &[Pose]) -> Vec<usize> {
    let Some(last) = poses.last() else { return Vec::new() };
    let is_near = |pose: &Pose| {
        let change = last.translation.vector - pose.translation.vector;
        change.x.hypot(change.y) < NEAR_M && last.rotation.angle_to(&pose.rotation) < NEAR_RAD
    };
    let near: Vec<bool> = poses.iter().map(is_near).collect();
    (0..near.len()).filter(|&index| near[index] && (index == 0 || !near[index - 1])).collect()
}

/// Describes the stops at one place in a sentence.
pub(super) fn sentence(stops: &[usize]) -> String {
    let numbers: Vec<String> = stops.iter().map(ToString::to_string).collect();
    let (last, others) = numbers.split_last().map_or(("", &[][..]), |(last, others)| (last.as_str(), others));
    format!("stops {} and {last} are at the same place, within 5 cm and 5°", others.join(", "))
}

#[cfg(test)]
mod tests {
    use sightline_geometry::frames::attitude_from_roll_pitch_yaw;

    use super::*;

    fn pose(x_m: f64, heading_deg: f64) -> Pose {
        let rotation = attitude_from_roll_pitch_yaw(0.0, 0.0, heading_deg.to_radians());
        Pose::from_parts([x_m, 0.0, 0.0].into(), rotation)
    }

    #[test]
    fn a_rover_that_turns_to_and_fro_visits_one_place_again() {
        let poses = [
            pose(0.0, 0.0),
            pose(1.0, 0.0),
            pose(1.0, 18.0),
            pose(1.01, 1.0),
            pose(1.0, 19.0),
            pose(1.0, -1.0),
        ];
        assert_eq!(visits(&poses), [1, 3, 5]);
        assert_eq!(visits(&poses[..5]), [2, 4]);
        assert_eq!(sentence(&visits(&poses)), "stops 1, 3 and 5 are at the same place, within 5 cm and 5°");
    }

    #[test]
    fn a_rover_that_approaches_in_small_steps_or_stays_is_on_one_visit() {
        let poses: Vec<Pose> = (0..20).map(|k| pose(1.0 + 0.02 * f64::from(k % 2), 0.0)).collect();
        assert_eq!(visits(&poses), [0]);
        let poses: Vec<Pose> = (0..20).map(|k| pose(0.1 * f64::from(k), 0.0)).collect();
        assert_eq!(visits(&poses), [19]);
        assert!(visits(&[]).is_empty());
    }
}
