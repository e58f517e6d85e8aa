//! Tests of the hazard map against planes, steps and a reference implementation that visits every cell of every disc.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use sightline_geometry::frames::{Point3, Pose, attitude_from_roll_pitch_yaw};

use super::*;

/// Points of a height function on a lattice of `spacing` within `reach` of a position, site frame.
fn points(middle: [f64; 2], reach: f64, spacing: f64, height: impl Fn(f64, f64) -> f64) -> Vec<Point3> {
    let count = (2.0 * reach / spacing) as i32;
    let at = |k: i32, middle: f64| middle - reach + (f64::from(k) + 0.5) * spacing;
    (0..count)
        .flat_map(|row| (0..count).map(move |column| (row, column)))
        .map(|(row, column)| (at(row, middle[0]), at(column, middle[1])))
        .map(|(x, y)| Point3::new(x, y, height(x, y)))
        .collect()
}

fn pose(x: f64, y: f64) -> Pose {
    Pose::translation(x, y, 0.0)
}

/// A map of points in the site frame, seen from a pose.
fn mapped(
    before: Option<&HazardMap>,
    points: &[Point3],
    site_from_rover: &Pose,
    driven_m: f64,
    settings: &HazardSettings,
) -> HazardMap {
    let in_rover: Vec<Point3> = points.iter().map(|p| site_from_rover.inverse_transform_point(p)).collect();
    map_hazards(
        before,
        &Scan { points_in_rover: &in_rover, site_from_rover, driven_m, noise: None },
        settings,
    )
}

fn assessed(height: impl Fn(f64, f64) -> f64) -> GoodnessMap {
    let settings = HazardSettings::default();
    let map = mapped(None, &points([0.0, 0.0], 4.0, 0.03, height), &pose(0.0, 0.0), 0.0, &settings);
    assess(&map, &MapRules::default(), &settings)
}

#[test]
fn a_tilted_plane_has_its_tilt_in_every_cell() {
    for deg in [0.0f64, 6.0, 15.0, 24.0] {
        let slope = deg.to_radians().tan();
        let map = assessed(|x, y| slope * (0.6 * x + 0.8 * y));
        for at in [[0.0, 0.0], [1.2, -2.0], [-2.5, 2.5]] {
            let cell = map.cell_at(at).unwrap();
            assert_eq!(cell.basis, CellBasis::Measured);
            assert!((f64::from(cell.tilt_deg) - deg).abs() < 1e-4, "{cell:?}");
            assert!(cell.roughness_m < 1e-5);
            assert!(cell.step_m < 1e-3, "the slope itself is not a step: {cell:?}");
        }
    }
}

#[test]
fn a_step_is_what_exceeds_the_error_of_the_heights() {
    let settings = HazardSettings::default();
    let heights = |x: f64, y: f64| if x.abs() < 0.25 && y.abs() < 0.25 { -0.3 } else { 0.0 };
    let points = points([0.0, 0.0], 1.0, 0.03, heights);
    let step = |per_m: f64| {
        // 100 m above level ground every height has nearly the same error.
        let camera_in_rover = Point3::new(0.0, 0.0, -100.0);
        let scan = Scan {
            points_in_rover: &points,
            site_from_rover: &pose(0.0, 0.0),
            driven_m: 0.0,
            noise: Some(RangeNoise { camera_in_rover, per_m }),
        };
        let map = assess(&map_hazards(None, &scan, &settings), &MapRules::default(), &settings);
        f64::from(map.cell_at([0.0, 0.0]).unwrap().step_m)
    };
    assert!((step(0.0) - 0.3).abs() < 1e-6, "{}", step(0.0));
    // 1σ of 5 cm each: 1σ of the difference is 7 cm.
    assert!((step(5e-6) - (0.3 - settings.step_sigmas * 0.1 * 0.5f64.sqrt())).abs() < 2e-3, "{}", step(5e-6));
    assert!(step(1e-4) < 1e-6, "within the error");
}

#[test]
fn a_box_is_a_step_within_the_rovers_radius_of_it() {
    let map = assessed(|x, y| if x.abs() < 0.25 && y.abs() < 0.25 { -0.3 } else { 0.0 });
    for (at, expected) in [([0.0, 0.0], 0.3), ([0.95, 0.05], 0.3), ([1.2, 0.05], 0.0), ([0.9, 0.9], 0.0)] {
        let cell = map.cell_at(at).unwrap();
        assert!((f64::from(cell.step_m) - expected).abs() < 1e-6, "{at:?}: {cell:?}");
        assert_eq!(cell.goodness == 0.0, expected > 0.0);
    }
    let (term, value) = map.cell_at([0.95, 0.05]).unwrap().limiting(&map.settings).unwrap();
    assert_eq!(term, HazardTerm::Step);
    assert!((value - 0.3).abs() < 1e-6);
    assert!(map.cell_at([2.0, 2.0]).unwrap().limiting(&map.settings).is_none());
}

