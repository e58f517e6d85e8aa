//! The map: rover and target in the site frame.
//!
//! Everything is placed with the *estimated* pose of the stop, including the true target: its true position in the rover
//! frame is transformed to the site frame with the same pose as the estimate. The gap between the two is therefore `err_m`,
//! without the drift of the site frame.

use nalgebra::Matrix3;
use rerun::{LineStrips3D, Radius, RecordingStream, TransformAxes3D, ViewCoordinates};
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3, Vector3};
use sightline_rover::pipeline::Stops;

use super::convert::{dot_3d, point_3d, transform};
use super::palette::{MEASUREMENT, PREDICTION, ROVER, Rgb, TRUTH, color, of_state};
use super::step::Step;
use super::{Logged, shape};

/// Length of the drawn camera pyramids, m.
const FRUSTUM_M: f64 = 0.8;

/// Length of the drawn axes of the rover, m.
const AXES_M: f32 = 0.5;

/// Points along each image edge, so that the pyramid of a fisheye camera has its curved base.
const EDGE_POINTS: u32 = 8;

/// Initial viewpoint of the map.
pub(super) struct Outlook {
    /// Position of the viewer's eye, site frame, m.
    pub(super) eye: Point3,
    /// Point in the centre of the view, site frame, m.
    pub(super) target: Point3,
}

impl Outlook {
    /// Behind, above and beside the first stop, with path and target in view.
    pub(super) fn over(stops: &dyn Stops, target_in_site: &Point3) -> Self {
        let start = Point3::from(stops.site_from_rover(0).translation.vector);
        let ahead = target_in_site - start;
        let extent_m = ahead.norm().max(1.0);
        let forward = Vector3::new(ahead.x, ahead.y, 0.0).try_normalize(1e-9).unwrap_or_else(Vector3::x);
        let right = Vector3::new(-forward.y, forward.x, 0.0);
        let eye = start + (right * 0.5 - forward * 0.15 - Vector3::z() * 0.5) * extent_m;
        Self { eye, target: start + ahead * 0.6 }
    }
}

/// The axes of the site frame: x north (forward), y east (right), z down.
pub(super) fn log_site_axes(stream: &RecordingStream) -> Logged {
    stream.log_static("/", &ViewCoordinates::FRD())
}

/// The driven path: the estimated positions of all stops.
pub(super) fn log_path(stream: &RecordingStream, stops: &dyn Stops) -> Logged {
    let strip =
        (0..stops.stop_count()).map(|step| point_3d(&stops.site_from_rover(step).translation.vector.into()));
    let line = LineStrips3D::new([strip.collect::<Vec<_>>()])
        .with_colors([color(ROVER)])
        .with_radii([Radius::new_ui_points(1.0)]);
    stream.log_static("/rover/path", &line)
}

/// The rover's estimated pose, with axes of constant length.
pub(super) fn log_pose(stream: &RecordingStream, stops: &dyn Stops, step: usize) -> Logged {
    if step == 0 {
        stream.log_static("/rover/pose", &TransformAxes3D::new(AXES_M))?;
    }
    stream.log("/rover/pose", &transform(&stops.site_from_rover(step)))
}

/// The left camera's pyramid, in the rover frame.
pub(super) fn log_left_frustum(stream: &RecordingStream, stops: &dyn Stops, step: usize) -> Logged {
    stream.log("/rover/pose/left", &frustum(stops.cameras(step).0, PREDICTION))
}

/// The right camera's pyramid, in the rover frame.
pub(super) fn log_right_frustum(stream: &RecordingStream, stops: &dyn Stops, step: usize) -> Logged {
    stream.log("/rover/pose/right", &frustum(stops.cameras(step).1, ROVER))
}

/// The pyramids of the further cameras, in the rover frame.
pub(super) fn log_further_frusta(stream: &RecordingStream, stops: &dyn Stops, step: usize) -> Logged {
    stops.further_cameras(step).iter().try_for_each(|camera| {
        let path = |eye: &str| format!("/rover/pose/{}/{eye}", camera.name);
        stream.log(path("left"), &frustum(camera.left, PREDICTION))?;
        camera.right.map_or(Ok(()), |right| stream.log(path("right"), &frustum(right, ROVER)))
    })
}

