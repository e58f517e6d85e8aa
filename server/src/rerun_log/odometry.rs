//! The corners of visual odometry over the left image of a stop, coloured by fate. Steps do not contain them: the update is
//! recomputed for the recording.
//!
//! `before` contains the corners in the left image of the previous stop, `after` their matches in that of the current stop,
//! and `flow` a line from one to the other. They are below the left image of the pair that measured the motion.

use std::collections::BTreeSet;

use rerun::{AsComponents, Clear, LineStrips2D, Points2D, Radius, RecordingStream};
use sightline_geometry::camera::CameraName;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Pixel;
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::{Fate, OdometryCorner};
use sightline_session::step::RunStep;

use super::Logged;
use super::convert::point;
use super::images::of_camera;
use super::palette::{INLIER, KEYPOINT, LOST, OUTLIER, PREDICTION, RESIDUAL, Rgb, SECOND_PEAK, color};

/// The pairs that measured motions.
pub(super) fn cameras(stops: &dyn Stops) -> BTreeSet<Option<CameraName>> {
    let measured = (0..stops.stop_count()).filter_map(|step| stops.measured_motion(step));
    measured.map(|measured| measured.camera).collect()
}

/// The corners of a step's odometry update; `None` without one, or if its images cannot be read.
pub(super) fn corners(stops: &dyn Stops, trace: &RunStep) -> Option<Vec<OdometryCorner>> {
    let measured = trace.odometry.as_deref()?;
    Some(measured.again(stops, trace.step, Cancel::default()).ok()?.table)
}

/// Logs the corners over the left image of a pair: those of the previous stop, their matches, and lines between them.
/// Without corners, clears the entities.
pub(super) fn log(
    stream: &RecordingStream,
    camera: Option<CameraName>,
    corners: Option<&[OdometryCorner]>,
) -> Logged {
    let before =
        corners.map(|all| points(all.iter().map(|corner| (corner.before_px, corner.fate)).collect()));
    log_part(stream, camera, "before", before)?;
    let matched = |corner: &OdometryCorner| Some((corner.after_px?, corner.fate));
    log_part(stream, camera, "after", corners.map(|all| points(all.iter().filter_map(matched).collect())))?;
    log_part(stream, camera, "flow", corners.map(flow))
}

fn log_part<A: AsComponents>(
    stream: &RecordingStream,
    camera: Option<CameraName>,
    part: &str,
    value: Option<A>,
) -> Logged {
    let path = format!("{}/odometry/{part}", of_camera(camera, "left"));
    match value {
        Some(value) => stream.log(path, &value),
        None => stream.log(path, &Clear::flat()),
    }
}

/// Lines from the corners to their matches.
fn flow(corners: &[OdometryCorner]) -> LineStrips2D {
    let line = |corner: &OdometryCorner| {
        let strip = [corner.before_px, corner.after_px?].map(at);
        Some((strip, color(appearance(corner.fate).0)))
    };
    let (strips, colors): (Vec<_>, Vec<_>) = corners.iter().filter_map(line).unzip();
    LineStrips2D::new(strips)
        .with_colors(colors)
        .with_radii([Radius::new_ui_points(0.75)])
        .with_draw_order(21.0)
}

fn points(corners: Vec<([f64; 2], Fate)>) -> Points2D {
    Points2D::new(corners.iter().map(|(position, _)| at(*position)))
        .with_colors(corners.iter().map(|(_, fate)| color(appearance(*fate).0)))
        .with_labels(corners.iter().map(|(_, fate)| appearance(*fate).1))
        .with_show_labels(false)
        .with_radii([Radius::new_ui_points(2.0)])
        .with_draw_order(22.0)
}

fn at([x, y]: [f64; 2]) -> [f32; 2] {
    point(Pixel::new(x, y))
}

/// The colour and label of a fate.
const fn appearance(fate: Fate) -> (Rgb, &'static str) {
    match fate {
        Fate::Inlier => (INLIER, "inlier"),
        Fate::Outlier => (OUTLIER, "outlier"),
        Fate::Unused => (LOST, "matched, no motion"),
        Fate::NoMatch => (RESIDUAL, "no match"),
        Fate::OutOfView => (PREDICTION, "out of view"),
        Fate::NoStereoAfter => (SECOND_PEAK, "no stereo after"),
        Fate::NoStereo => (KEYPOINT, "no stereo before"),
        Fate::OutOfRange => (KEYPOINT, "out of range"),
    }
}
