//! Stage `capture` and all that is drawn over its two images.
//!
//! Sizes in pixels are those of the image; pens are in screen points, so that a line is as thin at any zoom.

use nalgebra::Matrix2;
use rerun::{Boxes2D, LineStrips2D, Radius};
use sightline_geometry::frames::Pixel;
use sightline_track::locate::features::rows::moved_covariance_px2;
use sightline_track::locate::shape_tracker::rows::registered_covariance_px2;
use sightline_vision::image::PixelRect;

use super::Logged;
use super::border::{corner_frame, dot, ellipse, haloed, plus, png, point, square};
use super::palette::{MEASUREMENT, PREDICTION, Rgb, SECOND_PEAK, TRUTH, color, faint, of_score, of_state};
use super::step::Step;

/// How many standard deviations the ellipses on the images show.
const SIGMAS: f64 = 3.0;

/// Arm of the truth's plus sign, px.
const PLUS_ARM_PX: f64 = 6.0;

/// The left image.
pub(super) fn log_left_image(step: &Step<'_>) -> Logged {
    step.log("/capture/left", step.images.as_ref().and_then(|[left, _]| png(left)))
}

/// The right image.
pub(super) fn log_right_image(step: &Step<'_>) -> Logged {
    step.log("/capture/right", step.images.as_ref().and_then(|[_, right]| png(right)))
}

/// The prediction in the left image.
pub(super) fn log_predicted_left(step: &Step<'_>) -> Logged {
    let pixel = step.predicted().and_then(|pointing| pointing.predicted_left);
    step.log("/{target}/predict/left", pixel.map(|p| dot(p, PREDICTION, "predicted")))
}

/// The prediction in the right image.
pub(super) fn log_predicted_right(step: &Step<'_>) -> Logged {
    let pixel = step.predicted().and_then(|pointing| pointing.predicted_right);
    step.log("/{target}/predict/right", pixel.map(|p| dot(p, PREDICTION, "predicted")))
}

/// The gate: the prediction's covariance in the left image.
pub(super) fn log_gate(step: &Step<'_>) -> Logged {
    let strip = step
        .predicted()
        .and_then(|pointing| ellipse(pointing.predicted_left?, &pointing.predicted_covariance_px2?, SIGMAS));
    step.log("/{target}/point_mast/gate", strip.map(|s| haloed(&[s], PREDICTION)))
}

/// The subframe.
pub(super) fn log_subframe(step: &Step<'_>) -> Logged {
    let subframe = step.trace.capture().and_then(|capture| capture.subframe);
    step.log("/{target}/capture/subframe", subframe.map(|rect| frame(&rect, TRUTH, "subframe")))
}

/// The frame of the subframe, from which the close-up looks.
pub(super) fn log_subframe_frame(step: &Step<'_>) -> Logged {
    let subframe = step.trace.capture().and_then(|capture| capture.subframe);
    step.log("/{target}/capture/frame", subframe.map(|rect| corner_frame(&rect)))
}

/// What the template's window became by scale and roll, where it is expected.
pub(super) fn log_footprint(step: &Step<'_>) -> Logged {
    let prepared = step.template().and_then(|e| e.scale_roll.as_ref());
    let strip = prepared.zip(step.predicted().and_then(|p| p.predicted_left)).map(|(prepared, centre)| {
        square(centre, prepared.reference.width(), &prepared.prepared_from_template())
    });
    step.log("/{target}/locate/scale_roll/footprint", strip.map(|s| haloed(&[s], PREDICTION)))
}

/// The search window.
pub(super) fn log_search_window(step: &Step<'_>) -> Logged {
    let window = step.matched().map(|matched| frame(&matched.search_window, PREDICTION, "search window"));
    step.log("/{target}/locate/match_template/window", window)
}

/// The window that was compared with the template, in the colour of the state.
pub(super) fn log_matched_window(step: &Step<'_>) -> Logged {
    let rgb = of_state(step.trace.update.state);
    let strip = step.matched().map(|m| square(m.pixel, m.matched.width(), &Matrix2::identity()));
    step.log("/{target}/locate/match_template/matched_window", strip.map(|s| haloed(&[s], rgb)))
}

/// The match.
pub(super) fn log_peak(step: &Step<'_>) -> Logged {
    let peak = step.matched().map(|matched| dot(matched.pixel, MEASUREMENT, step.label));
    step.log("/{target}/locate/match_template/peak", peak)
}

/// The next best match.
pub(super) fn log_second_peak(step: &Step<'_>) -> Logged {
    let second = step.matched().and_then(|matched| matched.second_peak.as_ref());
    let second = second.map(|second| dot(second.pixel, SECOND_PEAK, "second peak"));
    step.log("/{target}/locate/match_template/second_peak", second)
}

/// The error of the located left position, bias included; that of a position by features or by shape at 1, 2 and 3 σ (R180).
pub(super) fn log_left_covariance(step: &Step<'_>) -> Logged {
    let strips = step.trace.located().and_then(|located| {
        let pixel = located.left_pixel?;
        let camera = &step.trace.point_mast.left;
        let moved =
            moved_covariance_px2(located, camera).or_else(|| registered_covariance_px2(located, camera));
        match moved {
            Some(moved) => {
                [1.0, 2.0, SIGMAS].map(|sigmas| ellipse(pixel, &moved, sigmas)).into_iter().collect()
            }
            None => Some(vec![ellipse(pixel, &located.left_error.mean_square_px2(), SIGMAS)?]),
        }
    });
    step.log("/{target}/locate/left_covariance", strips.map(|s: Vec<_>| haloed(&s, MEASUREMENT)))
}

/// The searched part of the epipolar curve, coloured by score.
pub(super) fn log_curve(step: &Step<'_>) -> Logged {
    let stereo = step.template().and_then(|e| e.point_stereo.as_ref());
    step.log(
        "/{target}/locate/point_stereo/curve",
        stereo.map(|stereo| {
            let pairs = || stereo.curve.windows(2);
            LineStrips2D::new(pairs().map(|p| [point(p[0].pixel), point(p[1].pixel)]))
                .with_colors(pairs().map(|p| p[0].score.map_or(faint(TRUTH, 60), |s| color(of_score(s)))))
                .with_radii([Radius::new_ui_points(1.5)])
                .with_draw_order(20.0)
        }),
    )
}

/// The corresponding point in the right image.
pub(super) fn log_right_match(step: &Step<'_>) -> Logged {
    let stereo = step.template().and_then(|e| e.point_stereo.as_ref());
    step.log(
        "/{target}/locate/point_stereo/match",
        stereo.map(|s| dot(s.right_pixel, MEASUREMENT, step.label)),
    )
}

/// The truth in the left image.
pub(super) fn log_true_left(step: &Step<'_>) -> Logged {
    let pixel = step.trace.truth.as_ref().and_then(|truth| truth.left_pixel);
    step.log("/truth/{target}/left", pixel.map(|p: Pixel| haloed(&plus(p, PLUS_ARM_PX), TRUTH)))
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
