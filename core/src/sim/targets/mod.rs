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
//!
//! The *large rock* is the one that most pixels near the targets' centre show.
//!
//! Nothing else is asked: not texture, not contrast, not how well anything tracks it. Where the rule finds fewer
//! pixels than asked for, there are fewer targets.
//!
//! What `drawn` finds in the default worlds of seeds 1 to 12: 20 targets in eight of them, 4 and 14 in seeds 4 and
//! 6, on one or two rocks, since at 10 m the window spans 17 cm and few rocks fill it; none in seeds 5 and 11. Level
//! ground at 10 m is seen at 81°, so that targets anywhere need `incidence_deg = 90` beside `on_rocks = false`
//! ([`share_on_rocks`] tells how many lie on rocks). A reduced image needs a reduced window: 21 px of a
//! 512-pixel image find nothing, 11 px almost what 21 px find in the full image.
//!
//! Units: px, m. Frames: pixels of the first left image, rays in the site frame. Sources: papers.md R20, R21,
//! R110, R119, R209.

mod arranged;
mod special;
mod window;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use crate::camera::Camera;
use crate::frames::{Pixel, Point3};
use crate::sim::camera::render::Eye;
use crate::sim::ground::texture::mix;
use crate::sim::index::true_camera_in_site;
use crate::sim::moment::Moment;
use crate::sim::scenario::{Arrangement, Scenario, TargetRule};
use crate::sim::world::{SurfaceId, World};
use crate::traverse::TraverseIndex;

pub use special::{Special, choose_special, is_on_boundary};

/// Draws per target before the search is given up.
const DRAWS_PER_TARGET: u32 = 2000;

/// The world as the first stop sees it, and where it must be seen again.
struct View<'a> {
    world: World,
    camera: Camera,
    last: [Camera; 2],
    rule: &'a TargetRule,
}

/// Chooses targets by the rule of the module's header; fewer than asked for where it finds no more.
pub fn choose_targets(world: &World, scenario: &Scenario, index: &TraverseIndex) -> Vec<Pixel> {
    let Some(view) = View::of(world, scenario, index) else { return Vec::new() };
    let mut random = Pcg64::seed_from_u64(mix(scenario.seed ^ 0x7a26_e750));
    match scenario.targets.arrangement {
        Arrangement::Drawn => view.drawn(scenario.targets.count, &mut random, &|pixel| view.is_target(pixel)),
        Arrangement::Rows => view.rows(),
        Arrangement::Face => view.face(&mut random),
        Arrangement::Centre => view.centre().into_iter().collect(),
    }
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

impl<'a> View<'a> {
    fn of(world: &World, scenario: &'a Scenario, index: &TraverseIndex) -> Option<Self> {
        let (first, last) = (index.stops.first()?, index.stops.last()?);
        Some(Self {
            world: world.at(&Moment::of(0, first)?, scenario),
            camera: true_camera_in_site(first, Eye::Left)?,
            last: [true_camera_in_site(last, Eye::Left)?, true_camera_in_site(last, Eye::Right)?],
            rule: &scenario.targets,
        })
    }

    /// Up to `count` different pixels, drawn evenly near the targets' centre, that `accepts` accepts.
    fn drawn(&self, count: u32, random: &mut Pcg64, accepts: &dyn Fn(Pixel) -> bool) -> Vec<Pixel> {
        let Some([columns, rows]) = self.bounds() else { return Vec::new() };
        let mut chosen: Vec<Pixel> = Vec::new();
        for _ in 0..count.saturating_mul(DRAWS_PER_TARGET) {
            if chosen.len() >= count as usize {
                break;
            }
            let x = f64::from(random.random_range(columns[0]..=columns[1]));
            let y = f64::from(random.random_range(rows[0]..=rows[1]));
            let pixel = Pixel::new(x, y);
            if !chosen.contains(&pixel) && accepts(pixel) {
                chosen.push(pixel);
            }
        }
        chosen
    }
}
