//! Artificial objects in the scene: boxes and spheres with exact ray intersection, plain or with a checkerboard face.
//!
//! **Box.** With the middle m and three orthogonal half-axes a_k, a ray o + t d is inside where
//! `|(o + t d − m)·a_k| ≤ |a_k|²` for each k: three slabs, whose intervals in t are intersected.
//! **Sphere.** `|o + t d − m|² = r²`, a quadratic in t.
//! **Checkerboard.** On the face a_0 = +1, squares of side s are counted from the face's corner along −a_1 (to the
//! right for a viewer of the face if a_1 points to the viewer's left) and along a_2.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | m | `middle` | m, site |
//! | a_k | `half_axes` | m, site; orthogonal |
//! | t | `enter_m`, `leave_m` | m along the ray |
//!
//! Sources: ours; Kay & Kajiya 1986 for slabs.

use sightline_geometry::frames::{Point3, Ray, Vector3};

/// Kind of an artificial object, as reported for a ray's hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SolidKind {
    /// A fiducial of the scenario.
    Fiducial,
    /// A block in front of a camera or the sun.
    Occluder,
    /// A part of the rover.
    Rover,
}

/// Albedo pattern of an artificial object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Look {
    /// Uniform albedo.
    Plain(f32),
    /// Squares on the face of the first positive half-axis; grey elsewhere.
    Checkerboard {
        /// Side of a square, m.
        square_m: f64,
        /// Albedo of the corner square and of every second square from it.
        first: f32,
        /// Albedo of the other squares.
        second: f32,
    },
}

/// A box or a sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A box with three orthogonal half-axes, m.
    Box([Vector3; 3]),
    /// A ball of this radius, m.
    Sphere(f64),
}

/// An artificial object in the site frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solid {
    /// Kind of the object.
    pub kind: SolidKind,
    /// Centre, site frame, m.
    pub middle: Point3,
    /// Shape and size.
    pub shape: Shape,
    /// Albedo pattern.
    pub look: Look,
    /// Whether cameras see it; if false, it only casts its shadow.
    pub is_seen: bool,
}

/// The interval of a ray inside an artificial object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// Distance of the entry, m; negative if the ray starts inside.
    pub enter_m: f64,
    /// Distance of the exit, m.
    pub leave_m: f64,
    /// Outward unit normal at the entry.
    pub normal: Vector3,
}

impl Solid {
    /// Radius of the circumscribed sphere about the centre, m.
    pub fn radius_m(&self) -> f64 {
        match self.shape {
            Shape::Box(axes) => axes.iter().map(Vector3::norm_squared).sum::<f64>().sqrt(),
            Shape::Sphere(radius_m) => radius_m,
        }
    }

    /// Returns the interval inside the object, or `None` if the ray misses it. The ray counts as an infinite line
    /// here.
    pub(crate) fn passage(&self, ray: &Ray) -> Option<Passage> {
        let from_middle = ray.origin - self.middle;
        match self.shape {
            Shape::Box(axes) => through_box(&axes, &from_middle, &ray.direction),
            Shape::Sphere(radius_m) => {
                let along_m = from_middle.dot(&ray.direction);
                let aside_m2 = (from_middle - along_m * ray.direction).norm_squared();
                let half_m = (radius_m * radius_m - aside_m2).max(0.0).sqrt();
                (half_m > 0.0).then(|| {
                    let enter_m = -along_m - half_m;
                    let normal = (from_middle + enter_m * ray.direction) / radius_m;
                    Passage { enter_m, leave_m: -along_m + half_m, normal }
                })
            }
        }
    }

    /// The albedo at a point of the surface with the outward unit normal `normal`.
    pub(crate) fn albedo_at(&self, point: &Point3, normal: &Vector3) -> f32 {
        /// Albedo of a board's back and edges.
        const EDGE: f32 = 0.3;
        match (self.look, self.shape) {
            (Look::Plain(albedo), _) => albedo,
            (Look::Checkerboard { square_m, first, second }, Shape::Box([out, left, up])) => {
                if normal.dot(&out) < 0.5 * out.norm() {
                    return EDGE;
                }
                let from_middle = point - self.middle;
                let along = |axis: &Vector3| {
                    let half_m = axis.norm();
                    ((from_middle.dot(axis) / half_m + half_m) / square_m).floor() as i64
                };
                if (along(&-left) + along(&up)).rem_euclid(2) == 0 { first } else { second }
            }
            (Look::Checkerboard { first, .. }, Shape::Sphere(_)) => first,
        }
    }
}

