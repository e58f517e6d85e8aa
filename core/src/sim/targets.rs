//! The rule that chooses the targets of a simulated traverse.
//!
//! Pixels are drawn evenly, by the scenario's seed, from the whole-pixel positions of the first left image
//! whose surface point lies within `radius_m` of the targets' centre. A pixel becomes a target when
//!
//! 1. the window of `window_px` around it lies in the image;
//! 2. its surface point is in both images of the last stop with its whole window, hidden by nothing: the mast
//!    points at the targets' centre, and a target that left one eye could not be judged;
//! 3. at most `shadow_fraction` of the window's pixels are in shadow (R21);
//! 4. depth along the left camera's rays ranges over at most `depth_range_fraction` of the target's
//!    distance inside the window (R21), the sky counting as infinitely far;
//! 5. with `on_rocks`, it lies on a rock, and at least `same_rock_fraction` of the window's pixels lie on that
//!    same rock: the papers' targets are on rocks and off their occluding boundaries (R20, R110);
//! 6. nine tenths of the window's surface are turned to the left camera, at the first stop and at the last: normal
//!    and line of sight differ by at most `incidence_deg`. An undercut face turns its edge to a camera that comes
//!    near and looks down, and the place one came for is hardly to be seen;
//! 7. it was not chosen before.
//!
//! Nothing else is asked: not texture, not contrast, not how well anything tracks it. Drawing ends after 2000
//! draws per target asked for; then there are fewer targets.
//!
//! What the rule finds in the default worlds of seeds 1 to 12: 20 targets in eight of them, 4 and 14 in seeds 4 and 6,
//! on one or two rocks, since at 10 m the window spans 17 cm and few rocks fill it; none in seeds 5 and 11. Level ground
//! at 10 m is seen at 81°, so that targets anywhere need `incidence_deg = 90` beside `on_rocks = false`
//! ([`share_on_rocks`] tells how many lie on rocks). A reduced image needs a reduced window: 21 px of a
//! 512-pixel image find nothing, 11 px almost what 21 px find in the full image.
//!
//! Units: px, m. Frames: pixels of the first left image, rays in the site frame. Sources: papers.md R21.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::camera::Camera;
use crate::frames::{Pixel, Point3};
use crate::traverse::TraverseIndex;

use crate::sim::camera::render::{Eye, visible_pixel};
use crate::sim::ground::texture::mix;
use crate::sim::index::true_camera_in_site;
use crate::sim::scenario::{Scenario, TargetRule};
use crate::sim::world::{Hit, SurfaceId, World};

/// Draws per target before the search is given up.
const DRAWS_PER_TARGET: u32 = 2000;

/// Least part of the window that must be turned to the camera.
const FACING_FRACTION: f64 = 0.90;

/// Chooses targets by the rule of the module's header; fewer than asked for if the draws run out.
pub fn choose_targets(world: &World, scenario: &Scenario, index: &TraverseIndex) -> Vec<Pixel> {
    let (Some(first), Some(last)) = (index.stops.first(), index.stops.last()) else { return Vec::new() };
    let (Some(camera), Some(last_left), Some(last_right)) = (
        true_camera_in_site(first, Eye::Left),
        true_camera_in_site(last, Eye::Left),
        true_camera_in_site(last, Eye::Right),
    ) else {
        return Vec::new();
    };
    let rule = &scenario.targets;
    let Some(bounds) = bounds(world, &camera, rule) else { return Vec::new() };
    let mut random = Pcg64::seed_from_u64(mix(scenario.seed ^ 0x7a26_e750));
    let mut chosen: Vec<Pixel> = Vec::new();
    for _ in 0..rule.count.saturating_mul(DRAWS_PER_TARGET) {
        if chosen.len() >= rule.count as usize {
            break;
        }
        let x = f64::from(random.random_range(bounds[0][0]..=bounds[0][1]));
        let y = f64::from(random.random_range(bounds[1][0]..=bounds[1][1]));
        let pixel = Pixel::new(x, y);
        if !chosen.contains(&pixel) && is_target(world, &camera, [&last_left, &last_right], rule, pixel) {
            chosen.push(pixel);
        }
    }
    chosen
}

/// The surface point under a pixel of a camera in the site: the truth of a target.
pub fn surface_point(world: &World, camera_in_site: &Camera, pixel: Pixel) -> Option<Point3> {
    Some(world.cast(&camera_in_site.ray(pixel)?)?.point)
}

