//! Tests of the navigator on maps of known height functions, and of complete drives in a kinematic simulation.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use sightline_geometry::frames::{Point3, Pose, attitude_from_roll_pitch_yaw};

use super::*;
use crate::driving::{ArcNavigator, Motion, Navigator, PathChoice, PathInput};
use crate::hazards::{
    GoodnessMap, HazardMap, HazardSettings, HazardTerm, MapRules, Scan, assess, map_hazards,
};

/// Half the length and width of the rover over its wheels, m (domain.md 5.4).
const WHEELS_M: [f64; 2] = [0.83, 0.61];

/// Distance of the points of the range data, m.
const SPACING_M: f64 = 0.05;

/// A round rock with a flat top.
#[derive(Clone, Copy, Debug)]
struct Rock {
    at: [f64; 2],
    radius: f64,
    height: f64,
}

fn rocks_height(rocks: &[Rock], x: f64, y: f64) -> f64 {
    let over = |rock: &&Rock| (x - rock.at[0]).hypot(y - rock.at[1]) < rock.radius;
    rocks.iter().find(over).map_or(0.0, |rock| -rock.height)
}

fn pose(at: [f64; 2], heading_rad: f64) -> Pose {
    Pose::from_parts([at[0], at[1], 0.0].into(), attitude_from_roll_pitch_yaw(0.0, 0.0, heading_rad))
}

/// Points of a height function that a stance sees: within a range and an angle of its heading, rover frame.
fn seen(stance: &Pose, range_m: f64, half_field_rad: f64, height: impl Fn(f64, f64) -> f64) -> Vec<Point3> {
    let count = (range_m / SPACING_M) as i32;
    let mut points = Vec::new();
    for row in -count..=count {
        for column in -count..=count {
            let ahead = Point3::new(SPACING_M * f64::from(row), SPACING_M * f64::from(column), 0.0);
            if ahead.x.hypot(ahead.y) > range_m || ahead.y.atan2(ahead.x).abs() > half_field_rad {
                continue;
            }
            let mut site = stance * ahead;
            site.z = height(site.x, site.y);
            points.push(stance.inverse_transform_point(&site));
        }
    }
    points
}

/// The map of a height function that is known all around.
fn known(stance: &Pose, settings: &HazardSettings, height: impl Fn(f64, f64) -> f64) -> GoodnessMap {
    let points = seen(stance, 6.0, 4.0, height);
    let scan = Scan { points_in_rover: &points, site_from_rover: stance, driven_m: 0.0 };
    assess(&map_hazards(None, &scan, settings), &MapRules::default(), settings)
}

fn select(
    preset: NavigatorPreset,
    map: &GoodnessMap,
    stance: &Pose,
    goal: [f64; 2],
    step_m: f64,
) -> PathChoice {
    let goal = stance.inverse_transform_point(&Point3::new(goal[0], goal[1], 0.0));
    let input = PathInput {
        goal_m: [goal.x, goal.y],
        step_m,
        curvature_per_m: 0.0,
        map: Some(map),
        site_from_rover: stance,
    };
    HazardNavigator { settings: preset.settings() }.select_path(&input)
}

/// A drive on exact motions over a field of rocks.
struct Drive<'a> {
    rocks: &'a [Rock],
    /// Range and half field of the range data, m and rad.
    view: [f64; 2],
    preset: NavigatorPreset,
    goal: [f64; 2],
    /// Largest error of a motion: a part of its length, and of the heading, rad.
    error: [f64; 2],
}

