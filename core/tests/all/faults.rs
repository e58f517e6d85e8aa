//! Faults injected into a drive: each affects only its own stops, and the drive continues or stops with a reason.

use std::path::Path;

use sightline_geometry::cancel::Cancel;
use sightline_recordings::DrivenTraverse;
use sightline_rover::driving::DriveCommand;
use sightline_rover::pipeline::Stops;
use sightline_session::faults::{NewFault, placed};
use sightline_session::targeted_drive::TargetedDrive;
use sightline_track::settings::Settings;
use sightline_track::target::{Designation, TrackingState};
use sightline_vision::image::GrayImage;
use sightline_world::scenario::FaultKind;
use sightline_world::target_truth::TruthSource;
use sightline_world::{Scenario, choose_targets, library};

/// The stops of the fault.
const FROM: usize = 3;
const TO: usize = 4;

fn scenario() -> Scenario {
    let mut scenario = library::scenario("five-targets").unwrap();
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 1);
    scenario.targets.window_px = 9;
    scenario.drive.start_distance_m = 6.0;
    scenario
}

/// A drive of seven stops with a fault.
fn drive(plain: &DrivenTraverse, kind: FaultKind, folder: &Path) -> TargetedDrive {
    let traverse = plain.traverse();
    let pixel = choose_targets(traverse.world().unwrap(), &scenario(), traverse.index())[0];
    let designation = Designation::new(0, pixel);
    let fault = NewFault { kind, from_stop: FROM as u32, to_stop: TO as u32, target: None };
    let faults = placed(traverse, &[fault], |number| (number == 0).then_some(designation), 0).unwrap();
    let world = plain.branch(1, &faults, folder, Cancel::default()).unwrap();
    let (command, settings) = (DriveCommand::default(), Settings::default());
    let mut drive = TargetedDrive::begin(world, designation, command, &settings, Cancel::default()).unwrap();
    while drive.steps.len() < 7 && drive.advance(&settings, Cancel::default()).unwrap() {}
    drive
}

fn contrast(image: &GrayImage) -> f64 {
    let values = || image.iter().copied().map(f64::from);
    let mean = values().sum::<f64>() / image.len() as f64;
    (values().map(|value| (value - mean).powi(2)).sum::<f64>() / image.len() as f64).sqrt() / mean
}

fn states(drive: &TargetedDrive) -> Vec<TrackingState> {
    drive.steps.iter().map(|step| step.update.state).collect()
}

#[test]
fn each_fault_affects_only_its_stops() {
    let folder = tempfile::tempdir().unwrap();
    let plain = DrivenTraverse::begin(&scenario(), &folder.path().join("plain"), Cancel::default()).unwrap();
    let with = |kind: FaultKind| drive(&plain, kind, &folder.path().join(kind.name()));

    let hidden = with(FaultKind::Occluder);
    println!("{:?}", states(&hidden));
    assert_eq!(hidden.steps.len(), 7);
    for step in &hidden.steps {
        let is_hidden = (FROM..=TO).contains(&step.step);
        assert_eq!(step.update.state.is_lost(), is_hidden, "stop {}", step.step);
        assert_eq!(step.truth.as_ref().unwrap().left_pixel.is_none(), is_hidden, "stop {}", step.step);
    }

    let shaded = with(FaultKind::Shadow);
    let share = |step: usize| {
        let pixel = shaded.steps[step].truth.as_ref().unwrap().left_pixel.unwrap();
        shaded.world.traverse().shadow_share(step, None, pixel, 9).unwrap()
    };
    println!("shadow {:?}", (0..shaded.steps.len()).map(share).collect::<Vec<_>>());
    assert!(share(FROM - 1) < 0.5 && share(FROM) > 0.9, "{} {}", share(FROM - 1), share(FROM));

    let starved = with(FaultKind::FeatureStarvation);
    let contrasts: Vec<f64> = (0..starved.steps.len())
        .map(|step| contrast(&starved.world.traverse().capture(step).unwrap().left))
        .collect();
    println!("contrast {contrasts:?}");
    assert!(contrasts[FROM] < 0.15 * contrasts[FROM - 1] && contrasts[TO + 1] > 0.5 * contrasts[FROM - 1]);

    let jumped = with(FaultKind::PoseJump);
    let off_deg = |step: usize| {
        let traverse = jumped.world.traverse();
        let truth = TruthSource::true_site_from_rover(traverse, step).unwrap();
        truth.rotation.angle_to(&Stops::site_from_rover(traverse, step).rotation).to_degrees()
    };
    assert!(off_deg(FROM - 1) < 1.0 && (6.0..8.0).contains(&off_deg(FROM)), "{}", off_deg(FROM));

    let blind = with(FaultKind::CameraDropOut);
    assert_eq!(blind.steps.len(), 7);
    for step in &blind.steps {
        let fault = step.fault().map(str::to_owned);
        let expected = format!("the cameras gave no images at stop {} (injected drop-out)", step.step);
        assert_eq!(fault, (FROM..=TO).contains(&step.step).then_some(expected));
        assert_eq!(step.update.state, TrackingState::Tracking, "no images are no failed update");
        let is_measured = Stops::measured_motion(blind.world.traverse(), step.step).is_some();
        assert_eq!(is_measured, step.step > 0 && !(FROM..=TO + 1).contains(&step.step));
    }
    assert!(blind.steps[TO + 1].verdict().unwrap().accepted);

    // A stop that the rover has left cannot be changed.
    let late = [sightline_world::scenario::Fault {
        kind: FaultKind::Shadow,
        from_stop: 2,
        to_stop: 9,
        target_m: None,
    }];
    let refused = blind.world.branch(4, &late, &folder.path().join("late"), Cancel::default());
    let error = refused.err().map(|error| error.to_string()).unwrap_or_default();
    assert!(error.contains("faults[0].from_stop: the rover has come to stop 3 already"), "{error}");
}
