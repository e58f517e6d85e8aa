//! The rover's body as boxes: the parts that cast shadows, and those that cameras see.
//!
//! Each part is a box in the rover frame, `centre + a h_1 + b h_2 + c h_3` with a, b, c in [−1, 1]. A wheel is two boxes,
//! one rotated by 45° about the axle, inscribed in the wheel's circle: their corners are on its rim. Wheels and arms
//! follow the angles of the suspension. Mast and camera bar cast shadows and are never seen: the cameras are inside them.
//!
//! | part | size, m | source |
//! |---|---|---|
//! | deck with panels | 1.6 × 2.3 | domain.md 5.4 |
//! | wheels | ⌀ 0.26 × 0.16 | domain.md 5.4; the width is ours |
//! | mast, camera bar | axes at (0.458, 0.028, −1.097), cameras 0.15 above | domain.md 4.1 |
//! | height of deck and body, their thickness, arms | as below | ours |
//!
//! Frame: rover (x forward, y right, z down), m.

use sightline_geometry::frames::{Point3, Vector3};

use crate::rover::suspension::{
    BOGIE_PIVOT_M, ROCKER_PIVOT_M, SuspensionAngles, WHEEL_RADIUS_M, WHEEL_WIDTH_M, axles_in_rover,
};

/// Half of an arm's thickness, m (ours).
const ARM_HALF_M: f64 = 0.025;

/// A box of the rover.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct BodyPart {
    /// Name of the part.
    pub name: &'static str,
    /// Its centre, rover frame, m.
    pub centre: Point3,
    /// Three half-axes at right angles, from the centre to the middles of three faces, rover frame, m.
    pub half_axes: [Vector3; 3],
    /// Whether cameras see it; it casts its shadow in any case.
    pub is_seen: bool,
}

/// A box along the axes of the rover frame.
fn upright(name: &'static str, from: [f64; 3], to: [f64; 3], is_seen: bool) -> BodyPart {
    let (from, to) = (Vector3::from(from), Vector3::from(to));
    let half = (to - from) * 0.5;
    let half_axes = [Vector3::x() * half.x, Vector3::y() * half.y, Vector3::z() * half.z];
    BodyPart { name, centre: Point3::from((from + to) * 0.5), half_axes, is_seen }
}

/// An arm of square section between two points that have the same y.
fn arm(name: &'static str, from: Point3, to: Point3) -> BodyPart {
    let half = (to - from) * 0.5;
    let across = half.cross(&Vector3::y()).normalize() * ARM_HALF_M;
    BodyPart {
        name,
        centre: from + half,
        half_axes: [half, Vector3::y() * ARM_HALF_M, across],
        is_seen: true,
    }
}

/// The two boxes of a wheel, one rotated by 45° against the other.
fn wheel(centre: Point3) -> [BodyPart; 2] {
    let across = Vector3::y() * (0.5 * WHEEL_WIDTH_M);
    let side_m = WHEEL_RADIUS_M * std::f64::consts::FRAC_1_SQRT_2;
    let straight = [Vector3::x() * side_m, across, Vector3::z() * side_m];
    let half = 0.5 * WHEEL_RADIUS_M;
    let turned = [Vector3::new(half, 0.0, half), across, Vector3::new(-half, 0.0, half)];
    [straight, turned].map(|half_axes| BodyPart { name: "wheel", centre, half_axes, is_seen: true })
}

