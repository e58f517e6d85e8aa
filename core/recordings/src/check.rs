//! Checks an index and resolves its cameras.
//!
//! Each problem is one sentence that begins with the field (`stops[3].left.camera: …`). A problem that does not
//! prevent the use of the index is a warning.

use std::path::Path;

use nalgebra::Vector3;

use super::files::{read_text, resolve};
use sightline_geometry::camera::{Camera, CameraName, MastAngles, text};
use sightline_geometry::frames::{POSITION_LIMIT_M, PoseRecord};
use sightline_rover::visual_odometry::MeasuredMotion;
use sightline_world::traverse::{
    CameraSource, FORMAT_VERSION, FURTHER_CAMERAS_LIMIT, Stop, StopCamera, StopLight, TraverseIndex, View,
};

/// The largest width or height of an image, px.
const IMAGE_SIDE_LIMIT: u32 = 16_384;
/// The largest camera file that is read, bytes.
const CAMERA_FILE_LIMIT: u64 = 1 << 20;

/// A motion between two stops is a jump beyond this length, m, if it is also [`FEW_TIMES`] as long as the median.
const JUMP_M: f64 = 20.0;
/// See [`JUMP_M`]: recordings of cars have long steps throughout.
const FEW_TIMES: f64 = 3.0;
/// A motion between two stops is a jump beyond this multiple of the median, unless it is shorter than [`SHORT_M`].
const MANY_TIMES: f64 = 20.0;
/// The shortest jump, m: a rover that turns in place has a median near zero.
const SHORT_M: f64 = 1.0;
/// Number of jumps that are named individually.
const JUMPS_NAMED: usize = 5;

/// The cameras of one stop, in the rover frame, with O made unit.
#[derive(Clone, Debug)]
pub(super) struct StopCameras {
    pub(super) left: Camera,
    pub(super) right: Camera,
    pub(super) true_left: Option<Camera>,
    pub(super) true_right: Option<Camera>,
    /// In the order of the index.
    pub(super) further: Vec<FurtherCameras>,
}

/// A further pair of a stop, or a single camera, in the rover frame, with O made unit.
#[derive(Clone, Debug)]
pub(super) struct FurtherCameras {
    pub(super) name: CameraName,
    pub(super) left: Camera,
    /// `None` for a single camera.
    pub(super) right: Option<Camera>,
    pub(super) true_left: Option<Camera>,
    pub(super) true_right: Option<Camera>,
}

impl FurtherCameras {
    /// The true left camera; the given one if no truth is recorded.
    pub(super) fn true_left(&self) -> &Camera {
        self.true_left.as_ref().unwrap_or(&self.left)
    }

    /// The true right camera; the given one if no truth is recorded, `None` for a single camera.
    pub(super) fn true_right(&self) -> Option<&Camera> {
        let given = self.right.as_ref()?;
        Some(self.true_right.as_ref().unwrap_or(given))
    }
}

impl StopCameras {
    /// The true camera of the left image; the given one if no truth is recorded.
    pub(super) fn true_left(&self) -> &Camera {
        self.true_left.as_ref().unwrap_or(&self.left)
    }

    /// The true camera of the right image; the given one if no truth is recorded.
    pub(super) fn true_right(&self) -> &Camera {
        self.true_right.as_ref().unwrap_or(&self.right)
    }

    /// The further camera of this name.
    pub(super) fn named(&self, name: CameraName) -> Option<&FurtherCameras> {
        self.further.iter().find(|camera| camera.name == name)
    }
}

/// Checks the fields of an index outside its stops.
pub(super) fn check_index(index: &TraverseIndex) -> Result<(), String> {
    if index.format != FORMAT_VERSION {
        let version = index.format;
        return Err(format!(
            "format: version {version} is unknown; this program reads version {FORMAT_VERSION}"
        ));
    }
    if index.stops.is_empty() {
        return Err("stops: there is none, but a traverse has at least one".to_owned());
    }
    if let Some(dn) = index.full_scale_dn.filter(|dn| !(dn.is_finite() && *dn > 0.0)) {
        return Err(format!("full_scale_dn: is {dn}, but it must be a positive number"));
    }
    let error = index.odometry_error;
    for (field, value) in [
        ("along_fraction", error.along_fraction),
        ("across_fraction", error.across_fraction),
        ("attitude_deg", error.attitude_deg),
    ] {
        if !(value.is_finite() && value >= 0.0) {
            return Err(format!("odometry_error.{field}: is {value}, but it must be a number from 0"));
        }
    }
    let pointing_deg = index.pointing_error_deg;
    if !(pointing_deg.is_finite() && pointing_deg >= 0.0) {
        return Err(format!("pointing_error_deg: is {pointing_deg}, but it must be a number from 0"));
    }
    if let Some(mast) = &index.mast {
        if !mast.origin_in_rover.iter().all(|v| v.is_finite()) {
            return Err("mast.origin_in_rover: must be three finite numbers".to_owned());
        }
        check_camera(&mast.left_in_head).map_err(|problem| format!("mast.left_in_head: {problem}"))?;
        check_camera(&mast.right_in_head).map_err(|problem| format!("mast.right_in_head: {problem}"))?;
    }
    Ok(())
}

