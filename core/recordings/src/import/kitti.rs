//! KITTI odometry sequences.
//!
//! Source: the benchmark's development kit; domain.md 14.1. A sequence is a folder with
//!
//! - `calib.txt`: lines `P0: …` and `P1: …`, 3 × 4 projection matrices (row by row) of the rectified grey
//!   cameras, in the frame of camera 0 (x right, y down, z forward), px and px·m;
//! - `image_0`, `image_1`: the left and right images `000000.png`, `000001.png`, …;
//! - `poses.txt` (or `../../poses/<sequence>.txt`): a 3 × 4 matrix a line, the pose of camera 0 at that frame
//!   in the frame of camera 0 at the sequence's first frame, m;
//! - `times.txt` (optional): seconds, one per line; otherwise 0.1 s per frame.
//!
//! The rover frame is camera 0's, with its axes renamed: x = z_c, y = x_c, z = y_c (`rover_from_camera`), and
//! the site frame is the rover frame at the first imported stop. A projection matrix P = [M | p] is the CAHV
//! model with A, H, V = third, first, second row of M and C = −M⁻¹ p.
//!
//! **The poses are true**, so the tracker's pose estimate is computed from them with a simulated odometry error, by
//! the simulator's model ([`sightline_world::rover::odometry::estimates`]): with T_k the true and E_k the estimated
//! pose (`site_from_rover`) at stop k,
//!
//! ```text
//! Δ_k = T_{k−1}⁻¹ T_k = (R, t)                  true motion of the step, in the rover frame before it
//! t' = t + (a n₁) u + (c n₂) v + (c n₃) w       u along t, v and w across; a = along_fraction · |t|, c likewise
//! R' = R · Rz(α n₆) Ry(α n₅) Rx(α n₄)           α = attitude_deg in rad
//! E_0 = T_0,   E_k = E_{k−1} · (R', t')         n₁ … n₆ standard normal, from the seed: errors add up
//! ```

use std::path::{Path, PathBuf};

use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};

use super::{ImportFormat, ImportOptions, Output};
use crate::files;
use sightline_geometry::camera::{Cahv, Camera, CameraModel};
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Point3, Pose, PoseRecord, Vector3};
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_vision::image::io;
use sightline_world::rover::odometry;
use sightline_world::traverse::{CameraSource, FORMAT_VERSION, Stop, StopTruth, TraverseIndex, View};

/// Time between frames without `times.txt`, s.
const FRAME_TIME_S: f64 = 0.1;
/// Largest deviation of a pose's matrix from a rotation (files have seven digits).
const ROTATION_TOLERANCE: f64 = 1e-3;

/// The smallest distance between the two cameras, m.
const SMALLEST_BASELINE_M: f64 = 1e-3;

/// The importer.
pub struct Kitti;

/// The description of a traverse with this number of stops.
fn description(stops: usize, options: &ImportOptions) -> String {
    format!(
        "KITTI odometry sequence, {stops} stereo frames. Truth: the recording's poses. Estimate: the truth with a \
         simulated odometry error of {} of the distance driven and {}° a step, seed {}.",
        options.odometry_fraction, options.attitude_deg, options.seed,
    )
}

