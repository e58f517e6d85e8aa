//! The index of a simulated traverse: stops, poses, mast angles, cameras and the names of the images.
//!
//! Each stop contains the tracker's inputs (estimated pose, measured mast angles and the cameras that follow from
//! them) and, separately, the ground truth. The truth contains cameras only where they differ from the cameras given
//! to the tracker, that is when the scenario has a pointing error.
//!
//! `camera.further` adds cameras to every stop: their images are rendered from the same poses. Cameras on the mast
//! use the angles of their `look_deg` or, by default, those of the main pair (level and ahead if that pair is on the
//! body). Their pointing error is that of the main pair.
//!
//! With `camera.hand_over` one more stop follows the last, with the same true and estimated poses and the other pair
//! of cameras, which is fixed to the body and therefore has no mast angles (R205, R209).
//!
//! Time: the rover drives at 3.75 cm/s, turns at 2.1°/s along its path (domain.md 5.4) and pauses for 60 s at each
//! stop (the pause is ours).
//! Frames: poses in the site frame, cameras in the rover frame. Sources: domain.md 4, 5; R104–R106, R205.

use crate::traverse::{CameraSource, FORMAT_VERSION, Stop, StopCamera, StopTruth, TraverseIndex, View};
use sightline_geometry::camera::{Camera, CameraName, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Pose, PoseRecord};
use sightline_geometry::stereo_geometry::StereoGeometry;

use crate::camera::picture::Eye;
use crate::camera::rig::Rig;
use crate::rover::{drive, mast_error, odometry};
use crate::scenario::{CameraRig, CameraSettings, Course, FurtherRig, Scenario};
use crate::world::World;

/// File name of the scenario within a traverse folder.
pub const SCENARIO_FILE: &str = "scenario.toml";

/// Mast angles without pointing: level and ahead.
const AHEAD: MastAngles = MastAngles { azimuth_rad: 0.0, elevation_rad: 0.0 };

/// Time spent at a stop, s (ours).
pub(crate) const PAUSE_S: f64 = 60.0;

/// Returns the index of a scenario's traverse without stops.
pub fn empty_index(scenario: &Scenario) -> TraverseIndex {
    TraverseIndex {
        format: FORMAT_VERSION,
        name: scenario.name.clone(),
        description: scenario.description.clone(),
        full_scale_dn: Some(scenario.camera.recorded_full_scale_dn()),
        stereo: StereoGeometry::Lateral,
        odometry_error: scenario.odometry_error,
        pointing_error_deg: scenario.drive.pointing_error_deg,
        mast: match Rig::new(&scenario.camera) {
            Rig::Mast(mast) => Some(mast),
            Rig::Body { .. } => None,
        },
        scenario: Some(SCENARIO_FILE.into()),
        stops: Vec::new(),
    }
}

/// Builds the index of a scenario's traverse; fails if the drive is impossible on this ground.
pub fn index(scenario: &Scenario, world: &World) -> Result<TraverseIndex> {
    index_until(scenario, world, Cancel::default())
}

/// [`index`], cancellable.
pub fn index_until(scenario: &Scenario, world: &World, cancel: Cancel<'_>) -> Result<TraverseIndex> {
    let rigs = Rigs::new(&scenario.camera);
    let drive = drive::true_drive(world, scenario, cancel)?;
    let estimates = odometry::believed(&drive, scenario);
    let told: Vec<MastAngles> = drive.stops.iter().filter_map(|stop| stop.angles).collect();
    let true_angles = mast_error::true_angles(&told, scenario);
    let mut stops = Vec::with_capacity(drive.stops.len());
    let mut time_s = 0.0;
    for (number, (truth, estimate)) in drive.stops.iter().zip(&estimates).enumerate() {
        if let Some(leg) = number.checked_sub(1).and_then(|before| drive.legs.get(before)) {
            time_s += PAUSE_S + leg.duration_s;
        }
        let pointed = true_angles.get(number).copied().filter(|_| mast_error::is_present(&scenario.drive));
        let poses = [truth.site_from_rover, *estimate];
        stops.push(simulated_stop(number, time_s, poses, truth.angles, pointed, &rigs));
    }
    let handed_over = stops.last().and_then(|last| handed_over(last, stops.len(), &scenario.camera));
    stops.extend(handed_over);
    let description = describe(scenario, stops.len());
    Ok(TraverseIndex { description, stops, ..empty_index(scenario) })
}

