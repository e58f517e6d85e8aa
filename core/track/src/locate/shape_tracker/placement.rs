//! The instrument-placement target: whether the arm can reach it, and the nearest point that it can touch (R146).
//!
//! ```text
//! reachable    r_min ≤ │x − s│ ≤ r_max  and  the target is ahead of the shoulder
//! touchable    no vertex of the mesh within r − ε of  p + n (r + ε)         a ball of the instrument's radius at p
//! ```
//! A point in a notch may be visible but not touchable by an instrument 5 cm wide; the arm then uses the nearest
//! touchable point (R145: 8 mm away). Arm kinematics are not modelled: the work space is a shell about the shoulder.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | x | target | m, rover |
//! | s | [`SHOULDER_IN_ROVER`] | m, rover |
//! | r | [`INSTRUMENT_RADIUS_M`] | m |
//! | n | normal of the surface towards the cameras | – |
//!
//! Source: R146 (ours); shoulder and reach are assumed, of the size of a MER arm.

use nalgebra::Point3 as NalgebraPoint3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::carried_ray::normal_around;
use sightline_geometry::frames::{Point3, Vector3};
use sightline_record::{Declaration, Record, Unit};
use sightline_vision::registration::Mesh;

/// Position of the shoulder, m: at the front edge, 0.5 m above flat ground.
pub const SHOULDER_IN_ROVER: [f64; 3] = [0.6, 0.0, -0.2];
/// Smallest and largest reach from the shoulder, m.
pub const REACH_M: [f64; 2] = [0.2, 1.1];
/// Radius of the instrument, m.
pub const INSTRUMENT_RADIUS_M: f64 = 0.025;

/// Touchable points are searched within this distance of the target, m.
const NEAR_M: f64 = 0.15;
/// The normal is averaged within this distance, m.
const NORMAL_M: f64 = 0.03;
/// Assumed error of the surface, m.
const SLACK_M: f64 = 0.005;

/// The instrument-placement target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Placement {
    /// Distance from the shoulder to the target, m.
    pub reach_m: f64,
    /// Whether the arm reaches the target from here.
    pub is_reachable: bool,
    /// The nearest point of the surface that can be touched, m, rover frame; null if none is within 15 cm.
    pub touch_in_rover: Option<[f64; 3]>,
    /// Distance of that point from the target, m.
    pub offset_m: Option<f64>,
    /// Unit vector in which the arm approaches that point, rover frame.
    pub approach_in_rover: Option<[f64; 3]>,
}

/// Computes the placement for a target on a surface, both in the rover frame.
pub fn placement(surface: &Mesh, target: &Point3) -> Placement {
    let shoulder = NalgebraPoint3::from(SHOULDER_IN_ROVER);
    let reach_m = (target - shoulder).norm();
    let touch = touch(surface, target);
    Placement {
        reach_m,
        is_reachable: (REACH_M[0]..=REACH_M[1]).contains(&reach_m) && target.x > shoulder.x,
        touch_in_rover: touch.map(|(point, _)| point.coords.into()),
        offset_m: touch.map(|(point, _)| (point - target).norm()),
        approach_in_rover: touch.map(|(_, normal)| (-normal).into()),
    }
}

/// Returns the nearest touchable point and the outward normal there.
fn touch(surface: &Mesh, target: &Point3) -> Option<(Point3, Vector3)> {
    let mut near: Vec<&Point3> =
        surface.vertices.iter().filter(|vertex| (*vertex - target).norm() < NEAR_M).collect();
    near.sort_by(|a, b| (*a - target).norm().total_cmp(&(*b - target).norm()));
    // The target itself first: it need not be a vertex.
    std::iter::once(target).chain(near).find_map(|point| {
        let normal = normal_around(surface, point, NORMAL_M)?;
        let sight = surface.viewpoint - point;
        let outwards = if normal.dot(&sight) < 0.0 { -normal } else { normal };
        is_free(surface, point, &outwards).then_some((*point, outwards))
    })
}

/// Whether a ball at a point of the surface touches it nowhere else.
fn is_free(surface: &Mesh, point: &Point3, outwards: &Vector3) -> bool {
    let centre = point + outwards * (INSTRUMENT_RADIUS_M + SLACK_M);
    surface.vertices.iter().all(|vertex| (vertex - centre).norm() > INSTRUMENT_RADIUS_M - SLACK_M)
}

impl Record for Placement {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("reach_m", Unit::Metre, |p| p.reach_m)
            .describe("Distance from the shoulder to the target.");
        r.quantity("is_reachable", Unit::One, |p| p.is_reachable)
            .describe("Whether the arm reaches the target from here.");
        r.quantity("touch_in_rover", Unit::Metre, |p| p.touch_in_rover).describe(
            "The nearest point that can be touched, rover frame; missing where none is within 15 cm.",
        );
        r.quantity("offset_m", Unit::Metre, |p| p.offset_m)
            .describe("Distance of that point from the target.");
        r.quantity("approach_in_rover", Unit::One, |p| p.approach_in_rover)
            .describe("Direction of approach in the rover frame.");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_vision::registration::{MeshSettings, PointGrid};

    /// A wall 1.3 m ahead, sampled every 1 mm across ±6 cm, with a groove along z at y = 0, `half_m` to each side and
    /// 3 cm deep.
    fn wall(half_m: f64) -> Mesh {
        let mut grid = PointGrid::empty(121, 121);
        for row in 0..121 {
            for column in 0..121 {
                let (y, z) = (0.001 * (column as f64 - 60.0), 0.001 * (row as f64 - 60.0));
                let depth = if y.abs() < half_m { 0.03 } else { 0.0 };
                grid.points[row * 121 + column] = Some(Point3::new(1.3 + depth, y, z));
            }
        }
        let settings = MeshSettings { spacing_m: 0.0, depth_ratio_max: 1.5, grazing_max_deg: 89.0 };
        Mesh::from_grid(&grid, &Point3::new(0.0, 0.0, 0.0), None, &settings)
    }

    #[test]
    fn a_target_on_a_flat_wall_is_touched_where_it_is_from_the_front() {
        let target = Point3::new(1.3, 0.01, 0.0);
        let found = placement(&wall(0.0), &target);
        assert!(found.is_reachable && found.offset_m == Some(0.0), "{found:?}");
        assert!(found.approach_in_rover.unwrap()[0] > 0.999);
    }

    #[test]
    fn a_target_in_a_narrow_groove_is_touched_beside_it() {
        let target = Point3::new(1.33, 0.0, 0.0);
        let found = placement(&wall(0.01), &target);
        let touch = found.touch_in_rover.unwrap();
        assert!(touch[1].abs() > 0.009 && (touch[0] - 1.3).abs() < 0.006, "{touch:?}");
        assert!(found.offset_m.unwrap() < 0.07);
    }

    #[test]
    fn what_is_too_far_cannot_be_reached_and_nothing_has_no_touching_point() {
        let found = placement(&Mesh::default(), &Point3::new(3.0, 0.0, 0.0));
        assert!(!found.is_reachable && found.touch_in_rover.is_none());
    }
}
