//! Tests of the rock field: its law, its free tracks and its clear path.

use super::*;
use crate::scenario::{ClearPath, TerrainSettings};
use sightline_geometry::frames::Point3;

fn approach() -> Approach {
    Approach { goal_m: [10.3, 0.0], wheels_reach_m: 9.7, around: None }
}

fn field(settings: &RockSettings, seed: u64) -> Vec<Rock> {
    let terrain = Terrain::new(&TerrainSettings::default(), [-2.0, 2.0], [-2.0, 2.0], seed);
    scatter(settings, &approach(), &terrain, seed, Cancel::default()).unwrap()
}

#[test]
fn rocks_near_the_approach_follow_the_distribution() {
    let settings = RockSettings { cluster_count: 0, farthest_m: 10.0, ..RockSettings::default() };
    let (mut counted, mut area_m2) = ([0.0; 3], 0.0);
    for seed in 0..10 {
        for rock in field(&settings, seed) {
            // Outside the tracks, which are kept free.
            let (x, y) = (rock.centre.x, rock.centre.y.abs());
            if (2.5..8.5).contains(&x) && (1.4..3.0).contains(&y) {
                counted[0] += f64::from(rock.diameter_m >= 0.02);
                counted[1] += f64::from(rock.diameter_m >= 0.04);
                counted[2] += f64::from(rock.diameter_m >= 0.15);
            }
        }
        area_m2 += 2.0 * 6.0 * 1.6;
    }
    let most = number_per_m2(0.09, 1.0);
    for (counted, diameter_m) in counted.into_iter().zip([0.02, 0.04, 0.15]) {
        let expected = (number_per_m2(0.09, diameter_m) - most) * area_m2;
        assert!((counted - expected).abs() < 4.0 * expected.sqrt(), "{counted} {expected}");
    }
}

#[test]
fn heights_follow_the_line_and_all_kinds_occur() {
    let settings = RockSettings { cluster_count: 0, farthest_m: 12.0, ..RockSettings::default() };
    for smallest_m in [0.02, 0.1] {
        let (mut over, mut count, mut slabs) = (0.0, 0.0, 0.0);
        for rock in (0..10).flat_map(|seed| field(&settings, seed)) {
            if (smallest_m..1.3 * smallest_m).contains(&rock.diameter_m) && rock.centre.y.abs() > 1.2 {
                over += rock.height_m / (0.5 * rock.diameter_m + 0.008);
                slabs += f64::from(rock.shape == RockShape::Slab);
                count += 1.0;
            }
        }
        // Single rocks vary by a fifth; 1σ of the mean is below 1 %.
        assert!(count > 400.0 && (over / count - 1.0f64).abs() < 0.03, "{count} {}", over / count);
        assert!((slabs / count - 0.15f64).abs() < 0.05, "{}", slabs / count);
    }
}

#[test]
fn placed_rocks_stand_where_they_should_and_others_give_way() {
    let mut settings = RockSettings { farthest_m: 12.0, ..RockSettings::default() };
    let text = "x_m = 0.5\ny_m = -0.2\ndiameter_m = 0.07\nheight_m = 0.05\n";
    settings.placed.push(toml::from_str(text).unwrap());
    for seed in 0..5 {
        let rocks = field(&settings, seed);
        let rock = &rocks[0];
        assert!((rock.centre.x - 10.8).abs() < 1e-12 && (rock.centre.y + 0.2).abs() < 1e-12);
        assert_eq!((rock.diameter_m, rock.shape), (0.07, RockShape::Block));
        let near = |other: &&Rock| (other.centre - rock.centre).xy().norm() < 0.6 * (other.diameter_m + 0.07);
        assert_eq!(rocks.iter().filter(near).count(), 1);
    }
}

#[test]
fn rocks_that_need_not_keep_off_the_planned_drive_are_the_same_for_every_drive() {
    let places = |off_planned_drive: bool, wheels_reach_m: f64| {
        let settings = RockSettings { off_planned_drive, farthest_m: 12.0, ..RockSettings::default() };
        let approach = Approach { wheels_reach_m, ..approach() };
        let terrain = Terrain::new(&TerrainSettings::default(), [-2.0, 2.0], [-2.0, 2.0], 3);
        let rocks = scatter(&settings, &approach, &terrain, 3, Cancel::default()).unwrap();
        rocks.iter().map(|rock| [rock.centre.x, rock.centre.y, rock.height_m]).collect::<Vec<_>>()
    };
    assert_eq!(places(false, 4.0), places(false, 9.7));
    assert_ne!(places(true, 4.0), places(true, 9.7));
    let in_track = |place: &[f64; 3]| place[0] < 9.0 && (0.43..0.70).contains(&place[1].abs());
    assert!(places(false, 9.7).iter().any(|place| in_track(place) && place[2] > 0.05));
}

#[test]
fn a_clear_path_removes_the_rocks_on_it_and_leaves_all_others_as_they_were() {
    let path = ClearPath { to_x_m: -2.0, to_y_m: 1.0, ..ClearPath::default() };
    let open = RockSettings { farthest_m: 12.0, ..RockSettings::default() };
    let cleared = RockSettings { clear_path: Some(path), ..open.clone() };
    let mut removed = 0;
    for seed in 0..5 {
        let (before, after) = (field(&open, seed), field(&cleared, seed));
        let in_strip = |rock: &&Rock| {
            let place_m = [rock.centre.x, rock.centre.y];
            clear_path::removes(&path, approach().goal_m, place_m, 0.6 * rock.diameter_m, rock.height_m)
        };
        let others: Vec<Point3> = before.iter().filter(|rock| !in_strip(rock)).map(|r| r.centre).collect();
        assert_eq!(after.iter().map(|rock| rock.centre).collect::<Vec<_>>(), others);
        removed += before.len() - after.len();
        // Pebbles on the path and the rocks beyond its end remain.
        assert!(after.iter().any(|rock| (3.0..7.0).contains(&rock.centre.x) && rock.centre.y.abs() < 0.4));
        let near = |rock: &&Rock| (rock.centre.x - 10.3).hypot(rock.centre.y) < 1.5;
        assert!(after.iter().filter(near).filter(|rock| rock.diameter_m >= 0.25).count() >= 8);
    }
    assert!(removed > 0);
}

#[test]
fn a_dozen_rocks_stand_near_the_goal_and_none_in_the_tracks_or_in_another() {
    for seed in 0..10 {
        let rocks = field(&RockSettings { farthest_m: 14.0, ..RockSettings::default() }, seed);
        let near = |rock: &&Rock| (rock.centre.x - 10.3).hypot(rock.centre.y) < 1.5;
        assert!(rocks.iter().filter(near).filter(|rock| rock.diameter_m >= 0.15).count() >= 12);
        for (index, rock) in rocks.iter().enumerate() {
            let aside = rock.centre.y.abs();
            let in_track = rock.centre.x < 9.7 && (0.43..0.70).contains(&aside);
            assert!(!in_track || rock.height_m <= 0.025);
            for other in &rocks[index + 1..] {
                let gap_m = (rock.centre - other.centre).xy().norm();
                assert!(gap_m >= 0.6 * (rock.diameter_m + other.diameter_m) - 1e-9);
            }
        }
    }
}
