//! The line of sight of the designation, carried to the current stop and intersected with the surface there.
//!
//! A designation is a pixel, so its ray is exact. Its range is measured at the far end of the drive, where a pixel of
//! disparity is tens of centimetres, and a tracker that only carries positions never corrects this error.
//! Registration gives the rays of the first view in the current frame. The target is the intersection of the ray with
//! the current surface, whose points are accurate to millimetres.
//! ```text
//! o' = T⁻¹ o,  u' = R⁻¹ u                         the ray in the current frame
//! x  = first facet that it crosses near the registered target
//! A  = I − u' nᵀ / (n · u')                       derivative of x with respect to a shift of the ray; A u' = 0
//! Σ  = A (Σ_reg + R⁻¹ Σ_first R) Aᵀ + u' u'ᵀ σ_s² / (n · u')²
//! ```
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | T | `fixed_from_moving` | rigid motion, rover frames of the two stops |
//! | n | normal of the surface within 2 cm of x | – |
//! | σ_s | error of the surface along its normal | m |
//!
//! At grazing incidence a small shift moves the point far; below 15° the ray is not used.
//!
//! Source: ours; D§2 keeps the designated position.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::{Point3, Pose, Ray, Vector3};
use sightline_record::{Declaration, Record, Unit};
use sightline_vision::registration::Mesh;

/// The surface's normal is averaged within this distance, m.
const AROUND_M: f64 = 0.02;
/// Sine of the smallest accepted angle between ray and surface: 15°.
const GRAZING: f64 = 0.259;
/// Largest distance of the intersection from the registered target, in half widths; beyond it the ray meets something else.
const FAR: f64 = 1.0;

/// The intersection of the carried ray with the current surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RayMeeting {
    /// Distance from the target by registration alone, m.
    pub moved_m: f64,
    /// Angle between the ray and the surface's normal, deg.
    pub incidence_deg: f64,
}

/// A target on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Met {
    /// The target, m, current rover frame.
    pub position: Point3,
    /// Its covariance, m².
    pub covariance: Matrix3<f64>,
    /// The intersection, for the evidence.
    pub meeting: RayMeeting,
}

/// The designated ray and the target by registration.
#[derive(Clone, Copy)]
pub(super) struct Carried<'a> {
    /// The ray of the designation, in the frame of the first view.
    pub ray: &'a Ray,
    /// The rigid motion T.
    pub fixed_from_moving: &'a Pose,
    /// The target by registration alone, m, current rover frame.
    pub registered: Point3,
    /// Its covariance, including that of the first view, m².
    pub covariance: Matrix3<f64>,
    /// Half the width of the rock, m.
    pub half_width_m: f64,
}

/// Intersects the ray with the surface near the registered target; `None` if it misses or grazes the surface.
pub(super) fn meet(carried: &Carried<'_>, surface: &Mesh) -> Option<Met> {
    let moving_from_fixed = carried.fixed_from_moving.inverse();
    let origin = moving_from_fixed * carried.ray.origin;
    let direction = moving_from_fixed * carried.ray.direction;
    let reach_m = FAR * carried.half_width_m;
    let crossings = surface.triangles.iter().filter_map(|triangle| {
        let corners = triangle.map(|corner| surface.vertices[corner as usize]);
        let point = origin + direction * crossing(&origin, &direction, corners)?;
        ((point - carried.registered).norm() <= reach_m).then_some((point, *triangle))
    });
    // Of several facets along the ray, the camera sees the first.
    let (position, triangle) =
        crossings.min_by(|a, b| (a.0 - origin).norm().total_cmp(&(b.0 - origin).norm()))?;
    let normal = normal_around(surface, &position, AROUND_M)?;
    let facing = normal.dot(&direction);
    if facing.abs() < GRAZING {
        return None;
    }
    // The errors of neighbours are correlated: a mean over three vertices is no more accurate than one of them.
    let sight = (position - surface.viewpoint).normalize();
    let range_sigma_m =
        triangle.iter().map(|&corner| f64::from(surface.range_sigma_m[corner as usize])).sum::<f64>() / 3.0;
    let along_m = range_sigma_m * (normal.dot(&sight) / facing).abs();
    let shear = Matrix3::identity() - direction * normal.transpose() / facing;
    let covariance = shear * carried.covariance * shear.transpose()
        + direction * direction.transpose() * (along_m * along_m);
    let meeting = RayMeeting {
        moved_m: (position - carried.registered).norm(),
        incidence_deg: facing.abs().min(1.0).acos().to_degrees(),
    };
    Some(Met { position, covariance, meeting })
}

