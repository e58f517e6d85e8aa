//! Step `point_stereo`: the one target point in the right image, along the epipolar curve (K§4.4, R73–R76).
//!
//! The left pixel's ray, sampled by range, projects into the right image as a curve; with real models it is
//! not an image row (E38). Along that curve, and up to the tolerance to either side of it, the left window is
//! compared with right windows by normalised correlation (R76). Each right window is resampled through
//! `A = ∂right/∂left` at the candidate's range, so that cameras which are turned against each other still see
//! the same patch; for two parallel eyes A is the identity. The best position is refined by a quadratic fit
//! along and across the curve, and then followed to the next maximum of scores that count the window's centre
//! most (`correlate::focus`).
//!
//! The interval searched is one of disparity for two eyes side by side: as wide as half the search window,
//! centred on the predicted range (R74, R75, E13), and the whole of the curve at designation or where the two
//! views are free. The slope of the surface (how the right position moves when the left one does) comes from
//! the same search at four neighbours: it turns an error of the left pixel into one of range, and with
//! `surface_warp` the windows near the best position are compared once more, resampled as on that surface; the
//! better score stands.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | curve parameter | arc length from the far end | px in the right image |
//! | A | `right_from_left` | px per px |

use nalgebra::{Matrix2, Matrix3, RowVector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::match_noise::match_noise;
use super::settings::{DisparityInterval, StereoReference, TemplateSettings};
use super::stereo_curve::{Curve, window_through};
use crate::camera::Camera;
use crate::correlate::Focus;
use crate::correlate::peak::Fit;
use crate::correlate::zncc::zncc;
use crate::frames::Pixel;
use crate::image::GrayImage;
use crate::image::patch::{self, Patch};
use crate::traverse::StereoGeometry;

/// Distance of the neighbours from which the slope is measured, px in the left image.
const SLOPE_BASE_PX: f64 = 8.0;

/// How far along the curve a neighbour's match may differ from the target's, px.
const SLOPE_REACH_PX: f64 = 5.0;

/// A neighbour below this score says nothing about the slope.
const SLOPE_SCORE_MIN: f32 = 0.6;

/// What point stereo is given.
#[derive(Clone, Copy, Debug)]
pub struct StereoInput<'a> {
    /// The target in the left image, px.
    pub left_pixel: Pixel,
    /// The left image.
    pub left_image: &'a GrayImage,
    /// The right image.
    pub right_image: &'a GrayImage,
    /// The left camera, rover frame.
    pub left: &'a Camera,
    /// The right camera, rover frame.
    pub right: &'a Camera,
    /// How the two images relate.
    pub geometry: StereoGeometry,
    /// Predicted distance from the left camera, m; null at designation.
    pub predicted_range_m: Option<f64>,
}

/// One candidate on the epipolar curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CurvePoint {
    /// Where it lies in the right image, px.
    pub pixel: Pixel,
    /// Range along the left ray, m.
    pub range_m: f64,
    /// Best score within the tolerance across the curve; null where no window fits.
    pub score: Option<f32>,
}

/// The corresponding point in the right image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PointStereo {
    /// The part of the epipolar curve that was searched, far end first, about a pixel apart.
    pub curve: Vec<CurvePoint>,
    /// The best position, px.
    pub right_pixel: Pixel,
    /// Its score.
    pub score: f64,
    /// Its range along the left ray on the curve, m.
    pub range_m: f64,
    /// How far it lies beside the curve, px.
    pub across_px: f64,
    /// Whether the best position is at an end of the searched interval.
    pub at_end: bool,
    /// Covariance of the right position for a given left one, px².
    #[schema(value_type = Vec<f64>)]
    pub covariance_px2: Matrix2<f64>,
    /// How the right position moves with the left one on the target's surface, px per px.
    #[schema(value_type = Vec<f64>)]
    pub right_from_left: Matrix2<f64>,
    /// The right image at the match, resampled as the left sees it.
    #[serde(skip)]
    #[schema(ignore)]
    pub right_window: Patch,
}

/// A slope that stretches the window by more than this is not believed, px per px.
const STRETCH_LIMIT: f64 = 0.5;

/// A score at a place along and across the curve.
#[derive(Clone, Copy)]
struct Best {
    along: f64,
    across: f64,
    score: f64,
    at_end: bool,
}

