//! Visual odometry in simulated drives: the motion, its covariance, and rejections.

use sightline_geometry::camera::{Camera, CameraModel};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Error;
use sightline_geometry::frames::Pose;
use sightline_recordings::{DrivenTraverse, Traverse};
use sightline_rover::driving::{ActiveWorld, Motion};
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::look::look;
use sightline_rover::visual_odometry::{
    Fate, OdometryInput, OdometryPreset, OdometrySettings, OdometryUpdate, OdometryView, update,
};
use sightline_study::odometry::{OdometryDrives, OdometryRow, Scene};
use sightline_track::stages::capture::StereoPair;
use sightline_world::scenario::{ForcedSlip, OdometryModel};
use sightline_world::target_truth::TruthSource;
use sightline_world::{Scenario, library};

/// Two stops between which the wheels turn by 60 cm, with this slip.
fn two_stops(slip: f64, folder: &std::path::Path) -> DrivenTraverse {
    let mut scenario = Scenario { seed: 1234, ..library::scenario("approach-10").unwrap() };
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 2);
    scenario.rover.odometry = OdometryModel::WheelsAndImu;
    scenario.rover.forced_slip = vec![ForcedSlip { stop: 1, slip }];
    let mut world = DrivenTraverse::begin(&scenario, folder, Cancel::default()).unwrap();
    let mast = world.traverse().mast().unwrap().clone();
    world.point_mast(look(&mast, None, &Pose::identity())).unwrap();
    world.drive(&Motion::Arc { length_m: 0.6, curvature_per_m: 0.2 }, Cancel::default()).unwrap();
    world.point_mast(look(&mast, None, &Pose::identity())).unwrap();
    world
}

fn between(
    traverse: &Traverse,
    [before, after]: [usize; 2],
    settings: &OdometrySettings,
    cancel: Cancel<'_>,
) -> Result<OdometryUpdate, Error> {
    let pairs = [before, after].map(|stop| traverse.capture(stop).unwrap());
    let predicted = traverse.site_from_rover(after).inverse() * traverse.site_from_rover(before);
    of_pairs(traverse, [before, after], [&pairs[0], &pairs[1]], &predicted, settings, cancel)
}

fn of_pairs(
    traverse: &Traverse,
    stops: [usize; 2],
    pairs: [&StereoPair; 2],
    predicted: &Pose,
    settings: &OdometrySettings,
    cancel: Cancel<'_>,
) -> Result<OdometryUpdate, Error> {
    let view = |i: usize| {
        let (left, right) = traverse.cameras(stops[i]);
        OdometryView { pair: pairs[i], left, right, mast_angles: traverse.mast_angles(stops[i]) }
    };
    update(&OdometryInput {
        before: view(0),
        after: view(1),
        predicted_after_from_before: predicted,
        mast: traverse.mast().map(|mast| (mast, 0.0)),
        settings,
        cancel,
    })
}

/// Error of the motion against the truth, m and deg.
fn error(traverse: &Traverse, found: &OdometryUpdate) -> [f64; 2] {
    let pose = |stop| TruthSource::true_site_from_rover(traverse, stop).unwrap();
    let truth = pose(1).inverse() * pose(0);
    let wrong = truth * found.after_from_before.unwrap().to_pose().inverse();
    [wrong.translation.vector.norm(), wrong.rotation.angle().to_degrees()]
}

#[test]
fn motion_is_within_millimetres_for_any_wheel_odometry() {
    for slip in [0.0, 0.5, 1.0, 1.25] {
        let folder = tempfile::tempdir().unwrap();
        let world = two_stops(slip, &folder.path().join("drive"));
        let found =
            between(world.traverse(), [0, 1], &OdometrySettings::default(), Cancel::default()).unwrap();
        let [error_m, error_deg] = error(world.traverse(), &found);
        assert!(found.accepted, "slip {slip}: {:?}", found.refusal());
        assert!(error_m < 0.003 && error_deg < 0.03, "slip {slip}: {error_m} m, {error_deg}°");
        let measured = found.slip.unwrap();
        assert!((measured.along - slip).abs() < 0.06, "{slip}: {measured:?}");
        assert!(found.inliers >= 60 && found.matches >= found.inliers && found.points >= found.matches);
        let inliers = found.table.iter().filter(|corner| corner.fate == Fate::Inlier).count();
        assert_eq!((inliers, found.table.len()), (found.inliers, found.corners));
        let gone = |corner: &&sightline_rover::visual_odometry::OdometryCorner| {
            corner.fate == Fate::Inlier && (corner.after_px.is_none() || corner.residual_sigmas.is_none())
        };
        assert!(found.table.iter().find(gone).is_none());
    }
}

#[test]
fn the_flown_preset_finds_the_motion_despite_wheel_slip() {
    let folder = tempfile::tempdir().unwrap();
    let flown = OdometryPreset::Mer2007.settings();
    let world = two_stops(0.05, &folder.path().join("firm"));
    let found = between(world.traverse(), [0, 1], &flown, Cancel::default()).unwrap();
    assert!(found.accepted && found.coarse_search.is_none(), "{:?}", found.refusal());
    let [error_m, error_deg] = error(world.traverse(), &found);
    assert!(error_m < 0.01 && error_deg < 0.1, "{error_m} m, {error_deg}°");
    // Pixels of corners are those of the whole image.
    assert!(found.table.iter().any(|corner| corner.before_px[0] > 300.0));
    // With spinning wheels, far points are predicted well; their motion then predicts the near ones.
    let world = two_stops(1.0, &folder.path().join("stuck"));
    let found = between(world.traverse(), [0, 1], &flown, Cancel::default()).unwrap();
    assert!(found.accepted && error(world.traverse(), &found)[0] < 0.01, "{:?}", found.refusal());
}

