//! Compares windows along an epipolar curve with one template, for `point_stereo` and its left–right check.
//!
//! Candidates are a pixel apart along the curve and across it. Each has its own window, resampled through `A =
//! ∂right/∂left` at its range, so that neighbouring windows share no sample, and hundreds of them would have to be
//! resampled one by one. Instead the image is resampled once into a *strip* rectified along the curve, in which the
//! windows of all candidates are slices, and the template is resampled on the strip's grid: with tangent T and normal N,
//! ```text
//! strip(i, j) = image(curve(i) + j N)            template'(i, j) = left image(centre + A⁻¹ (i T, j N))
//! ```
//! The dense correlator (`correlate::zncc`) scores the strip. It differs from the windows of the definition in the
//! outline of the template, which is rotated by the angle between T and A's axes, and in which of the two images is
//! interpolated: by some thousandths. Therefore every candidate within [`DOUBT`] of the best, its eight neighbours,
//! and every one that the strip cannot score are compared again by the definition, until the best and its neighbours
//! all are; position, fit and covariance use these scores only. One template' serves a stretch of the curve whose
//! maps differ by less than [`SHARED_MAP_PX`]; where A rotates or stretches the window against the curve by more than
//! [`STRIP_DISTORTION`], only the definition is used.
//!
//! The focused search (`correlate::focus`) resamples the image once around the best candidate, on the grid of A
//! itself, and climbs over windows that are slices of that; on a slope its windows are resampled one by one.

use nalgebra::{Matrix2, Matrix3, RowVector2, Vector2};

use super::settings::TemplateSettings;
use super::stereo_curve::Curve;
use super::stereo_input::{CurvePoint, StereoInput};
use sightline_geometry::frames::Pixel;
use sightline_vision::correlate::Focus;
use sightline_vision::correlate::peak::Fit;
use sightline_vision::correlate::zncc::{Reference, zncc_surface};
use sightline_vision::image::patch::Patch;
use sightline_vision::image::{GrayImage, PixelRect, resample};

/// Candidates whose score in the strip is less than this below the best are compared by the definition.
const DOUBT: f32 = 0.02;

/// Largest shift of a window's border between the maps of candidates that share a template, px.
const SHARED_MAP_PX: f64 = 0.05;

/// Largest difference between A and the strip's axes, up to quarter turns, px per px.
const STRIP_DISTORTION: f64 = 0.1;

/// Distance around the best candidate within which the image is resampled in advance for the focused search, px.
const FOCUS_REACH_PX: i32 = 3;

/// A candidate: position along and across the curve, px, and score.
#[derive(Clone, Copy)]
pub(super) struct Best {
    pub(super) along: f64,
    pub(super) across: f64,
    pub(super) score: f64,
    pub(super) at_end: bool,
}

/// A template with the data that its comparisons share.
pub(super) struct StereoTemplate<'a> {
    patch: Patch,
    reference: Reference,
    focus: &'a Focus,
}

impl<'a> StereoTemplate<'a> {
    /// `None` if the patch has an invalid pixel.
    pub(super) fn new(patch: Patch, focus: &'a Focus) -> Option<Self> {
        let reference = Reference::new(&patch)?;
        Some(Self { patch, reference, focus })
    }

    pub(super) fn patch(&self) -> &Patch {
        &self.patch
    }
}

/// The windows of the right image that are compared with a template, each resampled to the left view of a surface of
/// one slope.
#[derive(Clone, Copy)]
pub(super) struct Windows<'a> {
    pub(super) curve: &'a Curve,
    pub(super) template: &'a StereoTemplate<'a>,
    pub(super) input: &'a StereoInput<'a>,
    /// Derivative of the arc length with respect to the left pixel, relative to that of a facing surface, px per px.
    pub(super) slope: RowVector2<f64>,
    /// Tolerance across the curve, px.
    pub(super) tolerance_px: f64,
    pub(super) settings: &'a TemplateSettings,
}

