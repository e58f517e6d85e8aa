//! The coarse search, the mean distance of the surfaces over all shifts, with the basin given by the rock's half width
//! (R155, R200); and the path of the refinement (R201).

use egui::{Color32, Rect, Ui, UiBuilder, vec2};
use egui_plot::{Line, LineStyle, MarkerShape, Plot, PlotImage, PlotPoint, Points};
use sightline_track::locate::shape_tracker::evidence::Registered;
use sightline_track::locate::shape_tracker::rows::{PathStep, sensor_pixel_m};
use sightline_track::trace::ArrayName;
use sightline_vision::registration::Method;

use crate::drawing::overlay;
use crate::drawing::overlay::Mark;
use crate::drawing::raster;
use crate::drawing::raster::Raster;
use crate::panels;
use crate::panels::chart::plain;
use crate::panels::chart_legend;
use crate::panels::shape::array_image::{BAR, DisplayUnit, colour_bar};
use crate::panels::shape::part_context::{PartContext, ready, why_not};
use crate::state::State;
use crate::theme;

/// Minimum width at which both are side by side, points.
const TWO_COLUMNS: f32 = 520.0;
/// Minimum height of a plot, points.
const LEAST: f32 = 150.0;
/// Points of the basin's outline.
const OUTLINE: u32 = 96;
/// Height of the names above a plot, points.
const NAMES: f32 = 56.0;
/// Height of the text below a plot, points.
const WORDS: f32 = 32.0;
/// Mean distances are shown in millimetres.
const MM: DisplayUnit = DisplayUnit { word: "mm", factor: 1000.0 };

/// Shows the part.
pub(super) fn show(ui: &mut Ui, context: &PartContext<'_>) {
    let found = context.evidence.registration.as_ref().filter(|found| found.coarse_shift_m.is_some());
    let Some(found) = found else {
        panels::missing(
            ui,
            "The coarse search over all shifts, and the refinement.",
            &why_not(context, "search"),
        );
        return;
    };
    let height = ui.available_height();
    if ui.available_width() < TWO_COLUMNS {
        let half = (height / 2.0 - NAMES).max(LEAST);
        coarse(ui, context, found, half);
        refinement(ui, context, found, half);
    } else {
        ui.columns(2, |columns| {
            coarse(&mut columns[0], context, found, (height - NAMES).max(LEAST));
            refinement(&mut columns[1], context, found, (height - NAMES).max(LEAST));
        });
    }
}

/// The spacing of the shifts of a search with `side` shifts per axis, m.
pub(crate) fn step_m(state: &State, found: &Registered, side: u32) -> f64 {
    let columns = state.array(ArrayName::SENSOR).ready().map(|sensor| sensor.size()[0]);
    // Without the sensor's depth map, whose pixel size is the spacing, derive it from the search range.
    columns
        .and_then(|columns| sensor_pixel_m(found, columns))
        .unwrap_or(2.0 * found.search_m / f64::from(side.saturating_sub(1).max(1)))
}

/// The mean distance J over Δx and Δy.
fn coarse(ui: &mut Ui, context: &PartContext<'_>, found: &Registered, height: f32) {
    let Some(raster) = ready(ui, context.state.array(ArrayName::COARSE_SEARCH), "coarse search") else {
        return;
    };
    let side = raster.size()[0];
    let step_m = step_m(context.state, found, side);
    let run = theme::run(context.state.cursor.run);
    chart_legend::wrapped(
        ui,
        "mean distance of the surfaces, by shift across the line of sight",
        &[
            (Mark::Plus, theme::strong(), "start".to_owned()),
            (Mark::Ring, run, "best".to_owned()),
            (
                Mark::Stroke(overlay::StrokeStyle::Dashed),
                theme::search(),
                "basin: the rock’s half width".to_owned(),
            ),
        ],
    );
    let area = Rect::from_min_size(ui.cursor().min, vec2(ui.available_width(), height - WORDS));
    let (left, bar) = area.split_left_right_at_x(area.right() - BAR);
    let mut part = ui.new_child(UiBuilder::new().max_rect(left).id_salt("coarse search"));
    let at = surface(&mut part, raster, found, step_m, run);
    let colours = raster::ColourMap::Values(raster.levels);
    colour_bar(ui.painter(), bar.shrink2(vec2(2.0, 6.0)), colours, MM);
    ui.advance_cursor_after_rect(area);
    let words = match at.and_then(|at| cell(raster, step_m, at)) {
        Some(words) => words,
        None => resting(found, step_m, side),
    };
    ui.add(egui::Label::new(theme::note(words)).wrap());
}