#[test]
fn a_pair_beside_itself_shows_no_motion() {
    let folder = tempfile::tempdir().unwrap();
    let world = two_stops(0.0, &folder.path().join("drive"));
    let traverse = world.traverse();
    let pair = traverse.capture(0).unwrap();
    let settings = OdometrySettings::default();
    let still = Pose::identity();
    let found = of_pairs(traverse, [0, 0], [&pair, &pair], &still, &settings, Cancel::default()).unwrap();
    let motion = found.accepted_motion().unwrap();
    assert!(motion.translation.vector.norm() < 2e-4 && motion.rotation.angle() < 5e-5, "{motion:?}");
    assert!(found.slip.is_none());
}

#[test]
fn unmeasurable_motion_is_rejected_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let world = two_stops(0.0, &folder.path().join("drive"));
    let traverse = world.traverse();
    let flat = StereoPair {
        left: image::ImageBuffer::from_pixel(512, 512, image::Luma([0.4])).into(),
        right: image::ImageBuffer::from_pixel(512, 512, image::Luma([0.4])).into(),
    };
    let settings = OdometrySettings::default();
    let predicted = traverse.site_from_rover(1).inverse() * traverse.site_from_rover(0);
    let found = of_pairs(traverse, [0, 1], [&flat, &flat], &predicted, &settings, Cancel::default()).unwrap();
    assert!(!found.accepted && found.corners == 0 && found.after_from_before.is_none());
    assert_eq!(found.refusal().unwrap(), "no update: only 0 of 0 matches are inliers of a rigid transform");
    // A motion that wheels cannot cause fails the translation gate, with name, value and limit.
    let far = Pose::translation(-0.05, 0.0, 0.0);
    let pairs = [0, 1].map(|stop| traverse.capture(stop).unwrap());
    let strict = OdometrySettings { slip_max: 1.0, coarse_search: false, search_px: 100, ..settings };
    let found = of_pairs(traverse, [0, 1], [&pairs[0], &pairs[1]], &far, &strict, Cancel::default()).unwrap();
    let sentence = found.refusal().unwrap();
    assert!(sentence.starts_with("no update: odometry_translation_m is 0.5"), "{sentence}");
    let cancelled = std::sync::atomic::AtomicBool::new(true);
    let found = between(traverse, [0, 1], &settings, Cancel::from(&cancelled));
    assert!(matches!(found, Err(Error::Cancelled)));
}

#[test]
fn cameras_that_see_nothing_in_common_give_no_update() {
    let folder = tempfile::tempdir().unwrap();
    let world = two_stops(0.0, &folder.path().join("drive"));
    let traverse = world.traverse();
    let pairs = [0, 1].map(|stop| traverse.capture(stop).unwrap());
    let (left, right) = traverse.cameras(0);
    let away = Pose::from_parts(
        nalgebra::Translation3::identity(),
        nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::PI),
    );
    let turned: Vec<Camera> = [left, right]
        .iter()
        .map(|camera| Camera { model: CameraModel::clone(&camera.moved(&away).model), ..(*camera).clone() })
        .collect();
    let settings = OdometrySettings::default();
    let found = update(&OdometryInput {
        before: OdometryView { pair: &pairs[0], left, right, mast_angles: None },
        after: OdometryView { pair: &pairs[1], left: &turned[0], right: &turned[1], mast_angles: None },
        predicted_after_from_before: &Pose::identity(),
        mast: None,
        settings: &settings,
        cancel: Cancel::default(),
    })
    .unwrap();
    assert!(!found.accepted && found.matches == 0 && found.points > 100);
    assert!(found.table.iter().all(|corner| corner.fate != Fate::Inlier));
}

/// One drive of the study.
fn row(scene: Scene, seed: u64, steps: usize) -> OdometryRow {
    let folder = tempfile::tempdir().unwrap();
    let settings = OdometrySettings::default();
    let drives = OdometryDrives {
        configuration: "sightline",
        settings: &settings,
        scene,
        steps,
        size: 512,
        samples_per_axis: 2,
    };
    drives.drive(seed, &folder.path().join("drive"), Cancel::default()).unwrap()
}

#[test]
fn the_study_converges_on_texture_and_is_never_silently_wrong() {
    let textured = row(Scene::Textured, 9101, 6);
    assert!(textured.updates >= 5 && textured.converged == textured.updates, "{textured:?}");
    assert!(textured.drift_percent < 1.0 && textured.slip_error_points.unwrap() < 2.0, "{textured:?}");
    let slope = row(Scene::Slope, 9102, 3);
    assert!(slope.converged >= 2, "{slope:?}");
    let tracks = row(Scene::OwnTracks, 9103, 4);
    let fence = row(Scene::PicketFence, 9104, 3);
    let bare = row(Scene::Featureless, 9105, 3);
    // Without the gate `odometry_repetition`, two of these motions are wrong by a period of the tracks.
    let periods = row(Scene::PicketFence, 71214, 25);
    assert!(periods.refused > 0, "{periods:?}");
    assert_eq!((bare.converged, bare.refused), (0, bare.updates));
    for row in [&textured, &slope, &tracks, &fence, &periods, &bare] {
        assert_eq!((row.silently_wrong, &row.problem), (0, &None), "{row:?}");
        assert_eq!(row.converged + row.refused, row.updates);
    }
}