/// How a drive ended.
#[derive(Debug, PartialEq)]
struct Driven {
    arrived: bool,
    stops: usize,
    driven_m: f64,
    /// Least distance between a rock and the rectangle over the wheels, m.
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
        let mut curvature_per_m = 0.0;
        while driven.stops < 120 {
            driven.stops += 1;
            let origin = [stance.translation.x, stance.translation.y];
            let distance_m = (self.goal[0] - origin[0]).hypot(self.goal[1] - origin[1]);
            if distance_m < 0.05 {
                driven.arrived = true;
                break;
            }
            let points = seen(&stance, self.view[0], self.view[1], |x, y| rocks_height(self.rocks, x, y));
            let scan = Scan { points_in_rover: &points, site_from_rover: &stance, driven_m: driven.driven_m };
            let next = map_hazards(map.as_ref(), &scan, &settings);
            let goodness = assess(&next, &MapRules::at(origin, [0.0, 0.0], None, &settings), &settings);
            map = Some(next);
            let goal = stance.inverse_transform_point(&Point3::new(self.goal[0], self.goal[1], 0.0));
            let input = PathInput {
                goal_m: [goal.x, goal.y],
                step_m: 0.6_f64.min(0.3 + 0.1 * distance_m),
                curvature_per_m,
                map: Some(&goodness),
                site_from_rover: &stance,
            };
            let choice = HazardNavigator { settings: self.preset.settings() }.select_path(&input);
            let Some(motion) = choice.motion() else { break };
            if let Motion::Arc { length_m, curvature_per_m: curvature } = motion {
                driven.driven_m += length_m.abs();
                curvature_per_m = curvature;
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
        // Hazcams: 4 m and 60° to either side, nothing under the rover.
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
fn a_veto_names_the_first_failing_cell() {
    let stance = pose([0.05, 0.05], 0.0);
    let rocks = [Rock { at: [2.05, 0.05], radius: 0.3, height: 0.4 }];
    let map = known(&stance, &HazardSettings::default(), |x, y| rocks_height(&rocks, x, y));
    let choice = select(NavigatorPreset::Gestalt, &map, &stance, [6.0, 0.0], 1.0);
    let straight = choice.candidates[11];
    assert_eq!(straight.motion, Motion::Arc { length_m: 1.0, curvature_per_m: 0.0 });
    let veto = straight.veto.unwrap();
    assert_eq!(veto.term, HazardTerm::Step);
    // The rock covers a part of its outermost cells, whose mean height is less than its own.
    assert!(veto.value > veto.limit && veto.value < 0.401 && (veto.limit - 0.182).abs() < 1e-9, "{veto:?}");
    // The rock begins at 1.7 m, the leading disc is 0.3 m ahead and has a radius of 0.8 m: 0.6 m, by whole cells.
    assert!((veto.along_m - 0.6).abs() < 0.101, "{veto:?}");
    assert!(
        (veto.in_site_m[0] - veto.along_m - 0.35).abs() < 0.051 && (veto.in_site_m[1] - 0.05).abs() < 1e-9
    );
    // Every cell before it passes.
    let cell = map.cell_at([veto.in_site_m[0] - 0.1, veto.in_site_m[1]]).unwrap();
    assert!(f64::from(cell.step_m) <= veto.limit);
    let chosen = choice.candidates[choice.chosen.unwrap()];
    assert!(chosen.veto.is_none() && chosen.motion != straight.motion);
}

#[test]
fn a_blocked_corridor_has_no_safe_path() {
    let stance = pose([0.0, 0.0], 0.0);
    let closed = |x: f64, y: f64| if x.abs() > 1.25 || y.abs() > 1.15 { -0.5 } else { 0.0 };
    let map = known(&stance, &HazardSettings::default(), closed);
    let choice = select(NavigatorPreset::Gestalt, &map, &stance, [5.0, 0.0], 0.6);
    assert_eq!(choice.motion(), None);
    assert!(choice.candidates.iter().all(|candidate| candidate.veto.is_some()));
    let turns = choice.candidates.iter().filter(|path| matches!(path.motion, Motion::Turn { .. }));
    assert!(turns.count() >= 2 && choice.candidates.len() >= 27);
    // Open to the rear, the rover backs up or turns.
    let dead_end = |x: f64, y: f64| if x > 1.25 || y.abs() > 1.15 { -0.5 } else { 0.0 };
    let map = known(&stance, &HazardSettings::default(), dead_end);
    assert!(select(NavigatorPreset::Gestalt, &map, &stance, [5.0, 0.0], 0.6).motion().is_some());
}

#[test]
fn unknown_ground_is_vetoed_with_its_share() {
    let stance = pose([0.0, 0.0], 0.0);
    let settings = HazardSettings::default();
    let points = seen(&stance, 1.0, 4.0, |_, _| 0.0);
    let scan = Scan { points_in_rover: &points, site_from_rover: &stance, driven_m: 5.0 };
    let hazards = map_hazards(None, &scan, &settings);
    let map = assess(&hazards, &MapRules::default(), &settings);
    let choice = select(NavigatorPreset::Gestalt, &map, &stance, [5.0, 0.0], 1.5);
    let veto = choice.candidates[11].veto.unwrap();
    assert_eq!((veto.term, veto.limit), (HazardTerm::Unknown, 0.3));
    assert!(veto.value > 0.3 && veto.value == choice.candidates[11].unknown_share);
    // Near the start of the drive the same ground is assumed to be good.
    let rules = MapRules::at([0.0, 0.0], [0.0, 0.0], None, &settings);
    let first = assess(&hazards, &rules, &settings);
    let choice = select(NavigatorPreset::Gestalt, &first, &stance, [5.0, 0.0], 1.5);
    assert!(choice.candidates[11].veto.is_none());
}

#[test]
fn a_rover_on_bad_cells_may_leave_them_but_not_go_deeper() {
    let rocks = [Rock { at: [1.25, 0.0], radius: 0.3, height: 0.4 }];
    let stance = pose([0.0, 0.0], 0.0);
    let map = known(&stance, &HazardSettings::default(), |x, y| rocks_height(&rocks, x, y));
    assert_eq!(map.cell_at([0.3, 0.0]).unwrap().goodness, 0.0, "the leading disc touches the rock");
    let choice = select(NavigatorPreset::Gestalt, &map, &stance, [5.0, 0.0], 0.4);
    assert!(choice.candidates[11].veto.is_some());
    assert!(choice.motion().is_some());
}

#[test]
fn a_raised_limit_opens_exactly_the_paths_it_names() {
    let stance = pose([0.0, 0.0], 0.3);
    let settings = HazardSettings::default();
    // A bowl: steeper to all sides, unevenly; a low step beside it.
    let height = |x: f64, y: f64| {
        let radius = (x * x + 1.3 * y * y).sqrt();
        -0.16 * (radius - 0.9).max(0.0).powi(2)
            - 0.22 * (radius - 0.9).max(0.0)
            - if y < -1.2 { 0.1 } else { 0.0 }
    };
    let map = known(&stance, &settings, height);
    let navigator = NavigatorPreset::Gestalt.settings();
    let input = PathInput {
        goal_m: [5.0, 0.0],
        step_m: 1.2,
        curvature_per_m: 0.0,
        map: Some(&map),
        site_from_rover: &stance,
    };
    let choice = HazardNavigator { settings: navigator.clone() }.select_path(&input);
    let vetoed = |choice: &PathChoice, index: usize| choice.candidates[index].veto.is_some();
    assert!((0..23).all(|index| vetoed(&choice, index)), "no arc passes");
    let changes = counterfactual(&choice, &input, &navigator, None);
    assert!(!changes.is_empty());
    assert!(changes.windows(2).all(|pair| pair[0].relative() <= pair[1].relative()));
    for change in &changes {
        let (mut hazards, mut navigator) = (settings.clone(), navigator.clone());
        match change.setting.as_str() {
            "tilt_bad_deg" => hazards.tilt_bad_deg = change.setting_value,
            "roughness_bad_m" => hazards.roughness_bad_m = change.setting_value,
            "step_bad_m" => hazards.step_bad_m = change.setting_value,
            "unknown_share_max" => navigator.unknown_share_max = change.setting_value,
            other => panic!("no setting {other}"),
        }
        let raised = known(&stance, &hazards, height);
        let input = PathInput { map: Some(&raised), ..input };
        let again = HazardNavigator { settings: navigator }.select_path(&input);
        let opened: Vec<usize> = (0..23).filter(|index| !vetoed(&again, *index)).collect();
        let named: Vec<usize> = change.opens.iter().copied().filter(|index| *index < 23).collect();
        assert_eq!(opened, named, "{}", change.sentence());
        assert!(!named.is_empty());
    }
    let one = counterfactual(&choice, &input, &navigator, Some(11));
    assert!(one.iter().all(|change| change.opens.contains(&11)));
}

#[test]
fn the_sentence_of_a_change_has_both_limits_and_the_count() {
    let change = LimitChange {
        term: HazardTerm::Tilt,
        limit: 16.0,
        raised: 17.2,
        setting: "tilt_bad_deg".to_owned(),
        setting_value: 18.8,
        opens: vec![3, 4, 5, 6],
    };
    assert_eq!(change.sentence(), "a tilt limit of 17.2° instead of 16.0° opens 4 paths");
}

#[test]
fn without_a_map_the_choice_is_that_of_the_arc_navigator() {
    let stance = pose([1.0, 2.0], 0.4);
    for goal_m in [[3.0, 0.4], [-0.3, 0.1], [0.2, 2.0]] {
        let input =
            PathInput { goal_m, step_m: 0.5, curvature_per_m: 0.0, map: None, site_from_rover: &stance };
        let blind = ArcNavigator::default();
        assert_eq!(HazardNavigator::default().select_path(&input), blind.select_path(&input));
        assert_eq!(blind.select_path(&input).motion(), Some(blind.motion(goal_m, 0.5)));
    }
}

#[test]
fn presets_are_valid_and_values_out_of_range_are_refused() {
    for preset in [NavigatorPreset::Gestalt, NavigatorPreset::Morphin] {
        assert!(preset.settings().validate().is_ok());
    }
    let broken = NavigatorSettings { curvature_count: 4, ..NavigatorSettings::default() };
    assert!(broken.validate().unwrap_err().to_string().contains("curvature_count"));
}

#[test]
fn old_data_count_less_for_morphin_than_for_gestalt() {
    let stance = pose([0.0, 0.0], 0.0);
    let settings = HazardSettings::default();
    let points = seen(&stance, 5.0, 4.0, |_, _| 0.0);
    let scan = |driven_m: f64| Scan { points_in_rover: &points, site_from_rover: &stance, driven_m };
    let first = map_hazards(None, &scan(0.0), &settings);
    let nothing = Scan { points_in_rover: &[], ..scan(5.0) };
    let old = map_hazards(Some(&first), &nothing, &settings);
    let hazard = |map: &HazardMap, preset| {
        let map = assess(map, &MapRules::default(), &settings);
        select(preset, &map, &stance, [5.0, 0.0], 0.6).candidates[11].terms.hazard
    };
    for (preset, falls) in [(NavigatorPreset::Gestalt, false), (NavigatorPreset::Morphin, true)] {
        let (new, old) = (hazard(&first, preset), hazard(&old, preset));
        assert_eq!(old < 0.8 * new, falls, "{preset:?}: {new} {old}");
    }
}