impl Windows<'_> {
    /// `∂right/∂left` on the surface at an arc length, px per px.
    pub(super) fn right_from_left(&self, along: f64) -> Matrix2<f64> {
        let (_, range_m) = self.curve.at(along, 0.0);
        self.curve.right_from_left(self.input.right, range_m) + self.curve.tangent(along) * self.slope
    }

    /// The window about a pixel, resampled through `map`; `None` if part of it is outside the image.
    fn window(&self, centre: Pixel, map: &Matrix2<f64>) -> Option<Patch> {
        let (image, half) = (self.input.right_image, self.half());
        let corner = map.abs() * Vector2::repeat(f64::from(half));
        let last = [f64::from(image.width()) - 1.0, f64::from(image.height()) - 1.0];
        // The farthest corner in x and in y; a window that exceeds the image by more than rounding is incomplete.
        let inside = |v: f64, reach: f64, last: f64| v - reach >= -1e-9 && v + reach <= last + 1e-9;
        if !inside(centre.x, corner.x, last[0]) || !inside(centre.y, corner.y, last[1]) {
            return None;
        }
        Some(resample::window(image, centre, map, half, self.settings.kernel).into())
    }

    fn half(&self) -> u32 {
        self.settings.template_size_px / 2
    }

    /// The best position along the interval and up to the tolerance across it, with the profile of scores.
    pub(super) fn search(&self, interval: (f64, f64)) -> (Vec<CurvePoint>, Option<Best>) {
        let mut candidates = self.compared(interval);
        self.settle(&mut candidates);
        let point = |column: usize| {
            let (pixel, range_m) = self.curve.at(candidates.along(column), 0.0);
            CurvePoint { pixel, range_m, score: candidates.best_of_column(column) }
        };
        let points = (0..candidates.columns).map(point).collect();
        (points, candidates.refine(self.settings.sub_pixel))
    }

    /// The best position in focus, starting from the scores of the strip, or without a focus from those of the
    /// definition. The score is that of the search.
    pub(super) fn place(&self, interval: (f64, f64)) -> Option<Best> {
        let mut candidates = self.compared(interval);
        if self.template.focus.is_even() || candidates.highest().is_none() {
            self.settle(&mut candidates);
        }
        Some(self.in_focus(interval, candidates.refine(self.settings.sub_pixel)?))
    }

    /// Windows about a pixel apart along the interval and across it, compared in strips where possible.
    fn compared(&self, interval: (f64, f64)) -> Candidates {
        let mut candidates = Candidates::new(interval, self.tolerance_px);
        let mut stretches = vec![(0, candidates.columns - 1)];
        while let Some((first, last)) = stretches.pop() {
            if first == last || self.share_a_map(candidates.along(first), candidates.along(last)) {
                self.score_strip(&mut candidates, first, last);
            } else {
                let middle = usize::midpoint(first, last);
                stretches.extend([(first, middle), (middle + 1, last)]);
            }
        }
        candidates
    }

    fn share_a_map(&self, first: f64, last: f64) -> bool {
        let difference = self.right_from_left(first) - self.right_from_left(last);
        difference.amax() * f64::from(self.half()) <= SHARED_MAP_PX
    }

    /// Scores columns `first` to `last` in one strip, if the strip's grid is close to that of the windows.
    fn score_strip(&self, candidates: &mut Candidates, first: usize, last: usize) {
        let middle = candidates.along(usize::midpoint(first, last));
        let tangent = self.curve.tangent(middle);
        let axes =
            Matrix2::from_columns(&[tangent * candidates.spacing, Vector2::new(-tangent.y, tangent.x)]);
        let Some(left_from_strip) = self.right_from_left(middle).try_inverse().map(|inverse| inverse * axes)
        else {
            return;
        };
        let turned = left_from_strip.map(f64::round);
        let is_quarter_turn = turned.determinant().abs() == 1.0 && turned.abs().sum() == 2.0;
        if !is_quarter_turn || (left_from_strip - turned).amax() > STRIP_DISTORTION {
            return;
        }
        let (half, kernel) = (self.half(), self.settings.kernel);
        let template: Patch =
            resample::window(self.input.left_image, self.input.left_pixel, &left_from_strip, half, kernel)
                .into();
        let strip = self.strip(candidates, first, last);
        let whole = PixelRect::whole(strip.width(), strip.height());
        let Some(surface) = zncc_surface(&template, &strip, whole) else { return };
        for (row, scores) in surface.scores.chunks_exact(surface.width as usize).enumerate() {
            for (column, score) in (first..=last).zip(scores) {
                candidates.scores[column * candidates.rows + row] = *score;
            }
        }
    }

    /// The image rectified along the curve: the windows of columns `first` to `last` are slices of it.
    fn strip(&self, candidates: &Candidates, first: usize, last: usize) -> GrayImage {
        let half = self.half();
        let across = candidates.across(0) - f64::from(half);
        let columns: Vec<(Pixel, Vector2<f64>)> = (0..(last - first + 1) as u32 + 2 * half)
            .map(|i| {
                let along = candidates.along(first) + candidates.spacing * (f64::from(i) - f64::from(half));
                (self.curve.at(along, 0.0).0, self.curve.tangent(along))
            })
            .collect();
        let size = [columns.len() as u32, candidates.rows as u32 + 2 * half];
        resample::at_places(self.input.right_image, size, self.settings.kernel, |i, j| {
            let (pixel, tangent) = columns[i as usize];
            let across = across + f64::from(j);
            pixel.offset(-tangent.y * across, tangent.x * across)
        })
    }

    /// Compares by the definition the candidates that decide: the best, their neighbours, and those without a score.
    fn settle(&self, candidates: &mut Candidates) {
        let mut undecided: Vec<usize> =
            (0..candidates.scores.len()).filter(|index| candidates.scores[*index].is_nan()).collect();
        let mut maps = vec![None; candidates.columns];
        loop {
            for &index in &undecided {
                let (column, row) = (index / candidates.rows, index % candidates.rows);
                let along = candidates.along(column);
                let map = *maps[column].get_or_insert_with(|| self.right_from_left(along));
                let (pixel, _) = self.curve.at(along, candidates.across(row));
                let window = self.window(pixel, &map);
                let score = window.and_then(|window| self.template.reference.score(&window));
                candidates.scores[index] = score.unwrap_or(f32::NAN);
                candidates.is_settled[index] = true;
            }
            undecided = candidates.undecided();
            if undecided.is_empty() {
                return;
            }
        }
    }

    /// Moves the best position to the next maximum in focus, if there is one inside the interval and the tolerance;
    /// keeps the score of the whole window.
    pub(super) fn in_focus(&self, (from, to): (f64, f64), best: Best) -> Best {
        let focus = self.template.focus;
        if focus.is_even() || best.at_end {
            return best;
        }
        let (centre, _) = self.curve.at(best.along, best.across);
        let (map, tangent) = (self.right_from_left(best.along), self.curve.tangent(best.along));
        let (image, half, kernel) = (self.input.right_image, self.half(), self.settings.kernel);
        // On a slope A stretches its own grid, on which the peak would appear narrower or wider to a fit.
        let is_facing = self.slope == RowVector2::zeros();
        let step = if is_facing { map } else { Matrix2::new(tangent.x, -tangent.y, tangent.y, tangent.x) };
        let place = |offset: Vector2<f64>| {
            let moved = step * offset;
            (best.along + tangent.dot(&moved), best.across + tangent.perp(&moved))
        };
        let reach = FOCUS_REACH_PX as u32;
        let near = is_facing.then(|| resample::window(image, centre, &map, half + reach, kernel));
        let window_at = |x: i32, y: i32| {
            let offset = Vector2::new(f64::from(x), f64::from(y));
            if !(from..=to).contains(&place(offset).0) {
                return None;
            }
            if let Some(near) = near.as_ref().filter(|_| x.abs().max(y.abs()) <= FOCUS_REACH_PX) {
                return Some(slice(near, x + FOCUS_REACH_PX, y + FOCUS_REACH_PX, 2 * half + 1));
            }
            let moved = step * offset;
            self.window(centre.offset(moved.x, moved.y), &map)
        };
        let found = focus.climb(&self.template.patch, self.settings.sub_pixel, window_at);
        let Some((along, across)) = found.map(|found| place(found.offset_px)) else { return best };
        // Half a pixel beyond the tolerance, as in the fit of the whole window.
        if across.abs() > self.tolerance_px + 0.5 {
            return best;
        }
        Best { along, across, ..best }
    }
}

