//! The index of a simulated traverse: stops, poses, mast angles, cameras and the names of the images.
//!
//! Each stop carries what the tracker may know (estimated pose, measured mast angles and the cameras that
//! follow from them) and, apart from it, the truth. The true cameras stand in the truth only where they
//! differ from the ones that the tracker is given, which is when the scenario has a pointing error.
//!
//! Time: the rover drives at 3.75 cm/s and stands for 60 s at each stop (domain.md 5.4; the pause is ours).
//! Frames: poses in the site frame, cameras in the rover frame. Sources: domain.md 4, 5; R104–R106.

use crate::camera::Camera;
use crate::error::Result;
use crate::frames::{Pose, PoseRecord};
use crate::traverse::{CameraSource, FORMAT_VERSION, StereoGeometry, Stop, StopTruth, TraverseIndex, View};

use crate::sim::camera::render::Eye;
use crate::sim::rover::drive;
use crate::sim::scenario::Scenario;
use crate::sim::world::World;

/// The name of the scenario's file within a traverse folder.
pub const SCENARIO_FILE: &str = "scenario.toml";

/// Speed of the drive, m/s (domain.md 5.4).
const SPEED_M_S: f64 = 0.0375;
/// Time spent at a stop, s (ours).
const PAUSE_S: f64 = 60.0;

/// Builds the index of a scenario's traverse; fails where the drive is impossible on this ground.
pub fn index(scenario: &Scenario, world: &World) -> Result<TraverseIndex> {
    let mast = drive::mast(scenario);
    let true_stops = drive::true_stops(world, scenario)?;
    let true_poses: Vec<Pose> = true_stops.iter().map(|stop| stop.site_from_rover).collect();
    let estimates = drive::estimates(&true_poses, &scenario.odometry_error, scenario.seed);
    let mut stops = Vec::with_capacity(true_stops.len());
    let mut time_s = 0.0;
    for (number, (truth, estimate)) in true_stops.iter().zip(&estimates).enumerate() {
        if number > 0 {
            let way = truth.site_from_rover.translation.vector - true_poses[number - 1].translation.vector;
            time_s += PAUSE_S + way.norm() / SPEED_M_S;
        }
        let (left, right) = mast.cameras_in_rover(truth.angles);
        let view = |eye: &str, camera: Camera| View {
            image: format!("images/{eye}_{number:04}.png"),
            camera: CameraSource::Inline(camera),
        };
        let mut stop_truth = StopTruth {
            site_from_rover: PoseRecord::from(&truth.site_from_rover),
            left_camera: None,
            right_camera: None,
        };
        if scenario.drive.pointing_error_deg > 0.0 {
            let angles = drive::angles_with_error(truth.angles, scenario, number);
            let (left, right) = mast.cameras_in_rover(angles);
            (stop_truth.left_camera, stop_truth.right_camera) = (Some(left), Some(right));
        }
        stops.push(Stop {
            time_s,
            site_from_rover: PoseRecord::from(estimate),
            mast_angles: Some(truth.angles),
            left: view("left", left),
            right: view("right", right),
            truth: Some(stop_truth),
        });
    }
    Ok(TraverseIndex {
        format: FORMAT_VERSION,
        name: scenario.name.clone(),
        description: describe(scenario, stops.len()),
        full_scale_dn: Some(scenario.camera.recorded_full_scale_dn()),
        stereo: StereoGeometry::Lateral,
        odometry_error: scenario.odometry_error,
        mast: Some(mast),
        scenario: Some(SCENARIO_FILE.into()),
        stops,
    })
}

/// One sentence for people.
fn describe(scenario: &Scenario, stops: usize) -> String {
    let drive = &scenario.drive;
    format!(
        "Simulated: straight approach from {:.1} m in {stops} stops, steps of {:.0} % of the distance, \
         Spirit's navcams at {size} × {size} px, seed {}.",
        drive.start_distance_m,
        100.0 * drive.step_fraction,
        scenario.seed,
        size = scenario.camera.image_size,
    )
}

/// The camera that truly takes an image of a simulated stop, in the site frame.
///
/// `None` where the stop carries no truth, or where its camera is in a file.
pub fn true_camera_in_site(stop: &Stop, eye: Eye) -> Option<Camera> {
    let truth = stop.truth.as_ref()?;
    let (view, camera) = match eye {
        Eye::Left => (&stop.left, &truth.left_camera),
        Eye::Right => (&stop.right, &truth.right_camera),
    };
    let in_rover = match (camera, &view.camera) {
        (Some(camera), _) | (None, CameraSource::Inline(camera)) => camera,
        (None, CameraSource::File { .. }) => return None,
    };
    Some(in_rover.moved(&truth.site_from_rover.to_pose()))
}
