//! Speed of an update by features: one target, five that share what was found, and the parts of it; two threads help.
//!
//! **The bound.** A pair of 1024 × 1024 px with some 3500 features an eye, three remembered stops:
//!
//! | step | work | at what the processor can do, one thread |
//! |---|---|---|
//! | `detect`, features | twice what `sift.rs` counts: scale space, extrema, 3500 descriptors | 2 × 110 ms |
//! | `detect`, partners | 3500 features against those within 2 px of their epipolar curve, some 20 each, of 128 numbers | 1 ms |
//! | `motion`, matches | 2500 × 2500 products of 128 numbers, 32 a cycle, both ways at once | 10 ms |
//! | `motion`, fit | 100 draws and a few fits over some 800 matches (`motion.rs`) | 1 ms |
//! | `motion`, bootstrap | 200 sets of those | 2 ms |
//! | `motion`, shared error | three fits | 1 ms |
//!
//! The motion is measured from every remembered stop. All of it belongs to the scene and none to a target: a second target
//! adds the unscented carrying of 200 sets and tables, a millisecond.
//!
//! The stops are the first four of the demonstration, as its cameras see them.
//! Run with `cargo bench -p sightline-core --profile dev --bench features` (the profile `dev` is optimised).

use std::sync::{Arc, OnceLock};

use divan::Bencher;
use sightline_geometry::camera::{Camera, Mast, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Pixel, Pose};
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_rover::pipeline::{self, Stops};
use sightline_track::locate::features::detect::{StopFeatures, detect};
use sightline_track::locate::features::motion::{MotionInput, motion};
use sightline_track::locate::store::{Shared, SharedStore};
use sightline_track::presets::preset;
use sightline_track::settings::Settings;
use sightline_track::stages::capture::StereoPair;
use sightline_track::stages::update::Updated;
use sightline_track::target::Designation;
use sightline_world::traverse::TraverseIndex;
use sightline_world::{Eye, NoiseSeed, Scenario, World};

/// Stops of the drive; the last one is the update that is timed.
const STOPS: usize = 4;

fn main() {
    divan::main();
}

/// The stops with their pictures, and what all targets share there.
struct Scene {
    index: TraverseIndex,
    poses: Vec<Pose>,
    pairs: Vec<StereoPair>,
    cameras: Vec<[Camera; 2]>,
    store: SharedStore,
}

impl Scene {
    fn new() -> Self {
        let scenario = Scenario::demo();
        let world = World::new(&scenario);
        let index = sightline_world::index(&scenario, &world).expect("the demonstration can be driven");
        let poses: Vec<Pose> = index.stops.iter().map(|stop| stop.site_from_rover.to_pose()).collect();
        let in_site = |step: usize, eye: Eye| {
            sightline_world::true_camera_in_site(&index.stops[step], eye)
                .expect("a simulated stop has a camera")
        };
        let picture = |step: usize, eye: Eye| {
            let seed = NoiseSeed { step: step as u32, eye };
            Arc::new(sightline_world::render(&world, &scenario, &in_site(step, eye), seed))
        };
        let pair = |step| StereoPair { left: picture(step, Eye::Left), right: picture(step, Eye::Right) };
        // The demonstration's mast errs nowhere: the true cameras are those that the tracker is told.
        let in_rover = |step: usize| {
            let truth = index.stops[step].truth.as_ref().expect("it is simulated");
            let rover_from_site = truth.site_from_rover.to_pose().inverse();
            [Eye::Left, Eye::Right].map(|eye| in_site(step, eye).moved(&rover_from_site))
        };
        let (pairs, cameras) = (0..STOPS).map(|step| (pair(step), in_rover(step))).unzip();
        Self { poses, pairs, cameras, store: SharedStore::default(), index }
    }

    fn cameras(&self, step: usize) -> [&Camera; 2] {
        let [left, right] = &self.cameras[step];
        [left, right]
    }

    fn detected(&self, step: usize) -> StopFeatures {
        detect(&self.pairs[step], self.cameras(step), &settings().features, Cancel::default())
            .expect("nobody cancels it")
    }
}

