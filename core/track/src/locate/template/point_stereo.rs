//! Step `point_stereo`: matches the target in the right image, along the epipolar curve (K§4.4, R73–R76).
//!
//! The left pixel's ray, sampled by range, projects into the right image as a curve; with real camera models it is
//! not an image row (E38). Along that curve, and up to the tolerance to either side of it, the left window is
//! compared with right windows by normalised correlation (R76). Each right window is resampled through `A =
//! ∂right/∂left` at the candidate's range, so that cameras rotated against each other still see the same patch; for
//! two parallel cameras A is the identity. The best position is refined by a quadratic fit along and across the
//! curve, and then moved to the next maximum of scores that weight the window's centre most (`correlate::focus`).
//!
//! For two cameras side by side, the searched interval is one of disparity, `disparity_range_px` wide and centred on
//! the predicted range (R74, R75, E13); otherwise, and at the designation, it is the whole curve. The slope of the
//! surface (how the right position moves with the left one) is measured by the same search at four neighbours: it
//! propagates an error of the left pixel to the range. With `surface_warp` the windows near the best position are
//! compared again, resampled for that surface; the better score wins. If the neighbours give no slope, as on a narrow
//! face, that of an earlier stop is used, carried by the poses. `stereo_search` compares the windows.
//!
//! **Left–right check.** The right pixel is matched in the left image in the same way, with the cameras exchanged and
//! the surface seen from the other side. The distance of that match from the first pixel is recorded: a wrong match
//! seldom returns to it. It becomes a gate with `left_right_max_px`. **Disparity** is the arc length from the image
//! of a point at infinity; for two parallel cameras it is the difference of the columns.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | curve parameter | arc length from the far end | px in the right image |
//! | A | `right_from_left` | px per px |

use nalgebra::{Matrix2, RowVector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::failure::TemplateFailure;
use super::match_noise::match_noise;
use super::settings::{DisparityInterval, StereoReference, TemplateSettings};
use super::stereo_curve::{Curve, CurveInput};
pub use super::stereo_input::{CurvePoint, StereoInput};
use super::stereo_search::{Best, StereoTemplate, Windows};
use crate::array_name::ArrayName;
use sightline_geometry::frames::Pixel;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_record::{ArrayKind, Declaration, Record, Unit, Unsent};
use sightline_vision::correlate::Focus;
use sightline_vision::image::patch::{self, Patch};
use sightline_vision::image::resample;

/// Distance of the neighbours from which the slope is measured, px in the left image.
const SLOPE_BASE_PX: f64 = 8.0;

/// Largest distance along the curve between a neighbour's match and the target's, px.
const SLOPE_REACH_PX: f64 = 5.0;

/// Smallest score of a neighbour that is used for the slope.
const SLOPE_SCORE_MIN: f32 = 0.6;

/// The corresponding point in the right image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PointStereo {
    /// The part of the epipolar curve that was searched, far end first, about a pixel apart.
    pub curve: Vec<CurvePoint>,
    /// The best position, px.
    pub right_pixel: Pixel,
    /// Score of the best position.
    pub score: f64,
    /// Its range along the left ray on the curve, m.
    pub range_m: f64,
    /// Disparity: arc length from the image of a point at infinity, px; null if that is not visible.
    #[serde(default)]
    pub disparity_px: Option<f64>,
    /// Signed distance from the curve, px.
    pub across_px: f64,
    /// Distance between the left pixel and the match of the right one in the left image, px; null without such a match.
    #[serde(default)]
    pub left_right_px: Option<f64>,
    /// Whether the best position is at an end of the searched interval.
    pub at_end: bool,
    /// Covariance of the right position for a given left one, px².
    #[schema(value_type = Vec<f64>)]
    pub covariance_px2: Matrix2<f64>,
    /// Derivative of the right position with respect to the left one on the target's surface, px per px.
    #[schema(value_type = Vec<f64>)]
    pub right_from_left: Matrix2<f64>,
    /// The right image at the match, resampled to the left view.
    #[serde(skip)]
    #[schema(ignore)]
    pub right_window: Unsent<Patch>,
}

/// Largest accepted stretch of the window by a slope, px per px.
pub(super) const STRETCH_LIMIT: f64 = 1.0;

