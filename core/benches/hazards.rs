//! Speed of the hazard map and of path selection; the goals are 30 ms from a pair of 256 × 256 px to the goodness map and 20 ms
//! for a path, on two cores.
//!
//! **The bound**, for 160 × 160 cells, a disc of 197 cells in 17 rows, on one core:
//!
//! | step | work | at what the processor can do |
//! |---|---|---|
//! | stereo | 65,536 px × 64 disparities, semi-global (`stereo.rs`: 85 ms for 134 M cells) | 2.7 ms |
//! | points | 50,000 triangulations of CAHVORE rays, 0.2 µs each | 10 ms |
//! | sums of cells | 50,000 points × 11 sums | 0.3 ms |
//! | sums of discs | 25,600 cells × 17 rows × 24 sums, two at a time | 1.5 ms |
//! | steps | 24 offsets × 25,600 cells × 38 maxima, four at a time | 2 ms |
//! | clearance | 2 × 2 passes over 25,600 cells | 0.5 ms |
//! | route | 25,600 cells from a heap, some 100 ns each | 2.5 ms |
//! | paths | 24 paths × 24 samples × 2 discs | 0.1 ms |
//! | way | 30 to 6,000 stances × 4 motions that lower a sum × 12 samples, 10 ns each; the heap | 0.02 to 4 ms |
//!
//! Run with `cargo bench -p sightline-core --profile dev --bench hazards` (the profile `dev` is optimised); measured times:
//! `docs/benchmarks.md`.

use std::sync::OnceLock;

use divan::Bencher;
use sightline_geometry::camera::CameraName;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::{Point3, Pose};
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::{Navigator, PathInput};
use sightline_rover::hazards::{
    GoodnessMap, HazardMap, HazardSettings, MapRules, Scan, assess, map_hazards, range_points,
};
use sightline_rover::navigation::{HazardNavigator, counterfactual};
use sightline_rover::pipeline::Stops;
use sightline_world::library;
use sightline_world::scenario::{CameraRig, FurtherRig};

fn main() {
    divan::main();
}

/// The first stop of a drive with front hazcams of 256 × 256 px.
struct Scene {
    _folder: tempfile::TempDir,
    world: DrivenTraverse,
    name: CameraName,
    settings: HazardSettings,
}

fn scene() -> &'static Scene {
    static SCENE: OnceLock<Scene> = OnceLock::new();
    SCENE.get_or_init(|| {
        let mut scenario = library::scenario("approach-10").expect("a scenario of the library");
        let name: CameraName = "front_hazcam".parse().expect("a name");
        (scenario.camera.image_size, scenario.camera.samples_per_axis) = (256, 2);
        scenario.camera.further =
            vec![FurtherRig { name, rig: CameraRig::MerFrontHazcam, look_deg: None, image_size: 256 }];
        let folder = tempfile::tempdir().expect("a folder for the drive");
        let world = DrivenTraverse::begin(&scenario, &folder.path().join("drive"), Cancel::default())
            .expect("a drive");
        Scene { _folder: folder, world, name, settings: HazardSettings::default() }
    })
}

impl Scene {
    fn points(&self) -> Vec<Point3> {
        let stops = self.world.traverse();
        let pair = stops.further_pair(0, self.name).expect("a pair");
        let images = stops.capture_further(0, self.name, Cancel::default()).expect("images");
        let images = [&*images.left, &*images.right];
        range_points(images, [pair.left, pair.right], &self.settings, Cancel::default()).expect("points")
    }

    fn hazards(&self, points: &[Point3], before: Option<&HazardMap>) -> HazardMap {
        let site_from_rover = self.world.traverse().site_from_rover(0);
        let scan =
            Scan { points_in_rover: points, site_from_rover: &site_from_rover, driven_m: 0.0, noise: None };
        map_hazards(before, &scan, &self.settings)
    }

    fn goodness(&self, map: &HazardMap, pose: &Pose) -> GoodnessMap {
        let at = [pose.translation.x, pose.translation.y];
        assess(map, &MapRules::at(at, at, None, &self.settings), &self.settings)
    }
}

/// From the images of the pair to the goodness map, stereo included.
#[divan::bench]
fn pair_to_goodness(bencher: Bencher<'_, '_>) {
    let scene = scene();
    let stops = scene.world.traverse();
    let pair = stops.further_pair(0, scene.name).expect("a pair");
    let images = stops.capture_further(0, scene.name, Cancel::default()).expect("images");
    let images = [&*images.left, &*images.right];
    let before = scene.hazards(&scene.points(), None);
    let pose = stops.site_from_rover(0);
    bencher.bench_local(|| {
        let points = range_points(images, [pair.left, pair.right], &scene.settings, Cancel::default());
        let map = scene.hazards(&points.unwrap_or_default(), Some(&before));
        scene.goodness(&map, &pose)
    });
}

