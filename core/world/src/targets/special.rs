//! Targets for difficult cases that a tracker must detect: on occluding boundaries, and leaving the image.
//!
//! Both are drawn by the seed from the pixels near the targets' centre and are not part of a scenario's own targets.
//!
//! * On a *boundary*: rules 1 and 2 of the window, uneven in depth, with another surface farther behind in at least 15 %
//!   of it (R20, R119). Here the surface behind may also be the ground, which is more common than rocks.
//! * *Leaving*: rules 1, 3, 4 and 5 of the window at the first stop, and outside the left image at the last. The mast
//!   points at the targets' centre, so that points beside it leave the image as the rover comes near. They may be
//!   farther from the centre than the scenario's own targets: within [`LEAVING_RADIUS_M`].
//!
//! Units: px, m. Frames: pixels of the first left image, rays in the site frame. Sources: papers.md R20, R88, R119.

use rand::SeedableRng;
use rand_pcg::Pcg64;

use crate::ground::texture::mix;
use crate::scenario::Scenario;
use crate::targets::view::{View, surface_point};
use crate::traverse::TraverseIndex;
use crate::world::World;
use sightline_geometry::frames::Pixel;

/// Largest distance of a leaving target from the targets' centre, m.
const LEAVING_RADIUS_M: f64 = 3.0;

/// Kind of the requested pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Special {
    /// On an occluding boundary.
    Boundary,
    /// Outside the left image at the last stop.
    Leaving,
}

/// Up to `count` pixels of a kind; fewer if the world has no more.
pub fn choose_special(
    world: &World,
    scenario: &Scenario,
    index: &TraverseIndex,
    kind: Special,
    count: u32,
) -> Vec<Pixel> {
    let mut scenario = scenario.clone();
    if kind == Special::Leaving {
        scenario.targets.radius_m = scenario.targets.radius_m.max(LEAVING_RADIUS_M);
    }
    let Some(view) = View::of(world, &scenario, index) else { return Vec::new() };
    let mut random = Pcg64::seed_from_u64(mix(scenario.seed ^ 0x51de_7a26));
    view.drawn(count, &mut random, &|pixel| match kind {
        Special::Boundary => view.is_near_and_seen_again(pixel) && view.is_before_something(pixel),
        Special::Leaving => view.is_even_window(pixel) && view.leaves(pixel),
    })
}

/// Whether a pixel is on an occluding boundary with another rock behind, as in the arrangement `face` (R119).
pub fn is_on_boundary(world: &World, scenario: &Scenario, index: &TraverseIndex, pixel: Pixel) -> bool {
    View::of(world, scenario, index).is_some_and(|view| view.is_on_boundary(pixel))
}

impl View<'_> {
    /// Whether a surface point is outside the left image at the last stop.
    fn leaves(&self, pixel: Pixel) -> bool {
        let point = surface_point(&self.world, &self.camera, pixel);
        point.is_some_and(|point| {
            let near = (point - self.world.targets_centre()).norm() <= self.rule.radius_m;
            near && !self.last[0].sees(&point)
        })
    }
}