/// The predicted position.
pub(super) fn log_predicted_position(step: &Step<'_>) -> Logged {
    let point = step.trace.prediction().map(|p| dot_3d(p.position_in_site, PREDICTION, "predicted"));
    step.log("/{target}/predict/position", point)
}

/// The covariance of the prediction.
pub(super) fn log_predicted_covariance(step: &Step<'_>) -> Logged {
    let predict = step.trace.prediction();
    let found = predict.and_then(|p| step.spread(&p.position_in_rover, &p.covariance_in_rover, PREDICTION));
    step.log("/{target}/predict/covariance", found)
}

/// The triangulated position, accepted or not.
pub(super) fn log_triangulated_position(step: &Step<'_>) -> Logged {
    let found = step.template().and_then(|e| e.triangulate.as_ref());
    let point = found.map(|t| dot_3d(step.in_site(&t.position_in_rover), MEASUREMENT, "triangulated"));
    step.log("/{target}/locate/triangulate/position", point)
}

/// The covariance of the triangulated position.
pub(super) fn log_triangulated_covariance(step: &Step<'_>) -> Logged {
    let found = step.template().and_then(|e| e.triangulate.as_ref());
    let found = found.and_then(|t| step.spread(&t.position_in_rover, &t.covariance_in_rover, MEASUREMENT));
    step.log("/{target}/locate/triangulate/covariance", found)
}

/// The position transformed by the motion of the scene, accepted or not.
pub(super) fn log_moved_position(step: &Step<'_>) -> Logged {
    let point = moved(step).map(|(at, _)| dot_3d(step.in_site(&at), MEASUREMENT, "moved"));
    step.log("/{target}/locate/bootstrap/position", point)
}

/// The covariance of the position transformed by the motion.
pub(super) fn log_moved_covariance(step: &Step<'_>) -> Logged {
    let found = moved(step).and_then(|(at, covariance)| step.spread(&at, &covariance, MEASUREMENT));
    step.log("/{target}/locate/bootstrap/covariance", found)
}

/// Position and covariance of a target transformed by the motion, rover frame.
fn moved(step: &Step<'_>) -> Option<(Point3, Matrix3<f64>)> {
    let located = step.features()?.bootstrap.as_ref().and(step.trace.located())?;
    if shape::registered(step.trace).is_some() {
        return None;
    }
    located.position_in_rover.zip(located.covariance_in_rover)
}

/// The target after the step's update, in the colour of its state.
pub(super) fn log_position(step: &Step<'_>) -> Logged {
    let updated = &step.trace.update;
    let position = step.in_site(&updated.target.position_in_rover);
    let point = dot_3d(position, of_state(updated.state), step.label);
    step.log("/{target}/update/position", Some(point))
}

/// The true position of the target.
pub(super) fn log_true_position(step: &Step<'_>) -> Logged {
    let truth = step.trace.truth.as_ref();
    let point = truth.map(|t| dot_3d(step.in_site(&t.position_in_rover), TRUTH, "truth"));
    step.log("/truth/{target}/position", point)
}

/// The viewing pyramid of an image, along the camera's true rays instead of those of a pinhole.
fn frustum(camera: &Camera, rgb: Rgb) -> LineStrips3D {
    let (w, h) = (f64::from(camera.width()), f64::from(camera.height()));
    let corners = [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)];
    let reach = |(x, y): (f64, f64)| {
        camera
            .ray(Pixel::new(x - 0.5, y - 0.5))
            .map(|ray| [point_3d(&ray.origin), point_3d(&ray.at(FRUSTUM_M))])
    };
    let edges = (0..corners.len()).flat_map(|i| {
        let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
        (0..EDGE_POINTS).map(move |k| {
            let t = f64::from(k) / f64::from(EDGE_POINTS);
            (a.0 + (b.0 - a.0) * t, a.1 + (b.1 - a.1) * t)
        })
    });
    let mut base: Vec<[f32; 3]> = edges.filter_map(reach).map(|[_, end]| end).collect();
    base.extend(base.first().copied());
    let sides = corners.into_iter().filter_map(reach).map(Vec::from);
    LineStrips3D::new(sides.chain([base])).with_colors([color(rgb)]).with_radii([Radius::new_ui_points(0.75)])
}
