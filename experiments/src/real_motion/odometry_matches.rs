//! The inliers of visual odometry with all that another program needs to find the same motion: OpenCV's PnP
//! (`python/odometry_pnp.py`).
//!
//! All poses and points are in the frame of the left camera: x right, y down, z forward. Positions of the table of corners
//! follow from pixel and range:
//! ```text
//! | o + t d | = r        the ray (o, d) of the pixel, rover frame; r as the table has it: from the rover's origin
//! ```

use std::path::Path;

use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};

use sightline_geometry::camera::Camera;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Point3, Pose, PoseRecord, Ray};
use sightline_rover::visual_odometry::{Fate, OdometryUpdate};
use sightline_vision::image::io::write_png_u8;

use super::{Recording, Row, Set};

/// The inliers of one pair of frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct PairMatches {
    /// The set it belongs to.
    pub set: Set,
    /// The two frames, for example `0 to 1`.
    pub pair: String,
    /// Names of the frames as [`Recording::write_frames`] writes them, without `_left.png` or `_right.png`.
    pub frames: [String; 2],
    /// Focal lengths and centre, fx, fy, cx, cy, of the left and the right camera, px.
    pub intrinsics: [[f64; 4]; 2],
    /// Pose of the left camera's frame in that of the right one, m.
    pub right_from_left: PoseRecord,
    /// Whether the update is accepted.
    pub accepted: bool,
    /// The motion that was found; null where none was.
    pub after_from_before: Option<PoseRecord>,
    /// The true motion.
    pub true_after_from_before: PoseRecord,
    /// The inliers.
    pub inliers: Vec<Inlier>,
}

/// A match that agrees with the motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Inlier {
    /// Its position before, m.
    pub before_m: [f64; 3],
    /// Its pixel in the left image before, px.
    pub before_px: [f64; 2],
    /// Its pixel in the left image after, px.
    pub after_px: [f64; 2],
}

/// The inliers of an update with cameras in the rover frame; `truth` is from the rover frame before to that after.
pub(super) fn pair_matches(
    row: &Row,
    cameras: &[Camera; 2],
    update: &OdometryUpdate,
    truth: &Pose,
) -> PairMatches {
    let [rover_from_left, rover_from_right] = [0, 1].map(|eye| rover_from_camera(&cameras[eye]));
    let in_left = |motion: Pose| rover_from_left.inverse() * motion * rover_from_left;
    let corners = update.table.iter().filter(|corner| corner.fate == Fate::Inlier);
    let inlier = |corner: &sightline_rover::visual_odometry::OdometryCorner| {
        let [x, y] = corner.before_px;
        let ray = cameras[0].ray(Pixel::new(x, y))?;
        let before = rover_from_left.inverse() * at_distance_from_origin(&ray, corner.range_m?)?;
        Some(Inlier {
            before_m: before.coords.into(),
            before_px: corner.before_px,
            after_px: corner.after_px?,
        })
    };
    let name = |frame: &str| frame_name(row.set, frame);
    let (then, now) = row.pair.split_once(" to ").unwrap_or((&row.pair, ""));
    PairMatches {
        set: row.set,
        pair: row.pair.clone(),
        frames: [name(then), name(now)],
        intrinsics: [0, 1].map(|eye| intrinsics(&cameras[eye])),
        right_from_left: PoseRecord::from(&(rover_from_right.inverse() * rover_from_left)),
        accepted: update.accepted,
        after_from_before: update
            .after_from_before
            .map(|motion| PoseRecord::from(&in_left(motion.to_pose()))),
        true_after_from_before: PoseRecord::from(&in_left(*truth)),
        inliers: corners.filter_map(inlier).collect(),
    }
}

/// The farther point of a ray at a distance from the origin of its frame, m; none where the ray stays farther away.
fn at_distance_from_origin(ray: &Ray, distance_m: f64) -> Option<Point3> {
    let nearest_m = -ray.origin.coords.dot(&ray.direction);
    let square = nearest_m.powi(2) - ray.origin.coords.norm_squared() + distance_m.powi(2);
    (square >= 0.0).then(|| ray.at(nearest_m + square.sqrt()))
}

/// Focal lengths and centre of a pinhole camera, px.
fn intrinsics(camera: &Camera) -> [f64; 4] {
    let plane = camera.model.image_plane();
    [plane.hs, plane.vs, plane.hc, plane.vc]
}

/// The frame of a pinhole camera: x right, y down, z forward.
fn rover_from_camera(camera: &Camera) -> Pose {
    let (x, z) = (camera.model.horizontal_axis(), camera.model.axis());
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    let turn = UnitQuaternion::from_rotation_matrix(&turn);
    Pose::from_parts(Translation3::from(camera.model.centre().coords), turn)
}

/// The name of a frame's files.
fn frame_name(set: Set, frame: &str) -> String {
    let recording = match set {
        Set::EurocPair => "euroc_pair",
        Set::EurocStill | Set::EurocSpinning => "euroc_still",
        _ => "kitti",
    };
    format!("{recording}_{frame}")
}

impl Recording {
    /// Writes its frames as odometry is given them: 8-bit PNG files `NAME_left.png` and `NAME_right.png`, without distortion.
    ///
    /// # Errors
    /// The folder or a file that cannot be written.
    pub(super) fn write_frames(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.to_owned(), source })?;
        let Some(&(set, ..)) = self.pairs.first() else { return Ok(()) };
        for frame in &self.frames {
            let name = frame_name(set, &frame.name);
            write_png_u8(folder.join(format!("{name}_left.png")), &frame.pair.left)?;
            write_png_u8(folder.join(format!("{name}_right.png")), &frame.pair.right)?;
        }
        Ok(())
    }
}
