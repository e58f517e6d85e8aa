//! The rules that choose the targets of a simulated traverse.
//!
//! Every target satisfies the rule of its window (`window.rs`): in the image, lit, even, on a rock, turned to the
//! camera and seen again from the last stop. Which of such pixels become targets is the `arrangement`:
//!
//! * `drawn`: pixels drawn evenly, by the scenario's seed, from the whole-pixel positions of the first left
//!   image whose surface point lies within `radius_m` of the targets' centre.
//! * `rows`: on the large rock, in `rows` straight rows of equal spacing (R110; `arranged.rs`).
//! * `face`: on the large rock, `boundary` of them on an occluding boundary with another rock behind (R119).
//! * `centre`: the middle of what is seen of the rock on which the targets' centre lies (`arranged.rs`).
//! * `placed`: the same for each placed rock, in the order of the scenario (R207, R209).
//!
//! The *large rock* is the one that most pixels near the targets' centre show.
//!
//! Nothing else is asked: not texture, not contrast, not how well anything tracks it. Where the rule finds fewer
//! pixels than asked for, there are fewer targets.
//!
//! What `drawn` finds in the default worlds of seeds 1 to 12: 20 targets in eight of them, 4 and 14 in seeds 4 and
//! 6, on one or two rocks, since at 10 m the window spans 17 cm and few rocks fill it; none in seeds 5 and 11. Level
//! ground at 10 m is seen at 81°, so that targets anywhere need `incidence_deg = 90` beside `on_rocks = false`. A
//! reduced image needs a reduced window: 21 px of a 512-pixel image find nothing, 11 px almost what 21 px find in the
//! full image.
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

/// Chooses targets by the rule of the module's header; fewer than asked for where it finds no more.
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
