//! The rule of a target's window.
//!
//! A pixel can become a target when
//!
//! 1. the window of `window_px` around it is in the image;
//! 2. its surface point is unoccluded in both images of the last stop, with its whole window inside: the mast
//!    points at the targets' centre, and a target that left one image could not be judged;
//! 3. at most `shadow_fraction` of the window's pixels are in shadow (R21);
//! 4. depth along the left camera's rays ranges over at most `depth_range_fraction` of the target's
//!    distance inside the window (R21), the sky counting as infinitely far;
//! 5. with `on_rocks`, it is on a rock, and at least `same_rock_fraction` of the window's pixels are on that
//!    same rock: the papers' targets are on rocks and off their occluding boundaries (R20, R110);
//! 6. nine tenths of the window's surface face the left camera, at the first stop and at the last: normal
//!    and line of sight differ by at most `incidence_deg`. An undercut face is seen edge-on by a camera that comes
//!    near and looks down, so that the target is hardly visible.
//!
//! A target *on a boundary* satisfies 1 and 2, and its window shows another rock farther behind than 4 allows (R119).
//!
//! Units: px, m. Frames: pixels of the first left image, rays in the site frame. Sources: papers.md R20, R21, R119.

use crate::camera::render::visible_pixel;
use crate::scenario::TargetRule;
use crate::targets::view::{View, surface_point};
use crate::world::{Hit, SurfaceId};
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3};

/// Smallest fraction of the window that must face the camera.
const FACING_FRACTION: f64 = 0.90;

/// Smallest fraction of a boundary window that must show the rock behind.
const BEHIND_FRACTION: f64 = 0.15;

/// The content of the window around a pixel.
struct Window {
    middle: Hit,
    nearest_m: f64,
    farthest_m: f64,
    /// Fractions of the window's pixels, 0 to 1.
    shaded: f64,
    same: f64,
    facing: f64,
    behind: f64,
    /// The same for any surface behind.
    behind_any: f64,
}

