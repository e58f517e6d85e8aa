//! Claims about the simulator as a whole: rays, images, the drive and its targets.
//!
//! All tests share one world, that of the demonstration; it is built once.

mod courses;
mod drive;
mod fiducials;
mod moments;
mod geometry;
mod papers;
mod pictures;
mod slip;

use std::sync::OnceLock;

use super::*;
use crate::rover::drive::true_drive;
use crate::rover::scene::TrueStop;
use crate::traverse::TraverseIndex;
use sightline_geometry::cancel::Cancel;

/// The demonstration's scenario with its world and index.
struct Demo {
    scenario: Scenario,
    world: World,
    index: TraverseIndex,
}

fn demo() -> &'static Demo {
    static DEMO: OnceLock<Demo> = OnceLock::new();
    DEMO.get_or_init(|| {
        let scenario = Scenario::demo();
        let world = World::new(&scenario);
        let index = index(&scenario, &world).expect("the demonstration can be driven");
        Demo { scenario, world, index }
    })
}

/// The true stops of a possible scenario, in driving order.
fn true_stops(world: &World, scenario: &Scenario) -> Vec<TrueStop> {
    true_drive(world, scenario, Cancel::default()).unwrap().stops
}

/// A number in [0, 1) from two others.
fn unit(a: u64, b: u64) -> f64 {
    (crate::ground::texture::mix(crate::ground::texture::mix(a) ^ b) >> 11) as f64 / (1u64 << 53) as f64
}
