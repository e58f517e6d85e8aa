//! Randomised approaches: the paper's claim for any drive of 10 m (K abstract, R127).
//!
//! The seed of a world draws its surface, rocks and texture, as always, and here also the approach:
//!
//! | quantity | from | to |
//! |---|---|---|
//! | distance at the designation | 9.5 m | 10.5 m |
//! | bearing of the targets at the designation, to either side | 0° | 20° |
//! | heading in the site | −180° | 180° |
//! | sun's azimuth | 0° | 360° |
//! | sun's elevation | 25° | 65° |
//!
//! The rover turns towards the targets and then drives straight, in steps of 10 % to 2 m (R104); each mast angle has an
//! error of 0.05° (1σ, domain.md 4.5). Everything else is as in the scenario `approach-10`.

use rand::RngExt;
use rand_pcg::Pcg64;

use sightline_geometry::error::Result;
use sightline_world::scenario::{Course, Move};
use sightline_world::{Scenario, library};

/// Scenario name of the randomised approaches.
pub(crate) const CLAIM: &str = "claim";

/// Stream of the random generator, distinct from the other streams of a seed.
const STREAM: u128 = 0x0c1a_1a5e_ed00_0127;

/// The scenario of the library on which the worlds of a name are based.
///
/// # Errors
/// A name that is not in the library.
pub fn base(name: &str) -> Result<Scenario> {
    library::scenario(if name == CLAIM { "approach-10" } else { name })
}

/// World of a seed: that of the scenario, or, for the claim, one with drive and light also drawn from the seed.
pub fn world(name: &str, base: &Scenario, seed: u64) -> Scenario {
    let mut world = Scenario { seed, ..base.clone() };
    if name != CLAIM {
        return world;
    }
    let mut random = Pcg64::new(u128::from(seed), STREAM);
    let drive = &mut world.drive;
    drive.start_distance_m = random.random_range(9.5..10.5);
    drive.start_bearing_deg = random.random_range(-20.0..20.0);
    drive.heading_deg = random.random_range(-180.0..180.0);
    drive.pointing_error_deg = 0.05;
    drive.course = Course::Moves;
    drive.moves = vec![
        Move::FaceTarget,
        Move::Approach { to_distance_m: drive.end_distance_m, step_fraction: drive.step_fraction },
    ];
    world.sun.azimuth_deg = random.random_range(0.0..360.0);
    world.sun.elevation_deg = random.random_range(25.0..65.0);
    world.name = "approach from anywhere".to_owned();
    world
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_world;

    #[test]
    fn drawn_approaches_are_valid_differ_by_seed_and_end_at_two_metres() {
        let base = base(CLAIM).unwrap();
        let worlds: Vec<Scenario> = (1..=20).map(|seed| world(CLAIM, &base, seed)).collect();
        for (index, drawn) in worlds.iter().enumerate() {
            assert!(drawn.validate().is_ok(), "{drawn:?}");
            assert_eq!(*drawn, world(CLAIM, &base, drawn.seed));
            assert!(worlds[..index].iter().all(|other| other.drive != drawn.drive && other.sun != drawn.sun));
        }
        let mut small = worlds[0].clone();
        small.camera.image_size = 128;
        let built = sightline_world::World::new(&small);
        let stops = sightline_world::index(&small, &built).unwrap().stops;
        let distance_m = |stop: &sightline_world::traverse::Stop| {
            let camera = sightline_world::true_camera_in_site(stop, sightline_world::Eye::Left).unwrap();
            (camera.model.centre() - built.targets_centre()).norm()
        };
        assert!((distance_m(&stops[0]) - small.drive.start_distance_m).abs() < 0.1);
        let last_m = distance_m(&stops[stops.len() - 1]);
        assert!((1.7..=2.05).contains(&last_m), "{last_m}");
    }

    #[test]
    fn other_scenarios_differ_in_their_seed_alone() {
        let base = base("approach-5").unwrap();
        assert_eq!(world("approach-5", &base, 7), Scenario { seed: 7, ..base });
    }
}