#[test]
fn a_rock_on_a_slope_is_a_step_from_its_uphill_side_too() {
    // A block with a level top, 0.26 m above the ground at its centre.
    let slope = 10f64.to_radians().tan();
    let block = |x: f64, y: f64| if x.abs() < 0.25 && y.abs() < 0.25 { -0.26 } else { -slope * x };
    let map = assessed(block);
    // The disc extends 0.15 m into it: 0.2 m from its centre its top is 0.22 m above the slope uphill, and 0.30 m
    // downhill.
    for at in [[0.9, 0.05], [-0.9, 0.05], [0.05, 0.9], [0.05, -0.9]] {
        let step_m = f64::from(map.cell_at(at).unwrap().step_m);
        let edge_m = 0.26 + if at[0].abs() > 0.5 { -0.2 * slope * at[0].signum() } else { 0.0 };
        assert!((step_m - edge_m).abs() < 0.03, "{at:?}: {step_m} {edge_m}");
    }
    assert!(map.cell_at([1.5, 0.0]).unwrap().step_m < 0.02);
}

#[test]
fn level_ground_before_a_wall_has_no_steps() {
    for (height_m, top_m) in [(0.3, 4.0), (0.5, 1.0), (1.2, 0.3), (1.2, 2.0), (1.8, 1.0)] {
        let settings = HazardSettings::default();
        let seen = points([0.0, 0.0], 4.0, 0.03, |x, _| if x > 1.0 { -height_m } else { 0.0 });
        let seen: Vec<Point3> = seen.into_iter().filter(|point| point.x < 1.0 + top_m).collect();
        let map = mapped(None, &seen, &pose(0.0, 0.0), 0.0, &settings);
        let map = assess(&map, &MapRules::default(), &settings);
        for x in [-2.0, -1.0, -0.5, 0.0, 0.1] {
            let cell = map.cell_at([x, 0.3]).unwrap();
            assert!(cell.step_m < 1e-6, "wall of {height_m} m, top of {top_m} m, {x}: {cell:?}");
        }
        // A wall that reaches the deck counts from 1.25 m on.
        for (x, is_high) in [(-0.4, false), (-0.1, height_m > 0.5)] {
            let found = f64::from(map.cell_at([x, 0.3]).unwrap().deck_step_m);
            assert!((found - if is_high { height_m } else { 0.0 }).abs() < 1e-6, "{height_m}, {x}: {found}");
        }
        let at_wall = map.cell_at([0.5, 0.3]).unwrap().step_m;
        assert!((f64::from(at_wall) - height_m).abs() < 1e-6, "{height_m}: {at_wall}");
    }
}

#[test]
fn a_chequered_surface_is_rough_but_level() {
    let height = |x: f64, y: f64| {
        let is_up = ((x / 0.03).floor() + (y / 0.03).floor()).rem_euclid(2.0) < 0.5;
        if is_up { -0.06 } else { 0.06 }
    };
    let cell = *assessed(height).cell_at([0.5, 0.5]).unwrap();
    assert!((cell.roughness_m - 0.06).abs() < 1e-3 && cell.tilt_deg < 0.5, "{cell:?}");
    assert!(cell.goodness > 0.0 && cell.goodness < 0.8);
}