impl ImportFormat for Kitti {
    fn name(&self) -> &'static str {
        "KITTI odometry"
    }

    fn expects(&self) -> &'static str {
        "a folder with calib.txt, poses.txt, image_0 and image_1"
    }

    fn sniff(&self, path: &Path) -> bool {
        path.join("calib.txt").is_file() && path.join("image_0").is_dir() && path.join("image_1").is_dir()
    }

    fn import(&self, path: &Path, options: &ImportOptions, output: &mut Output<'_>) -> Result<TraverseIndex> {
        let poses = read_poses(&poses_path(path, options))?;
        let times = read_times(&path.join("times.txt"))?;
        let frames = choose_frames(path, &poses, options)?;
        let size = image_size(&path.join("image_0").join(&frames[0].1))?;
        let cameras = read_cameras(&path.join("calib.txt"), size)?;
        output.expect(2 * frames.len());

        let site_from_first = poses[frames[0].0].inverse();
        let truth: Vec<Pose> = frames.iter().map(|(frame, _)| site_from_first * poses[*frame]).collect();
        let odometry_error = OdometryError {
            along_fraction: options.odometry_fraction,
            across_fraction: options.odometry_fraction,
            attitude_deg: options.attitude_deg,
        };
        let estimates = odometry::estimates(&truth, &odometry_error, options.seed);
        let time = |frame: usize| times.get(frame).copied().unwrap_or(frame as f64 * FRAME_TIME_S);
        let mut stops = Vec::with_capacity(frames.len());
        for (((frame, file), truth), estimate) in frames.iter().zip(&truth).zip(&estimates) {
            let mut view = |folder: &str, camera: &Camera| -> Result<View> {
                let image = format!("{folder}/{file}");
                output.copy(&path.join(folder).join(file), &image)?;
                Ok(View { image, camera: CameraSource::Inline(camera.clone()) })
            };
            stops.push(Stop {
                time_s: time(*frame) - time(frames[0].0),
                site_from_rover: PoseRecord::from(estimate),
                mast_angles: None,
                left: view("image_0", &cameras[0])?,
                right: view("image_1", &cameras[1])?,
                light: None,
                metered_px: None,
                odometry: None,
                odometry_alone: false,
                mast_target: None,
                truth: Some(StopTruth {
                    site_from_rover: PoseRecord::from(truth),
                    left_camera: None,
                    right_camera: None,
                    wheel_places_m: None,
                }),
                cameras: Vec::new(),
            });
        }
        let folder_name = || path.file_name().map(|name| name.to_string_lossy().into_owned());
        let description = description(stops.len(), options);
        Ok(TraverseIndex {
            format: FORMAT_VERSION,
            name: options.name.clone().or_else(folder_name).unwrap_or_default(),
            description,
            full_scale_dn: None,
            stereo: StereoGeometry::Lateral,
            odometry_error,
            pointing_error_deg: 0.0,
            mast: None,
            scenario: None,
            stops,
        })
    }
}

/// Rover x = camera z, y = camera x, z = camera y.
fn rover_from_camera() -> Rotation3<f64> {
    let axes = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
    Rotation3::from_matrix_unchecked(axes)
}

fn read_text(path: &Path) -> Result<String> {
    files::read_text(path).map_err(|source| Error::Read { path: path.to_owned(), source })
}

/// The finite numbers of a line; `None` if one of its words is not a finite number.
fn numbers(line: &str) -> Option<Vec<f64>> {
    line.split_whitespace().map(|word| word.parse().ok().filter(|v: &f64| v.is_finite())).collect()
}

/// The left and the right camera in the rover frame.
pub fn read_cameras(path: &Path, size: [u32; 2]) -> Result<[Camera; 2]> {
    let text = read_text(path)?;
    let read = |key: &str| {
        let line = text.lines().find_map(|line| line.trim().strip_prefix(key)?.strip_prefix(':'));
        let values: Option<[f64; 12]> = line.and_then(numbers).and_then(|values| values.try_into().ok());
        let values = values.ok_or_else(|| {
            Error::format(
                path,
                format!("needs a line \"{key}: …\" with the 12 numbers of a projection matrix"),
            )
        })?;
        let model = cahv(&values).ok_or_else(|| Error::format(path, format!("{key} has no inverse")))?;
        model.validate().map_err(|problem| Error::format(path, format!("{key}: {problem}")))?;
        Ok(Camera { model, size })
    };
    let cameras = [read("P0")?, read("P1")?];
    let baseline_m = (cameras[1].model.centre() - cameras[0].model.centre()).norm();
    if baseline_m < SMALLEST_BASELINE_M {
        let problem =
            "P0 and P1 have the same centre, so no range can be measured; give the matrices of both cameras";
        return Err(Error::format(path, problem));
    }
    Ok(cameras)
}

/// The CAHV model of a projection matrix (header), in the rover frame.
fn cahv(p: &[f64; 12]) -> Option<CameraModel> {
    let rows = Matrix3::new(p[0], p[1], p[2], p[4], p[5], p[6], p[8], p[9], p[10]);
    let centre = -(rows.try_inverse()? * Vector3::new(p[3], p[7], p[11]));
    let turn = rover_from_camera();
    let row = |index: usize| turn * rows.row(index).transpose();
    let centre = Point3::from(turn * centre);
    Some(CameraModel::Cahv(Cahv::as_printed(centre, row(2), row(0), row(1))))
}

