//! The rules that choose the targets of a simulated traverse.
//!
//! Every target satisfies the rule of its window (`window.rs`): in the image, lit, even, on a rock, facing the camera and
//! visible from the last stop. The `arrangement` chooses among such pixels:
//!
//! * `drawn`: pixels drawn uniformly, by the scenario's seed, from the whole-pixel positions of the first left
//!   image whose surface point is within `radius_m` of the targets' centre.
//! * `rows`: on the large rock, in `rows` straight rows of equal spacing (R110; `arranged.rs`).
//! * `face`: on the large rock, `boundary` of them on an occluding boundary with another rock behind (R119).
//! * `centre`: the centre of the visible part of the rock at the targets' centre (`arranged.rs`).
//! * `placed`: the same for each placed rock, in the order of the scenario (R207, R209).
//!
//! The *large rock* is the one with the most pixels near the targets' centre.
//!
//! There is no other condition: not on texture, contrast or trackability. If the rule finds fewer pixels than requested,
//! there are fewer targets.
//!
//! Results of `drawn` in the default worlds of seeds 1 to 12: 20 targets in eight of them, 4 and 14 in seeds 4 and 6, on
//! one or two rocks, since at 10 m the window spans 17 cm and few rocks fill it; none in seeds 5 and 11. Level ground at
//! 10 m is seen at 81°, so that targets anywhere need `incidence_deg = 90` beside `on_rocks = false`. A smaller image
//! needs a smaller window: 21 px in a 512-pixel image find nothing, 11 px almost as much as 21 px in the full image.
//!
//! Units: px, m. Frames: pixels of the first left image, rays in the site frame. Sources: papers.md R20, R21,
//! R110, R119, R209.

mod arranged;
mod special;
mod view;
mod window;

use rand::SeedableRng;
use rand_pcg::Pcg64;

use crate::ground::texture::mix;
use crate::scenario::{Arrangement, Scenario};
use crate::targets::view::View;
use crate::traverse::TraverseIndex;
use crate::world::World;
use sightline_geometry::frames::Pixel;

pub use special::{Special, choose_special, is_on_boundary};
pub use view::surface_point;

/// Chooses targets by the rule of the module's header; fewer than requested if there are no more.
pub fn choose_targets(world: &World, scenario: &Scenario, index: &TraverseIndex) -> Vec<Pixel> {
    let Some(view) = View::of(world, scenario, index) else { return Vec::new() };
    let mut random = Pcg64::seed_from_u64(mix(scenario.seed ^ 0x7a26_e750));
    match scenario.targets.arrangement {
        Arrangement::Drawn => view.drawn(scenario.targets.count, &mut random, &|pixel| view.is_target(pixel)),
        Arrangement::Rows => view.rows(),
        Arrangement::Face => view.face(&mut random),
        Arrangement::Placed => view.on_placed(),
        Arrangement::Centre => view.centre().into_iter().collect(),
    }
}