impl View<'_> {
    /// Ranges of columns and rows that contain all pixels within the radius.
    pub(super) fn bounds(&self) -> Option<[[u32; 2]; 2]> {
        let (camera, radius_m) = (&self.camera, self.rule.radius_m);
        let centre = self.world.targets_centre();
        let pixel = camera.project(&centre)?;
        let ray = camera.ray(pixel)?;
        let distance_m = (centre - ray.origin).norm();
        let next = camera.ray(pixel.offset(1.0, 0.0))?;
        let rad_per_px = (ray.direction - next.direction).norm();
        // A sphere seen from inside fills the image; the factor covers the lens's uneven scale.
        let reach = if distance_m > 1.05 * radius_m {
            1.2 * (radius_m / distance_m).asin().tan() / rad_per_px
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
    pub(super) fn is_target(&self, pixel: Pixel) -> bool {
        let rule = self.rule;
        self.is_near_and_seen_again(pixel)
            && self.window(pixel).is_some_and(|window| {
                let on_rock = matches!(window.middle.surface, SurfaceId::Rock(_));
                window.shaded <= rule.shadow_fraction
                    && window.is_even(rule)
                    && (!rule.on_rocks || on_rock && window.same >= rule.same_rock_fraction)
                    && window.facing >= FACING_FRACTION
            })
    }

    /// Whether a pixel is on an occluding boundary with another rock behind.
    pub(super) fn is_on_boundary(&self, pixel: Pixel) -> bool {
        self.is_near_and_seen_again(pixel)
            && self
                .window(pixel)
                .is_some_and(|window| !window.is_even(self.rule) && window.behind >= BEHIND_FRACTION)
    }

    /// Whether a pixel's window is uneven in depth and shows another surface farther behind.
    pub(super) fn is_before_something(&self, pixel: Pixel) -> bool {
        self.window(pixel).is_some_and(|window| {
            let on_rock = matches!(window.middle.surface, SurfaceId::Rock(_));
            on_rock && !window.is_even(self.rule) && window.behind_any >= BEHIND_FRACTION
        })
    }

    /// Whether a pixel's window is in the first image, lit, even and on one rock, regardless of later stops.
    pub(super) fn is_even_window(&self, pixel: Pixel) -> bool {
        let rule = self.rule;
        window_is_inside(&self.camera, pixel, rule)
            && self.window(pixel).is_some_and(|window| {
                let on_rock = matches!(window.middle.surface, SurfaceId::Rock(_));
                window.shaded <= rule.shadow_fraction
                    && window.is_even(rule)
                    && (!rule.on_rocks || on_rock && window.same >= rule.same_rock_fraction)
            })
    }

    pub(super) fn is_near_and_seen_again(&self, pixel: Pixel) -> bool {
        let Some(point) = surface_point(&self.world, &self.camera, pixel) else { return false };
        let seen_again = |eye: &Camera| {
            visible_pixel(&self.world, eye, &point).is_some_and(|seen| window_is_inside(eye, seen, self.rule))
        };
        (point - self.world.targets_centre()).norm() <= self.rule.radius_m
            && window_is_inside(&self.camera, pixel, self.rule)
            && self.last.iter().all(seen_again)
    }

    /// Evaluates the window around a pixel; `None` if it shows the sky.
    fn window(&self, pixel: Pixel) -> Option<Window> {
        let half = i32::try_from(self.rule.window_px / 2).unwrap_or(i32::MAX);
        let middle_ray = self.camera.ray(pixel)?;
        let middle = self.world.cast(&middle_ray)?;
        let places = [middle_ray.origin, self.last[0].model.centre()];
        let (mut nearest_m, mut farthest_m) = (f64::INFINITY, 0.0f64);
        let (mut shaded, mut same, mut facing, mut behind, mut behind_any) = (0u32, 0u32, 0u32, 0u32, 0u32);
        for dy in -half..=half {
            for dx in -half..=half {
                let ray = self.camera.ray(pixel.offset(f64::from(dx), f64::from(dy)))?;
                let hit = self.world.cast(&ray)?;
                nearest_m = nearest_m.min(hit.distance_m);
                farthest_m = farthest_m.max(hit.distance_m);
                shaded += u32::from(self.world.in_shadow(&hit.point));
                same += u32::from(hit.surface == middle.surface);
                facing += u32::from(faces(&hit, &places, self.rule));
                let another = hit.surface != middle.surface && hit.distance_m > middle.distance_m;
                behind += u32::from(another && matches!(hit.surface, SurfaceId::Rock(_)));
                behind_any += u32::from(another);
            }
        }
        let part = |count: u32| f64::from(count) / f64::from((2 * half + 1).pow(2));
        let [shaded, same, facing, behind, behind_any] = [shaded, same, facing, behind, behind_any].map(part);
        Some(Window { middle, nearest_m, farthest_m, shaded, same, facing, behind, behind_any })
    }
}

impl Window {
    /// Whether its range of depth is small (R21).
    fn is_even(&self, rule: &TargetRule) -> bool {
        self.farthest_m - self.nearest_m <= rule.depth_range_fraction * self.middle.distance_m
    }
}

/// Whether the whole window around a pixel is in the image.
fn window_is_inside(camera: &Camera, pixel: Pixel, rule: &TargetRule) -> bool {
    let half = f64::from(rule.window_px / 2);
    let corners = [pixel.offset(-half, -half), pixel.offset(half, half)];
    corners.iter().all(|corner| corner.is_inside(camera.width(), camera.height()))
}

/// Whether a surface faces both camera positions.
fn faces(hit: &Hit, places: &[Point3; 2], rule: &TargetRule) -> bool {
    places.iter().all(|place| hit.normal.angle(&(place - hit.point)) <= rule.incidence_deg.to_radians())
}
