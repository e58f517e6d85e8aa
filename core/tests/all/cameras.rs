//! Several cameras per stop: each is rendered and tracked independently, and may be missing at a stop.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use sightline_geometry::camera::CameraName;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Point3;
use sightline_recordings::{DrivenTraverse, Existing, IndexFormat, Traverse, create_simulated, write};
use sightline_rover::designate::Place;
use sightline_rover::driving::DriveCommand;
use sightline_rover::visual_odometry::OdometryMode;
use sightline_session::step::RunStep;
use sightline_session::targeted_drive::TargetedDrive;
use sightline_session::track;
use sightline_track::presets::preset;
use sightline_track::settings::Settings;
use sightline_track::target::{Designation, TrackingState};
use sightline_world::scenario::{CameraRig, FurtherRig};
use sightline_world::target_truth::TruthSource;
use sightline_world::{Eye, NoiseSeed, Rig, Scenario, choose_targets, library};

static NEVER: AtomicBool = AtomicBool::new(false);

fn name(text: &str) -> CameraName {
    text.parse().unwrap()
}

fn further(text: &str, rig: CameraRig, image_size: u32) -> FurtherRig {
    FurtherRig { name: name(text), rig, look_deg: None, image_size }
}

/// A short approach with a pair of hazcams and one of pancams in addition to the navcams.
fn scenario() -> Scenario {
    let mut scenario = library::scenario("approach-5").unwrap();
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (256, 1);
    (scenario.drive.end_distance_m, scenario.drive.step_fraction) = (2.0, 0.1);
    scenario.drive.pointing_error_deg = 0.02;
    scenario.camera.further = vec![
        further("front_hazcam", CameraRig::MerFrontHazcam, 512),
        further("pancam", CameraRig::MerPancam, 256),
    ];
    scenario
}

fn made(scenario: &Scenario, folder: &Path) -> Traverse {
    create_simulated(scenario, folder).unwrap()
}

/// The target of the scenario's rule at which the mast points, so that the pancams see it to the end: site frame, m.
fn target_in_site(traverse: &Traverse, scenario: &Scenario) -> Point3 {
    let pixels = choose_targets(traverse.world().unwrap(), scenario, traverse.index());
    let centre = traverse.left_camera(0).centre_pixel();
    let pixel = pixels.iter().min_by(|a, b| a.distance(centre).total_cmp(&b.distance(centre))).unwrap();
    traverse.surface_point_in_site(0, None, *pixel).unwrap()
}

/// The designation of a true point in the images of a pair.
fn designation(traverse: &Traverse, step: usize, camera: CameraName, point_in_site: Point3) -> Designation {
    let pose = traverse.true_site_from_rover(step).unwrap();
    let in_rover = pose.inverse_transform_point(&point_in_site);
    let camera = Some(camera);
    let pixel = TruthSource::true_left_camera(traverse, step, camera).unwrap().project(&in_rover).unwrap();
    Designation { step, pixel, camera }
}

#[test]
fn further_images_are_rendered_on_demand_like_their_rig() {
    let folder = tempfile::tempdir().unwrap();
    let mut scenario = scenario();
    scenario.camera.further.push(further("twin", CameraRig::MerNavcam, 256));
    let traverse = made(&scenario, folder.path());
    let main = traverse.capture(1).unwrap();
    assert_eq!(traverse.rendered_count(), 2, "the main pair alone");
    assert!(!traverse.is_rendered(1, Some(name("pancam"))));
    // The same rig at the same position has the same images, noise included.
    let capture = |camera: &str| traverse.capture_pair(1, Some(name(camera)), &NEVER).unwrap();
    assert_eq!(capture("twin"), main);
    // Compared with the library's function for the true camera, exposed for its own first image.
    let (pancam, hazcam) = (capture("pancam"), capture("front_hazcam"));
    for (camera, rig, pair) in
        [("pancam", CameraRig::MerPancam, &pancam), ("front_hazcam", CameraRig::MerFrontHazcam, &hazcam)]
    {
        let mut alone = scenario.clone();
        (alone.camera.rig, alone.camera.image_size) = (rig, pair.left.width());
        let in_site = TruthSource::true_left_camera(&traverse, 1, Some(name(camera))).unwrap();
        let in_site = in_site.moved(&traverse.true_site_from_rover(1).unwrap());
        let here = traverse.world_at(1).unwrap();
        let seed = NoiseSeed { step: 1, eye: Eye::Left };
        let expected = sightline_world::render(&here, &alone, &in_site, seed);
        let mean = |image: &sightline_vision::image::GrayImage| {
            image.as_raw().iter().copied().map(f64::from).sum::<f64>() / image.as_raw().len() as f64
        };
        // The expected image has the exposure of the navcams: they are equal up to the exposure of the camera.
        let ratio = mean(&pair.left) / mean(&expected);
        let differing = pair.left.as_raw().iter().zip(expected.as_raw());
        let largest =
            differing.map(|(a, b)| (f64::from(*a) - ratio * f64::from(*b)).abs()).fold(0.0, f64::max);
        assert!((0.5..2.0).contains(&ratio) && largest < 0.06, "{camera}: {ratio} {largest}");
        let first = traverse.capture_pair(0, Some(name(camera)), &NEVER).unwrap();
        println!(
            "{camera}: exposure ratio {ratio:.3}, largest difference {largest:.4}, mean {:.4}",
            mean(&first.left)
        );
        // Rays of the fisheye reach the sky in the coarse exposure metering; the mean of the whole image is the requested
        // one.
        assert!((mean(&first.left) - scenario.camera.mean_level).abs() < 0.03, "{camera}");
    }
    let told = traverse.index().stops[1].mast_angles;
    let rig = Rig::of(CameraRig::MerPancam, 256).cameras_in_rover(told);
    let listed: Vec<_> = traverse.further_cameras(1).collect();
    assert_eq!(
        (listed[1].left.clone(), listed[1].right.cloned()),
        (rig.0.normalised(), Some(rig.1.normalised()))
    );
    assert_eq!((listed[0].mast_angles, listed[1].mast_angles), (None, told));
}