/// The pairs of cameras of a scenario.
pub(crate) struct Rigs {
    main: Rig,
    further: Vec<FurtherPair>,
}

/// A further pair: its rig, and the mast angles for it; `None` for those of the main pair.
struct FurtherPair {
    name: CameraName,
    rig: Rig,
    look: Option<MastAngles>,
}

impl FurtherPair {
    fn new(camera: &FurtherRig) -> Self {
        Self { name: camera.name, rig: Rig::of(camera.rig, camera.image_size), look: camera.look() }
    }

    /// Commanded and true angles for this pair, from those for the main pair.
    fn angles(&self, [told, pointed]: [Option<MastAngles>; 2]) -> [Option<MastAngles>; 2] {
        let Some(look) = self.look else { return [told, pointed] };
        let from = told.unwrap_or(AHEAD);
        let off = |pointed: MastAngles| MastAngles {
            azimuth_rad: look.azimuth_rad + pointed.azimuth_rad - from.azimuth_rad,
            elevation_rad: look.elevation_rad + pointed.elevation_rad - from.elevation_rad,
        };
        [Some(look), pointed.map(off)]
    }
}

impl Rigs {
    pub(crate) fn new(settings: &CameraSettings) -> Self {
        let further = settings.further.iter().map(FurtherPair::new).collect();
        Self { main: Rig::new(settings), further }
    }
}

/// A stop of a simulated drive. `poses`: true and estimated; `pointed`: true mast angles if they differ from the
/// commanded ones.
pub(crate) fn simulated_stop(
    number: usize,
    time_s: f64,
    poses: [Pose; 2],
    told: Option<MastAngles>,
    pointed: Option<MastAngles>,
    rigs: &Rigs,
) -> Stop {
    let (left, right) = rigs.main.cameras_in_rover(told);
    let (left_camera, right_camera) = true_cameras(&rigs.main, pointed);
    let further =
        |pair: &FurtherPair| further_camera(number, pair.name, &pair.rig, pair.angles([told, pointed]));
    let [truth, estimate] = poses.map(|pose| PoseRecord::from(&pose));
    Stop {
        time_s,
        site_from_rover: estimate,
        mast_angles: told,
        left: view("left", number, left),
        right: view("right", number, right),
        light: None,
        metered_px: None,
        odometry: None,
        odometry_alone: false,
        mast_target: None,
        truth: Some(StopTruth { site_from_rover: truth, left_camera, right_camera, wheel_places_m: None }),
        cameras: rigs.further.iter().map(further).collect(),
    }
}

/// The pair that visual odometry takes in addition at a stop, with the cameras of the main pair. `angles`: commanded,
/// and true where they differ.
pub(crate) fn odometry_pair(number: usize, rigs: &Rigs, angles: [Option<MastAngles>; 2]) -> StopCamera {
    further_camera(number, CameraName::ODOMETRY, &rigs.main, angles)
}

/// The cameras of a rig at the true mast angles; `None` if these equal the commanded ones.
fn true_cameras(rig: &Rig, pointed: Option<MastAngles>) -> (Option<Camera>, Option<Camera>) {
    pointed.map(|angles| rig.cameras_in_rover(Some(angles))).unzip()
}

/// A further camera of a stop. `angles`: commanded, and true where they differ.
fn further_camera(number: usize, name: CameraName, rig: &Rig, angles: [Option<MastAngles>; 2]) -> StopCamera {
    let [told, pointed] = match rig {
        Rig::Mast(_) => [Some(angles[0].unwrap_or(AHEAD)), angles[1]],
        Rig::Body { .. } => [None, None],
    };
    let (left, right) = rig.cameras_in_rover(told);
    let (true_left_camera, true_right_camera) = true_cameras(rig, pointed);
    StopCamera {
        name,
        mast_angles: told,
        left: view(&format!("{name}_left"), number, left),
        right: Some(view(&format!("{name}_right"), number, right)),
        true_left_camera,
        true_right_camera,
    }
}