#[test]
fn a_face_is_as_high_as_its_upper_edge_whether_its_top_is_seen_or_not() {
    let settings = HazardSettings::default();
    let ground = (-150..150)
        .flat_map(|row| (-150..150).map(move |column| (row, column)))
        .map(|(row, column)| Point3::new(0.01 * f64::from(row), 0.01 * f64::from(column) + 0.005, 0.0));
    let ground: Vec<Point3> = ground.filter(|point| point.x < 1.0).collect();
    // A face of 0.3 m across the path at 1.05 m; behind it no points, or those of its top.
    let face = (0..30).flat_map(|z| {
        (-30..30).map(move |y| Point3::new(1.05, 0.01 * f64::from(y) + 0.005, -0.01 * f64::from(z) - 0.005))
    });
    let top = (0..20).flat_map(|x| {
        (-30..30).map(move |y| Point3::new(1.105 + 0.01 * f64::from(x), 0.01 * f64::from(y) + 0.005, -0.3))
    });
    let (face, top): (Vec<Point3>, Vec<Point3>) = (face.collect(), top.collect());
    for seen in [[&ground[..], &face[..], &[]].concat(), [&ground[..], &face[..], &top[..]].concat()] {
        let map = mapped(None, &seen, &pose(0.0, 0.0), 0.0, &settings);
        let assessed = assess(&map, &MapRules::default(), &settings);
        let step_m = assessed.cell_at([0.65, 0.05]).unwrap().step_m;
        assert!((step_m - 0.3).abs() < 0.02, "{step_m}");
        // Level ground stays level.
        assert!(assessed.cell_at([-0.5, 0.05]).unwrap().step_m < 1e-6);
    }
}

/// The mean of a cell relative to the corner of the window, m; `None` without a point.
fn mean_of(map: &HazardMap, cell: &[i64; 2]) -> Option<[f64; 3]> {
    let own = map.cell(cell[0] as usize, cell[1] as usize);
    let [x, y, z] = own.mean();
    let corner = cell.map(|number| (number as f64 + 0.5) * map.grid.cell_m);
    (own.count() >= 1.0).then_some([corner[0] + x, corner[1] + y, z])
}

/// The slope of all pairs of cells that are four cells apart along an axis.
fn slope_by_sorting(map: &HazardMap) -> [f64; 2] {
    let side = map.grid.side as i64;
    let mut slope = [0.0; 2];
    for axis in [0, 1, 0, 1, 0, 1] {
        let mut all = Vec::new();
        for [row, column] in (0..side).flat_map(|row| (0..side).map(move |column| [row, column])) {
            let next = [[row + 4, column], [row, column + 4]][axis];
            if next[axis] < side
                && let (Some(a), Some(b)) = (mean_of(map, &[row, column]), mean_of(map, &next))
            {
                let aside = slope[1 - axis] * (b[1 - axis] - a[1 - axis]);
                all.push((b[2] - a[2] - aside) / (b[axis] - a[axis]));
            }
        }
        all.sort_by(f64::total_cmp);
        slope[axis] = all[all.len() / 2];
    }
    slope
}

#[test]
fn sums_and_steps_are_those_of_a_visit_of_every_cell() {
    let settings =
        HazardSettings { side_m: 5.0, weight_min: 1.0, face_spread_m: 2.0, ..HazardSettings::default() };
    let mut random = Pcg64::seed_from_u64(3);
    // With holes: about a third of the cells have no point.
    let scattered: Vec<Point3> = (0..3000)
        .map(|_| {
            let mut next = |from: f64, to: f64| random.random_range(from..to);
            Point3::new(next(-2.6, 2.6), next(-2.6, 2.6), next(-0.2, 0.2))
        })
        .collect();
    let map = mapped(None, &scattered, &pose(0.04, -0.02), 0.0, &settings);
    let assessed = assess(&map, &MapRules::default(), &settings);
    let grid = &map.grid;
    let side = grid.side as i64;
    let slope = slope_by_sorting(&map);
    assert!(slope.iter().all(|along| along.abs() > 1e-4), "{slope:?}");
    let above = |cell: &[i64; 2]| mean_of(&map, cell).map(|[x, y, z]| z - slope[0] * x - slope[1] * y);
    for index in (0..grid.len()).step_by(7) {
        let [row, column] = [index as i64 / side, index as i64 % side];
        let inside = |d: &[i64; 2]| ((d[0] * d[0] + d[1] * d[1]) as f64).sqrt() * grid.cell_m <= 0.8 + 1e-9;
        let disc: Vec<[i64; 2]> = (-8..=8)
            .flat_map(|a| (-8..=8).map(move |b| [a, b]))
            .filter(inside)
            .map(|[a, b]| [row + a, column + b])
            .filter(|cell| cell.iter().all(|number| (0..side).contains(number)))
            .collect();
        let above: Vec<([i64; 2], f64)> =
            disc.iter().filter_map(|cell| Some((*cell, above(cell)?))).collect();
        let mut step = 0.0f64;
        for (a, above_a) in &above {
            for (b, above_b) in &above {
                let apart = (((a[0] - b[0]).pow(2) + (a[1] - b[1]).pow(2)) as f64).sqrt() * grid.cell_m;
                if apart <= 0.4 + 1e-9 {
                    step = step.max((above_a - above_b).abs());
                }
            }
        }
        let count: f64 = disc.iter().map(|c| map.cell(c[0] as usize, c[1] as usize).count()).sum();
        let known = disc.iter().filter(|cell| mean_of(&map, cell).is_some()).count() as f64 / 197.0;
        let cell = &assessed.cells[index];
        assert!((f64::from(cell.step_m) - step).abs() < 1e-6, "{index}: {} {step}", cell.step_m);
        assert!((f64::from(cell.certainty) - (count / 40.0).min(1.0) * known).abs() < 1e-6);
    }
}