/// The interval of a line inside a box centred on the origin.
fn through_box(axes: &[Vector3; 3], origin: &Vector3, direction: &Vector3) -> Option<Passage> {
    let (mut enter_m, mut leave_m, mut normal) = (f64::NEG_INFINITY, f64::INFINITY, Vector3::z());
    for axis in axes {
        let (reach, start, speed) = (axis.norm_squared(), origin.dot(axis), direction.dot(axis));
        if speed == 0.0 {
            if start.abs() > reach {
                return None;
            }
            continue;
        }
        let (a_m, b_m) = ((-reach - start) / speed, (reach - start) / speed);
        if a_m.min(b_m) > enter_m {
            enter_m = a_m.min(b_m);
            normal = -speed.signum() * axis / reach.sqrt();
        }
        leave_m = leave_m.min(a_m.max(b_m));
    }
    (enter_m < leave_m).then_some(Passage { enter_m, leave_m, normal })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solid(shape: Shape, look: Look) -> Solid {
        Solid { kind: SolidKind::Fiducial, middle: Point3::new(5.0, 1.0, -0.5), shape, look, is_seen: true }
    }

    #[test]
    fn a_turned_box_is_entered_where_its_nearest_face_lies() {
        let (sin, cos) = 0.5f64.sin_cos();
        let axes = [
            Vector3::new(-0.3 * cos, -0.3 * sin, 0.0),
            Vector3::new(-0.2 * sin, 0.2 * cos, 0.0),
            Vector3::new(0.0, 0.0, -0.1),
        ];
        let thing = solid(Shape::Box(axes), Look::Plain(0.5));
        let ray = Ray { origin: Point3::new(0.0, 1.0, -0.5), direction: Vector3::x() };
        let passage = thing.passage(&ray).unwrap();
        // The face normal is turned by 0.5 rad from the ray, which meets it 0.3/cos before the middle.
        assert!((passage.enter_m - (5.0 - 0.3 / cos)).abs() < 1e-12, "{}", passage.enter_m);
        assert!((passage.normal - axes[0].normalize()).norm() < 1e-12);
        let above = Ray { origin: Point3::new(0.0, 1.0, -0.601), direction: Vector3::x() };
        assert!(thing.passage(&above).is_none());
    }

    #[test]
    fn a_sphere_is_entered_where_the_quadratic_says() {
        let thing = solid(Shape::Sphere(0.25), Look::Plain(0.5));
        let ray = Ray { origin: Point3::new(0.0, 1.15, -0.5), direction: Vector3::x() };
        let passage = thing.passage(&ray).unwrap();
        assert!((passage.enter_m - (5.0 - 0.2)).abs() < 1e-12);
        assert!((passage.normal - Vector3::new(-0.8, 0.6, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn squares_of_a_board_alternate_from_its_corner() {
        let axes = [-Vector3::x() * 0.005, -Vector3::y() * 0.2, -Vector3::z() * 0.1];
        let look = Look::Checkerboard { square_m: 0.1, first: 0.05, second: 0.8 };
        let board = solid(Shape::Box(axes), look);
        let at = |right_m: f64, up_m: f64| {
            board.albedo_at(&(board.middle + Vector3::new(-0.005, right_m, -up_m)), &-Vector3::x())
        };
        // The lower left corner square as seen by a viewer of the face, then its neighbours.
        assert_eq!([at(-0.15, -0.05), at(-0.05, -0.05), at(-0.15, 0.05)], [0.05, 0.8, 0.8]);
        assert_eq!(board.albedo_at(&(board.middle + Vector3::x() * 0.005), &Vector3::x()), 0.3);
    }
}