/// Checks the time, the poses and the mast angles of one stop.
pub(super) fn check_stop_numbers(stop: &Stop) -> Result<(), String> {
    if !stop.time_s.is_finite() {
        return Err(format!("time_s: is {}, but it must be a finite number", stop.time_s));
    }
    check_pose("site_from_rover", &stop.site_from_rover)?;
    stop.odometry.as_ref().map_or(Ok(()), MeasuredMotion::check)?;
    check_angles(stop.mast_angles)?;
    check_names(&stop.cameras)?;
    if let Some(light) = &stop.light {
        check_light(light)?;
    }
    let Some(truth) = &stop.truth else { return Ok(()) };
    check_pose("truth.site_from_rover", &truth.site_from_rover)?;
    let mut places = truth.wheel_places_m.iter().flatten().flatten().flatten();
    if places.any(|value| !(value.is_finite() && value.abs() <= POSITION_LIMIT_M)) {
        return Err(format!("truth.wheel_places_m: must be numbers within {POSITION_LIMIT_M:.0e} m"));
    }
    Ok(())
}

fn check_angles(angles: Option<MastAngles>) -> Result<(), String> {
    if angles.is_none_or(|angles| angles.azimuth_rad.is_finite() && angles.elevation_rad.is_finite()) {
        return Ok(());
    }
    Err("mast_angles: must be finite numbers".to_owned())
}

/// Checks number, names and mast angles of a stop's further cameras.
fn check_names(cameras: &[StopCamera]) -> Result<(), String> {
    let count = cameras.len();
    if count > FURTHER_CAMERAS_LIMIT {
        return Err(format!(
            "cameras: there are {count}, but a stop may have at most {FURTHER_CAMERAS_LIMIT}"
        ));
    }
    for (k, camera) in cameras.iter().enumerate() {
        let name = camera.name;
        if cameras[..k].iter().any(|other| other.name == name) {
            return Err(format!("cameras[{k}].name: {name} is the name of another camera of this stop"));
        }
        check_angles(camera.mast_angles).map_err(|problem| format!("cameras[{k}].{problem}"))?;
    }
    Ok(())
}

fn check_light(light: &StopLight) -> Result<(), String> {
    if !light.sun_azimuth_deg.is_finite() || !(-90.0..=90.0).contains(&light.sun_elevation_deg) {
        return Err(
            "light: the sun's azimuth must be a number, and its elevation from -90 to 90 deg".to_owned()
        );
    }
    match light.exposure_s.filter(|time_s| !(time_s.is_finite() && *time_s > 0.0)) {
        Some(time_s) => Err(format!("light.exposure_s: is {time_s}, but it must be greater than 0")),
        None => Ok(()),
    }
}

/// Checks one stop and reads its cameras.
pub(super) fn check_stop(stop: &Stop, folder: &Path) -> Result<StopCameras, String> {
    check_stop_numbers(stop)?;
    let truth = stop.truth.as_ref();
    let further = |(k, camera): (usize, &StopCamera)| {
        check_further(camera, folder).map_err(|problem| format!("cameras[{k}].{problem}"))
    };
    Ok(StopCameras {
        left: check_view("left", &stop.left, folder)?,
        right: check_view("right", &stop.right, folder)?,
        true_left: check_true_camera(
            "truth.left_camera",
            truth.and_then(|truth| truth.left_camera.as_ref()),
        )?,
        true_right: check_true_camera(
            "truth.right_camera",
            truth.and_then(|truth| truth.right_camera.as_ref()),
        )?,
        further: stop.cameras.iter().enumerate().map(further).collect::<Result<_, _>>()?,
    })
}

fn check_further(camera: &StopCamera, folder: &Path) -> Result<FurtherCameras, String> {
    let right = camera.right.as_ref().map(|right| check_view("right", right, folder));
    Ok(FurtherCameras {
        name: camera.name,
        left: check_view("left", &camera.left, folder)?,
        right: right.transpose()?,
        true_left: check_true_camera("true_left_camera", camera.true_left_camera.as_ref())?,
        true_right: check_true_camera("true_right_camera", camera.true_right_camera.as_ref())?,
    })
}

fn check_true_camera(field: &str, camera: Option<&Camera>) -> Result<Option<Camera>, String> {
    let named = |problem| format!("{field}: {problem}");
    camera.cloned().map(checked).transpose().map_err(named)
}

