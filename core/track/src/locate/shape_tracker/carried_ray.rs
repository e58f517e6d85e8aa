//! The line of sight of the designation, carried along and met with the near surface.
//!
//! A person points at a pixel: what is exact is the ray. Its range comes from stereo at the far end of the drive, where a
//! pixel of disparity is tens of centimetres, and a tracker that only carries positions keeps that error for good.
//! Registration knows where the first view's rays lie in the present one; where the ray meets the present surface, whose
//! points are known to millimetres, is the target.
//! ```text
//! o' = T⁻¹ o,  u' = R⁻¹ u                         the ray in the present frame
//! x  = first facet that it crosses near the registered target
//! A  = I − u' nᵀ / (n · u')                       how x follows a shift of the ray: along u' not at all
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
//! Source: ours; D§2 leaves the target where it was designated.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::{Point3, Pose, Ray, Vector3};
use sightline_record::{Declaration, Record, Unit};
use sightline_vision::registration::Mesh;

/// The surface's normal is a mean over this distance, m.
const AROUND_M: f64 = 0.02;
/// Sine of the least angle between ray and surface: 15°.
const GRAZING: f64 = 0.259;
/// A ray that meets the surface farther than this from the registered target meets something else, as a share of the half
/// width.
const FAR: f64 = 1.0;

/// Where the carried ray met the present surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RayMeeting {
    /// How far from the target as registration alone has it, m.
    pub moved_m: f64,
    /// Angle between the ray and the surface's normal, deg.
    pub incidence_deg: f64,
}

/// A target on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Met {
    /// The target, m, present rover frame.
    pub position: Point3,
    /// Its covariance, m².
    pub covariance: Matrix3<f64>,
    /// What happened.
    pub meeting: RayMeeting,
}

/// What registration knows.
#[derive(Clone, Copy)]
pub(super) struct Carried<'a> {
    /// The ray of the designation, in the frame of the first view.
    pub ray: &'a Ray,
    /// T.
    pub fixed_from_moving: &'a Pose,
    /// The target by registration alone, m, present rover frame.
    pub registered: Point3,
    /// Its covariance, that of the first view included, m².
    pub covariance: Matrix3<f64>,
    /// Half the width of the rock, m.
    pub half_width_m: f64,
}

/// Where the ray meets the surface near the registered target; none where it does not, or only grazes it.
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
    // Of several facets behind one another the eye sees the first.
    let (position, triangle) =
        crossings.min_by(|a, b| (a.0 - origin).norm().total_cmp(&(b.0 - origin).norm()))?;
    let normal = normal_around(surface, &position, AROUND_M)?;
    let facing = normal.dot(&direction);
    if facing.abs() < GRAZING {
        return None;
    }
    // The errors of neighbours are alike, so that a mean over three vertices is no better than one of them.
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

/// How far along a ray it crosses a triangle, m (Möller and Trumbore 1997).
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

/// The mean normal of the facets around a point, weighed by their areas.
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

    /// A wall that leans, seen from the origin: x = 2 + 0.5 z.
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
        // The first range was 6 cm wrong; across, a millimetre is known.
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
        // A shift of the ray by ε moves the meeting by A ε: as the covariance says.
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
