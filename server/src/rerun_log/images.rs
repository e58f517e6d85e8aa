//! Stage `capture` and all overlays of its two images.
//!
//! Sizes in pixels are image pixels; line widths are screen points, independent of the zoom.

use rerun::{Boxes2D, LineStrips2D, Radius, RecordingStream};
use sightline_geometry::camera::CameraName;
use sightline_geometry::frames::Pixel;
use sightline_rover::pair::FurtherImages;
use sightline_session::marks::{MarkName, Shape};
use sightline_vision::image::{GrayImage, PixelRect};

use super::Logged;
use super::convert::{corner_frame, dot, ellipse, haloed, outline, plus, png, point};
use super::palette::{MEASUREMENT, PREDICTION, Rgb, SECOND_PEAK, TRUTH, color, faint, of_score, of_state};
use super::step::Step;

/// Half length of the strokes of the ground truth's plus sign, px.
const PLUS_ARM_PX: f64 = 6.0;

/// The left image of the pair used for tracking the target.
pub(super) fn log_left_image(step: &Step<'_>) -> Logged {
    step.log(&of_camera(step.camera(), "left"), step.images.as_ref().and_then(|[left, _]| png(left)))
}

/// The right image of the pair used for tracking the target.
pub(super) fn log_right_image(step: &Step<'_>) -> Logged {
    step.log(&of_camera(step.camera(), "right"), step.images.as_ref().and_then(|[_, right]| png(right)))
}

/// The images of a further camera.
pub(super) fn log_further(stream: &RecordingStream, name: CameraName, images: &FurtherImages) -> Logged {
    let log = |eye: &str, image: &GrayImage| match png(image) {
        Some(png) => stream.log(of_camera(Some(name), eye), &png),
        None => Ok(()),
    };
    log("left", &images.0)?;
    images.1.as_ref().map_or(Ok(()), |right| log("right", right))
}

/// The entity path of an image of the main pair or of a further camera.
pub(super) fn of_camera(camera: Option<CameraName>, eye: &str) -> String {
    camera.map_or_else(|| format!("/capture/{eye}"), |name| format!("/capture/{name}/{eye}"))
}

/// The prediction in the left image.
pub(super) fn log_predicted_left(step: &Step<'_>) -> Logged {
    step.log(
        "/{target}/predict/left",
        at(step, MarkName::PredictedLeft).map(|p| dot(p, PREDICTION, "predicted")),
    )
}

/// The prediction in the right image.
pub(super) fn log_predicted_right(step: &Step<'_>) -> Logged {
    step.log(
        "/{target}/predict/right",
        at(step, MarkName::PredictedRight).map(|p| dot(p, PREDICTION, "predicted")),
    )
}

/// The gate: the prediction's covariance in the left image.
pub(super) fn log_gate(step: &Step<'_>) -> Logged {
    step.log("/{target}/point_mast/gate", lines(step, MarkName::PredictionGate, PREDICTION))
}

/// The subframe.
pub(super) fn log_subframe(step: &Step<'_>) -> Logged {
    let subframe = rect(step, MarkName::Subframe);
    step.log("/{target}/capture/subframe", subframe.map(|rect| frame(&rect, TRUTH, "subframe")))
}

/// The frame of the subframe, which is the origin of the close-up.
pub(super) fn log_subframe_frame(step: &Step<'_>) -> Logged {
    step.log("/{target}/capture/frame", rect(step, MarkName::Subframe).map(|rect| corner_frame(&rect)))
}

/// The outline of the template's window after scale and roll, at its predicted position.
pub(super) fn log_footprint(step: &Step<'_>) -> Logged {
    step.log("/{target}/locate/scale_roll/footprint", lines(step, MarkName::PredictedWindow, PREDICTION))
}

/// The search window.
pub(super) fn log_search_window(step: &Step<'_>) -> Logged {
    let window = rect(step, MarkName::SearchWindow).map(|rect| frame(&rect, PREDICTION, "search window"));
    step.log("/{target}/locate/match_template/window", window)
}