/// The extent of the search, shown while the pointer is elsewhere.
fn resting(found: &Registered, step_m: f64, side: u32) -> String {
    let best = found.coarse_shift_m.map_or_else(String::new, |[x, y, z]| {
        format!("; best at Δx {:+.1}, Δy {:+.1}, Δz {:+.1} cm", x * 100.0, y * 100.0, z * 100.0)
    });
    let beyond = if found.search_m < found.half_width_m - step_m {
        ", as far as the start can be off"
    } else {
        ", the whole basin"
    };
    format!(
        "{side} × {side} shifts of {:.1} mm, to ± {:.1} cm{beyond}; half width {:.1} cm{best}",
        step_m * 1000.0,
        found.search_m * 100.0,
        found.half_width_m * 100.0
    )
}

/// The value under the pointer; `None` outside the search.
fn cell(raster: &Raster, step_m: f64, [x_cm, y_cm]: [f64; 2]) -> Option<String> {
    let steps = i64::from(raster.size()[0] / 2);
    let index = |cm: f64| (cm / (100.0 * step_m)).round() as i64 + steps;
    let (column, row) = (index(x_cm), index(y_cm));
    if column < 0 || row < 0 || column > 2 * steps || row > 2 * steps {
        return None;
    }
    let value = raster.at(column, row).map_or_else(|| "too little overlaps".to_owned(), |v| MM.format(v));
    Some(format!("Δx {x_cm:+.1}, Δy {y_cm:+.1} cm: {value}"))
}

/// The plot of the coarse search. Returns the shift under the pointer, cm.
fn surface(ui: &mut Ui, raster: &Raster, found: &Registered, step_m: f64, run: Color32) -> Option<[f64; 2]> {
    raster.set_colour_map(raster::ColourMap::Values(raster.levels));
    let [width, height] = raster.size().map(|side| f64::from(side) * step_m * 100.0);
    let basin_cm = found.half_width_m * 100.0;
    let reach = basin_cm.max(width / 2.0) * 1.05;
    let plot = Plot::new("coarse search")
        .height(ui.available_height())
        .data_aspect(1.0)
        .allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .include_x(-reach)
        .include_x(reach)
        .include_y(-reach)
        .include_y(reach)
        .show_grid(false)
        .x_axis_label(theme::note("Δx, cm"))
        .y_axis_label(theme::note("Δy, cm (down)"))
        .x_axis_formatter(plain)
        // The sensor's y points down, the plot's up.
        .y_axis_formatter(|mark, range| plain(egui_plot::GridMark { value: 0.0 - mark.value, ..mark }, range))
        .label_formatter(|_| None);
    let texture = raster.texture.id();
    let best = found.coarse_shift_m.map(|[x, y, _]| [x * 100.0, -y * 100.0]);
    let response = plot.show(ui, move |plot| {
        let size = vec2(width as f32, height as f32);
        plot.image(PlotImage::new("J", texture, PlotPoint::new(0.0, 0.0), size).allow_hover(false));
        let outline: Vec<[f64; 2]> = (0..=OUTLINE)
            .map(|i| (std::f64::consts::TAU * f64::from(i) / f64::from(OUTLINE)).sin_cos())
            .map(|(sin, cos)| [basin_cm * cos, basin_cm * sin])
            .collect();
        let line = Line::new("basin", outline).color(theme::search()).style(LineStyle::dashed_dense());
        plot.line(line.width(1.5).allow_hover(false));
        let start = Points::new("start", [0.0, 0.0]).color(theme::strong()).radius(6.0);
        plot.points(start.shape(MarkerShape::Plus).allow_hover(false));
        if let Some(best) = best {
            let ring = Points::new("best", best).color(run).radius(6.0).filled(false);
            plot.points(ring.shape(MarkerShape::Circle).allow_hover(false));
        }
        plot.pointer_coordinate()
    });
    let hovered = response.response.hovered();
    response.inner.filter(|_| hovered).map(|at| [at.x, -at.y])
}

