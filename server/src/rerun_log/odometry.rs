//! The corners of visual odometry over the left image of a stop, by their fates. No step contains them: the update is
//! computed again for the recording.
//!
//! Corners `before` are where they are in the left image of the stop before; `after` has the matches in that of the stop, and
//! `flow` a line from one to the other. They are below the left image of the pair in which the motion was measured.

use std::collections::BTreeSet;

use rerun::{AsComponents, Clear, LineStrips2D, Points2D, Radius, RecordingStream};
use sightline_geometry::camera::CameraName;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Pixel;
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::{Fate, OdometryCorner};
use sightline_session::step::RunStep;

use super::Logged;
use super::border::point;
use super::images::of_camera;
use super::palette::{INLIER, KEYPOINT, LOST, OUTLIER, PREDICTION, RESIDUAL, Rgb, SECOND_PEAK, color};

/// The pairs in which motions were measured.
pub(super) fn cameras(stops: &dyn Stops) -> BTreeSet<Option<CameraName>> {
    let measured = (0..stops.stop_count()).filter_map(|step| stops.measured_motion(step));
    measured.map(|measured| measured.camera).collect()
}

/// The corners of the update behind a step; `None` where there is none, or where its images cannot be read.
pub(super) fn corners(stops: &dyn Stops, trace: &RunStep) -> Option<Vec<OdometryCorner>> {
    let measured = trace.odometry.as_deref()?;
    Some(measured.again(stops, trace.step, Cancel::default()).ok()?.table)
}

/// Logs the corners over the left image of a pair, or that there are none: those of the stop before, their matches, and lines
/// from one to the other.
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
        Some((strip, color(looks(corner.fate).0)))
    };
    let (strips, colors): (Vec<_>, Vec<_>) = corners.iter().filter_map(line).unzip();
    LineStrips2D::new(strips)
        .with_colors(colors)
        .with_radii([Radius::new_ui_points(0.75)])
        .with_draw_order(21.0)
}

fn points(places: Vec<([f64; 2], Fate)>) -> Points2D {
    Points2D::new(places.iter().map(|(place, _)| at(*place)))
        .with_colors(places.iter().map(|(_, fate)| color(looks(*fate).0)))
        .with_labels(places.iter().map(|(_, fate)| looks(*fate).1))
        .with_show_labels(false)
        .with_radii([Radius::new_ui_points(2.0)])
        .with_draw_order(22.0)
}

fn at([x, y]: [f64; 2]) -> [f32; 2] {
    point(Pixel::new(x, y))
}

/// The colour and the word of a fate.
const fn looks(fate: Fate) -> (Rgb, &'static str) {
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