/// The path of the poses: beside the images, or in the benchmark's own folders unless that is outside of the allowed folder.
fn poses_path(sequence: &Path, options: &ImportOptions) -> PathBuf {
    let beside = sequence.join("poses.txt");
    let name = sequence.canonicalize().ok().and_then(|path| Some(path.file_name()?.to_owned()));
    let shared = name.map(|name| sequence.join("../../poses").join(name).with_extension("txt"));
    let is_allowed = |shared: &PathBuf| {
        let real = || shared.canonicalize().unwrap_or_default();
        options.within.as_ref().is_none_or(|root| real().starts_with(root))
    };
    shared.filter(|shared| !beside.is_file() && shared.is_file() && is_allowed(shared)).unwrap_or(beside)
}

/// The poses of the rover frame in that of the sequence's first frame.
pub fn read_poses(path: &Path) -> Result<Vec<Pose>> {
    let text = read_text(path)?;
    let turn = rover_from_camera();
    let read = |(index, line): (usize, &str)| {
        let problem = |problem: &str| Error::format(path, format!("line {}: {problem}", index + 1));
        let p: Option<[f64; 12]> = numbers(line).and_then(|values| values.try_into().ok());
        let p = p.ok_or_else(|| problem("a pose must have 12 finite numbers"))?;
        let matrix = Matrix3::new(p[0], p[1], p[2], p[4], p[5], p[6], p[8], p[9], p[10]);
        let square = matrix.transpose() * matrix;
        if (square - Matrix3::identity()).amax() > ROTATION_TOLERANCE || matrix.determinant() < 0.0 {
            return Err(problem("the first three columns are no rotation"));
        }
        let rotation = nearest_rotation(&(turn.matrix() * matrix * turn.matrix().transpose()));
        Ok(Pose::from_parts(Translation3::from(turn * Vector3::new(p[3], p[7], p[11])), rotation))
    };
    text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()).map(read).collect()
}

/// The rotation closest to a matrix that is a rotation up to rounding: U Vᵀ of its singular value decomposition.
fn nearest_rotation(matrix: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let parts = matrix.svd(true, true);
    let closest = parts.u.zip(parts.v_t).map_or(*matrix, |(u, v_t)| u * v_t);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(closest))
}

fn read_times(path: &Path) -> Result<Vec<f64>> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    let text = read_text(path)?;
    let times =
        text.lines().filter(|line| !line.trim().is_empty()).map(|line| match numbers(line)?.as_slice() {
            [time] => Some(*time),
            _ => None,
        });
    times.collect::<Option<_>>().ok_or_else(|| Error::format(path, "must have one time in seconds a line"))
}

/// The frames to import: their numbers, which are their lines in `poses.txt`, and their file names.
fn choose_frames(path: &Path, poses: &[Pose], options: &ImportOptions) -> Result<Vec<(usize, String)>> {
    let folder = path.join("image_0");
    let unreadable = |source| Error::Read { path: folder.clone(), source };
    let mut frames = Vec::new();
    for entry in std::fs::read_dir(&folder).map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.file_name().to_string_lossy().into_owned();
        let number = file.strip_suffix(".png").and_then(|stem| stem.parse::<usize>().ok());
        frames.extend(number.map(|number| (number, file)));
    }
    frames.sort();
    let chosen = frames.into_iter().filter(|(number, _)| *number >= options.first_frame);
    let chosen: Vec<_> = chosen.step_by(options.every).take(options.max_stops).collect();
    let Some((last, file)) = chosen.last() else {
        return Err(Error::format(folder, "holds no images such as 000000.png from the first frame on"));
    };
    if *last >= poses.len() {
        let problem = format!("has {} poses, but image_0/{file} needs line {}", poses.len(), last + 1);
        return Err(Error::format(poses_path(path, options), problem));
    }
    Ok(chosen)
}

fn image_size(path: &Path) -> Result<[u32; 2]> {
    let size = io::png_size(path)?;
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    if pixels > io::MAX_PIXELS {
        return Err(Error::format(path, format!("{} × {} pixels are too many", size[0], size[1])));
    }
    Ok(size)
}
