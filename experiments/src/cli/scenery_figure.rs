//! The figures of the scenery study, drawn by `plotters` as SVG: rocks, ground, noise, spectra and levels of soil, and
//! exposure under a changing share of sky.
//!
//! Where laws are powers both axes are logarithms to the base of ten.

use std::path::Path;

use crate::exposure::ExposureRow;
use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;
use sightline_geometry::error::{Error, Result};

use super::scenery_report::Report;

/// Okabe and Ito's colours: told apart by everyone.
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
    RGBColor(240, 228, 66),
];

type Drawn = std::result::Result<(), String>;
type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// A line or a set of dots with its name.
struct Series {
    name: String,
    colour: RGBColor,
    points: Vec<(f64, f64)>,
    is_line: bool,
}

/// Draws all figures into a folder.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn draw(folder: &Path, report: &Report) -> Result<()> {
    let file = |name: &str, act: &dyn Fn(&Area<'_>) -> Drawn| {
        let path = folder.join(name);
        let area = SVGBackend::new(&path, (640, 440)).into_drawing_area();
        area.fill(&WHITE)
            .map_err(|e| e.to_string())
            .and_then(|()| act(&area))
            .and_then(|()| area.present().map_err(|e| e.to_string()))
            .map_err(|problem| Error::format(&path, problem))
    };
    file("rocks.svg", &|area| rocks(area, report))?;
    file("ground.svg", &|area| ground(area, report))?;
    file("noise.svg", &|area| noise(area, report))?;
    file("spectrum.svg", &|area| spectrum(area, report))?;
    file("histogram.svg", &|area| histogram(area, report))?;
    file("exposure.svg", &|area| exposure(area, report))
}

fn rocks(area: &Area<'_>, report: &Report) -> Drawn {
    let mut all = Vec::new();
    for ((abundance, rocks), colour) in report.rocks.iter().zip(COLOURS) {
        let per_m2 = |number: f64| (number / rocks.area_m2).log10();
        let expected = rocks.rows.iter().map(|row| (row.diameter_m.log10(), per_m2(row.expected)));
        let counted = rocks.rows.iter().filter(|row| row.counted > 0);
        let counted = counted.map(|row| (row.diameter_m.log10(), per_m2(f64::from(row.counted))));
        let name = format!("k = {abundance}");
        all.push(Series { name: String::new(), colour, points: expected.collect(), is_line: true });
        all.push(Series { name, colour, points: counted.collect(), is_line: false });
    }
    chart(
        area,
        "rocks: counted (dots) and the law (lines)",
        ["log10 of diameter, m", "log10 of number per m²"],
        &all,
        SeriesLabelPosition::UpperRight,
    )
}

fn ground(area: &Area<'_>, report: &Report) -> Drawn {
    let rows = &report.ground.rows;
    let of = |value: fn(&crate::scenery::GroundRow) -> f64| {
        rows.iter().map(|row| (row.distance_m.log10(), value(row).log10())).collect::<Vec<_>>()
    };
    let all = [
        Series { name: "expected".into(), colour: COLOURS[1], points: of(|r| r.expected_m), is_line: true },
        Series {
            name: "measured".into(),
            colour: COLOURS[0],
            points: of(|r| r.rms_difference_m),
            is_line: false,
        },
    ];
    chart(
        area,
        "ground: RMS difference of height",
        ["log10 of distance, m", "log10 of difference, m"],
        &all,
        SeriesLabelPosition::LowerRight,
    )
}

fn noise(area: &Area<'_>, report: &Report) -> Drawn {
    let points: Vec<(f64, f64)> = report.noise.iter().map(|row| (row.mean_dn, row.variance_dn2)).collect();
    let dark = report.noise.first().map_or(0.0, |row| row.variance_dn2 - row.mean_dn / report.gain[0]);
    let line = [0.0, 4095.0].map(|mean| (mean, dark + mean / report.gain[0])).to_vec();
    let all = [
        Series { name: "stated gain".into(), colour: COLOURS[1], points: line, is_line: true },
        Series { name: "measured".into(), colour: COLOURS[0], points, is_line: false },
    ];
    let title = format!("noise: {:.1} e⁻/DN stated, {:.1} from the slope", report.gain[0], report.gain[1]);
    chart(area, &title, ["mean, DN", "variance, DN²"], &all, SeriesLabelPosition::LowerRight)
}

