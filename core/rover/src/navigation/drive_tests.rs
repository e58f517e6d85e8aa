//! Complete drives over fields of rocks in a kinematic simulation: motions with errors, exact poses and heights.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use sightline_geometry::frames::{Point3, Pose};

use super::tests::{Rock, pose, rocks_height, seen};
use super::*;
use crate::driving::{Motion, Navigator, PathInput};
use crate::hazards::{HazardMap, HazardSettings, MapRules, Scan, assess, map_hazards};

/// Half the length and width of the rover over its wheels, m (domain.md 5.4).
const WHEELS_M: [f64; 2] = [0.83, 0.61];

/// Parameters of a simulated drive over a field of rocks.
struct Drive<'a> {
    rocks: &'a [Rock],
    /// Range, m, and half field of view, rad, of the range data.
    view: [f64; 2],
    preset: NavigatorPreset,
    goal: [f64; 2],
    /// Largest errors of a motion: relative to its length, and of the heading, rad.
    error: [f64; 2],
}

/// The result of a drive.
#[derive(Debug, PartialEq)]
struct Driven {
    arrived: bool,
    stops: usize,
    driven_m: f64,
    /// Smallest distance between a rock and the rectangle over the wheels, m.
    clearance_m: f64,
}

impl Drive<'_> {
    fn clearance_m(&self, stance: &Pose) -> f64 {
        let gap = |rock: &Rock| {
            let seen = stance.inverse_transform_point(&Point3::new(rock.at[0], rock.at[1], 0.0));
            let [dx, dy] = [seen.x.abs() - WHEELS_M[0], seen.y.abs() - WHEELS_M[1]].map(|d| d.max(0.0));
            dx.hypot(dy) - rock.radius
        };
        self.rocks.iter().map(gap).fold(f64::INFINITY, f64::min)
    }

    fn run(&self, seed: u64) -> Driven {
        let settings = HazardSettings::default();
        let mut random = Pcg64::seed_from_u64(seed);
        let mut stance = pose([0.0, 0.0], 0.0);
        let mut map: Option<HazardMap> = None;
        let mut driven = Driven { arrived: false, stops: 0, driven_m: 0.0, clearance_m: f64::INFINITY };
        let mut before = None;
        while driven.stops < 120 {
            driven.stops += 1;
            let origin = [stance.translation.x, stance.translation.y];
            let distance_m = (self.goal[0] - origin[0]).hypot(self.goal[1] - origin[1]);
            if distance_m < 0.05 {
                driven.arrived = true;
                break;
            }
            let points = seen(&stance, self.view[0], self.view[1], |x, y| rocks_height(self.rocks, x, y));
            let scan = Scan {
                points_in_rover: &points,
                site_from_rover: &stance,
                driven_m: driven.driven_m,
                noise: None,
            };
            let next = map_hazards(map.as_ref(), &scan, &settings);
            let goodness = assess(&next, &MapRules::at(origin, [0.0, 0.0], None, &settings), &settings);
            map = Some(next);
            let goal = stance.inverse_transform_point(&Point3::new(self.goal[0], self.goal[1], 0.0));
            let input = PathInput {
                goal_m: [goal.x, goal.y],
                step_m: 0.6_f64.min(0.3 + 0.1 * distance_m),
                before,
                map: Some(&goodness),
                site_from_rover: &stance,
            };
            let choice = HazardNavigator { settings: self.preset.settings() }.select_path(&input);
            let Some(motion) = choice.motion() else { break };
            before = Some(motion);
            if let Motion::Arc { length_m, .. } = motion {
                driven.driven_m += length_m.abs();
            }
            let errors = self.error.map(|error| error * random.random_range(-1.0..1.0));
            let start = stance;
            for k in 1..=30 {
                let part = f64::from(k) / 30.0;
                let (moved, turned_rad) = motion.after(part * (1.0 + errors[0]));
                let change = pose(moved, turned_rad + part * errors[1]);
                stance = start * change;
                driven.clearance_m = driven.clearance_m.min(self.clearance_m(&stance));
            }
        }
        driven
    }
}

