//! Goodness map of a world's true ground, and reachability of a goal over it: which drives can arrive at all.

use rayon::prelude::*;

use sightline_geometry::frames::{Point3, Pose, Ray, Vector3};
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::set_goal::goal_position_m;
use sightline_rover::driving::{DriveCommand, Motion};
use sightline_rover::hazards::{GoodnessMap, HazardSettings, MapRules, Scan, assess, map_hazards};
use sightline_rover::navigation::{NavigatorSettings, way};
use sightline_track::target::Designation;
use sightline_world::World;
use sightline_world::target_truth::{TargetTruth, TruthSource};

/// Spacing of the points of the true map, m.
const GROUND_STEP_M: f64 = 0.05;

/// Length of a path over the true ground from a pose to a goal, site frame, m; `None` if the search finds none.
pub fn true_way_m(
    world: &World,
    start: &Pose,
    goal_m: [f64; 2],
    (hazards, navigator): (&HazardSettings, &NavigatorSettings),
) -> Option<f64> {
    let map = true_map(world, start, goal_m, hazards);
    way(&map, start, goal_m, navigator).map(|motions| motions.iter().map(length_m).sum())
}

/// Length of a path over the true ground, from the first stop to the goal of the true target, m, before the rover has
/// moved; `None` without a path, or without a surface at the target's pixel.
pub fn way_to_goal_m(
    begun: &DrivenTraverse,
    command: &DriveCommand,
    designation: Designation,
    settings: (&HazardSettings, &NavigatorSettings),
) -> Option<f64> {
    let traverse = begun.traverse();
    let target = TargetTruth::new(traverse, designation, None)?.position_in_site();
    let start = TruthSource::true_site_from_rover(traverse, 0)?;
    let goal_m = goal_position_m(command, 0, &target, [start.translation.x, start.translation.y]);
    true_way_m(traverse.world()?, &start, goal_m, settings)
}

fn length_m(motion: &Motion) -> f64 {
    match motion {
        Motion::Arc { length_m, .. } => length_m.abs(),
        Motion::Turn { .. } => 0.0,
    }
}

/// Goodness map of the true surface, centred between start and goal.
fn true_map(world: &World, start: &Pose, goal_m: [f64; 2], settings: &HazardSettings) -> GoodnessMap {
    let origin = start.translation.vector;
    let middle = Pose::translation(0.5 * (origin.x + goal_m[0]), 0.5 * (origin.y + goal_m[1]), origin.z);
    let half = 0.5 * settings.side_m;
    let count = (half / GROUND_STEP_M) as i32;
    let place = |number: i32| GROUND_STEP_M * (f64::from(number) + 0.5);
    let points: Vec<Point3> = (-count..count)
        .into_par_iter()
        .flat_map_iter(|row| (-count..count).map(move |column| (place(row), place(column))))
        .filter_map(|(x, y)| {
            let above = middle * Point3::new(x, y, 0.0) - 10.0 * Vector3::z();
            let hit = world.cast(&Ray { origin: above, direction: Vector3::z() })?;
            Some(middle.inverse_transform_point(&hit.point))
        })
        .collect();
    // Every point was hit from above, so the test for vertical faces does not apply.
    let settings = &HazardSettings { face_spread_m: f64::INFINITY, ..settings.clone() };
    let scan = Scan { points_in_rover: &points, site_from_rover: &middle, driven_m: 0.0, noise: None };
    assess(&map_hazards(None, &scan, settings), &MapRules::default(), settings)
}