/// The mean distance J over the evaluations of the refinement.
fn refinement(ui: &mut Ui, context: &PartContext<'_>, found: &Registered, height: f32) {
    if found.mean_m[2].is_none() {
        panels::missing(ui, "The refinement.", &why_not(context, "refinement"));
        return;
    }
    let Some(path) = ready(ui, context.state.refine_path(), "refinement") else { return };
    let Some(last) = path.last() else {
        panels::missing(ui, "", "The refinement made no step: it stayed where the coarse search ended.");
        return;
    };
    let method = match found.method {
        Method::SimplexL1 => "simplex",
        Method::PointToPlane => "point to plane",
    };
    let runs = last.run + 1;
    let title = format!("mean distance, mm, over the evaluations of the refinement ({method})");
    let run_name = |run: u32| if run == 0 { "first run".to_owned() } else { format!("restart {run}") };
    let entries: Vec<(Mark, Color32, String)> =
        (0..runs).map(|run| (Mark::Dot, theme::run(run as usize), run_name(run))).collect();
    chart_legend::wrapped(ui, &title, &entries);
    let nearest = plot(ui, path, height - WORDS);
    ui.add(egui::Label::new(theme::note(words(nearest.unwrap_or(last)))).wrap());
}

/// The plot of the refinement. Returns the step nearest to the pointer.
fn plot<'a>(ui: &mut Ui, path: &'a [PathStep], height: f32) -> Option<&'a PathStep> {
    let plot = Plot::new("refinement")
        .height(height)
        .allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .include_y(0.0)
        .set_margin_fraction(vec2(0.04, 0.08))
        .x_axis_label(theme::note("evaluations"))
        .y_axis_min_width(26.0)
        .x_axis_formatter(plain)
        .y_axis_formatter(plain)
        .label_formatter(|_| None);
    let place = |step: &PathStep| [f64::from(step.evaluations), step.mean_m * 1000.0];
    let response = plot.show(ui, |plot| {
        let way: Vec<[f64; 2]> = path.iter().map(place).collect();
        plot.line(Line::new("way", way).color(theme::weak()).width(1.0).allow_hover(false));
        for run in 0..=path.last().map_or(0, |step| step.run) {
            let points: Vec<[f64; 2]> = path.iter().filter(|step| step.run == run).map(place).collect();
            let points = Points::new("steps", points).color(theme::run(run as usize)).radius(2.5);
            plot.points(points.shape(MarkerShape::Circle).allow_hover(false));
        }
        let at = plot.response().hovered().then(|| plot.pointer_coordinate()).flatten()?;
        let away = |step: &&PathStep| (f64::from(step.evaluations) - at.x).abs();
        let nearest = path.iter().min_by(|a, b| away(a).total_cmp(&away(b)))?;
        let ring = Points::new("here", place(nearest)).color(theme::accent()).radius(5.0).filled(false);
        plot.points(ring.shape(MarkerShape::Circle).allow_hover(false));
        Some(nearest)
    });
    response.inner
}

/// A step of the refinement in words.
fn words(step: &PathStep) -> String {
    let [x, y, z] = step.shift_m.map(|m| m * 100.0);
    let [a, b, c] = step.turn_rad.map(f64::to_degrees);
    format!(
        "evaluation {}: {:.2} mm; shift {x:+.2}, {y:+.2}, {z:+.2} cm; turn {a:+.2}, {b:+.2}, {c:+.2}° (axes of the sensor)",
        step.evaluations,
        step.mean_m * 1000.0
    )
}
