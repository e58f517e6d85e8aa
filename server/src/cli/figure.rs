//! The figures of the studies, drawn by `plotters` as SVG.
//!
//! The approach figure has two parts: the cumulative distribution of NEES against the χ² distribution with three
//! degrees of freedom that a right covariance gives, and the error of each run against its 1σ.

use std::path::Path;

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use sightline_core::error::{Error, Result};
use sightline_core::study::approach::{ApproachRun, ApproachSummary};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Okabe and Ito's blue and vermilion: told apart by everyone.
const MEASURED: RGBColor = RGBColor(0, 114, 178);
const EXPECTED: RGBColor = RGBColor(213, 94, 0);

/// Draws the calibration of an approach study.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn approach(path: &Path, runs: &[ApproachRun], summary: &ApproachSummary) -> Result<()> {
    let failed = |problem: String| Error::format(path, problem);
    let area = SVGBackend::new(path, (1000, 460)).into_drawing_area();
    area.fill(&WHITE).map_err(|e| failed(e.to_string()))?;
    let (left, right) = area.split_horizontally(500);
    nees(&left, runs, summary).map_err(failed)?;
    errors(&right, runs).map_err(failed)?;
    area.present().map_err(|e| failed(e.to_string()))
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// The distribution of NEES over the tracked runs against χ² with three degrees of freedom.
fn nees(area: &Area<'_>, runs: &[ApproachRun], summary: &ApproachSummary) -> std::result::Result<(), String> {
    let tracked = runs.iter().filter(|run| run.summary.run_tracked == Some(true));
    let mut values: Vec<f64> = tracked.filter_map(|run| run.nees).collect();
    values.sort_by(f64::total_cmp);
    let count = values.len() as f64;
    let title = summary.calibration.as_ref().map_or_else(
        || "no tracked run".to_owned(),
        |c| {
            format!(
                "mean NEES {:.2}, 95 % band {:.2} to {:.2} ({} runs)",
                c.mean_nees, c.band[0], c.band[1], c.count
            )
        },
    );
    let mut chart = chart(area, &title, 0.0..16.0, 0.0..1.0, ["NEES", "share of runs below"])?;
    let steps = values.iter().enumerate().map(|(i, &v)| (v, (i + 1) as f64 / count));
    let line =
        chart.draw_series(LineSeries::new(steps, MEASURED.stroke_width(2))).map_err(|e| e.to_string())?;
    line.label("measured").legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], MEASURED.stroke_width(2)));
    let chi_squared = ChiSquared::new(3.0).map_err(|e| e.to_string())?;
    let expected = (0..=160).map(|i| f64::from(i) / 10.0).map(|x| (x, chi_squared.cdf(x)));
    let line =
        chart.draw_series(LineSeries::new(expected, EXPECTED.stroke_width(2))).map_err(|e| e.to_string())?;
    line.label("χ² with 3 d.o.f.")
        .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], EXPECTED.stroke_width(2)));
    let labels =
        chart.configure_series_labels().position(SeriesLabelPosition::LowerRight).border_style(BLACK).draw();
    labels.map_err(|e| e.to_string())
}

/// The error of each run against its 1σ, with the lines of equality and of three sigma.
fn errors(area: &Area<'_>, runs: &[ApproachRun]) -> std::result::Result<(), String> {
    let centimetres = |m: f64| 100.0 * m;
    let points: Vec<(f64, f64)> = runs
        .iter()
        .filter_map(|run| Some((centimetres(run.sigma_m?), centimetres(run.summary.final_err_m?))))
        .collect();
    let reach = |values: &mut dyn Iterator<Item = f64>| values.fold(0.5_f64, f64::max) * 1.1;
    let (x, y) = (reach(&mut points.iter().map(|p| p.0)), reach(&mut points.iter().map(|p| p.1)));
    let axes = ["largest 1σ axis of the covariance, cm", "error at the last stop, cm"];
    let mut chart = chart(area, "error against the covariance's own word", 0.0..x, 0.0..y, axes)?;
    for factor in [1.0, 3.0] {
        // A line that left the frame would be bent at its border.
        let end = x.min(y / factor);
        let line = LineSeries::new([(0.0, 0.0), (end, factor * end)], EXPECTED.stroke_width(1));
        chart.draw_series(line).map_err(|e| e.to_string())?;
    }
    let dots = points.iter().map(|&point| Circle::new(point, 3, MEASURED.filled()));
    chart.draw_series(dots).map(|_| ()).map_err(|e| e.to_string())
}

type Chart<'a, 'b> = ChartContext<'b, SVGBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

fn chart<'a, 'b>(
    area: &'b Area<'a>,
    title: &str,
    x: std::ops::Range<f64>,
    y: std::ops::Range<f64>,
    axes: [&str; 2],
) -> std::result::Result<Chart<'a, 'b>, String> {
    let mut chart = ChartBuilder::on(area)
        .caption(title, ("sans-serif", 16))
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(48)
        .build_cartesian_2d(x, y)
        .map_err(|e| e.to_string())?;
    let mesh = chart.configure_mesh().x_desc(axes[0]).y_desc(axes[1]).light_line_style(TRANSPARENT).draw();
    mesh.map_err(|e| e.to_string())?;
    Ok(chart)
}