#[test]
fn a_map_that_wrapped_around_is_a_fresh_one() {
    let settings = HazardSettings { side_m: 8.0, ..HazardSettings::default() };
    let height = |x: f64, y: f64| 0.1 * (1.3 * x).sin() * (0.9 * y).cos();
    let seen = points([6.3, -2.1], 3.9, 0.05, height);
    // Elsewhere first, then 12 m without a point: the window has wrapped and no data remain.
    let elsewhere = mapped(None, &points([0.0, 0.0], 3.0, 0.1, height), &pose(-7.0, 3.0), 0.0, &settings);
    let moved = mapped(Some(&elsewhere), &seen, &pose(6.3, -2.1), 20.0, &settings);
    let fresh = mapped(None, &seen, &pose(6.3, -2.1), 20.0, &settings);
    assert_eq!(moved, fresh);
    // In steps of 0.7 m, with the points added at the end.
    let mut wandering = mapped(None, &[], &pose(0.0, 0.0), 0.0, &settings);
    for k in 1..=9 {
        wandering = mapped(Some(&wandering), &[], &pose(0.7 * f64::from(k), -0.2), f64::from(k), &settings);
    }
    let wandering = mapped(Some(&wandering), &seen, &pose(6.3, -2.1), 20.0, &settings);
    let assess = |map| assess(map, &MapRules::default(), &settings);
    assert_eq!(assess(&wandering).cells, assess(&fresh).cells);
}

#[test]
fn points_decay_by_half_in_their_half_life() {
    let settings = HazardSettings::default();
    let seen = points([0.0, 0.0], 0.5, 0.05, |_, _| 0.0);
    let first = mapped(None, &seen, &pose(0.0, 0.0), 0.0, &settings);
    let count = |map: &HazardMap| {
        let side = map.grid.side;
        (0..side * side).map(|index| map.cell(index / side, index % side).count()).sum::<f64>()
    };
    let later = mapped(Some(&first), &[], &pose(2.0, 0.0), 5.0, &settings);
    assert!((count(&later) - 0.5 * count(&first)).abs() < 1e-9);
    let goodness = assess(&later, &MapRules::default(), &settings);
    let cell = goodness.cell_at([0.0, 0.0]).unwrap();
    assert!((cell.age_m - 5.0).abs() < 1e-4, "{cell:?}");
    let both = mapped(Some(&later), &seen, &pose(2.0, 0.0), 5.0, &settings);
    let age = assess(&both, &MapRules::default(), &settings).cell_at([0.0, 0.0]).unwrap().age_m;
    assert!((age - 5.0 / 3.0).abs() < 1e-4, "{age}");
}

#[test]
fn what_left_the_view_is_kept_and_what_left_the_window_is_not() {
    let settings = HazardSettings { side_m: 8.0, ..HazardSettings::default() };
    let rock = points([1.5, 0.0], 0.3, 0.03, |_, _| -0.4);
    let ground = points([1.5, 0.0], 1.5, 0.03, |_, _| 0.0);
    let first = mapped(None, &[rock, ground].concat(), &pose(0.0, 0.0), 0.0, &settings);
    let passed = mapped(Some(&first), &[], &pose(3.0, 0.0), 3.0, &settings);
    let goodness = |map: &HazardMap| assess(map, &MapRules::default(), &settings);
    assert_eq!(goodness(&passed).cell_at([1.5, 0.0]).unwrap().goodness, 0.0);
    assert_eq!(goodness(&passed).cell_at([1.5, 0.0]).unwrap().basis, CellBasis::Measured);
    let far = mapped(Some(&passed), &[], &pose(9.0, 0.0), 9.0, &settings);
    let back = mapped(Some(&far), &[], &pose(2.0, 0.0), 16.0, &settings);
    assert_eq!(goodness(&back).cell_at([1.5, 0.0]).unwrap().basis, CellBasis::Unknown);
}