/// The matched window, in the colour of the state.
pub(super) fn log_matched_window(step: &Step<'_>) -> Logged {
    let rgb = of_state(step.trace.update.state);
    step.log("/{target}/locate/match_template/matched_window", lines(step, MarkName::MatchedWindow, rgb))
}

/// The position of the match.
pub(super) fn log_peak(step: &Step<'_>) -> Logged {
    let peak = at(step, MarkName::Peak).map(|pixel| dot(pixel, MEASUREMENT, step.label));
    step.log("/{target}/locate/match_template/peak", peak)
}

/// The second peak.
pub(super) fn log_second_peak(step: &Step<'_>) -> Logged {
    let second = at(step, MarkName::SecondPeak).map(|pixel| dot(pixel, SECOND_PEAK, "second peak"));
    step.log("/{target}/locate/match_template/second_peak", second)
}

/// The error ellipses of the located left position (R180).
pub(super) fn log_left_covariance(step: &Step<'_>) -> Logged {
    step.log("/{target}/locate/left_covariance", lines(step, MarkName::LocatedError, MEASUREMENT))
}

/// The searched part of the epipolar curve, coloured by score.
pub(super) fn log_curve(step: &Step<'_>) -> Logged {
    let curve = step.mark(MarkName::Curve).and_then(|shape| match shape {
        Shape::Curve(points) => Some(points),
        _ => None,
    });
    step.log(
        "/{target}/locate/point_stereo/curve",
        curve.map(|points| {
            let pairs = || points.windows(2);
            LineStrips2D::new(pairs().map(|p| [point(p[0].0), point(p[1].0)]))
                .with_colors(pairs().map(|p| p[0].1.map_or(faint(TRUTH, 60), |s| color(of_score(s)))))
                .with_radii([Radius::new_ui_points(1.5)])
                .with_draw_order(20.0)
        }),
    )
}

/// The corresponding point in the right image.
pub(super) fn log_right_match(step: &Step<'_>) -> Logged {
    let matched = at(step, MarkName::StereoMatch).map(|pixel| dot(pixel, MEASUREMENT, step.label));
    step.log("/{target}/locate/point_stereo/match", matched)
}

/// The ground truth in the left image.
pub(super) fn log_true_left(step: &Step<'_>) -> Logged {
    let pixel = at(step, MarkName::TrueLeft);
    step.log("/truth/{target}/left", pixel.map(|pixel| haloed(&plus(pixel, PLUS_ARM_PX), TRUTH)))
}

/// The position of a mark.
fn at(step: &Step<'_>, name: MarkName) -> Option<Pixel> {
    match step.mark(name)? {
        Shape::Point(pixel) => Some(*pixel),
        _ => None,
    }
}

/// The rectangle of a mark.
fn rect(step: &Step<'_>, name: MarkName) -> Option<PixelRect> {
    match step.mark(name)? {
        Shape::Rect(rect) => Some(*rect),
        _ => None,
    }
}

/// The outlines of a mark; `None` if its covariance is not finite.
fn lines(step: &Step<'_>, name: MarkName, rgb: Rgb) -> Option<LineStrips2D> {
    let strips = match step.mark(name)? {
        Shape::Outline(corners) => vec![outline(corners.iter().copied())],
        Shape::Ellipse { centre, covariance_px2, sigmas } => {
            let contour = |sigmas: &f64| ellipse(*centre, covariance_px2, *sigmas);
            sigmas.iter().map(contour).collect::<Option<Vec<_>>>()?
        }
        _ => return None,
    };
    Some(haloed(&strips, rgb))
}

/// A rectangle of whole pixels.
fn frame(rect: &PixelRect, rgb: Rgb, label: &str) -> Boxes2D {
    let corner = point(Pixel::new(f64::from(rect.x) - 0.5, f64::from(rect.y) - 0.5));
    Boxes2D::from_mins_and_sizes([corner], [[rect.width as f32, rect.height as f32]])
        .with_colors([color(rgb)])
        .with_radii([Radius::new_ui_points(0.75)])
        .with_labels([label])
        .with_show_labels(false)
        .with_draw_order(15.0)
}
