//! Target pixels of a world at a point of the grid, their groups, and the steps at which a fault affects them.
//!
//! The step of a fault is determined from the truth, target by target: the first visited step at which the point is
//! hidden, in shadow, or outside the left image. A target that the fault does not affect has no step and is no case.
//!
//! On a face that is circled, two groups are separated from the other targets: those on an occluding boundary (R119),
//! and those in front of which another rock passes during the drive, which then have such a boundary too.

use super::point::{Fault, Picks, Point};
use super::row::{BOUNDARY, PASSED};
use super::run::Chosen;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Point3};
use sightline_recordings::Traverse;
use sightline_world::scenario::Arrangement;
use sightline_world::target_truth::TruthSource;
use sightline_world::{Scenario, Special, SurfaceId, World, choose_special, choose_targets, is_on_boundary};

/// Number of special targets (on boundaries, or leaving the image) requested in each world.
const SPECIAL_COUNT: u32 = 6;

/// Chooses the targets of a point in a simulated world.
///
/// # Errors
/// A recorded traverse, whose true surface is unknown.
pub fn choose(traverse: &Traverse, scenario: &Scenario, point: &Point) -> Result<Vec<Chosen>> {
    let world = traverse
        .world()
        .ok_or_else(|| Error::Request("a study needs simulated worlds, whose surface is known".to_owned()))?;
    let special = |kind| choose_special(world, scenario, traverse.index(), kind, SPECIAL_COUNT);
    let pixels = match point.picks {
        Picks::Rule => choose_targets(world, scenario, traverse.index()),
        Picks::Boundary => special(Special::Boundary),
        Picks::Leaving => special(Special::Leaving),
    };
    let groups = groups(world, scenario, traverse, point, &pixels);
    let mut chosen: Vec<Chosen> = pixels
        .into_iter()
        .zip(groups)
        .map(|(pixel, group)| Chosen { pixel, group, fault_step: None })
        .collect();
    if let Some(fault) = point.fault {
        find_fault_steps(traverse, point, fault, &mut chosen)?;
    }
    Ok(chosen)
}

/// The group of each pixel.
fn groups(
    world: &World,
    scenario: &Scenario,
    traverse: &Traverse,
    point: &Point,
    pixels: &[Pixel],
) -> Vec<String> {
    let rule = &scenario.targets;
    let of = |(number, pixel): (usize, &Pixel)| match (point.picks, rule.arrangement) {
        (Picks::Boundary, _) => BOUNDARY.to_owned(),
        (Picks::Rule, Arrangement::Rows) => {
            let per_row = (rule.count / rule.rows.max(1)).max(1) as usize;
            format!("row-{}", number / per_row + 1)
        }
        (Picks::Rule, Arrangement::Face) if is_on_boundary(world, scenario, traverse.index(), *pixel) => {
            BOUNDARY.to_owned()
        }
        (Picks::Rule, Arrangement::Face) if is_passed(world, traverse, *pixel, rule.window_px) => {
            PASSED.to_owned()
        }
        _ => "all".to_owned(),
    };
    pixels.iter().enumerate().map(of).collect()
}

/// Returns whether, at any stop, another rock is nearer in the window around the target, or occludes it.
fn is_passed(world: &World, traverse: &Traverse, pixel: Pixel, window_px: u32) -> bool {
    let surface_at = |stop: usize, pixel: Pixel| {
        let site_from_rover = traverse.true_site_from_rover(stop)?;
        let ray = traverse.true_left_camera(stop).moved(&site_from_rover).ray(pixel)?;
        world.cast(&ray).map(|hit| (hit.surface, hit.distance_m))
    };
    let Some((own, _)) = surface_at(0, pixel) else { return false };
    let Some(point) = traverse.surface_point_in_site(0, None, pixel) else { return false };
    (0..traverse.stop_count()).any(|stop| {
        let camera = traverse.true_left_camera(stop);
        let Some(site_from_rover) = traverse.true_site_from_rover(stop) else { return false };
        let camera = camera.moved(&site_from_rover);
        let Some(middle) = camera.project(&point) else { return false };
        let distance_m = (point - camera.model.centre()).norm();
        let half = f64::from(window_px / 2);
        let offsets = || (-2..=2).map(|i| f64::from(i) / 2.0 * half);
        offsets().flat_map(|dy| offsets().map(move |dx| middle.offset(dx, dy))).any(|pixel| {
            surface_at(stop, pixel).is_some_and(|(surface, hit_m)| {
                matches!(surface, SurfaceId::Rock(_)) && surface != own && hit_m < distance_m
            })
        })
    })
}

/// Determines, from the truth, the step at which the fault affects each target.
fn find_fault_steps(traverse: &Traverse, point: &Point, fault: Fault, chosen: &mut [Chosen]) -> Result<()> {
    let fixed = match fault {
        Fault::Cloud(step) | Fault::AzimuthJump(step) | Fault::HeadingJump { step, .. } => Some(step),
        Fault::Boundary | Fault::FromTheStart => Some(1),
        Fault::Occlusion | Fault::Shadow | Fault::OutOfFrame | Fault::PositionJump { .. } => None,
    };
    if fixed.is_some() {
        chosen.iter_mut().for_each(|target| target.fault_step = fixed);
        return Ok(());
    }
    let points: Vec<Option<Point3>> =
        chosen.iter().map(|target| traverse.surface_point_in_site(0, None, target.pixel)).collect();
    for (step, stop) in point.visit.stops(traverse.stop_count()).into_iter().enumerate() {
        let world = traverse.world_at(stop)?;
        for (target, surface) in chosen.iter_mut().zip(&points) {
            let Some(surface) = surface else { continue };
            if target.fault_step.is_none() && is_met(traverse, &world, stop, surface, fault) {
                target.fault_step = Some(step);
            }
        }
    }
    // A condition that is true from the beginning is no event of the drive.
    chosen.iter_mut().for_each(|target| target.fault_step = target.fault_step.filter(|&step| step > 0));
    Ok(())
}

/// Returns whether a fault affects a surface point at a stop.
fn is_met(traverse: &Traverse, world: &World, stop: usize, point: &Point3, fault: Fault) -> bool {
    let Some(site_from_rover) = traverse.true_site_from_rover(stop) else { return false };
    let camera_in_site = traverse.true_left_camera(stop).moved(&site_from_rover);
    let is_seen = camera_in_site.sees(point);
    match fault {
        Fault::Shadow => world.in_shadow(point),
        Fault::OutOfFrame => !is_seen,
        _ => {
            let ray = camera_in_site.project(point).and_then(|pixel| camera_in_site.ray(pixel));
            is_seen && ray.is_some_and(|ray| !world.is_visible(&ray.origin, point))
        }
    }
}
