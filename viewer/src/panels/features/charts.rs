//! The residuals of the matches as a histogram, and the number of inliers of each RANSAC iteration (R164, R170).

use egui::{Color32, Stroke, Ui, vec2};
use egui_plot::{Bar, BarChart, HLine, LineStyle, MarkerShape, Plot, Points, VLine};
use sightline_track::locate::features::evidence::FittedMotion;
use sightline_track::locate::features::rows::Feature;
use sightline_track::locate::features::settings::MotionGate;

use crate::drawing::overlay::{Mark, StrokeStyle};
use crate::panels::chart::{few_marks, plain};
use crate::panels::chart_legend;
use crate::state::State;
use crate::theme;

/// Height of a plot, points.
const HEIGHT: f32 = 104.0;
/// Bars of the histogram up to the gate.
const BARS_TO_GATE: usize = 10;
/// Bars of the histogram; the last one also counts all larger residuals.
const BARS: usize = 30;

/// Counts of residuals in bins of equal width; the last bin also counts all larger residuals.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Histogram {
    /// Width of a bin, m.
    pub(crate) step_m: f64,
    /// Counts of inliers.
    pub(crate) inliers: [usize; BARS],
    /// Counts of outliers.
    pub(crate) outliers: [usize; BARS],
}

impl Histogram {
    /// The residuals of a step, binned by the gate of its run.
    pub(crate) fn of(state: &State, features: &[Feature]) -> Self {
        Self::new(features, gate_m(state))
    }

    /// The residuals of `features`, binned by a gate.
    fn new(features: &[Feature], gate_m: f64) -> Self {
        let step_m = gate_m / BARS_TO_GATE as f64;
        let mut histogram = Self { step_m, inliers: [0; BARS], outliers: [0; BARS] };
        for matched in features.iter().filter_map(|feature| feature.matched.as_ref()) {
            let Some(residual_m) = matched.residual_m else { continue };
            let bars = if matched.is_inlier { &mut histogram.inliers } else { &mut histogram.outliers };
            bars[((residual_m / step_m) as usize).min(BARS - 1)] += 1;
        }
        histogram
    }
}

/// The gate on the distance of two matched points, m; it bounds inliers with `MotionGate::Distance`.
fn gate_m(state: &State) -> f64 {
    state.run_settings().features.motion_inlier_m
}

/// Shows the histogram with the gate and the filters.
pub(crate) fn residuals(ui: &mut Ui, state: &State, features: &[Feature]) {
    let gate_m = gate_m(state);
    let settings = &state.run_settings().features;
    let is_distance = settings.motion_gate == MotionGate::Distance;
    let sigmas = settings.motion_inlier_sigma;
    let gate = if is_distance {
        format!("gate {:.1} cm", gate_m * 100.0)
    } else {
        format!("gate: {sigmas} σ of the two points, at no one distance")
    };
    chart_legend::wrapped(
        ui,
        "residuals of matches, cm",
        &[
            (Mark::Dot, theme::inlier(), "inliers, filled".to_owned()),
            (Mark::Square, theme::outlier(), "outliers, outlined; the last bar: beyond".to_owned()),
            (Mark::Stroke(StrokeStyle::Dashed), theme::strong(), gate),
        ],
    );
    let histogram = Histogram::new(features, gate_m);
    let width_cm = histogram.step_m * 100.0;
    let bar = |i: usize, count: usize, below: usize| {
        let bar = Bar::new((i as f64 + 0.5) * width_cm, count as f64).width(width_cm * 0.9);
        bar.base_offset(below as f64)
    };
    let counts = || histogram.inliers.iter().zip(&histogram.outliers).enumerate();
    let (filled, edge) = (Stroke::new(0.5, theme::inlier()), Stroke::new(1.0, theme::outlier()));
    let inliers = counts().map(|(i, (n, _))| bar(i, *n, 0).fill(theme::inlier()).stroke(filled)).collect();
    let outliers = counts().filter(|(_, (_, n))| **n > 0);
    let outliers =
        outliers.map(|(i, (below, n))| bar(i, *n, *below).fill(Color32::TRANSPARENT).stroke(edge)).collect();
    still("residuals").show(ui, |plot| {
        plot.bar_chart(BarChart::new("inliers", inliers).allow_hover(false));
        plot.bar_chart(BarChart::new("outliers", outliers).allow_hover(false));
        if is_distance {
            let line = VLine::new("", gate_m * 100.0).color(theme::strong()).style(LineStyle::dashed_dense());
            plot.vline(line.width(1.5).allow_hover(false));
        }
        for limit in state.feature_view.residual_m.into_iter().filter(|v| *v > 0.0 && v.is_finite()) {
            plot.vline(VLine::new("", limit * 100.0).color(theme::accent()).width(1.0).allow_hover(false));
        }
    });
}

/// Shows the number of inliers of each RANSAC iteration.
pub(crate) fn consensus(ui: &mut Ui, motion: &FittedMotion) {
    let best = motion.consensus_by_draw.iter().max().copied().unwrap_or_default();
    let title = format!("inliers by RANSAC iteration ({} iterations)", motion.consensus_by_draw.len());
    chart_legend::wrapped(
        ui,
        &title,
        &[
            (Mark::Dot, theme::prediction(), format!("an iteration, best {best}")),
            (Mark::Stroke(StrokeStyle::Dashed), theme::inlier(), format!("in the end {}", motion.inliers)),
        ],
    );
    let points: Vec<[f64; 2]> =
        motion.consensus_by_draw.iter().enumerate().map(|(i, n)| [i as f64, f64::from(*n)]).collect();
    still("consensus").show(ui, |plot| {
        let line =
            HLine::new("", motion.inliers as f64).color(theme::inlier()).style(LineStyle::dashed_dense());
        plot.hline(line.width(1.5).allow_hover(false));
        let points = Points::new("", points).color(theme::prediction()).radius(1.8);
        plot.points(points.shape(MarkerShape::Circle).allow_hover(false));
    });
}

/// A plot without interaction.
fn still(name: &'static str) -> Plot<'static> {
    Plot::new(name)
        .height(HEIGHT)
        .allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .include_y(0.0)
        .include_x(0.0)
        .set_margin_fraction(vec2(0.02, 0.08))
        .y_axis_min_width(26.0)
        .x_grid_spacer(few_marks)
        .y_grid_spacer(few_marks)
        .y_axis_formatter(plain)
        .x_axis_formatter(plain)
        .label_formatter(|_| None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_geometry::frames::Pixel;
    use sightline_track::locate::features::rows::Matched;

    #[test]
    fn a_third_of_the_histogram_lies_within_the_gate_and_its_last_bar_holds_what_is_beyond() {
        let place = Pixel::new(0.0, 0.0);
        let feature = |residual_m: f64| {
            let is_inlier = residual_m < 0.03;
            let matched = Some(Matched { then: place, moved: None, residual_m: Some(residual_m), is_inlier });
            Feature { pixel: place, sigma_px: 1.0, orientation_rad: 0.0, right: None, range_m: None, matched }
        };
        let features = [0.001, 0.0295, 0.031, 0.0899, 2.0].map(feature);
        let histogram = Histogram::new(&features, 0.03);
        assert_eq!((histogram.inliers[0], histogram.inliers[9]), (1, 1));
        assert_eq!((histogram.outliers[10], histogram.outliers[29]), (1, 2));
        assert_eq!(histogram.inliers.iter().chain(&histogram.outliers).sum::<usize>(), features.len());
    }
}