/// Returns the distance along a ray to a triangle, m; `None` if it misses (Möller and Trumbore 1997).
fn crossing(origin: &Point3, direction: &Vector3, [a, b, c]: [Point3; 3]) -> Option<f64> {
    let (first, second) = (b - a, c - a);
    let across = direction.cross(&second);
    let volume = first.dot(&across);
    if volume.abs() < 1e-15 {
        return None;
    }
    let from = origin - a;
    let u = from.dot(&across) / volume;
    let other = from.cross(&first);
    let v = direction.dot(&other) / volume;
    let is_inside = u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9;
    Some(second.dot(&other) / volume).filter(|distance_m| is_inside && *distance_m > 0.0)
}

/// Returns the mean normal of the facets around a point, weighted by their areas.
pub(super) fn normal_around(surface: &Mesh, point: &Point3, around_m: f64) -> Option<Vector3> {
    let mut sum = Vector3::zeros();
    for triangle in &surface.triangles {
        let [a, b, c] = triangle.map(|corner| surface.vertices[corner as usize]);
        let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        if (middle - point).norm() < around_m {
            sum += (b - a).cross(&(c - a));
        }
    }
    sum.try_normalize(1e-12)
}

impl Record for RayMeeting {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("moved_m", Unit::Metre, |ray| ray.moved_m)
            .describe("Distance from the target by the registration alone.");
        r.quantity("incidence_deg", Unit::Degree, |ray| ray.incidence_deg)
            .describe("Angle between the ray and the normal of the surface.");
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion};

    use super::*;

    /// A leaning wall, seen from the origin: x = 2 + 0.5 z.
    fn wall() -> Mesh {
        let point = |y: f64, z: f64| Point3::new(2.0 + 0.5 * z, y, z);
        let mut mesh = Mesh::default();
        for row in 0..40 {
            for column in 0..40 {
                mesh.vertices.push(point((column as f64 - 19.5) * 0.01, (row as f64 - 19.5) * 0.01));
                mesh.range_sigma_m.push(0.002);
                if row > 0 && column > 0 {
                    let last = (row * 40 + column) as u32;
                    mesh.triangles.push([last - 41, last - 40, last]);
                    mesh.triangles.push([last - 41, last, last - 1]);
                }
            }
        }
        mesh
    }

    #[test]
    fn a_ray_meets_the_leaning_wall_where_geometry_says_and_forgets_a_wrong_range() {
        let surface = wall();
        let truth = Point3::new(2.05, 0.03, 0.1);
        let fixed_from_moving = Pose::from_parts(
            Translation3::new(4.0, 1.0, -0.2),
            UnitQuaternion::from_euler_angles(0.1, -0.05, 0.3),
        );
        let eye = fixed_from_moving * Point3::new(-5.0, 0.4, -0.6);
        let ray = Ray { origin: eye, direction: (fixed_from_moving * truth - eye).normalize() };
        let along = fixed_from_moving.inverse() * ray.direction;
        // The first range is 6 cm wrong; the error across is 1 mm.
        let covariance = along * along.transpose() * 0.06f64.powi(2) + Matrix3::identity() * 1e-6;
        let carried = Carried {
            ray: &ray,
            fixed_from_moving: &fixed_from_moving,
            registered: truth + along * 0.06,
            covariance,
            half_width_m: 0.2,
        };
        let met = meet(&carried, &surface).unwrap();
        assert!((met.position - truth).norm() < 1e-9, "{}", met.position);
        assert!((met.meeting.moved_m - 0.06).abs() < 1e-9);
        let sigma_m = met.covariance.symmetric_eigenvalues().max().sqrt();
        assert!((0.001..0.004).contains(&sigma_m), "{sigma_m}");
        // A shift of the ray by ε moves the intersection by A ε, as in the covariance.
        let shift = Vector3::new(0.0, 0.0, 1e-4);
        let moved = Ray { origin: ray.origin + fixed_from_moving.rotation * shift, ..ray };
        let again = meet(&Carried { ray: &moved, ..carried }, &surface).unwrap();
        let normal = Vector3::new(1.0, 0.0, -0.5).normalize();
        let expected = shift - along * (normal.dot(&shift) / normal.dot(&along));
        assert!((again.position - met.position - expected).norm() < 1e-9);
    }

    #[test]
    fn a_ray_beside_the_surface_or_along_it_meets_nothing() {
        let surface = wall();
        let carried = |direction: Vector3, origin: Point3| {
            let ray = Ray { origin, direction: direction.normalize() };
            let registered = Point3::new(2.0, 0.0, 0.0);
            let (fixed_from_moving, covariance) = (Pose::identity(), Matrix3::identity());
            let half_width_m = 0.2;
            meet(
                &Carried {
                    ray: &ray,
                    fixed_from_moving: &fixed_from_moving,
                    registered,
                    covariance,
                    half_width_m,
                },
                &surface,
            )
        };
        assert!(carried(Vector3::x(), Point3::origin()).is_some());
        assert!(carried(Vector3::new(1.0, 0.5, 0.0), Point3::origin()).is_none());
        let along = Vector3::new(0.5, 0.0, 1.0);
        assert!(carried(along, Point3::new(1.95, 0.0, -0.11)).is_none());
    }
}
