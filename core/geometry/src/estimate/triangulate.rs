//! Triangulation of two rays: the midpoint of their shortest connection.
//!
//! For rays (o1, u1), (o2, u2) with unit u (domain.md 3.1; Yakimovsky & Cunningham 1978):
//!
//! ```text
//! b = o2 − o1   c = u1·u2   k = 1 − c²
//! s = (b·u1 − c b·u2)/k   t = (c b·u1 − b·u2)/k
//! X = (o1 + s u1 + o2 + t u2)/2   gap = |o1 + s u1 − o2 − t u2|
//! ```
//!
//! Both rays in one frame; all lengths in m. k is computed as |u1 × u2|², which loses no digits when the
//! rays are nearly parallel. The gap in pixels is gap · f/range, below about 1 px for a correct match.

use crate::frames::{Point3, Ray};

/// Smallest squared sine of the angle between two rays that are not parallel (domain.md 3.1).
const PARALLEL: f64 = 1e-12;

/// The closest approach of two rays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangulated {
    /// Midpoint of the shortest connection, in the rays' frame, m.
    pub point: Point3,
    /// Distance along the left ray, m.
    pub range_left_m: f64,
    /// Distance along the right ray, m.
    pub range_right_m: f64,
    /// Length of the shortest connection, m.
    pub gap_m: f64,
}

/// The midpoint of two rays; `None` if they are parallel or meet behind one of the cameras.
pub fn midpoint(left: &Ray, right: &Ray) -> Option<Triangulated> {
    let (u1, u2) = (&left.direction, &right.direction);
    let b = right.origin - left.origin;
    let c = u1.dot(u2);
    let k = u1.cross(u2).norm_squared();
    let s = (b.dot(u1) - c * b.dot(u2)) / k;
    let t = (c * b.dot(u1) - b.dot(u2)) / k;
    if !(k >= PARALLEL && s > 0.0 && t > 0.0) {
        return None;
    }
    let (on_left, on_right) = (left.at(s), right.at(t));
    Some(Triangulated {
        point: nalgebra::center(&on_left, &on_right),
        range_left_m: s,
        range_right_m: t,
        gap_m: (on_left - on_right).norm(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Vector3;

    fn ray_to(origin: Point3, point: Point3) -> Ray {
        Ray { origin, direction: (point - origin).normalize() }
    }

    #[test]
    fn rays_through_one_point_meet_there_near_and_far() {
        let (left, right) = (Point3::new(0.39, -0.06, -1.24), Point3::new(0.58, 0.01, -1.24));
        for range in [0.3, 1.0, 3.0, 30.0] {
            let point = left + Vector3::new(0.6, -0.7, 0.39) * range;
            let found = midpoint(&ray_to(left, point), &ray_to(right, point)).unwrap();
            assert!((found.point - point).norm() < 1e-12 * range * range.max(1.0), "{found:?}");
            assert!((found.range_left_m - (point - left).norm()).abs() < 1e-10);
            assert!((found.range_right_m - (point - right).norm()).abs() < 1e-10);
            assert!(found.gap_m < 1e-13 * range.max(1.0));
        }
    }

    #[test]
    fn skew_rays_have_their_gap_halved() {
        let left = Ray { origin: Point3::origin(), direction: Vector3::x() };
        let right = Ray { origin: Point3::new(5.0, -2.0, 0.1), direction: Vector3::y() };
        let found = midpoint(&left, &right).unwrap();
        assert!((found.point - Point3::new(5.0, 0.0, 0.05)).norm() < 1e-15);
        assert_eq!((found.range_left_m, found.range_right_m), (5.0, 2.0));
        assert!((found.gap_m - 0.1).abs() < 1e-15);
    }

    #[test]
    fn parallel_and_diverging_rays_do_not_meet() {
        let right_origin = Point3::new(0.0, 0.2, 0.0);
        let left = Ray { origin: Point3::origin(), direction: Vector3::x() };
        assert_eq!(midpoint(&left, &Ray { origin: right_origin, direction: Vector3::x() }), None);
        let outward = Vector3::new(1.0, 0.1, 0.0).normalize();
        assert_eq!(midpoint(&left, &Ray { origin: right_origin, direction: outward }), None);
    }
}