fn summary(steps: &[RunStep]) -> Vec<(usize, TrackingState, Option<f64>, Option<f64>)> {
    let of = |step: &RunStep| {
        let truth = step.truth.as_ref();
        (step.step, step.update.state, truth.and_then(|t| t.err_px), truth.map(|t| t.err_m))
    };
    steps.iter().map(of).collect()
}

#[test]
fn a_target_is_tracked_in_the_pair_in_which_it_was_designated() {
    let (folder, scenario) = (tempfile::tempdir().unwrap(), scenario());
    let traverse = made(&scenario, folder.path());
    let point = target_in_site(&traverse, &scenario);
    // Tolerances: 0.1 px of disparity, at 10 m for the pancams and at 3.5 m for the hazcams, whose resolution is lower.
    let near = (0..traverse.stop_count())
        .find(|&step| (traverse.true_site_from_rover(step).unwrap().inverse() * point).coords.norm() < 3.5);
    for (camera, from, tolerance_m) in [("pancam", 0, 0.037), ("front_hazcam", near.unwrap(), 0.054)] {
        let designation = designation(&traverse, from, name(camera), point);
        let steps = track::run(&traverse, designation, &Settings::default()).unwrap();
        println!("{camera}: {:?}", summary(&steps));
        // The target leaves the narrow field of view of the pancams at a shorter range, where the template no longer fits.
        let is_inside = |step: &&RunStep| {
            let size = f64::from(step.point_mast.left.width());
            let pixel = step.truth.as_ref().and_then(|truth| truth.left_pixel);
            pixel.is_some_and(|pixel| pixel.x.min(pixel.y) > 14.0 && pixel.x.max(pixel.y) < size - 14.0)
        };
        let seen: Vec<_> = steps.iter().take_while(is_inside).collect();
        assert!(seen.len() >= if camera == "pancam" { 10 } else { 4 }, "{camera}: {} stops", seen.len());
        for step in seen {
            let truth = step.truth.as_ref().unwrap();
            assert_eq!(truth.tracked, Some(true), "{camera}, stop {}", step.step);
            assert!(truth.err_m < tolerance_m, "{camera}, stop {}: {} m", step.step, truth.err_m);
            let size = [step.point_mast.left.width(), step.capture().unwrap().left_size[0]];
            let wide = if camera == "pancam" { 256 } else { 512 };
            assert_eq!(size, [wide; 2]);
            // Cameras on the body have no mast with a pointing error.
            assert_eq!(step.point_mast.used.is_some(), camera == "pancam");
            assert_eq!(step.point_mast.error_covariance_in_rover.is_some(), camera == "pancam");
        }
        // The serialised form names the pair; an older form without a name means the main pair.
        let json = serde_json::to_value(steps[0].update.target.designation).unwrap();
        assert_eq!(json["camera"], camera);
    }
    let older = r#"{"step":0,"pixel":{"x":1.0,"y":2.0}}"#;
    let read: Designation = serde_json::from_str(older).unwrap();
    assert_eq!((read.camera, serde_json::to_string(&read).unwrap().as_str()), (None, older));
}

#[test]
fn targets_of_different_pairs_share_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut scenario = scenario();
    scenario.camera.further = vec![further("pancam", CameraRig::MerPancam, 256)];
    // Both pairs have images of one size, so that only the store can separate their features.
    let traverse = made(&scenario, folder.path());
    let point = target_in_site(&traverse, &scenario);
    let features = preset("features").unwrap().settings().unwrap();
    let designations = [
        Designation { camera: None, ..designation_in_main(&traverse, point) },
        designation(&traverse, 0, name("pancam"), point),
    ];
    let run = |traverse: &Traverse, designation: Designation| {
        let mut steps = vec![track::designate(traverse, designation, &features).unwrap()];
        for _ in 0..2 {
            let next = track::advance(traverse, &steps[0], &steps[steps.len() - 1], &features);
            steps.push(next);
        }
        summary(&steps)
    };
    let together = designations.map(|designation| run(&traverse, designation));
    let apart = designations.map(|designation| run(&Traverse::open(folder.path()).unwrap(), designation));
    assert_eq!(together, apart);
    assert_ne!(together[0], together[1]);
}