/// Finds the left pixel's point in the right image.
///
/// # Errors
/// A sentence saying why there is nothing to compare.
pub fn point_stereo(input: &StereoInput<'_>, settings: &TemplateSettings) -> Result<PointStereo, String> {
    let half = settings.template_size_px / 2;
    let template = patch::extract(input.left_image, input.left_pixel, half, settings.kernel);
    if template.iter().any(|v| !v.is_finite()) {
        return Err("the stereo window reaches over the border of the left image".to_owned());
    }
    let mut curve =
        Curve::new(input.left, input.right, input.left_pixel, settings.range_min_m, settings.range_max_m)
            .ok_or("the target's ray is not seen by the right camera")?;
    if settings.stereo_reference == StereoReference::ImageRow {
        curve.flatten_to_row(input.left_pixel.y);
    }
    let interval = search_interval(&curve, input, settings)?;
    let facing = Windows { curve: &curve, template: &template, input, slope: RowVector2::zeros(), settings };
    let (points, best) = facing.search(interval);
    let best = best
        .map(|best| facing.in_focus(interval, best))
        .ok_or("no window of the right image fits on the searched part of the epipolar curve")?;
    let slope = surface_slope(&curve, best.along, input, settings);
    let (windows, best) = facing.on_surface(interval, best, slope);
    let (right_pixel, range_m) = curve.at(best.along, best.across);
    let prepared = windows.right_from_left(best.along);
    let right_window = window_through(input.right_image, right_pixel, &prepared, half, settings.kernel);
    let right_from_left =
        slope.map_or(prepared, |slope| Windows { slope, ..facing }.right_from_left(best.along));
    let misfit = prepared
        .try_inverse()
        .map_or_else(Matrix2::zeros, |inverse| inverse * right_from_left - Matrix2::identity());
    let focus = Focus::new(settings.template_size_px, settings.focus_px);
    let noise = match_noise(&template, &right_window, &misfit, &focus);
    let seen = noise.covariance_px2 + noise.bias_px * noise.bias_px.transpose();
    Ok(PointStereo {
        curve: points,
        right_pixel,
        score: best.score,
        range_m,
        across_px: best.across,
        at_end: best.at_end,
        covariance_px2: prepared * seen * prepared.transpose(),
        right_from_left,
        right_window,
    })
}

/// The part of the curve to search: first and last arc length, px.
fn search_interval(
    curve: &Curve,
    input: &StereoInput<'_>,
    settings: &TemplateSettings,
) -> Result<(f64, f64), String> {
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
        DisparityInterval::FromZero => (0.0, width),
    };
    let cut = (from.max(whole.0), to.min(whole.1));
    if cut.0 < cut.1 { Ok(cut) } else { Err("the disparity interval lies off the epipolar curve".to_owned()) }
}

/// The windows of the right image that a template is compared with, each resampled as the left camera sees it on
/// a surface of one slope.
#[derive(Clone, Copy)]
struct Windows<'a> {
    curve: &'a Curve,
    template: &'a Patch,
    input: &'a StereoInput<'a>,
    /// How the place on the curve moves with the left pixel beside what a facing surface makes it, px per px.
    slope: RowVector2<f64>,
    settings: &'a TemplateSettings,
}

impl Windows<'_> {
    /// `∂right/∂left` on the surface at an arc length, px per px.
    fn right_from_left(&self, along: f64) -> Matrix2<f64> {
        let (_, range_m) = self.curve.at(along, 0.0);
        let StereoInput { left, right, left_pixel, .. } = *self.input;
        self.curve.right_from_left(left, right, left_pixel, range_m) + self.curve.tangent(along) * self.slope
    }

    /// The window at a place of the curve, resampled through `map`.
    fn at(&self, along: f64, across: f64, map: &Matrix2<f64>) -> Patch {
        let (pixel, _) = self.curve.at(along, across);
        let half = self.settings.template_size_px / 2;
        window_through(self.input.right_image, pixel, map, half, self.settings.kernel)
    }

    /// Compares windows about a pixel apart along the interval and up to the tolerance across it.
    fn search(&self, (from, to): (f64, f64)) -> (Vec<CurvePoint>, Option<Best>) {
        let steps = (to - from).ceil().max(1.0) as usize;
        let spacing = (to - from) / steps as f64;
        let side = self.settings.epipolar_tolerance_px.floor() as i32;
        // One more to either side, so that the quadratic fit across the curve has neighbours.
        let rows = (2 * (side + 1) + 1) as usize;
        let mut scores = vec![f32::NAN; (steps + 1) * rows];
        let mut points = Vec::with_capacity(steps + 1);
        for i in 0..=steps {
            let along = from + spacing * i as f64;
            let (pixel, range_m) = self.curve.at(along, 0.0);
            let map = self.right_from_left(along);
            let mut best: Option<f32> = None;
            for row in 0..rows {
                let across = row as i32 - side - 1;
                if let Some(score) = zncc(self.template, &self.at(along, f64::from(across), &map)) {
                    scores[i * rows + row] = score;
                    if across.abs() <= side {
                        best = Some(best.map_or(score, |b| b.max(score)));
                    }
                }
            }
            points.push(CurvePoint { pixel, range_m, score: best });
        }
        (points, refine(&scores, rows, from, spacing, side, self.settings.sub_pixel))
    }

    /// The best position moved to the next maximum in focus, where there is one inside the interval and the
    /// tolerance; its score stays that of the whole window.
    fn in_focus(&self, (from, to): (f64, f64), best: Best) -> Best {
        let focus = Focus::new(self.settings.template_size_px, self.settings.focus_px);
        if focus.is_even() || best.at_end {
            return best;
        }
        let window_at = |x: i32, y: i32| {
            let along = best.along + f64::from(x);
            let is_inside = (from..=to).contains(&along);
            is_inside.then(|| self.at(along, best.across + f64::from(y), &self.right_from_left(along)))
        };
        let Some(found) = focus.climb(self.template, self.settings.sub_pixel, window_at) else { return best };
        let across = best.across + found.offset_px.y;
        // The same half pixel more that the fit of the whole window may take.
        if across.abs() > self.settings.epipolar_tolerance_px + 0.5 {
            return best;
        }
        Best { along: best.along + found.offset_px.x, across, ..best }
    }

    /// The best position once more, near where it was, with windows resampled as on a surface of this slope; what
    /// was found before stands unless that scores better.
    fn on_surface(self, (from, to): (f64, f64), best: Best, slope: Option<RowVector2<f64>>) -> (Self, Best) {
        let believed = slope.filter(|slope| self.settings.surface_warp && slope.norm() <= STRETCH_LIMIT);
        let Some(slope) = believed.filter(|_| !best.at_end) else { return (self, best) };
        let windows = Self { slope, ..self };
        let near = ((best.along - SLOPE_REACH_PX).max(from), (best.along + SLOPE_REACH_PX).min(to));
        let (_, again) = windows.search(near);
        match again.filter(|again| !again.at_end && again.score >= best.score) {
            Some(again) => (windows, windows.in_focus(near, again)),
            None => (self, best),
        }
    }
}