/// Rocks between start and goal at random, with gaps of at least 2.2 m: the two discs of the footprint need 1.6 m.
fn rock_field(seed: u64, goal: [f64; 2]) -> Vec<Rock> {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut rocks: Vec<Rock> = Vec::new();
    for _ in 0..4000 {
        let rock = Rock {
            at: [random.random_range(-2.0..12.0), random.random_range(-5.0..5.0)],
            radius: random.random_range(0.12..0.4),
            height: random.random_range(0.25..0.5),
        };
        let gap =
            |at: [f64; 2], radius: f64| (at[0] - rock.at[0]).hypot(at[1] - rock.at[1]) - rock.radius - radius;
        let is_free = gap([0.0, 0.0], 0.0) > 1.5 && gap(goal, 0.0) > 1.3;
        if is_free && rocks.iter().all(|other| gap(other.at, other.radius) > 2.2) {
            rocks.push(rock);
        }
    }
    rocks
}

#[test]
fn open_ground_is_driven_straight_to_the_goal() {
    let rocks = [Rock { at: [20.0, 20.0], radius: 0.1, height: 0.1 }];
    for preset in [NavigatorPreset::Gestalt, NavigatorPreset::Morphin] {
        let drive = Drive { rocks: &rocks, view: [6.0, 4.0], preset, goal: [7.0, 1.5], error: [0.0; 2] };
        let driven = drive.run(1);
        assert!(driven.arrived && driven.driven_m < 1.02 * 7.0f64.hypot(1.5), "{preset:?}: {driven:?}");
    }
}

#[test]
fn rock_fields_are_crossed_without_touching_a_rock() {
    let goal = [10.0, 0.5];
    for (preset, seeds) in [(NavigatorPreset::Gestalt, 0..6), (NavigatorPreset::Morphin, 6..9)] {
        for seed in seeds {
            let rocks = rock_field(seed, goal);
            let drive = Drive { rocks: &rocks, view: [6.0, 4.0], preset, goal, error: [0.03, 0.02] };
            let driven = drive.run(seed);
            assert!(driven.arrived, "{preset:?} {seed}: {driven:?}");
            assert!(driven.clearance_m > 0.0, "{preset:?} {seed}: {driven:?}");
        }
    }
}

#[test]
fn a_view_ahead_with_memory_crosses_rock_fields_too() {
    let goal = [9.0, -1.0];
    for seed in 20..26 {
        let rocks = rock_field(seed, goal);
        let preset = NavigatorPreset::Gestalt;
        // Hazcams: 4 m and 60° to either side, no data under the rover.
        let drive = Drive { rocks: &rocks, view: [4.0, 1.05], preset, goal, error: [0.03, 0.02] };
        let driven = drive.run(seed);
        assert!(driven.arrived && driven.clearance_m > 0.0, "{seed}: {driven:?}");
    }
}

#[test]
fn a_trap_open_to_the_start_is_left_and_driven_round() {
    let mut rocks = Vec::new();
    let mut wall = |from: [f64; 2], to: [f64; 2]| {
        for k in 0..=20 {
            let part = f64::from(k) / 20.0;
            let at = [0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis]));
            rocks.push(Rock { at, radius: 0.2, height: 0.4 });
        }
    };
    wall([4.5, -2.5], [4.5, 2.5]);
    wall([2.0, 2.5], [4.5, 2.5]);
    wall([2.0, -2.5], [4.5, -2.5]);
    for view in [[6.0, 4.0], [4.0, 1.05]] {
        let preset = NavigatorPreset::Gestalt;
        let drive = Drive { rocks: &rocks, view, preset, goal: [8.0, 0.2], error: [0.02, 0.01] };
        let driven = drive.run(5);
        assert!(driven.arrived && driven.clearance_m > 0.0, "{view:?}: {driven:?}");
    }
}

#[test]
fn a_goal_before_a_rock_is_reached_from_the_side() {
    let rocks = [Rock { at: [6.2, 0.0], radius: 0.3, height: 0.4 }];
    let preset = NavigatorPreset::Gestalt;
    let drive = Drive { rocks: &rocks, view: [4.0, 1.05], preset, goal: [5.0, 0.0], error: [0.02, 0.01] };
    let driven = drive.run(3);
    assert!(driven.arrived && driven.clearance_m > 0.0 && driven.driven_m < 10.0, "{driven:?}");
}

#[test]
fn a_rover_whose_goal_is_inside_a_rock_ends_beside_it() {
    let rocks = [Rock { at: [5.0, 0.2], radius: 0.4, height: 0.4 }];
    let preset = NavigatorPreset::Gestalt;
    let drive = Drive { rocks: &rocks, view: [4.0, 1.05], preset, goal: [5.0, 0.0], error: [0.02, 0.01] };
    let driven = drive.run(3);
    assert!(!driven.arrived && driven.stops < 30 && driven.clearance_m > 0.0, "{driven:?}");
    assert!((3.5..8.0).contains(&driven.driven_m), "{driven:?}");
}
