//! The definition of point stereo, window by window: the reference for the fast search.

use super::*;
use crate::locate::template::match_noise::match_noise;
use crate::locate::template::point_stereo::STRETCH_LIMIT;
use crate::locate::template::stereo_curve::CurveInput;
use sightline_vision::correlate::zncc::zncc;
use sightline_vision::image::patch;
use sightline_vision::image::sample::Kernel;

/// The results in which both must agree.
pub(super) struct Answer {
    pub(super) right_pixel: Pixel,
    pub(super) score: f64,
    pub(super) at_end: bool,
    pub(super) right_from_left: Matrix2<f64>,
    pub(super) covariance_px2: Matrix2<f64>,
    pub(super) profile: Vec<Option<f32>>,
}

/// One search: every candidate has its own window, resampled pixel by pixel.
#[derive(Clone, Copy)]
struct Direct<'a> {
    curve: &'a Curve,
    patch: &'a Patch,
    input: &'a StereoInput<'a>,
    slope: RowVector2<f64>,
    tolerance_px: f64,
    settings: &'a TemplateSettings,
}

impl Direct<'_> {
    fn map(&self, along: f64) -> Matrix2<f64> {
        let range_m = self.curve.at(along, 0.0).1;
        self.curve.right_from_left(self.input.right, range_m) + self.curve.tangent(along) * self.slope
    }

    fn window(&self, along: f64, across: f64) -> Patch {
        let (centre, map) = (self.curve.at(along, across).0, self.map(along));
        through(self.input.right_image, centre, &map, self.settings)
    }

    fn search(&self, interval: (f64, f64)) -> (Candidates, Option<Best>) {
        let mut candidates = Candidates::new(interval, self.tolerance_px);
        for index in 0..candidates.scores.len() {
            let (column, row) = (index / candidates.rows, index % candidates.rows);
            let window = self.window(candidates.along(column), candidates.across(row));
            candidates.scores[index] = zncc(self.patch, &window).unwrap_or(f32::NAN);
        }
        let best = candidates.refine(self.settings.sub_pixel);
        (candidates, best)
    }

    fn in_focus(&self, (from, to): (f64, f64), best: Best) -> Best {
        let focus = Focus::new(self.settings.template_size_px, self.settings.focus_px);
        if focus.is_even() || best.at_end {
            return best;
        }
        let window_at = |x: i32, y: i32| {
            let along = best.along + f64::from(x);
            (from..=to).contains(&along).then(|| self.window(along, best.across + f64::from(y)))
        };
        let Some(found) = focus.climb(self.patch, self.settings.sub_pixel, window_at) else { return best };
        let across = best.across + found.offset_px.y;
        if across.abs() > self.tolerance_px + 0.5 {
            return best;
        }
        Best { along: best.along + found.offset_px.x, across, ..best }
    }
}

fn through(image: &GrayImage, centre: Pixel, map: &Matrix2<f64>, settings: &TemplateSettings) -> Patch {
    let size = settings.template_size_px;
    let half = f64::from(size / 2);
    GrayImage::from_fn(size, size, |x, y| {
        let offset = map * Vector2::new(f64::from(x) - half, f64::from(y) - half);
        let value = Kernel::Bicubic.sample(image, centre.offset(offset.x, offset.y));
        image::Luma([value.unwrap_or(f32::NAN)])
    })
    .into()
}

fn curve_input<'a>(input: &StereoInput<'a>, settings: &TemplateSettings) -> CurveInput<'a> {
    let ranges_m = [settings.range_min_m, settings.range_max_m];
    CurveInput { left: input.left, right: input.right, left_pixel: input.left_pixel, ranges_m }
}

/// The slope from four neighbours, each on a whole curve of its own.
fn slope(
    curve: &Curve,
    along: f64,
    input: &StereoInput<'_>,
    settings: &TemplateSettings,
) -> Option<RowVector2<f64>> {
    let range_m = curve.at(along, 0.0).1;
    let neighbour = |dx: f64, dy: f64| -> Option<f64> {
        let left_pixel = input.left_pixel.offset(dx, dy);
        let shifted = StereoInput { left_pixel, ..*input };
        let patch =
            patch::extract(input.left_image, left_pixel, settings.template_size_px / 2, Kernel::Bicubic);
        let own = Curve::new(&curve_input(&shifted, settings))?;
        let expected = own.along_of_range(range_m);
        let interval = ((expected - 5.0).max(0.0), (expected + 5.0).min(own.length_px()));
        let direct = Direct {
            curve: &own,
            patch: &patch,
            input: &shifted,
            slope: RowVector2::zeros(),
            tolerance_px: 0.0,
            settings,
        };
        let best = direct.in_focus(interval, direct.search(interval).1?);
        (best.score >= 0.6 && !best.at_end).then_some(best.along - expected)
    };
    let du = (neighbour(8.0, 0.0)? - neighbour(-8.0, 0.0)?) / 16.0;
    let dv = (neighbour(0.0, 8.0)? - neighbour(0.0, -8.0)?) / 16.0;
    Some(RowVector2::new(du, dv))
}

/// Point stereo around the predicted range.
pub(super) fn answer(input: &StereoInput<'_>, settings: &TemplateSettings) -> Option<Answer> {
    let patch =
        patch::extract(input.left_image, input.left_pixel, settings.template_size_px / 2, Kernel::Bicubic);
    let curve = Curve::new(&curve_input(input, settings))?;
    let centre = curve.along_of_range(input.predicted_range_m?);
    let width = settings.disparity_range_px;
    let interval = ((centre - width / 2.0).max(0.0), (centre + width / 2.0).min(curve.length_px()));
    let facing = Direct {
        curve: &curve,
        patch: &patch,
        input,
        slope: RowVector2::zeros(),
        tolerance_px: settings.epipolar_tolerance_px,
        settings,
    };
    let (candidates, best) = facing.search(interval);
    let profile = (0..candidates.columns).map(|column| candidates.best_of_column(column)).collect();
    let mut best = facing.in_focus(interval, best?);
    let slope = slope(&curve, best.along, input, settings);
    let mut windows = facing;
    if let Some(slope) = slope.filter(|slope| slope.norm() <= STRETCH_LIMIT && !best.at_end) {
        let on_surface = Direct { slope, ..facing };
        let near = ((best.along - 5.0).max(interval.0), (best.along + 5.0).min(interval.1));
        let again = on_surface.search(near).1;
        if let Some(again) = again.filter(|again| !again.at_end && again.score >= best.score) {
            (windows, best) = (on_surface, on_surface.in_focus(near, again));
        }
    }
    let right_pixel = curve.at(best.along, best.across).0;
    let prepared = windows.map(best.along);
    let right_from_left = slope.map_or(prepared, |slope| Direct { slope, ..facing }.map(best.along));
    let misfit = prepared.try_inverse()? * right_from_left - Matrix2::identity();
    let window = through(input.right_image, right_pixel, &prepared, settings);
    let focus = Focus::new(settings.template_size_px, settings.focus_px);
    let noise = match_noise(&patch, &window, &misfit, &focus);
    let seen = noise.covariance_px2 + noise.bias_px * noise.bias_px.transpose();
    Some(Answer {
        right_pixel,
        score: best.score,
        at_end: best.at_end,
        right_from_left,
        covariance_px2: prepared * seen * prepared.transpose(),
        profile,
    })
}