/// The highest score within the tolerance, refined by a quadratic fit along and across.
fn refine(scores: &[f32], rows: usize, from: f64, spacing: f64, side: i32, sub_pixel: bool) -> Option<Best> {
    let columns = scores.len() / rows;
    let inside = |row: usize| (1..rows - 1).contains(&row);
    let (index, score) =
        scores.iter().enumerate().filter(|(index, score)| inside(index % rows) && score.is_finite()).fold(
            None,
            |best: Option<(usize, f32)>, (index, &score)| {
                if best.is_none_or(|(_, b)| score > b) { Some((index, score)) } else { best }
            },
        )?;
    let (column, row) = (index / rows, index % rows);
    let at_end = column == 0 || column + 1 == columns;
    let mut best = Best {
        along: from + spacing * column as f64,
        across: f64::from(row as i32 - side - 1),
        score: f64::from(score),
        at_end,
    };
    if sub_pixel && !at_end {
        // Rows of the fit lie across the curve, columns along it.
        let neighbours =
            Matrix3::from_fn(|dy, dx| f64::from(scores[(column + dx - 1) * rows + row + dy - 1]));
        if let Some(fit) = Fit::quadratic(&neighbours) {
            best.along += fit.offset.x * spacing;
            best.across += fit.offset.y;
            best.score = fit.score;
        }
    }
    Some(best)
}

/// How the place on the curve moves with the left pixel, from the matches of four neighbours of the target, px per
/// px; beside what a surface that faces the camera makes it.
fn surface_slope(
    curve: &Curve,
    along: f64,
    input: &StereoInput<'_>,
    settings: &TemplateSettings,
) -> Option<RowVector2<f64>> {
    let (_, range_m) = curve.at(along, 0.0);
    let narrow = TemplateSettings { epipolar_tolerance_px: 0.0, ..settings.clone() };
    let neighbour = |dx: f64, dy: f64| -> Option<f64> {
        let left_pixel = input.left_pixel.offset(dx, dy);
        let template =
            patch::extract(input.left_image, left_pixel, settings.template_size_px / 2, settings.kernel);
        let own =
            Curve::new(input.left, input.right, left_pixel, settings.range_min_m, settings.range_max_m)?;
        let expected = own.along_of_range(range_m);
        let interval =
            ((expected - SLOPE_REACH_PX).max(0.0), (expected + SLOPE_REACH_PX).min(own.length_px()));
        let shifted = StereoInput { left_pixel, ..*input };
        let windows = Windows {
            curve: &own,
            template: &template,
            input: &shifted,
            slope: RowVector2::zeros(),
            settings: &narrow,
        };
        let best = windows.in_focus(interval, windows.search(interval).1?);
        (best.score as f32 >= SLOPE_SCORE_MIN && !best.at_end).then_some(best.along - expected)
    };
    let slope = |a: Option<f64>, b: Option<f64>| Some((b? - a?) / (2.0 * SLOPE_BASE_PX));
    let du = slope(neighbour(-SLOPE_BASE_PX, 0.0), neighbour(SLOPE_BASE_PX, 0.0))?;
    let dv = slope(neighbour(0.0, -SLOPE_BASE_PX), neighbour(0.0, SLOPE_BASE_PX))?;
    Some(RowVector2::new(du, dv))
}