fn check_pose(field: &str, pose: &PoseRecord) -> Result<(), String> {
    if pose.is_plausible() {
        return Ok(());
    }
    Err(format!(
        "{field}: must have a position_m within {POSITION_LIMIT_M:.0e} m and a quaternion_sxyz of unit length"
    ))
}

fn check_view(side: &str, view: &View, folder: &Path) -> Result<Camera, String> {
    resolve(folder, &view.image).map_err(|problem| format!("{side}.image: {problem}"))?;
    let camera = match &view.camera {
        CameraSource::Inline(camera) => Ok(camera.clone()),
        CameraSource::File { file } => read_camera(folder, file),
    };
    camera.and_then(checked).map_err(|problem| format!("{side}.camera: {problem}"))
}

fn read_camera(folder: &Path, name: &str) -> Result<Camera, String> {
    let path = resolve(folder, name)?;
    let unreadable = |error: std::io::Error| format!("{name} cannot be read ({error})");
    if std::fs::metadata(&path).map_err(unreadable)?.len() > CAMERA_FILE_LIMIT {
        return Err(format!("{name} is too large for a camera file"));
    }
    let content = read_text(&path).map_err(unreadable)?;
    text::read_text(&content, Path::new(name)).map_err(|error| error.to_string())
}

fn checked(camera: Camera) -> Result<Camera, String> {
    check_camera(&camera)?;
    Ok(camera.normalised())
}

fn check_camera(camera: &Camera) -> Result<(), String> {
    if !camera.size.iter().all(|side| (1..=IMAGE_SIDE_LIMIT).contains(side)) {
        let [width, height] = camera.size;
        return Err(format!("size is {width} × {height}, but each must be 1 to {IMAGE_SIDE_LIMIT}"));
    }
    camera.model.validate()
}

/// One warning for each of the first [`JUMPS_NAMED`] motions between stops that are much longer than the others.
fn jumps(index: &TraverseIndex) -> Vec<String> {
    let between_m = |pair: &[Stop]| {
        let [from, to] = [&pair[0], &pair[1]].map(|stop| Vector3::from(stop.site_from_rover.position_m));
        (to - from).norm()
    };
    let motions_m: Vec<f64> = index.stops.windows(2).map(between_m).collect();
    let mut sorted_m = motions_m.clone();
    sorted_m.sort_by(f64::total_cmp);
    let others_m = sorted_m.get(sorted_m.len().saturating_sub(1) / 2).copied().filter(|_| sorted_m.len() > 1);
    let is_jump = |motion_m: f64| {
        let exceeds = |times: f64, others_m: f64| motion_m > times * others_m;
        (motion_m > JUMP_M && others_m.is_none_or(|others_m| exceeds(FEW_TIMES, others_m)))
            || (motion_m > SHORT_M && others_m.is_some_and(|others_m| exceeds(MANY_TIMES, others_m)))
    };
    let found: Vec<_> = motions_m.iter().enumerate().filter(|(_, motion_m)| is_jump(**motion_m)).collect();
    let typical =
        others_m.map_or_else(String::new, |others_m| format!("; a typical step is {others_m:.2} m"));
    let named = found.iter().take(JUMPS_NAMED).map(|(step, motion_m)| {
        let stop = step + 1;
        // Scientific notation if the digits of an absurd number would fill the line.
        let motion = if **motion_m < 1e7 { format!("{motion_m:.1}") } else { format!("{motion_m:.1e}") };
        format!("stops[{stop}].site_from_rover: is {motion} m from the stop before{typical}: check the poses")
    });
    let mut sentences: Vec<String> = named.collect();
    if found.len() > JUMPS_NAMED {
        sentences.push(format!("{} more stops are as far from the stop before", found.len() - JUMPS_NAMED));
    }
    sentences
}

/// Returns warnings about an index that can be used nevertheless.
pub(super) fn warnings(index: &TraverseIndex, folder: &Path) -> Vec<String> {
    let mut warnings = Vec::new();
    for (step, pair) in index.stops.windows(2).enumerate() {
        if pair[1].time_s < pair[0].time_s {
            warnings.push(format!("stops[{}].time_s: is earlier than the stop before", step + 1));
        }
    }
    warnings.extend(jumps(index));
    if index.scenario.is_none() {
        let missing = |view: &View| !folder.join(&view.image).is_file();
        let views = || index.stops.iter().flat_map(Stop::views);
        let count = views().filter(|view| missing(view)).count();
        if count > 0 {
            let total = views().count();
            warnings.push(format!("{count} of {total} images are missing; their stops cannot be tracked"));
        }
    }
    warnings
}

#[cfg(test)]
#[path = "check_tests.rs"]
mod tests;
