//! The scores of a match as tables: of the template over the search window, and of point stereo along the epipolar curve.

use sightline_geometry::frames::Pixel;
use sightline_track::trace::ArrayName;

use crate::panels::score_marks::region_of;
use crate::panels::sheets::{Cell, Column, Sheet};
use crate::state::State;

/// Positions listed to either side of the peak; the copy has all of them.
const NEAR_PX: i64 = 4;

/// The marks on the score map, the scores about the peak, and all scores for the copy.
pub(crate) fn surface(state: &State) -> Result<Vec<Sheet>, String> {
    let matched = state.trace().and_then(|trace| trace.template()).and_then(|e| e.match_template.as_ref());
    let (Some(trace), Some(matched)) = (state.trace(), matched) else { return Err(state.missing_template()) };
    let measure = matched.measure.word();
    let columns = ["x, px", "y, px"].map(|name| Column::new(name, "")).into_iter();
    let names = std::iter::once(Column::new("what", "")).chain(columns).chain([Column::new(measure, "")]);
    let step = state.cursor.step;
    let mut marks = Sheet::of(format!("Match scores, step {step}"), names.collect());
    let mut mark = |what: &str, pixel: Pixel, score: Option<f64>| {
        let cells =
            vec![Cell::Word(what.to_owned()), Cell::Number(pixel.x), Cell::Number(pixel.y), score.into()];
        marks.row(what == "peak", cells);
    };
    let raster = state.array(ArrayName::SURFACE).ready();
    let region = raster.map(|raster| region_of(matched.search_window, raster.size()));
    let score_at = |pixel: Pixel| {
        let (raster, region) = raster.zip(region)?;
        let (x, y) = (pixel.x.round() as i64, pixel.y.round() as i64);
        raster.at(x - i64::from(region.x), y - i64::from(region.y)).map(f64::from)
    };
    mark("peak", matched.peak.pixel, Some(matched.peak.score));
    if let Some(second) = &matched.second_peak {
        mark("second peak", second.pixel, Some(second.score));
    }
    if let Some(pixel) = trace.point_mast.predicted_left {
        mark("predicted", pixel, score_at(pixel));
    }
    if let Some(pixel) = trace.truth.as_ref().and_then(|t| t.left_pixel) {
        mark("truth", pixel, score_at(pixel));
    }
    let tried = state.trial().and_then(|trial| trial.ghost.as_ref()?.matched.as_ref());
    if let Some(tried) = tried {
        mark("what if: peak", tried.peak.pixel, Some(tried.peak.score));
        if let Some(second) = &tried.second_peak {
            mark("what if: second peak", second.pixel, Some(second.score));
        }
    }
    let mut sheets = vec![marks];
    if let Some((raster, region)) = raster.zip(region) {
        sheets.push(about_the_peak(raster, region, matched.peak.integer.map(i64::from), measure));
    }
    Ok(sheets)
}

fn about_the_peak(
    raster: &crate::drawing::raster::Raster,
    region: sightline_vision::image::PixelRect,
    [x, y]: [i64; 2],
    measure: &'static str,
) -> Sheet {
    let at =
        |x: i64, y: i64| raster.at(x - i64::from(region.x), y - i64::from(region.y)).map(f64::from).into();
    let columns = (x - NEAR_PX..=x + NEAR_PX).map(|x| Column::new(format!("x {x}"), ""));
    let columns = std::iter::once(Column::new("y", "px")).chain(columns).collect();
    let mut sheet = Sheet::of(format!("Scores about the peak, {measure}"), columns);
    for row in y - NEAR_PX..=y + NEAR_PX {
        let cells = (x - NEAR_PX..=x + NEAR_PX).map(|column| at(column, row));
        sheet.row(row == y, std::iter::once(Cell::Number(row as f64)).chain(cells).collect());
    }
    let names = [Column::new("x", "px"), Column::new("y", "px"), Column::new(measure, "")];
    let mut all = Sheet::of("all scores", names.to_vec());
    let [width, height] = raster.size().map(i64::from);
    let (left, top) = (i64::from(region.x), i64::from(region.y));
    for (row, column) in (0..height).flat_map(|row| (0..width).map(move |column| (row, column))) {
        let (x, y) = (left + column, top + row);
        all.row(false, vec![Cell::Number(x as f64), Cell::Number(y as f64), at(x, y)]);
    }
    sheet.more = Some(Box::new(all));
    sheet
}

/// The scores along the epipolar curve.
pub(crate) fn stereo_profile(state: &State) -> Result<Vec<Sheet>, String> {
    let stereo = state.trace().and_then(|trace| trace.template()).and_then(|e| e.point_stereo.as_ref());
    let Some(stereo) = stereo else { return Err(state.missing_template()) };
    let columns =
        [("range", "m"), ("score", ""), ("x in the right image", "px"), ("y in the right image", "px")];
    let columns = columns.map(|(name, unit)| Column::new(name, unit)).to_vec();
    let mut sheet = Sheet::of(format!("Stereo scores, step {}", state.cursor.step), columns);
    let nearest =
        stereo.curve.iter().map(|point| (point.range_m - stereo.range_m).abs()).fold(f64::INFINITY, f64::min);
    for point in &stereo.curve {
        let is_best = (point.range_m - stereo.range_m).abs() == nearest;
        let cells = [point.range_m, point.pixel.x, point.pixel.y].map(|value| Cell::from(Some(value)));
        let [range, x, y] = cells;
        sheet.row(is_best, vec![range, point.score.map(f64::from).into(), x, y]);
    }
    let mut best = Sheet::of(
        "Best stereo match",
        vec![Column::new("what", ""), Column::new("value", ""), Column::new("unit", "")],
    );
    for (what, value, unit) in [
        ("range", Some(stereo.range_m), "m"),
        ("score", Some(stereo.score), ""),
        ("disparity", stereo.disparity_px, "px"),
        ("off the epipolar curve", Some(stereo.across_px), "px"),
        ("left–right distance", stereo.left_right_px, "px"),
    ] {
        best.row(false, vec![Cell::Word(what.to_owned()), value.into(), Cell::Word(unit.to_owned())]);
    }
    Ok(vec![best, sheet])
}