fn designation_in_main(traverse: &Traverse, point_in_site: Point3) -> Designation {
    let in_rover = traverse.true_site_from_rover(0).unwrap().inverse_transform_point(&point_in_site);
    Designation::new(0, traverse.true_left_camera(0).project(&in_rover).unwrap())
}

#[test]
fn tracking_continues_after_a_stop_without_the_pair() {
    let (folder, scenario) = (tempfile::tempdir().unwrap(), scenario());
    let whole = made(&scenario, folder.path());
    let point = target_in_site(&whole, &scenario);
    let pancam = name("pancam");
    let target = designation(&whole, 0, pancam, point);
    let mut index = whole.index().clone();
    index.stops[2].cameras.retain(|camera| camera.name != pancam);
    index.stops[3].cameras.iter_mut().filter(|camera| camera.name == pancam).for_each(|c| c.right = None);
    write(&index, folder.path(), IndexFormat::Toml, Existing::Replace).unwrap();
    let traverse = Traverse::open(folder.path()).unwrap();
    assert_eq!(traverse.index(), &index, "the index survives its file");
    let steps = track::run(&traverse, target, &Settings::default()).unwrap();
    println!("{:?}", summary(&steps));
    assert_eq!(steps[2].fault(), Some("stop 2 has no pair `pancam`, which the target was designated in"));
    assert_eq!(
        steps[3].fault(),
        Some("stop 3 has only a single image of `pancam`, which the target was designated in")
    );
    for step in &steps[2..4] {
        assert_eq!(step.update.state, TrackingState::Tracking, "it does not count as a loss");
        assert_eq!((step.point_mast.predicted_left, step.point_mast.used), (None, None));
        // All functions of a step accept it.
        assert!(serde_json::to_string(step).is_ok() && step.row().left_pixel.is_none());
    }
    assert!(steps[2].truth.is_none() && steps[4].truth.as_ref().unwrap().tracked == Some(true));
    assert_eq!(steps[4].fault(), None);
    let refused = |step: usize, camera: &str| {
        let place = Place { camera: Some(name(camera)), ..Place::of_pixel(target.pixel) };
        let by_place = place.name(&traverse, step).unwrap_err().to_string();
        let designation = Designation { step, camera: place.camera, ..target };
        let by_pixel = track::designate(&traverse, designation, &Settings::default()).unwrap_err();
        assert_eq!(by_pixel.to_string(), by_place);
        by_place
    };
    assert_eq!(refused(0, "chemcam"), "target: stop 0 has no pair `chemcam`");
    assert_eq!(refused(2, "pancam"), "target: stop 2 has no pair `pancam`");
    assert_eq!(refused(3, "pancam"), "target: stop 3 has only a single image of `pancam`");
    let [left, before] = [&traverse, &whole].map(|drive| drive.capture_one(3, Some(pancam), true).unwrap());
    assert_eq!((left.dimensions(), left), ((256, 256), before));
    let message = traverse.capture_one(3, Some(pancam), false).unwrap_err().to_string();
    assert_eq!(message, "stop 3 has only a single image of `pancam`");
}

#[test]
fn a_pancam_target_points_the_mast_for_the_main_pair() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = scenario();
    let world = DrivenTraverse::begin(&scenario, &folder.path().join("a"), Cancel::default()).unwrap();
    let point = target_in_site(world.traverse(), &scenario);
    let target = designation(world.traverse(), 0, name("pancam"), point);
    // Visual odometry would use the main pair.
    let odometry = OdometryMode::Off;
    let command = DriveCommand { standoff_m: 2.0, tolerance_m: 0.02, odometry, ..DriveCommand::default() };
    let settings = Settings::default();
    let mut drive = TargetedDrive::begin(world, target, command, &settings, Cancel::default()).unwrap();
    for _ in 0..3 {
        assert!(drive.advance(&settings, Cancel::default()).unwrap());
    }
    for step in &drive.steps[1..] {
        assert_eq!(step.update.state, TrackingState::Tracking);
        assert!(step.truth.as_ref().unwrap().err_m < 0.03);
        // The main pair was not rendered: only the pancams were used.
        assert!(!drive.world.traverse().is_rendered(step.step, None));
        let (left, _) = sightline_rover::pipeline::Stops::cameras(drive.world.traverse(), step.step);
        let predicted = step.prediction().unwrap().position_in_rover;
        assert!(left.project(&predicted).unwrap().distance(left.centre_pixel()) < 1e-6);
    }
    // A branch copies the images.
    let branch = drive.world.branch(2, &[], &folder.path().join("b"), Cancel::default()).unwrap();
    assert!(branch.traverse().is_rendered(1, Some(name("pancam"))));
    // Restoring another state deletes them.
    let first = drive.world.state()[..1].to_vec();
    drive.world.restore(first).unwrap();
    let left_over = folder.path().join("a/images/pancam_left_0001.png");
    assert!(!left_over.exists(), "{}", left_over.display());
}