/// The square of side `size` at (`left`, `top`), which must be inside the image.
fn slice(image: &GrayImage, left: i32, top: i32, size: u32) -> Patch {
    let (left, top, side) = (left as usize, top as usize, size as usize);
    let mut values = Vec::with_capacity(side * side);
    for row in image.as_raw().chunks_exact(image.width() as usize).skip(top).take(side) {
        values.extend_from_slice(&row[left..left + side]);
    }
    GrayImage::from_raw(size, size, values).unwrap_or_default().into()
}

/// The scores of all candidates, column by column along the curve.
struct Candidates {
    from: f64,
    spacing: f64,
    columns: usize,
    /// Rows within the tolerance and one more to either side, so that the fit across the curve has neighbours.
    rows: usize,
    scores: Vec<f32>,
    is_settled: Vec<bool>,
}

impl Candidates {
    fn new((from, to): (f64, f64), tolerance_px: f64) -> Self {
        // Rounding of the ends must not add a candidate.
        let steps = (to - from - 1e-9).ceil().max(1.0);
        let columns = steps as usize + 1;
        let rows = 2 * (tolerance_px.floor() as usize + 1) + 1;
        Self {
            from,
            spacing: (to - from) / steps,
            columns,
            rows,
            scores: vec![f32::NAN; columns * rows],
            is_settled: vec![false; columns * rows],
        }
    }