fn spectrum(area: &Area<'_>, report: &Report) -> Drawn {
    let all: Vec<Series> = report
        .pictures
        .iter()
        .zip(COLOURS)
        .map(|((name, picture), colour)| {
            let rows = picture.spectrum.iter().filter(|row| row.power > 0.0 && row.cycles_per_px > 0.0);
            let points = rows.map(|row| (row.cycles_per_px.log10(), row.power.log10())).collect();
            Series { name: name.clone(), colour, points, is_line: true }
        })
        .collect();
    chart(
        area,
        "soil: power of its texture",
        ["log10 of cycles per px", "log10 of power"],
        &all,
        SeriesLabelPosition::UpperRight,
    )
}

fn histogram(area: &Area<'_>, report: &Report) -> Drawn {
    let all: Vec<Series> = report
        .pictures
        .iter()
        .zip(COLOURS)
        .map(|((name, picture), colour)| {
            let width = 2.0 / picture.histogram.len() as f64;
            let bins = picture.histogram.iter().enumerate();
            let points = bins.map(|(bin, part)| ((bin as f64 + 0.5) * width, *part)).collect();
            Series { name: name.clone(), colour, points, is_line: true }
        })
        .collect();
    chart(
        area,
        "soil: levels",
        ["level over the mean", "part of the pixels"],
        &all,
        SeriesLabelPosition::UpperRight,
    )
}

fn exposure(area: &Area<'_>, report: &Report) -> Drawn {
    let points = |value: fn(&ExposureRow) -> f64| -> Vec<(f64, f64)> {
        report.exposure.iter().map(|row| (100.0 * row.sky_share, value(row))).collect()
    };
    let ways = [("full frame", points(|row| row.full_frame_dn)), ("subframe", points(|row| row.subframe_dn))];
    let mut all = Vec::new();
    for ((name, points), colour) in ways.into_iter().zip(COLOURS) {
        all.push(Series { name: name.into(), colour, points: points.clone(), is_line: false });
        all.push(Series { name: String::new(), colour, points, is_line: true });
    }
    chart(
        area,
        "exposure: level of the targets",
        ["sky in the frame, %", "mean level, DN"],
        &all,
        SeriesLabelPosition::MiddleRight,
    )
}

/// A chart whose axes hold all points; the legend stands in the corner that the curves leave free.
fn chart(
    area: &Area<'_>,
    title: &str,
    axes: [&str; 2],
    all: &[Series],
    corner: SeriesLabelPosition,
) -> Drawn {
    let points = || all.iter().flat_map(|series| series.points.iter().copied());
    let range = |of: fn((f64, f64)) -> f64| {
        let (low, high) = points()
            .map(of)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        let margin = 0.05 * (high - low).max(1e-9);
        low - margin..high + margin
    };
    let mut chart: ChartContext<'_, SVGBackend<'_>, Cartesian2d<RangedCoordf64, RangedCoordf64>> =
        ChartBuilder::on(area)
            .caption(title, ("sans-serif", 16))
            .margin(12)
            .x_label_area_size(40)
            .y_label_area_size(56)
            .build_cartesian_2d(range(|p| p.0), range(|p| p.1))
            .map_err(|e| e.to_string())?;
    let mesh = chart.configure_mesh().x_desc(axes[0]).y_desc(axes[1]).light_line_style(TRANSPARENT).draw();
    mesh.map_err(|e| e.to_string())?;
    for series in all {
        let colour = series.colour;
        let drawn = if series.is_line {
            chart.draw_series(LineSeries::new(series.points.iter().copied(), colour.stroke_width(2)))
        } else {
            chart.draw_series(series.points.iter().map(|&point| Circle::new(point, 3, colour.filled())))
        };
        let drawn = drawn.map_err(|e| e.to_string())?;
        if !series.name.is_empty() {
            drawn
                .label(series.name.as_str())
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        }
    }
    let labels = chart
        .configure_series_labels()
        .position(corner)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .draw();
    labels.map_err(|e| e.to_string())
}