/// The stops with a store that is new for every update, or with the one of the stops before.
struct Drive<'a> {
    scene: &'a Scene,
    store: &'a SharedStore,
}

impl Stops for Drive<'_> {
    fn stop_count(&self) -> usize {
        STOPS
    }
    fn time_s(&self, step: usize) -> f64 {
        self.scene.index.stops[step].time_s
    }
    fn site_from_rover(&self, step: usize) -> Pose {
        self.scene.poses[step]
    }
    fn cameras(&self, step: usize) -> (&Camera, &Camera) {
        let [left, right] = self.scene.cameras(step);
        (left, right)
    }
    fn mast(&self) -> Option<&Mast> {
        self.scene.index.mast.as_ref()
    }
    fn mast_angles(&self, step: usize) -> Option<MastAngles> {
        self.scene.index.stops[step].mast_angles
    }
    fn odometry_error(&self) -> OdometryError {
        self.scene.index.odometry_error
    }
    fn pointing_error_deg(&self) -> f64 {
        self.scene.index.pointing_error_deg
    }
    fn stereo(&self) -> StereoGeometry {
        self.scene.index.stereo
    }
    fn shared(&self, step: usize) -> Option<Shared<'_>> {
        Some(Shared { store: self.store, stop: step })
    }
    fn capture(&self, step: usize, _: Cancel<'_>) -> Result<StereoPair> {
        Ok(self.scene.pairs[step].clone())
    }
}

fn settings() -> &'static Settings {
    static SETTINGS: OnceLock<Settings> = OnceLock::new();
    SETTINGS.get_or_init(|| {
        preset("features").expect("the preset exists").settings().expect("its settings are valid")
    })
}

/// The stops, and five targets as the last stop but one left them.
fn scene() -> &'static (Scene, Vec<Updated>) {
    static SCENE: OnceLock<(Scene, Vec<Updated>)> = OnceLock::new();
    SCENE.get_or_init(|| {
        let scene = Scene::new();
        let drive = Drive { scene: &scene, store: &scene.store };
        let carried = |x: f64| {
            let designation = Designation::new(0, Pixel::new(x, 600.0));
            let first = pipeline::designate(&drive, designation, settings()).expect("there is ground");
            (2..STOPS).fold(first.update, |last, _| pipeline::run_step(&drive, &last, settings()).update)
        };
        let targets = [300.0, 400.0, 500.0, 600.0, 700.0].map(carried).to_vec();
        (scene, targets)
    })
}

/// An update of some targets, for which nothing was found before at its stop.
fn update(bencher: Bencher<'_, '_>, count: usize) {
    let (scene, targets) = scene();
    bencher.with_inputs(SharedStore::default).bench_local_refs(|store| {
        let drive = Drive { scene, store };
        targets[..count].iter().map(|last| pipeline::run_step(&drive, last, settings()).step).sum::<usize>()
    });
}

/// The update of one target.
#[divan::bench(sample_count = 10)]
fn one_target(bencher: Bencher<'_, '_>) {
    update(bencher, 1);
}

/// The update of five targets.
#[divan::bench(sample_count = 10)]
fn five_targets(bencher: Bencher<'_, '_>) {
    update(bencher, 5);
}

/// Features of both eyes, their partners and points.
#[divan::bench(sample_count = 10)]
fn features(bencher: Bencher<'_, '_>) {
    let (scene, _) = scene();
    bencher.bench_local(|| scene.detected(STOPS - 1));
}

/// The motion from one remembered stop, with its covariance.
#[divan::bench(sample_count = 10)]
fn motion_from_one_stop(bencher: Bencher<'_, '_>) {
    let (scene, _) = scene();
    let (then, now) = (scene.detected(STOPS - 2), scene.detected(STOPS - 1));
    let expected = scene.poses[STOPS - 1].inverse() * scene.poses[STOPS - 2];
    let [left, _] = scene.cameras(STOPS - 1);
    let settings = &settings().features;
    let input = MotionInput { then: &then, now: &now, expected_now_from_then: &expected, left, settings };
    bencher.bench_local(|| motion(&input));
}
