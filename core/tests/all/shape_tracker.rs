//! The shape tracker and the combined one on a K9 drive of few stops and small images, and on a bare wall.

use std::sync::LazyLock;

use sightline_geometry::frames::{Pixel, Pose};
use sightline_recordings::{Traverse, create_simulated};
use sightline_rover::pipeline::Stops;
use sightline_session::step::RunStep;
use sightline_session::track;
use sightline_study::point::Visit;
use sightline_study::staged::Staged;
use sightline_testing::PlaneWorld;
use sightline_track::locate::features::FeatureSettings;
use sightline_track::locate::shape_tracker::evidence::Registered;
use sightline_track::presets::preset;
use sightline_track::settings::{Settings, TrackerKind};
use sightline_track::target::{Designation, TrackingState};
use sightline_world::{choose_targets, library};

/// A drive from 5 m in three steps, whose last stop is taken by the hazcams as well, and the pixel of its rock.
struct Scene {
    _folder: tempfile::TempDir,
    traverse: Traverse,
    pixel: Pixel,
}

static SCENE: LazyLock<Scene> = LazyLock::new(|| {
    let mut scenario = library::scenario("k9-5").unwrap();
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 2);
    (scenario.drive.step_fraction, scenario.drive.end_distance_m) = (0.2, 3.0);
    (scenario.rocks.area_fraction, scenario.rocks.cluster_count) = (0.02, 0);
    let folder = tempfile::tempdir().unwrap();
    let traverse = create_simulated(&scenario, folder.path()).unwrap();
    let pixel = choose_targets(traverse.world().unwrap(), &scenario, traverse.index())[0];
    Scene { _folder: folder, traverse, pixel }
});

fn run(settings: &Settings) -> Vec<RunStep> {
    let designation = Designation::new(0, SCENE.pixel);
    track::run(&SCENE.traverse, designation, settings).unwrap()
}

fn combined() -> Settings {
    preset("combined").unwrap().settings().unwrap()
}

fn error_m(trace: &RunStep) -> f64 {
    trace.truth.as_ref().unwrap().err_m
}

fn registration(trace: &RunStep) -> &Registered {
    trace.shape().unwrap().registration.as_ref().unwrap()
}

#[test]
fn features_track_the_approach_and_shape_hands_off() {
    let steps = run(&combined());
    let [.., mast, hazcam] = steps.as_slice() else { panic!("too few stops") };
    for way in &steps[1..steps.len() - 2] {
        let evidence = way.shape().unwrap();
        assert!(evidence.registration.is_none() && evidence.surface.is_none(), "step {}", way.step);
        assert!(evidence.features.as_ref().is_some_and(|f| f.fit_motion.is_some()));
        assert_eq!(way.verdict().unwrap().gates[0].name, "confidence");
    }
    let first = registration(mast);
    assert_eq!((first.to_step, first.is_hand_off, &first.reason), (0, false, &None));
    assert!(first.ray.is_some(), "the line of sight met nothing");
    assert_eq!(mast.verdict().unwrap().gates[0].name, "shape_overlap");
    let handed = registration(hazcam);
    assert_eq!((handed.to_step, handed.is_hand_off), (mast.step, true));
    assert_eq!((&handed.reason, &handed.draped_missing), (&None, &None));
    assert!(handed.draped.as_ref().is_some_and(|draped| draped.score > 0.9));
    // Half a pixel of either camera at this size: a hazcam pixel is 1.5 cm wide at that range.
    for (trace, limit_m) in [(mast, 0.004), (hazcam, 0.008)] {
        assert_eq!(trace.update.state, TrackingState::Tracking, "step {}", trace.step);
        assert!(error_m(trace) < limit_m, "step {}: {} m", trace.step, error_m(trace));
    }
    let target = hazcam.located().unwrap().left_pixel.unwrap();
    assert!(target.distance(hazcam.truth.as_ref().unwrap().left_pixel.unwrap()) < 2.0);
}

#[test]
fn shape_finds_the_target_after_dead_reckoning() {
    let mut settings = combined();
    settings.features = FeatureSettings { features_max: 3, ..settings.features };
    let steps = run(&settings);
    let [.., before, mast, _] = steps.as_slice() else { panic!("too few stops") };
    assert!(before.update.state.is_lost(), "three features must not be enough");
    let found = registration(mast);
    assert_eq!((found.to_step, &found.reason), (0, &None));
    assert!(error_m(mast) < 0.01 && error_m(mast) < error_m(before), "{} m", error_m(mast));
    assert_eq!(mast.update.state, TrackingState::Tracking);
}

#[test]
fn a_target_beyond_the_basin_is_not_handed_off() {
    let mut settings = combined();
    settings.features = FeatureSettings { features_max: 3, ..settings.features };
    let staged = Staged::new(&SCENE.traverse, Visit::Every(1)).with_position_jump(0.4);
    let steps = track::run(&staged, Designation::new(0, SCENE.pixel), &settings).unwrap();
    let [.., mast, hazcam] = steps.as_slice() else { panic!("too few stops") };
    assert!(mast.update.state.is_lost() && error_m(mast) > 0.3, "the jump must lead out of the basin");
    let found = registration(hazcam);
    assert_eq!((found.to_step, found.is_hand_off), (0, false));
    assert!(hazcam.update.state.is_lost() || error_m(hazcam) < 0.05, "{} m", error_m(hazcam));
}

#[test]
fn the_shape_tracker_registers_every_stop_to_the_first_view() {
    let steps = run(&preset("shape").unwrap().settings().unwrap());
    for trace in &steps[1..steps.len() - 1] {
        let found = registration(trace);
        assert_eq!((found.to_step, &found.reason), (0, &None), "step {}", trace.step);
        assert!(error_m(trace) < 0.015, "step {}: {} m", trace.step, error_m(trace));
    }
}

#[test]
fn the_same_drive_gives_the_same_bits() {
    // Compared as text, in which NaN equals NaN.
    let text = || serde_json::to_string(&run(&combined())).unwrap();
    assert!(text() == text());
}

#[test]
fn the_half_width_of_the_rock_is_measured_on_its_first_surface() {
    let found = registration(run(&combined()).last().unwrap()).half_width_m;
    // The scenario's rock is 0.45 m wide.
    assert!((0.17..0.28).contains(&found), "{found} m");
}

#[test]
fn the_shape_tracker_rejects_a_flat_wall_with_a_reason() {
    let wall =
        PlaneWorld::new((0..3).map(|stop| Pose::translation(0.4 * f64::from(stop), 0.0, 0.0)).collect());
    let settings = Settings { tracker: TrackerKind::Shape, ..Settings::default() };
    let centre = wall.cameras(0).0.centre_pixel();
    let steps = track::run(&wall, Designation::new(0, centre), &settings).unwrap();
    for trace in &steps[1..] {
        let reason = trace.verdict().unwrap().reason.clone().unwrap();
        assert!(trace.update.state.is_lost());
        assert!(
            reason.contains("target uncertainty after registration") || reason.contains("nearly as well"),
            "{reason}"
        );
    }
}

#[test]
fn shape_is_measured_at_the_last_stops_of_both_pairs() {
    let steps = run(&combined());
    let asked: Vec<bool> = steps[1..].iter().map(|trace| trace.shape().unwrap().surface.is_some()).collect();
    let expected: Vec<bool> = (1..steps.len()).map(|step| step + 2 >= steps.len()).collect();
    assert_eq!(asked, expected);
}