/// Points of the pair alone.
#[divan::bench]
fn pair_to_points(bencher: Bencher<'_, '_>) {
    let scene = scene();
    let stops = scene.world.traverse();
    let pair = stops.further_pair(0, scene.name).expect("a pair");
    let images = stops.capture_further(0, scene.name, Cancel::default()).expect("images");
    let images = [&*images.left, &*images.right];
    bencher.bench_local(|| range_points(images, [pair.left, pair.right], &scene.settings, Cancel::default()));
}

/// Points to the goodness map, on one thread.
#[divan::bench]
fn points_to_goodness_one_thread(bencher: Bencher<'_, '_>) {
    let scene = scene();
    let (points, pose) = (scene.points(), scene.world.traverse().site_from_rover(0));
    let before = scene.hazards(&points, None);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
    bencher.bench_local(|| pool.install(|| scene.goodness(&scene.hazards(&points, Some(&before)), &pose)));
}

/// A path on that map.
#[divan::bench]
fn path(bencher: Bencher<'_, '_>) {
    let scene = scene();
    let pose = scene.world.traverse().site_from_rover(0);
    let map = scene.goodness(&scene.hazards(&scene.points(), None), &pose);
    let input = input(&map, &pose);
    let navigator = HazardNavigator::default();
    bencher.bench_local(|| navigator.select_path(&input));
}

/// A path where a closed wall encloses the goal.
#[divan::bench]
fn path_to_an_enclosed_goal(bencher: Bencher<'_, '_>) {
    let is_wall = |x: f64, y: f64| (1.4..1.9).contains(&x.hypot(y));
    bench_path_among_walls(bencher, is_wall);
}

/// A path where the only way out of the goal's place has a corner that the rover cannot turn in: the search ends at its limit.
#[divan::bench]
fn path_to_a_goal_behind_a_narrow_corner(bencher: Bencher<'_, '_>) {
    let is_free = |x: f64, y: f64| {
        let is_in = |x_range: [f64; 2], y_range: [f64; 2]| {
            (x_range[0]..x_range[1]).contains(&x) && (y_range[0]..y_range[1]).contains(&y)
        };
        is_in([-0.95, 0.95], [-0.95, 2.5]) || is_in([-5.0, 0.95], [0.6, 2.5])
    };
    bench_path_among_walls(bencher, |x, y| x > -3.0 && !is_free(x, y));
}

/// A path to the goal of `input`, with walls at places relative to it, x and y of the rover frame, m.
fn bench_path_among_walls(bencher: Bencher<'_, '_>, is_wall: impl Fn(f64, f64) -> bool) {
    let scene = scene();
    let pose = scene.world.traverse().site_from_rover(0);
    let mut points = scene.points();
    for (row, column) in (-50..50).flat_map(|row| (-50..50).map(move |column| (row, column))) {
        let (x, y) = (0.06 * f64::from(row), 0.06 * f64::from(column));
        // Below the deck, which would make the goal itself bad ground.
        let height_m = if is_wall(x, y) { 0.4 } else { 0.0 };
        points.push(Point3::new(6.0 + x, 1.0 + y, 0.3 - height_m));
    }
    let map = scene.goodness(&scene.hazards(&points, None), &pose);
    let input = input(&map, &pose);
    let navigator = HazardNavigator::default();
    let choice = navigator.select_path(&input);
    let goal = choice.blocked_goal.expect("an enclosed goal");
    assert!(goal.ground.is_none() && goal.nearest_m.is_some() && choice.motion().is_some(), "{goal:?}");
    bencher.bench_local(|| navigator.select_path(&input));
}

/// The smallest changes of limits, on a map without a safe path.
#[divan::bench]
fn counterfactual_of_a_blocked_rover(bencher: Bencher<'_, '_>) {
    let scene = scene();
    let pose = scene.world.traverse().site_from_rover(0);
    let settings = HazardSettings { tilt_ok_deg: 0.0, tilt_bad_deg: 1.0, ..scene.settings.clone() };
    let hazards = scene.hazards(&scene.points(), None);
    let map = assess(&hazards, &MapRules::default(), &settings);
    let input = input(&map, &pose);
    let navigator = HazardNavigator::default();
    let choice = navigator.select_path(&input);
    bencher.bench_local(|| counterfactual(&choice, &input, &navigator.settings, None));
}

fn input<'a>(map: &'a GoodnessMap, pose: &'a Pose) -> PathInput<'a> {
    PathInput { goal_m: [6.0, 1.0], step_m: 0.6, before: None, map: Some(map), site_from_rover: pose }
}