#[test]
fn cells_near_an_exempt_target_count_as_good() {
    let settings = HazardSettings { exemption_radius_m: 1.0, ..HazardSettings::default() };
    let seen = points([0.0, 0.0], 3.0, 0.03, |x, y| if x.hypot(y) < 0.3 { -0.4 } else { 0.0 });
    let map = mapped(None, &seen, &pose(0.0, 0.0), 0.0, &settings);
    let rules = MapRules::at([0.0, 0.0], [-9.0, 0.0], Some([0.5, 0.0]), &settings);
    assert_eq!(rules.start, None);
    let exempt = assess(&map, &rules, &settings);
    let [near, beyond] = [[0.9, 0.0], [-0.8, 0.0]].map(|at| *exempt.cell_at(at).unwrap());
    assert_eq!((near.basis, near.goodness), (CellBasis::Exempt, 1.0));
    assert!(near.step_m > 0.3, "the terms stay for display");
    assert_eq!((beyond.basis, beyond.goodness), (CellBasis::Measured, 0.0));
    let off = MapRules::at([0.0, 0.0], [0.0, 0.0], Some([0.5, 0.0]), &HazardSettings::default());
    assert_eq!(off.exemption, None);
}

#[test]
fn unknown_cells_near_the_start_are_assumed_good_for_2_m() {
    let settings = HazardSettings::default();
    let map = mapped(None, &[], &pose(0.0, 0.0), 0.0, &settings);
    let at = |rover: [f64; 2]| assess(&map, &MapRules::at(rover, [0.0, 0.0], None, &settings), &settings);
    let first = at([0.0, 0.0]);
    assert_eq!(first.cell_at([1.5, 0.5]).unwrap().basis, CellBasis::Assumed);
    assert_eq!(first.cell_at([1.5, 0.5]).unwrap().goodness, 1.0);
    assert_eq!(first.cell_at([2.2, 0.0]).unwrap().basis, CellBasis::Unknown);
    assert_eq!(at([2.1, 0.0]).cell_at([1.5, 0.5]).unwrap().basis, CellBasis::Unknown);
}

#[test]
fn a_cell_with_few_points_is_unknown() {
    let settings = HazardSettings::default();
    let sparse = mapped(None, &points([0.0, 0.0], 2.0, 0.35, |_, _| 0.0), &pose(0.0, 0.0), 0.0, &settings);
    let cell = *assess(&sparse, &MapRules::default(), &settings).cell_at([0.0, 0.0]).unwrap();
    assert_eq!((cell.basis, cell.goodness), (CellBasis::Unknown, 0.0));
    assert!(cell.certainty > 0.0 && f64::from(cell.certainty) < settings.certainty_min);
    assert_eq!(cell.limiting(&settings).unwrap().0, HazardTerm::Unknown);
}

#[test]
fn points_high_above_the_rover_are_left_out() {
    let settings = HazardSettings::default();
    let overhang = points([0.0, 0.0], 1.0, 0.05, |_, _| -3.0);
    let map = mapped(None, &overhang, &pose(0.0, 0.0), 0.0, &settings);
    assert_eq!(map, mapped(None, &[], &pose(0.0, 0.0), 0.0, &settings));
}

#[test]
fn points_enter_the_map_by_the_pose() {
    let settings = HazardSettings::default();
    let tilted = Pose::from_parts([2.0, -1.0, 0.4].into(), attitude_from_roll_pitch_yaw(0.05, 0.1, 0.7));
    let seen = points([2.0, -1.0], 2.0, 0.04, |x, _| 0.1 * x);
    let map = mapped(None, &seen, &tilted, 0.0, &settings);
    let cell = *assess(&map, &MapRules::default(), &settings).cell_at([2.0, -1.0]).unwrap();
    assert!((f64::from(cell.tilt_deg) - 0.1f64.atan().to_degrees()).abs() < 1e-4, "{cell:?}");
}

#[test]
fn a_stored_map_is_restored_bit_for_bit() {
    let settings = HazardSettings::default();
    let seen = points([1.0, 0.0], 2.0, 0.09, |x, y| 0.07 * (3.0 * x + y).sin());
    let map = mapped(None, &seen, &pose(0.3, 0.2), 1.7, &settings);
    let text = serde_json::to_string(&map).unwrap();
    assert_eq!(serde_json::from_str::<HazardMap>(&text).unwrap(), map);
    assert!(serde_json::from_str::<HazardMap>(&text.replace("\"side\":160", "\"side\":0")).is_err());
}
