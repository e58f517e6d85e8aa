//! Rocks inside the rover's body at its pose: one of the two kinds of collision.
//!
//! Frame: rocks in the site, the body in the rover frame, m.

use sightline_geometry::frames::{Point3, Pose};

use crate::rover::body::parts;
use crate::rover::suspension::Stand;
use crate::world::World;

/// Number of rocks that extend into the body of a settled rover, wheels and arms excluded.
pub(crate) fn touched_rocks(world: &World, stand: &Stand) -> u32 {
    let boxes = parts(&stand.angles);
    let is_inside = |point: Point3| {
        boxes.iter().filter(|part| matches!(part.name, "body" | "deck")).any(|part| {
            let off = point - part.centre;
            part.half_axes.iter().all(|half| off.dot(half).abs() <= half.norm_squared())
        })
    };
    let rover_from_site: Pose = stand.site_from_rover.inverse();
    let origin = stand.site_from_rover * Point3::origin();
    let near = world.rocks().iter().filter(|rock| (rock.centre - origin).norm() < 2.0 + rock.radius_m);
    let touched = near.filter(|rock| {
        rock.vertices().iter().any(|vertex| is_inside(rover_from_site * (rock.centre + vertex)))
    });
    touched.count() as u32
}
