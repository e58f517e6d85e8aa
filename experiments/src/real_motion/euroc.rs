//! The excerpts of a EuRoC recording in ASL format (domain.md 14.2), straightened.
//!
//! ```text
//! left_from_right = left_from_body · body_from_right            T_BS of the two cameras
//! world_from_left = world_from_body · body_from_left            Vicon
//! ```
//! Both cameras' images bear the time stamp as their name. Without poses in the folder the body stands.

use std::path::Path;

use nalgebra::{Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion};

use super::lens::Lens;
use super::{Frame, Recording, Set, pair};
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Point3, Pose, Vector3};
use sightline_vision::image::io::read_png;

/// The two frames half a second apart, or those of a body that stands.
pub(super) fn read(data: &Path, set: Set) -> Result<Recording> {
    let excerpt = if set == Set::EurocStill { "still" } else { "aprilgrid-pair" };
    let folder = data.join("euroc-v101").join(excerpt).join("mav0");
    let sensors = [sensor(&folder.join("cam0/sensor.yaml"))?, sensor(&folder.join("cam1/sensor.yaml"))?];
    let body_from_left = sensors[0].body_from_camera;
    let poses = folder.join("state_groundtruth_estimate0/data.csv");
    let poses = if set == Set::EurocStill { None } else { Some((text(&poses)?, poses)) };
    let mut frames = Vec::new();
    for line in records(&text(&folder.join("cam0/data.csv"))?) {
        let [stamp, file] = [0, 1].map(|column| line.split(',').nth(column).unwrap_or_default().trim());
        let image = |eye: usize| {
            let distorted = read_png(folder.join(format!("cam{eye}/data")).join(file), None)?;
            Ok::<_, Error>(sensors[eye].lens.straighten(&distorted))
        };
        let world_from_body = match &poses {
            Some((text, path)) => world_from_body(text, stamp)
                .ok_or_else(|| Error::format(path, format!("has no pose for {stamp}")))?,
            None => Pose::identity(),
        };
        frames.push(Frame {
            name: format!("{}", frames.len()),
            pair: pair(image(0)?, image(1)?),
            world_from_rig: world_from_body * body_from_left,
            about_in_rig: Point3::origin(),
            outline: None,
        });
    }
    let size = frames.first().map(|frame| frame.pair.left.dimensions().into()).unwrap_or_default();
    let camera = |eye: &Sensor| eye.lens.camera(&(body_from_left.inverse() * eye.body_from_camera), size);
    let pairs = (1..frames.len()).map(|now| (set, now - 1, now)).collect();
    Ok(Recording { cameras: [camera(&sensors[0]), camera(&sensors[1])], frames, pairs, range_min_m: None })
}

/// One eye.
struct Sensor {
    lens: Lens,
    body_from_camera: Pose,
}

fn sensor(path: &Path) -> Result<Sensor> {
    let text = text(path)?;
    let read = || {
        let t: [f64; 16] = list(&text, "data")?.try_into().ok()?;
        let [fu, fv, cu, cv]: [f64; 4] = list(&text, "intrinsics")?.try_into().ok()?;
        let [k1, k2, p1, p2]: [f64; 4] = list(&text, "distortion_coefficients")?.try_into().ok()?;
        let rotation = Matrix3::new(t[0], t[1], t[2], t[4], t[5], t[6], t[8], t[9], t[10]);
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&rotation));
        Some(Sensor {
            lens: Lens { focal_px: [fu, fv], centre: Pixel::new(cu, cv), distortion: [k1, k2, p1, p2, 0.0] },
            body_from_camera: Pose::from_parts(Translation3::new(t[3], t[7], t[11]), rotation),
        })
    };
    let problem = "needs T_BS with data: [16 numbers], intrinsics: [4] and distortion_coefficients: [4]";
    read().ok_or_else(|| Error::format(path, problem))
}

/// The numbers of `key: [ … ]`, on however many lines.
fn list(text: &str, key: &str) -> Option<Vec<f64>> {
    let (_, rest) = text.split_once(&format!("{key}:"))?;
    let inside = rest.trim_start().strip_prefix('[')?.split_once(']')?.0;
    inside.split(',').map(|word| word.trim().parse().ok()).collect()
}

/// The lines of a table below its heading.
fn records(text: &str) -> impl Iterator<Item = &str> {
    text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty())
}

/// The pose at a time stamp; quaternions are scalar first.
fn world_from_body(text: &str, stamp: &str) -> Option<Pose> {
    let line = records(text).find_map(|line| line.strip_prefix(stamp)?.strip_prefix(','))?;
    let values: Vec<f64> = line.split(',').map_while(|word| word.trim().parse().ok()).collect();
    let [x, y, z, qw, qx, qy, qz] = *values.first_chunk()?;
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(qw, qx, qy, qz));
    Some(Pose::from_parts(Translation3::from(Vector3::new(x, y, z)), rotation))
}

fn text(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).map_err(|source| Error::Read { path: path.to_owned(), source })
}