/// Matches the left pixel in the right image.
///
/// # Errors
/// Why there is nothing to compare.
pub fn point_stereo(
    input: &StereoInput<'_>,
    settings: &TemplateSettings,
) -> Result<PointStereo, TemplateFailure> {
    let half = settings.template_size_px / 2;
    let patch = patch::extract(input.left_image, input.left_pixel, half, settings.kernel);
    let focus = Focus::new(settings.template_size_px, settings.focus_px);
    let template = StereoTemplate::new(patch, &focus).ok_or(TemplateFailure::StereoWindowOutside)?;
    let curve = curve(input, settings).ok_or(TemplateFailure::RayUnseen)?;
    let interval = search_interval(&curve, input, settings)?;
    let facing = Windows {
        curve: &curve,
        template: &template,
        input,
        slope: RowVector2::zeros(),
        tolerance_px: settings.epipolar_tolerance_px,
        settings,
    };
    let (points, best) = facing.search(interval);
    let best = best.map(|best| facing.in_focus(interval, best)).ok_or(TemplateFailure::NoStereoWindow)?;
    let measured = surface_slope(&curve, best.along, input, &focus, settings);
    let slope = measured.or_else(|| carried_slope(&curve, best.along, input));
    let (windows, best) = on_surface(facing, interval, best, slope);
    let (right_pixel, range_m) = curve.at(best.along, best.across);
    let prepared = windows.right_from_left(best.along);
    let right_window =
        resample::window(input.right_image, right_pixel, &prepared, half, settings.kernel).into();
    let right_from_left =
        measured.map_or(prepared, |slope| Windows { slope, ..facing }.right_from_left(best.along));
    let misfit = prepared
        .try_inverse()
        .map_or_else(Matrix2::zeros, |inverse| inverse * right_from_left - Matrix2::identity());
    let noise = match_noise(template.patch(), &right_window, &misfit, &focus);
    let seen = noise.covariance_px2 + noise.bias_px * noise.bias_px.transpose();
    let found = Found { right_pixel, range_m, right_from_left };
    Ok(PointStereo {
        curve: points,
        right_pixel,
        score: best.score,
        range_m,
        disparity_px: curve.along_of_infinity().map(|infinity| best.along - infinity),
        across_px: best.across,
        left_right_px: left_again(input, &found, &focus, settings)
            .map(|left| left.distance(input.left_pixel)),
        at_end: best.at_end,
        covariance_px2: prepared * seen * prepared.transpose(),
        right_from_left,
        right_window: right_window.into(),
    })
}

/// The whole epipolar curve, or the image row instead.
pub(super) fn curve(input: &StereoInput<'_>, settings: &TemplateSettings) -> Option<Curve> {
    let mut curve = Curve::new(&curve_input(input, settings))?;
    if settings.stereo_reference == StereoReference::ImageRow {
        curve.flatten_to_row(input.left_pixel.y);
    }
    Some(curve)
}

fn curve_input<'a>(input: &StereoInput<'a>, settings: &TemplateSettings) -> CurveInput<'a> {
    CurveInput {
        left: input.left,
        right: input.right,
        left_pixel: input.left_pixel,
        ranges_m: [settings.range_min_m, settings.range_max_m],
    }
}

/// The part of the curve to search: first and last arc length, px.
pub(super) fn search_interval(
    curve: &Curve,
    input: &StereoInput<'_>,
    settings: &TemplateSettings,
) -> Result<(f64, f64), TemplateFailure> {
    let whole = (0.0, curve.length_px());
    let range_m = match (input.geometry, input.predicted_range_m) {
        (StereoGeometry::Lateral, Some(range_m)) => range_m,
        _ => return Ok(whole),
    };
    let width = settings.disparity_range_px;
    let (from, to) = match settings.disparity_interval {
        DisparityInterval::Centred => {
            let centre = curve.along_of_range(range_m);
            (centre - width / 2.0, centre + width / 2.0)
        }
        DisparityInterval::FromZero => {
            let zero = curve.along_of_infinity().unwrap_or(0.0);
            (zero, zero + width)
        }
    };
    let cut = (from.max(whole.0), to.min(whole.1));
    if cut.0 < cut.1 { Ok(cut) } else { Err(TemplateFailure::IntervalOffCurve) }
}

/// Repeats the search near the best position, with windows resampled for a surface of this slope; keeps the first
/// result if that scores more.
fn on_surface<'a>(
    facing: Windows<'a>,
    (from, to): (f64, f64),
    best: Best,
    slope: Option<RowVector2<f64>>,
) -> (Windows<'a>, Best) {
    let believed = slope.filter(|slope| facing.settings.surface_warp && slope.norm() <= STRETCH_LIMIT);
    let Some(slope) = believed.filter(|_| !best.at_end) else { return (facing, best) };
    let windows = Windows { slope, ..facing };
    let near = ((best.along - SLOPE_REACH_PX).max(from), (best.along + SLOPE_REACH_PX).min(to));
    let (_, again) = windows.search(near);
    match again.filter(|again| !again.at_end && again.score >= best.score) {
        Some(again) => (windows, windows.in_focus(near, again)),
        None => (facing, best),
    }
}