/// One image of a stop with its camera.
fn view(eye: &str, number: usize, camera: Camera) -> View {
    View { image: format!("images/{eye}_{number:04}.png"), camera: CameraSource::Inline(camera) }
}

/// The hand-off stop after the last one: same pose, the other pair. `None` if the scenario has no hand-off.
fn handed_over(last: &Stop, number: usize, settings: &CameraSettings) -> Option<Stop> {
    let (left, right) = Rig::of(settings.hand_over?, settings.image_size).cameras_in_rover(None);
    let truth = last.truth.as_ref()?;
    let renamed = |camera: &StopCamera| {
        let name = camera.name;
        let named = |eye: &str, of: &View| View {
            image: format!("images/{name}_{eye}_{number:04}.png"),
            camera: of.camera.clone(),
        };
        let right = camera.right.as_ref().map(|right| named("right", right));
        StopCamera { left: named("left", &camera.left), right, ..camera.clone() }
    };
    Some(Stop {
        time_s: last.time_s + PAUSE_S,
        site_from_rover: last.site_from_rover,
        mast_angles: None,
        left: view("left", number, left),
        right: view("right", number, right),
        light: None,
        metered_px: None,
        odometry: None,
        odometry_alone: false,
        mast_target: None,
        truth: Some(StopTruth {
            site_from_rover: truth.site_from_rover,
            left_camera: None,
            right_camera: None,
            wheel_places_m: None,
        }),
        cameras: last.cameras.iter().map(renamed).collect(),
    })
}

/// Replaces the main pair of a stop by the further pair of this name, if that pair is fixed to the body; otherwise
/// returns the stop unchanged.
pub(crate) fn seen_by_body(stop: Stop, number: usize, name: CameraName, rigs: &Rigs) -> Stop {
    let pair = rigs.further.iter().find(|pair| pair.name == name);
    let Some(FurtherPair { rig: rig @ Rig::Body { .. }, .. }) = pair else { return stop };
    let (left, right) = rig.cameras_in_rover(None);
    let truth = stop.truth.map(|truth| StopTruth { left_camera: None, right_camera: None, ..truth });
    let (left, right) = (view("left", number, left), view("right", number, right));
    Stop { mast_angles: None, left, right, truth, ..stop }
}

/// Describes the drive in one sentence.
fn describe(scenario: &Scenario, stops: usize) -> String {
    let drive = &scenario.drive;
    let course = match drive.course {
        Course::Approach => format!(
            "straight approach from {:.1} m in {stops} stops, steps of {:.0} % of the distance",
            drive.start_distance_m,
            100.0 * drive.step_fraction,
        ),
        Course::Moves => format!(
            "{stops} stops along a list of moves that starts at {:.1} m, the targets {:.0}° from straight ahead",
            drive.start_distance_m, drive.start_bearing_deg,
        ),
    };
    let cameras = cameras_of(scenario.camera.rig);
    let then = match scenario.camera.hand_over {
        Some(rig) => format!(", at the last stop {}", cameras_of(rig)),
        None => String::new(),
    };
    let made = format!(
        "Simulated: {course}, {cameras}{then}, images {size} px wide, seed {}.",
        scenario.seed,
        size = scenario.camera.image_size,
    );
    format!("{} {made}", scenario.description).trim_start().to_owned()
}

/// Describes a pair of cameras.
fn cameras_of(rig: CameraRig) -> &'static str {
    match rig {
        CameraRig::MerNavcam => "Spirit's navcams",
        CameraRig::MerPancam => "Opportunity's pancams",
        CameraRig::MerFrontHazcam => "Opportunity's front hazcams",
        CameraRig::MerRearHazcam => "rear hazcams like Opportunity's front ones",
        CameraRig::Table1Pancam => "the paper's f = 16 mm pair",
        CameraRig::Table1Navcam => "the paper's f = 6 mm pair",
    }
}

/// Returns the true camera of an image of a simulated stop's main pair, in the site frame.
///
/// `None` if the stop has no truth, or if its camera model is in a file.
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