/// The part of the targets that lie on rocks, 0 to 1.
pub fn share_on_rocks(world: &World, index: &TraverseIndex, targets: &[Pixel]) -> f64 {
    let Some(camera) = index.stops.first().and_then(|stop| true_camera_in_site(stop, Eye::Left)) else {
        return 0.0;
    };
    let hits = targets.iter().filter_map(|pixel| world.cast(&camera.ray(*pixel)?));
    let on_rocks = hits.filter(|hit| matches!(hit.surface, SurfaceId::Rock(_))).count();
    on_rocks as f64 / targets.len().max(1) as f64
}

/// Columns and rows between which all pixels within the radius lie; drawing outside would be in vain.
fn bounds(world: &World, camera: &Camera, rule: &TargetRule) -> Option<[[u32; 2]; 2]> {
    let centre = world.targets_centre();
    let pixel = camera.project(&centre)?;
    let ray = camera.ray(pixel)?;
    let distance_m = (centre - ray.origin).norm();
    let next = camera.ray(pixel.offset(1.0, 0.0))?;
    let rad_per_px = (ray.direction - next.direction).norm();
    // A sphere seen from inside fills the image; the factor covers the lens's uneven scale.
    let reach = if distance_m > 1.05 * rule.radius_m {
        1.2 * (rule.radius_m / distance_m).asin().tan() / rad_per_px
    } else {
        f64::from(camera.width() + camera.height())
    };
    let side = |middle: f64, size: u32| {
        let last = f64::from(size) - 1.0;
        [(middle - reach).clamp(0.0, last) as u32, (middle + reach).clamp(0.0, last) as u32]
    };
    Some([side(pixel.x, camera.width()), side(pixel.y, camera.height())])
}

/// Whether a pixel satisfies the rule.
fn is_target(world: &World, camera: &Camera, last: [&Camera; 2], rule: &TargetRule, pixel: Pixel) -> bool {
    let Some(point) = surface_point(world, camera, pixel) else { return false };
    (point - world.targets_centre()).norm() <= rule.radius_m
        && window_is_inside(camera, pixel, rule)
        && last.iter().all(|eye| {
            visible_pixel(world, eye, &point).is_some_and(|seen| window_is_inside(eye, seen, rule))
        })
        && window_is_even(world, camera, rule, pixel, &last[0].model.centre())
}

/// Whether the whole window around a pixel lies in the image.
fn window_is_inside(camera: &Camera, pixel: Pixel, rule: &TargetRule) -> bool {
    let half = f64::from(rule.window_px / 2);
    let corners = [pixel.offset(-half, -half), pixel.offset(half, half)];
    corners.iter().all(|corner| corner.is_inside(camera.width(), camera.height()))
}

/// Whether a window lies on one rock (R20), given what its middle lies on and the part that lies on the same.
fn is_on_rock(surface: SurfaceId, same_fraction: f64, rule: &TargetRule) -> bool {
    matches!(surface, SurfaceId::Rock(_)) && same_fraction >= rule.same_rock_fraction
}

/// Whether a surface is turned to both places enough.
fn faces(hit: &Hit, places: [&Point3; 2], rule: &TargetRule) -> bool {
    places.iter().all(|place| hit.normal.angle(&(*place - hit.point)) <= rule.incidence_deg.to_radians())
}

/// Whether the window around a pixel is lit, even and turned to the camera enough, here and from the last stop.
fn window_is_even(world: &World, camera: &Camera, rule: &TargetRule, pixel: Pixel, last: &Point3) -> bool {
    let half = i32::try_from(rule.window_px / 2).unwrap_or(i32::MAX);
    let Some(middle_ray) = camera.ray(pixel) else { return false };
    let Some(middle) = world.cast(&middle_ray) else { return false };
    let (mut nearest_m, mut farthest_m) = (f64::INFINITY, 0.0f64);
    let (mut shaded, mut same, mut facing) = (0u32, 0u32, 0u32);
    for dy in -half..=half {
        for dx in -half..=half {
            let hit = camera.ray(pixel.offset(f64::from(dx), f64::from(dy))).and_then(|ray| world.cast(&ray));
            let Some(hit) = hit else { return false };
            nearest_m = nearest_m.min(hit.distance_m);
            farthest_m = farthest_m.max(hit.distance_m);
            shaded += u32::from(world.in_shadow(&hit.point));
            same += u32::from(hit.surface == middle.surface);
            facing += u32::from(faces(&hit, [&middle_ray.origin, last], rule));
        }
    }
    let pixels = f64::from((2 * half + 1).pow(2));
    f64::from(shaded) <= rule.shadow_fraction * pixels
        && farthest_m - nearest_m <= rule.depth_range_fraction * middle.distance_m
        && (!rule.on_rocks || is_on_rock(middle.surface, f64::from(same) / pixels, rule))
        && f64::from(facing) >= FACING_FRACTION * pixels
}
