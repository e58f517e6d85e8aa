//! The corners of visual odometry over the left image of a stop, by their fates. No step contains them: the update is
//! computed again for the recording.
//!
//! Corners `before` are where they are in the left image of the stop before; `after` has the matches in that of the stop, and
//! `flow` a line from one to the other.

use rerun::{AsComponents, Clear, LineStrips2D, Points2D, Radius, RecordingStream};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Pixel;
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::{Fate, OdometryCorner};
use sightline_session::step::RunStep;

use super::Logged;
use super::border::point;
use super::palette::{INLIER, KEYPOINT, LOST, OUTLIER, PREDICTION, RESIDUAL, Rgb, SECOND_PEAK, color};

/// The corners of the update behind a step; `None` where there is none, or where its images cannot be read.
pub(super) fn corners(stops: &dyn Stops, trace: &RunStep) -> Option<Vec<OdometryCorner>> {
    let measured = trace.odometry.as_deref()?;
    Some(measured.again(stops, trace.step, Cancel::default()).ok()?.table)
}

/// Logs the corners in the left image of the stop before.
pub(super) fn log_before(stream: &RecordingStream, corners: Option<&[OdometryCorner]>) -> Logged {
    let all = corners.map(|all| all.iter().map(|corner| (corner.before_px, corner.fate)).collect());
    log(stream, "/capture/left/odometry/before", all.map(points))
}

/// Logs the matches in the left image of the stop.
pub(super) fn log_after(stream: &RecordingStream, corners: Option<&[OdometryCorner]>) -> Logged {
    let matched = |corner: &OdometryCorner| Some((corner.after_px?, corner.fate));
    let all = corners.map(|all| all.iter().filter_map(matched).collect());
    log(stream, "/capture/left/odometry/after", all.map(points))
}

/// Logs the lines from the corners to their matches.
pub(super) fn log_flow(stream: &RecordingStream, corners: Option<&[OdometryCorner]>) -> Logged {
    let line = |corner: &OdometryCorner| {
        let strip = [corner.before_px, corner.after_px?].map(at);
        Some((strip, color(looks(corner.fate).0)))
    };
    let lines = corners.map(|all| {
        let (strips, colors): (Vec<_>, Vec<_>) = all.iter().filter_map(line).unzip();
        LineStrips2D::new(strips)
            .with_colors(colors)
            .with_radii([Radius::new_ui_points(0.75)])
            .with_draw_order(21.0)
    });
    log(stream, "/capture/left/odometry/flow", lines)
}

fn log<A: AsComponents>(stream: &RecordingStream, path: &str, value: Option<A>) -> Logged {
    match value {
        Some(value) => stream.log(path, &value),
        None => stream.log(path, &Clear::flat()),
    }
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
