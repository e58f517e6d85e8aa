//! A jump of the pose estimate: a change of heading or direction that no earlier step of the drive has and that moves the
//! target out of the search window. No truth is used.
//!
//! ```text
//! │x_s − m│ > max(6 s, 2 d, x_min)      m, d: median and largest deviation of x at up to eight earlier steps
//! s² = (1.4826 MAD)² + σ²               MAD of the same values; σ by the error model of the pose estimates
//! ```
//! x is the change of yaw, or the direction of the translation in the rover frame of the previous stop. A rover on an arc
//! moves along the chord, whose direction is half the change of yaw: a change of yaw without that direction is not a turn of
//! the rover. With the usual value in place of x_s the target would be predicted elsewhere: the jump is a cause only if that
//! position is outside the searched positions.

use nalgebra::{Rotation3, Vector3};
use sightline_geometry::frames::{Pixel, Pose, attitude_from_roll_pitch_yaw};

use super::Book;
use super::pose_change::components;
use crate::step::RunStep;
use sightline_vision::image::PixelRect;

/// Maximum number of earlier steps for comparison.
const HISTORY: usize = 8;
/// Minimum number of earlier steps for comparison.
const HISTORY_MIN: usize = 2;
/// Minimum deviation of a jump, in robust standard deviations.
const SPREADS: f64 = 6.0;
/// Minimum deviation of the yaw change that counts as a jump, deg.
const YAW_MIN_DEG: f64 = 1.5;
/// Minimum deviation of the direction that counts as a jump, deg.
const DIRECTION_MIN_DEG: f64 = 8.0;
/// Ratio of chord direction to yaw change below which the rover drove straight; on an arc it is 0.5.
const CHORD_SHARE: f64 = 0.4;
/// Minimum translation with a direction, m.
const WAY_MIN_M: f64 = 0.02;

/// The quantity that jumped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Jumped {
    /// The heading, while the rover drove straight.
    Heading,
    /// The position, sideways.
    Position,
}

/// A jump of the pose estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jump {
    /// The stop at which the estimate jumps.
    pub(super) stop: usize,
    /// The quantity that jumps.
    pub(super) jumped: Jumped,
    /// Deviation from the usual change: deg for the heading, m for the position; positive to the right.
    pub(super) by: f64,
    /// The largest deviation at the earlier steps, in the unit of `by`.
    pub(super) usual: f64,
    /// Distance between the predictions with and without the jump, px; `None` if the latter is outside the camera's view.
    pub(super) shift_px: Option<f64>,
}

/// The pose change of one step.
#[derive(Clone, Copy)]
struct Change {
    before_from_after: Pose,
    way_m: f64,
    yaw_deg: f64,
    /// Direction of the horizontal translation, deg; `None` below `WAY_MIN_M`.
    direction_deg: Option<f64>,
}

impl Change {
    fn to(book: &Book<'_>, stop: usize) -> Self {
        let [before, after] = [stop - 1, stop].map(|stop| book.sources.site_from_rover(stop));
        let before_from_after = before.inverse() * after;
        let [x, y, .., yaw_deg] = components(&before_from_after);
        let way_m = x.hypot(y);
        let direction_deg = (way_m >= WAY_MIN_M).then(|| y.atan2(x).to_degrees());
        Self { before_from_after, way_m, yaw_deg, direction_deg }
    }
}

/// The median of the earlier values, their robust standard deviation and their largest deviation.
struct Usual {
    median: f64,
    spread: f64,
    largest: f64,
}

impl Usual {
    fn of(values: &[f64], sigma: f64) -> Option<Self> {
        (values.len() >= HISTORY_MIN).then(|| {
            let median = median(values.to_vec());
            let off: Vec<f64> = values.iter().map(|value| (value - median).abs()).collect();
            let largest = off.iter().copied().fold(0.0, f64::max);
            Self { median, spread: sigma.hypot(1.4826 * self::median(off)), largest }
        })
    }

