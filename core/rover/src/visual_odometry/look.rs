//! Mast pointing for odometry: at the ground ahead, and in turns half way back to the previous view.
//!
//! ```text
//! azimuth = ½ (azimuth before − turn)
//! ```
//! A view straight ahead keeps at least 60 % of the ground in steps of 0.75 m; a turn of 18° with a field of view of 45°
//! does so only if the mast compensates half of it (domain.md 9.2: at least 60 % of overlap). Frame: rover. Source: ours.

use std::f64::consts::{PI, TAU};

use sightline_geometry::camera::{Mast, MastAngles};
use sightline_geometry::frames::{Point3, Pose};

/// Horizontal distance of the ground at the centre of the view from the mast, m.
const AHEAD_M: f64 = 3.0;

/// The mast angles for the pair after a motion by wheels and gyro. `before` is the azimuth of the previous pair, whose
/// view must overlap. `None` if the mast cannot point there.
pub fn look(mast: &Mast, before: Option<f64>, predicted_after_from_before: &Pose) -> Option<MastAngles> {
    let turn_rad = predicted_after_from_before.inverse().rotation.euler_angles().2;
    let azimuth_rad = before.map_or(0.0, |before| 0.5 * (before - turn_rad));
    let origin = mast.origin_in_rover;
    let ground =
        Point3::new(origin.x + AHEAD_M * azimuth_rad.cos(), origin.y + AHEAD_M * azimuth_rad.sin(), 0.0);
    mast.point_left_centre_at(&ground)
}

/// The same backwards, at the rover's own tracks (R142).
pub(crate) fn look_back(
    mast: &Mast,
    before: Option<f64>,
    predicted_after_from_before: &Pose,
) -> Option<MastAngles> {
    let from_straight_back = |azimuth_rad: f64| azimuth_rad.rem_euclid(TAU) - PI;
    let ahead = look(mast, before.map(from_straight_back), predicted_after_from_before)?;
    Some(MastAngles { azimuth_rad: ahead.azimuth_rad + PI, ..ahead })
}

/// Whether the mast looks back.
pub(crate) fn is_back(angles: MastAngles) -> bool {
    angles.azimuth_rad.cos() < 0.0
}

#[cfg(test)]
mod tests {
    use nalgebra::Translation3;
    use sightline_geometry::frames::attitude_from_roll_pitch_yaw;

    use super::*;

    #[test]
    fn a_turn_is_shared_between_rover_and_mast() {
        let mast = Mast::spirit();
        let turned = |deg: f64| {
            let attitude = attitude_from_roll_pitch_yaw(0.0, 0.0, deg.to_radians());
            Pose::from_parts(Translation3::new(0.3, 0.0, 0.0), attitude).inverse()
        };
        let ahead = look(&mast, None, &Pose::identity()).unwrap();
        assert!(ahead.azimuth_rad.abs() < 0.05 && ahead.elevation_rad < -0.2, "{ahead:?}");
        // To the right by 18°: the previous view is 18° to the left, the new one 9°.
        let right = look(&mast, Some(0.0), &turned(18.0)).unwrap();
        assert!((right.azimuth_rad - ahead.azimuth_rad + 9f64.to_radians()).abs() < 0.01, "{right:?}");
        // Also backwards, with the previous azimuth in any revolution.
        for turns in [-TAU, 0.0, TAU] {
            let back = look_back(&mast, Some(PI + turns), &turned(18.0)).unwrap();
            assert!((back.azimuth_rad - right.azimuth_rad - PI).abs() < 0.01, "{back:?}");
            assert!(is_back(back) && !is_back(right) && back.elevation_rad == right.elevation_rad);
        }
    }
}
