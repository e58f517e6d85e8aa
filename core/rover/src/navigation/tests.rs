//! Tests of single decisions on maps of known height functions.

use sightline_geometry::frames::{Point3, Pose, attitude_from_roll_pitch_yaw};

use super::*;
use crate::driving::{ArcNavigator, Motion, Navigator, PathChoice, PathInput};
use crate::hazards::{
    GoodnessMap, HazardMap, HazardSettings, HazardTerm, MapRules, Scan, assess, map_hazards,
};

/// Spacing of the points of the range data, m.
const SPACING_M: f64 = 0.05;

/// A round rock with a flat top.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rock {
    pub(super) at: [f64; 2],
    pub(super) radius: f64,
    pub(super) height: f64,
}

pub(super) fn rocks_height(rocks: &[Rock], x: f64, y: f64) -> f64 {
    let over = |rock: &&Rock| (x - rock.at[0]).hypot(y - rock.at[1]) < rock.radius;
    rocks.iter().find(over).map_or(0.0, |rock| -rock.height)
}

pub(super) fn pose(at: [f64; 2], heading_rad: f64) -> Pose {
    Pose::from_parts([at[0], at[1], 0.0].into(), attitude_from_roll_pitch_yaw(0.0, 0.0, heading_rad))
}

/// Points of a height function visible from a stance: within a range and an angle of its heading, rover frame.
pub(super) fn seen(
    stance: &Pose,
    range_m: f64,
    half_field_rad: f64,
    height: impl Fn(f64, f64) -> f64,
) -> Vec<Point3> {
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
pub(super) fn known(
    stance: &Pose,
    settings: &HazardSettings,
    height: impl Fn(f64, f64) -> f64,
) -> GoodnessMap {
    known_to(6.0, stance, settings, height)
}

/// The same up to a distance.
pub(super) fn known_to(
    range_m: f64,
    stance: &Pose,
    settings: &HazardSettings,
    height: impl Fn(f64, f64) -> f64,
) -> GoodnessMap {
    let points = seen(stance, range_m, 4.0, height);
    let scan = Scan { points_in_rover: &points, site_from_rover: stance, driven_m: 0.0, noise: None };
    assess(&map_hazards(None, &scan, settings), &MapRules::default(), settings)
}

pub(super) fn select(
    preset: NavigatorPreset,
    map: &GoodnessMap,
    stance: &Pose,
    goal: [f64; 2],
    step_m: f64,
) -> PathChoice {
    select_after(None, preset, map, stance, goal, step_m)
}

fn select_after(
    before: Option<Motion>,
    preset: NavigatorPreset,
    map: &GoodnessMap,
    stance: &Pose,
    goal: [f64; 2],
    step_m: f64,
) -> PathChoice {
    let goal = stance.inverse_transform_point(&Point3::new(goal[0], goal[1], 0.0));
    let input =
        PathInput { goal_m: [goal.x, goal.y], step_m, before, map: Some(map), site_from_rover: stance };
    HazardNavigator { settings: preset.settings() }.select_path(&input)
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
    // The rock covers only a part of its outermost cells, whose mean height is less than its own.
    assert!(veto.value > veto.limit && veto.value < 0.401 && (veto.limit - 0.165).abs() < 1e-9, "{veto:?}");
    // The rock begins at 1.7 m, the leading disc is 0.55 m ahead and has a radius of 0.8 m: 0.35 m, by whole cells.
    assert!((veto.along_m - 0.35).abs() < 0.101, "{veto:?}");
    assert!(
        (veto.in_site_m[0] - veto.along_m - 0.6).abs() < 0.051 && (veto.in_site_m[1] - 0.05).abs() < 1e-9
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
    // Reversing would bring it no nearer to the goal either.
    let before = Some(Motion::Arc { length_m: 0.5, curvature_per_m: 0.4 });
    let after = select_after(before, NavigatorPreset::Gestalt, &map, &stance, [5.0, 0.0], 0.6);
    assert_eq!(after.motion(), None);
    // Open to the rear, the rover backs up or turns.
    let dead_end = |x: f64, y: f64| if x > 1.25 || y.abs() > 1.15 { -0.5 } else { 0.0 };
    let map = known(&stance, &HazardSettings::default(), dead_end);
    assert!(select(NavigatorPreset::Gestalt, &map, &stance, [-4.0, 0.0], 0.6).motion().is_some());
    // Towards a goal that it cannot reach it stays.
    let ahead = select(NavigatorPreset::Gestalt, &map, &stance, [5.0, 0.0], 0.6);
    assert!(ahead.motion().is_none() && ahead.stays_for().is_some());
}

#[test]
fn a_line_ends_at_a_goal_beside_bad_ground() {
    let stance = pose([0.0, 0.0], 0.0);
    let rocks = [Rock { at: [3.0, 0.1], radius: 0.35, height: 0.4 }];
    let map = known(&stance, &HazardSettings::default(), |x, y| rocks_height(&rocks, x, y));
    // From well beside the rock to a cell whose disc nearly touches it.
    for goal in [[4.6, 0.0], [4.4, 0.0], [3.0, 1.5]] {
        let choice = select(NavigatorPreset::Gestalt, &map, &stance, goal, 0.6);
        assert_eq!(choice.blocked_goal, None);
        let line = choice.route_m;
        assert!(line.iter().flatten().all(|along| along.is_finite()));
        assert!(distance(line[line.len() - 1], goal) < 1e-6, "{goal:?}: {:?}", line.last());
        let steps = line.windows(2).map(|pair| distance(pair[0], pair[1]));
        let length_m: f64 = steps.sum();
        assert!(length_m < goal[0].hypot(goal[1]) + 2.0, "{goal:?}: {length_m} m, {} points", line.len());
    }
}

pub(super) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[test]
fn a_goal_inside_a_rock_is_replaced_by_the_nearest_place_to_it() {
    let rocks = [Rock { at: [3.0, 0.1], radius: 0.35, height: 0.4 }];
    let stance = pose([0.0, 0.0], 0.0);
    let map = known(&stance, &HazardSettings::default(), |x, y| rocks_height(&rocks, x, y));
    let choice = select(NavigatorPreset::Gestalt, &map, &stance, [3.0, 0.1], 0.6);
    let blocked = choice.blocked_goal.unwrap();
    let ground = blocked.ground.unwrap();
    assert_eq!((ground.term, ground.limit), (HazardTerm::Step, 0.165));
    assert!((ground.value - 0.4).abs() < 0.01, "{ground:?}");
    // The disc of 0.8 m, by whole cells, is clear of the rock.
    let nearest = blocked.nearest_m.unwrap();
    assert!((1.05..1.35).contains(&distance(nearest, [3.0, 0.1])), "{nearest:?}");
    assert!((distance(nearest, [3.0, 0.1]) - blocked.nearest_from_goal_m.unwrap()).abs() < 1e-9);
    assert!(choice.motion().is_some() && choice.stays_for().is_none());
    assert!(distance(choice.route_m[choice.route_m.len() - 1], nearest) < 1e-6);
    // There the rover stays, although other paths are safe.
    let there = pose(nearest, 0.0);
    let choice = select(NavigatorPreset::Gestalt, &map, &there, [3.0, 0.1], 0.6);
    let sentence = choice.stays_for().unwrap().sentence();
    assert!(sentence.starts_with(
        "the rover cannot stand at its goal, where the step is 0.400 m, limit 0.165 m; the nearest"
    ));
    assert_eq!(choice.motion(), None);
}

#[test]
fn a_way_passes_no_bad_cell_and_ends_at_the_goal() {
    // A rock behind the goal: straight ahead the leading disc would touch it.
    let rocks = [Rock { at: [4.4, 0.0], radius: 0.3, height: 0.4 }];
    let stance = pose([0.0, 0.0], 0.0);
    let map = known(&stance, &HazardSettings::default(), |x, y| rocks_height(&rocks, x, y));
    let settings = NavigatorSettings::default();
    let goal = [3.2, 0.0];
    let motions = way(&map, &stance, goal, &settings).unwrap();
    let mut at = stance;
    for motion in &motions {
        let start = at;
        for k in 1..=40 {
            let (moved, turned_rad) = motion.after(f64::from(k) / 40.0);
            at = start * pose(moved, turned_rad);
            for ahead in [0.0, settings.reach_m] {
                let disc = at * Point3::new(ahead, 0.0, 0.0);
                let step_m = f64::from(map.cell_at([disc.x, disc.y]).unwrap().step_m);
                // Backwards, the other disc leads.
                let is_back = matches!(*motion, Motion::Arc { length_m, .. } if length_m < 0.0);
                assert!(step_m <= 0.165 || (is_back && ahead > 0.0), "{motion:?} {k}: {step_m} m");
            }
        }
    }
    assert!(distance([at.translation.x, at.translation.y], goal) < 1e-6);
    let heading_rad = at.rotation.euler_angles().2;
    assert!(heading_rad.abs() > 0.3, "it comes from the side: {heading_rad}");
    // Among walls there is no way.
    let closed = |x: f64, y: f64| if x.abs() > 1.5 || y.abs() > 1.5 { -0.5 } else { 0.0 };
    let map = known(&stance, &HazardSettings::default(), closed);
    assert_eq!(way(&map, &stance, goal, &settings), None);
}

#[test]
fn the_rover_does_not_back_up_over_ground_that_it_has_not_seen() {
    let stance = pose([0.0, 0.0], 0.0);
    let settings = HazardSettings::default();
    // A wall ahead and to both sides.
    let walls = |x: f64, y: f64| if x > 1.25 || y.abs() > 1.15 { -0.5 } else { 0.0 };
    for (half_field_rad, backs_up) in [(4.0, true), (1.6, false)] {
        let points = seen(&stance, 6.0, half_field_rad, walls);
        let scan = Scan { points_in_rover: &points, site_from_rover: &stance, driven_m: 0.0, noise: None };
        let map = assess(&map_hazards(None, &scan, &settings), &MapRules::default(), &settings);
        let choice = select(NavigatorPreset::Gestalt, &map, &stance, [-4.0, 0.0], 0.6);
        assert_eq!(choice.motion().is_some(), backs_up, "{choice:?}");
        if !backs_up {
            let back = choice
                .candidates
                .iter()
                .find(|path| matches!(path.motion, Motion::Arc { length_m, .. } if length_m < 0.0));
            let veto = back.unwrap().veto.unwrap();
            assert_eq!((veto.term, veto.limit), (HazardTerm::Unknown, 0.0));
            // It reverses the motion that led here, and does not oscillate.
            let after = |before: Motion| {
                select_after(Some(before), NavigatorPreset::Gestalt, &map, &stance, [-4.0, 0.0], 0.6).motion()
            };
            let arc = |length_m: f64| Motion::Arc { length_m, curvature_per_m: 0.4 };
            assert_eq!(after(arc(0.5)), Some(arc(-0.5)));
            assert_eq!((after(arc(-0.5)), after(Motion::Turn { angle_rad: 0.3 })), (None, None));
        }
    }
}

#[test]
fn unknown_ground_is_vetoed_with_its_share() {
    let stance = pose([0.0, 0.0], 0.0);
    let settings = HazardSettings::default();
    let points = seen(&stance, 1.0, 4.0, |_, _| 0.0);
    let scan = Scan { points_in_rover: &points, site_from_rover: &stance, driven_m: 5.0, noise: None };
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

/// Raises one limit after the other in the settings, and compares the arcs that then pass with the reported ones.
fn check_changes(settings: &HazardSettings, height: fn(f64, f64) -> f64, expected: HazardTerm) {
    let stance = pose([0.0, 0.0], 0.3);
    let map = known(&stance, settings, height);
    // With a way the arcs would be as short as the ground allows.
    let navigator = NavigatorSettings { has_route: false, ..NavigatorPreset::Gestalt.settings() };
    let input = PathInput {
        goal_m: [5.0, 0.0],
        step_m: 0.7,
        before: None,
        map: Some(&map),
        site_from_rover: &stance,
    };
    let choice = HazardNavigator { settings: navigator.clone() }.select_path(&input);
    let vetoed = |choice: &PathChoice, index: usize| choice.candidates[index].veto.is_some();
    assert!((0..23).all(|index| vetoed(&choice, index)), "no arc passes");
    let changes = counterfactual(&choice, &input, &navigator, None);
    assert_eq!(changes[0].term, expected);
    assert!(changes.windows(2).all(|pair| pair[0].relative() <= pair[1].relative()));
    let one = counterfactual(&choice, &input, &navigator, Some(11));
    assert!(one.iter().all(|change| change.opens.contains(&11)) && !one.is_empty());
    let mut partly = 0;
    for change in changes.iter().chain(&one) {
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
        assert!(!change.opens.is_empty());
        partly += usize::from((1..23).contains(&named.len()));
    }
    assert!(partly > 0, "no change opens a part of the arcs: {changes:?}");
}

#[test]
fn a_raised_limit_opens_exactly_the_paths_it_names() {
    // A bowl that is steeper on one side; steps do not matter there.
    let settings = HazardSettings { step_bad_m: 0.6, deck_clearance_m: 10.0, ..HazardSettings::default() };
    let bowl = |x: f64, y: f64| -0.3 * ((x * x + 1.3 * y * y).sqrt() - 0.1 * y).max(0.4).powi(2);
    check_changes(&settings, bowl, HazardTerm::Tilt);
    // A surrounding wall that grows with the bearing.
    let wall = |x: f64, y: f64| if x.hypot(y) > 1.5 { -0.22 - 0.02 * y.atan2(x) } else { 0.0 };
    check_changes(&HazardSettings::default(), wall, HazardTerm::Step);
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
        let input = PathInput { goal_m, step_m: 0.5, before: None, map: None, site_from_rover: &stance };
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
    let scan =
        |driven_m: f64| Scan { points_in_rover: &points, site_from_rover: &stance, driven_m, noise: None };
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