/// Derivative of the arc length with respect to the left pixel, from the matches of four neighbours of the target, px
/// per px; relative to that of a surface that faces the camera.
fn surface_slope(
    curve: &Curve,
    along: f64,
    input: &StereoInput<'_>,
    focus: &Focus,
    settings: &TemplateSettings,
) -> Option<RowVector2<f64>> {
    let (_, range_m) = curve.at(along, 0.0);
    let half = settings.template_size_px / 2;
    let neighbour = |dx: f64, dy: f64| -> Option<f64> {
        let left_pixel = input.left_pixel.offset(dx, dy);
        let patch = patch::extract(input.left_image, left_pixel, half, settings.kernel);
        let shifted = StereoInput { left_pixel, ..*input };
        let reach_px = SLOPE_REACH_PX + f64::from(half) + 1.0;
        let own = Curve::near(&curve_input(&shifted, settings), range_m, reach_px)?;
        let expected = own.along_of_range(range_m);
        let interval =
            ((expected - SLOPE_REACH_PX).max(0.0), (expected + SLOPE_REACH_PX).min(own.length_px()));
        let windows = Windows {
            curve: &own,
            template: &StereoTemplate::new(patch, focus)?,
            input: &shifted,
            slope: RowVector2::zeros(),
            tolerance_px: 0.0,
            settings,
        };
        let best = windows.place(interval)?;
        (best.score as f32 >= SLOPE_SCORE_MIN && !best.at_end).then_some(best.along - expected)
    };
    // On a plane, opposite neighbours have opposite offsets from the target, which is at 0; at a depth edge they do not.
    let slope = |a: Option<f64>, b: Option<f64>| {
        let (a, b) = (a?, b?);
        let bend_px = (a + b).abs() / 2.0;
        (bend_px <= settings.slope_bend_px).then_some((b - a) / (2.0 * SLOPE_BASE_PX))
    };
    let du = slope(neighbour(-SLOPE_BASE_PX, 0.0), neighbour(SLOPE_BASE_PX, 0.0))?;
    let dv = slope(neighbour(0.0, -SLOPE_BASE_PX), neighbour(0.0, SLOPE_BASE_PX))?;
    Some(RowVector2::new(du, dv))
}

/// The same derivative from the surface of an earlier stop.
fn carried_slope(curve: &Curve, along: f64, input: &StereoInput<'_>) -> Option<RowVector2<f64>> {
    let (_, range_m) = curve.at(along, 0.0);
    let point = input.left.ray(input.left_pixel)?.at(range_m);
    let (_, right_by_point) = input.right.model.project_with_jacobian(&point)?;
    let beside = right_by_point * input.surface_by_pixel? - curve.right_from_left(input.right, range_m);
    Some(curve.tangent(along).transpose() * beside)
}

/// A point of the right image and the surface there.
pub(super) struct Found {
    pub(super) right_pixel: Pixel,
    pub(super) range_m: f64,
    pub(super) right_from_left: Matrix2<f64>,
}

/// Matches the right pixel in the left image, by the same search with the cameras exchanged; `None` if there is
/// nothing to compare.
pub(super) fn left_again(
    input: &StereoInput<'_>,
    found: &Found,
    focus: &Focus,
    settings: &TemplateSettings,
) -> Option<Pixel> {
    let back = StereoInput {
        left_pixel: found.right_pixel,
        left_image: input.right_image,
        right_image: input.left_image,
        left: input.right,
        right: input.left,
        ..*input
    };
    let half = settings.template_size_px / 2;
    let patch = patch::extract(back.left_image, back.left_pixel, half, settings.kernel);
    let template = StereoTemplate::new(patch, focus)?;
    let curve = curve(&back, settings)?;
    let interval = search_interval(&curve, &back, settings).ok()?;
    let along = curve.along_of_range(found.range_m);
    // The surface of the first search, seen from the other side.
    let beside = found.right_from_left.try_inverse()? - curve.right_from_left(back.right, found.range_m);
    let slope = curve.tangent(along).transpose() * beside;
    let is_believed = settings.surface_warp && slope.norm() <= STRETCH_LIMIT;
    let windows = Windows {
        curve: &curve,
        template: &template,
        input: &back,
        slope: if is_believed { slope } else { RowVector2::zeros() },
        tolerance_px: settings.epipolar_tolerance_px,
        settings,
    };
    let best = windows.place(interval)?;
    Some(curve.at(best.along, best.across).0)
}

impl Record for PointStereo {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("right_pixel", Unit::Pixel, |s| s.right_pixel).describe("The match in the right image.");
        r.quantity("score", Unit::One, |s| s.score)
            .label("stereo score")
            .describe("Normalised correlation of the stereo match.");
        r.quantity("range_m", Unit::Metre, |s| s.range_m)
            .describe("Range along the left ray on the epipolar curve.");
        r.quantity("disparity_px", Unit::Pixel, |s| s.disparity_px)
            .describe("Distance along the curve from the image of a point at infinity.");
        r.quantity("across_px", Unit::Pixel, |s| s.across_px)
            .describe("Offset of the match across the curve.");
        r.quantity("left_right_px", Unit::Pixel, |s| s.left_right_px)
            .describe("Distance between the left pixel and the match of the right one in the left image.");
        r.quantity("at_end", Unit::One, |s| s.at_end)
            .describe("Whether the best position is at an end of the searched interval.");
        r.quantity("covariance_px2", Unit::SquarePixel, |s| s.covariance_px2)
            .describe("Covariance of the right position for a given left one.");
        r.quantity("right_from_left", Unit::One, |s| s.right_from_left)
            .describe("Derivative of the right position by the left one on the target's surface.");
        r.array(
            "right_window",
            ArrayKind::Patch,
            "The right image at the stereo match, as the left eye would see it",
            |s| s.right_window.view(),
        );
    }
}

/// Names of the arrays of this stage that a panel draws individually.
impl ArrayName {
    /// The right image at the stereo match.
    pub const RIGHT_WINDOW: Self = Self::new("right_window");
}
