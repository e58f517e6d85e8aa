//! Targets for what a tracker must notice: on occluding boundaries, and such as leave the picture.
//!
//! Both are drawn by the seed from the pixels near the targets' centre and are no part of a scenario's own targets.
//!
//! * On a *boundary*: rule 1 and 2 of the window, uneven in depth, with another surface farther behind in at least 15 %
//!   of it (R20, R119). Here the surface behind may be the ground too, of which there is more than of rocks.
//! * *Leaving*: rules 1, 3, 4 and 5 of the window at the first stop, and out of the left image at the last. The mast
//!   points at the targets' centre, so that what lies aside of it leaves the image as the rover comes near. They may lie
//!   farther from the centre than the scenario's own: within [`LEAVING_RADIUS_M`].
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

/// Greatest distance of a leaving target from the targets' centre, m.
const LEAVING_RADIUS_M: f64 = 3.0;

/// Which pixels are asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Special {
    /// On an occluding boundary.
    Boundary,
    /// Out of the left image at the last stop.
    Leaving,
}

/// Up to `count` pixels of a kind; fewer where the world has no more.
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

/// Whether a pixel lies on an occluding boundary with another rock behind, as those of the arrangement `face` (R119).
pub fn is_on_boundary(world: &World, scenario: &Scenario, index: &TraverseIndex, pixel: Pixel) -> bool {
    View::of(world, scenario, index).is_some_and(|view| view.is_on_boundary(pixel))
}

impl View<'_> {
    /// Whether a point is out of the left image at the last stop.
    fn leaves(&self, pixel: Pixel) -> bool {
        let point = surface_point(&self.world, &self.camera, pixel);
        point.is_some_and(|point| {
            let near = (point - self.world.targets_centre()).norm() <= self.rule.radius_m;
            near && !self.last[0].sees(&point)
        })
    }
}