    /// The deviation of a value from the median; `None` if it is usual.
    fn outlier(&self, value: f64, least: f64) -> Option<f64> {
        let off = within_half_turn(value - self.median);
        (off.abs() > least.max(SPREADS * self.spread) && off.abs() > 2.0 * self.largest).then_some(off)
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len().is_multiple_of(2) { (values[middle - 1] + values[middle]) / 2.0 } else { values[middle] }
}

fn within_half_turn(deg: f64) -> f64 {
    (deg + 180.0).rem_euclid(360.0) - 180.0
}

/// Finds the first jump since the last accepted update that moves the target out of the searched positions.
pub(super) fn find(book: &Book<'_>, rejected_before: usize) -> Option<Jump> {
    let step = book.trace.step;
    let is_corrected = book.trace.odometry.as_ref().is_some_and(|measured| measured.corrects);
    if book.prediction_px.is_some() || is_corrected {
        return None;
    }
    let first = step.saturating_sub(rejected_before).max(book.trace.update.target.designation.step + 1);
    (first..=step).find_map(|stop| {
        let (jumped, by, usual, without) = at_stop(book, stop)?;
        if jumped == Jumped::Heading && is_turn_by_vision(book, stop, by) {
            return None;
        }
        let shift_px = effect(book, stop, &without)?;
        Some(Jump { stop, jumped, by, usual, shift_px })
    })
}

/// Whether the pose change of this step is like those of the earlier steps.
pub(super) fn is_usual(book: &Book<'_>) -> bool {
    book.trace.step < 1 || at_stop(book, book.trace.step).is_none()
}

/// The jump at a stop: the quantity, its deviation, the largest usual deviation, and the pose change without the jump.
fn at_stop(book: &Book<'_>, stop: usize) -> Option<(Jumped, f64, f64, Pose)> {
    let change = Change::to(book, stop);
    let earlier: Vec<Change> =
        (stop.saturating_sub(HISTORY).max(1)..stop).map(|stop| Change::to(book, stop)).collect();
    let error = book.sources.pose_error();
    let yaws: Vec<f64> = earlier.iter().map(|change| change.yaw_deg).collect();
    let directions: Vec<f64> = earlier.iter().filter_map(|change| change.direction_deg).collect();
    let usual_yaw = Usual::of(&yaws, error.attitude_deg)?;
    let usual_direction = Usual::of(&directions, error.across_fraction.atan().to_degrees())?;
    let aside_deg = within_half_turn(change.direction_deg? - usual_direction.median);
    let translation = change.before_from_after.translation;
    if let Some(by) = usual_yaw.outlier(change.yaw_deg, YAW_MIN_DEG) {
        let without =
            change.before_from_after.rotation * attitude_from_roll_pitch_yaw(0.0, 0.0, -by.to_radians());
        let is_straight = aside_deg.abs() < CHORD_SHARE * by.abs();
        return is_straight
            .then(|| (Jumped::Heading, by, usual_yaw.largest, Pose::from_parts(translation, without)));
    }
    let off = usual_direction.outlier(change.direction_deg?, DIRECTION_MIN_DEG)?.to_radians();
    let back = Rotation3::from_axis_angle(&Vector3::z_axis(), -off) * translation.vector;
    let aside_m = |angle: f64| change.way_m * angle.sin();
    let without = Pose::from_parts(back.into(), change.before_from_after.rotation);
    Some((Jumped::Position, aside_m(off), aside_m(usual_direction.largest.to_radians()), without))
}

/// Whether visual odometry, which did not correct the pose, confirms the estimated turn.
fn is_turn_by_vision(book: &Book<'_>, stop: usize, by_deg: f64) -> bool {
    let measured = book.trace.odometry.as_deref().filter(|_| stop == book.trace.step);
    let motion = measured.and_then(|measured| measured.update.after_from_before);
    motion.is_some_and(|motion| {
        let [.., seen_deg] = components(&motion.to_pose().inverse());
        let [.., estimated_deg] = components(&Change::to(book, stop).before_from_after);
        (seen_deg - estimated_deg).abs() < by_deg.abs() / 2.0
    })
}

/// The distance between the predictions with and without the jump, px. `None` if the latter was searched; the inner `None`
/// if it is out of the camera's view.
fn effect(book: &Book<'_>, stop: usize, without: &Pose) -> Option<Option<f64>> {
    let trace = book.trace;
    let (predicted, prediction) = (trace.point_mast.predicted_left?, trace.prediction()?);
    let [before, at, now] = [stop - 1, stop, trace.step].map(|stop| book.sources.site_from_rover(stop));
    let site_from_rover = before * without * at.inverse() * now;
    let there = site_from_rover.inverse() * prediction.position_in_site;
    let Some(pixel) = trace.point_mast.left.project(&there) else { return Some(None) };
    is_outside(trace, book.settings.template.template_size_px, pixel)?
        .then_some(Some(predicted.distance(pixel)))
}

/// Whether a pixel is outside the positions at which the template was compared; `None` if nothing was compared.
pub(super) fn is_outside(trace: &RunStep, template_size_px: u32, pixel: Pixel) -> Option<bool> {
    let window = trace.template()?.match_template.as_ref()?.search_window;
    let half = f64::from(template_size_px / 2);
    let PixelRect { x, y, width, height } = window;
    let out = |at: f64, start: i32, length: u32| {
        at < f64::from(start) + half || at > f64::from(start) + f64::from(length) - 1.0 - half
    };
    Some(out(pixel.x, x, width) || out(pixel.y, y, height))
}