    fn along(&self, column: usize) -> f64 {
        self.from + self.spacing * column as f64
    }

    fn across(&self, row: usize) -> f64 {
        row as f64 - (self.rows / 2) as f64
    }

    fn is_inside(&self, index: usize) -> bool {
        (1..self.rows - 1).contains(&(index % self.rows))
    }

    fn best_of_column(&self, column: usize) -> Option<f32> {
        let inside = &self.scores[column * self.rows..][1..self.rows - 1];
        inside.iter().copied().filter(|score| !score.is_nan()).reduce(f32::max)
    }

    /// Index and score of the best candidate within the tolerance, the first among equals.
    fn highest(&self) -> Option<(usize, f32)> {
        let valid = self.scores.iter().copied().enumerate();
        valid.filter(|(index, score)| self.is_inside(*index) && score.is_finite()).fold(
            None,
            |best: Option<(usize, f32)>, (index, score)| {
                if best.is_none_or(|(_, highest)| score > highest) { Some((index, score)) } else { best }
            },
        )
    }

    /// The candidates that must still be compared by the definition.
    fn undecided(&self) -> Vec<usize> {
        let Some((best, highest)) = self.highest() else { return Vec::new() };
        let (column, row) = (best / self.rows, best % self.rows);
        let is_near = |index: usize| {
            (index / self.rows).abs_diff(column) <= 1 && (index % self.rows).abs_diff(row) <= 1
        };
        (0..self.scores.len())
            .filter(|&index| !self.is_settled[index])
            .filter(|&i| is_near(i) || (self.is_inside(i) && self.scores[i] >= highest - DOUBT))
            .collect()
    }

    /// The highest score within the tolerance, refined by a quadratic fit along and across.
    fn refine(&self, sub_pixel: bool) -> Option<Best> {
        let (index, score) = self.highest()?;
        let (column, row) = (index / self.rows, index % self.rows);
        // Next to a window that reaches out of the image, a better match may be outside.
        let is_cut = |column: usize| self.scores[column * self.rows + row].is_nan();
        let at_end = column == 0 || column + 1 == self.columns || is_cut(column - 1) || is_cut(column + 1);
        let mut best =
            Best { along: self.along(column), across: self.across(row), score: f64::from(score), at_end };
        if sub_pixel && !at_end {
            // Rows of the fit are across the curve, columns along it.
            let neighbours = Matrix3::from_fn(|dy, dx| {
                f64::from(self.scores[(column + dx - 1) * self.rows + row + dy - 1])
            });
            if let Some(fit) = Fit::quadratic(&neighbours) {
                best.along += fit.offset.x * self.spacing;
                best.across += fit.offset.y;
                // The fit may exceed 1, the highest score of a correlation.
                best.score = fit.score.min(1.0);
            }
        }
        Some(best)
    }
}

#[cfg(test)]
#[path = "stereo_search_tests.rs"]
mod tests;