/// The parts of the rover at these suspension angles.
pub(crate) fn parts(angles: &SuspensionAngles) -> Vec<BodyPart> {
    let mut parts = vec![
        upright("deck", [-0.90, -1.15, -0.37], [0.70, 1.15, -0.33], true),
        upright("body", [-0.45, -0.33, -0.33], [0.50, 0.33, 0.02], true),
        upright("mast", [0.41, -0.02, -1.20], [0.51, 0.08, -0.37], false),
        upright("camera bar", [0.41, -0.20, -1.31], [0.51, 0.24, -1.20], false),
    ];
    let axles = axles_in_rover(angles);
    for side in 0..2 {
        let [front, middle, rear] = [axles[side], axles[2 + side], axles[4 + side]];
        // The arms run between the body and the wheels, in one plane for each side.
        let y_m = front.y - front.y.signum() * 0.5 * (WHEEL_WIDTH_M + 2.0 * ARM_HALF_M);
        let in_plane = |point: Point3| Point3::new(point.x, y_m, point.z);
        let turned = |[x, z]: [f64; 2]| {
            let (sine, cosine) = angles.rocker_rad[side].sin_cos();
            let (x, z) = (x - ROCKER_PIVOT_M[0], z - ROCKER_PIVOT_M[1]);
            let (turned_x, turned_z) = (cosine * x + sine * z, cosine * z - sine * x);
            Point3::new(ROCKER_PIVOT_M[0] + turned_x, y_m, ROCKER_PIVOT_M[1] + turned_z)
        };
        let (rocker_pivot, bogie_pivot) = (turned(ROCKER_PIVOT_M), turned(BOGIE_PIVOT_M));
        parts.push(arm("rocker arm", rocker_pivot, in_plane(front)));
        parts.push(arm("rocker arm", rocker_pivot, bogie_pivot));
        parts.push(arm("bogie arm", bogie_pivot, in_plane(middle)));
        parts.push(arm("bogie arm", bogie_pivot, in_plane(rear)));
    }
    parts.extend(axles.into_iter().flat_map(wheel));
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::camera::{Mast, MastAngles};

    /// The corners of a box.
    fn corners(part: &BodyPart) -> impl Iterator<Item = Point3> {
        let part = *part;
        (0..8).map(move |k| {
            let sign = |bit: u32| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            (0..3).fold(part.centre, |point, axis| point + part.half_axes[axis] * sign(axis as u32))
        })
    }

    #[test]
    fn the_rover_is_as_large_as_the_real_one_and_stands_on_its_wheels() {
        let parts = parts(&SuspensionAngles::default());
        let deck = parts.iter().find(|part| part.name == "deck").unwrap();
        let [length, width] = [deck.half_axes[0].norm() * 2.0, deck.half_axes[1].norm() * 2.0];
        assert!((length - 1.6).abs() < 1e-12 && (width - 2.3).abs() < 1e-12);
        let all = || parts.iter().flat_map(corners);
        let lowest_m = all().map(|point| point.z).fold(f64::MIN, f64::max);
        let highest_m = all().map(|point| point.z).fold(f64::MAX, f64::min);
        // The rotated box of each wheel stands on the ground with its edge.
        assert!((lowest_m - 0.294).abs() < 1e-12, "{lowest_m}");
        assert!((lowest_m - highest_m - 1.6).abs() < 0.02, "{highest_m}");
        assert_eq!(parts.iter().filter(|part| part.name == "wheel").count(), 12);
        assert!(all().all(|point| point.y.abs() <= 1.15 + 1e-12));
    }

    #[test]
    fn half_axes_are_at_right_angles_whatever_the_suspension() {
        let angles = SuspensionAngles { rocker_rad: [0.2, -0.2], bogie_rad: [-0.3, 0.4] };
        for part in parts(&angles) {
            let [a, b, c] = part.half_axes;
            assert!(a.dot(&b).abs() + b.dot(&c).abs() + c.dot(&a).abs() < 1e-15, "{part:?}");
        }
    }

    #[test]
    fn the_cameras_are_in_no_part_that_is_seen() {
        let (left, right) =
            Mast::spirit().cameras_in_rover(MastAngles { azimuth_rad: 0.4, elevation_rad: -0.6 });
        let front_hazcam = Point3::new(0.6098595, 0.0589344, -0.2336460);
        for centre in [left.model.centre(), right.model.centre(), front_hazcam] {
            for part in parts(&SuspensionAngles::default()).iter().filter(|part| part.is_seen) {
                let off = centre - part.centre;
                let outside = part.half_axes.iter().any(|half| off.dot(half).abs() > half.norm_squared());
                assert!(outside, "{centre} is in {}", part.name);
            }
        }
    }
}
