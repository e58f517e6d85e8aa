//! Plots over the steps of a run: scores, or confidence and inliers; pixel error; position error with its 1σ.

use std::collections::HashMap;

use egui::{Color32, RichText, ScrollArea, Ui, vec2};
use egui_plot::{HLine, HoverPosition, Line, LineStyle, MarkerShape, Plot, PlotPoint, PlotUi, Points};
use sightline_record::{Kind, Quantity, StageSchema, Unit};
use sightline_session::records;
use sightline_session::step::StepRow;
use sightline_session::view::RunView;
use sightline_track::settings::TrackerKind;

use crate::breakpoints::BreakpointCommand;
use crate::command::{Command, Go};
use crate::compare::state::Other;
use crate::drawing::decimate;
use crate::drawing::overlay;
use crate::drawing::overlay::Mark;
use crate::figure;
use crate::panels::chart::{over_steps, polylines, shape, step_of};
use crate::panels::chart_legend;
use crate::panels::chart_legend::HEIGHT as NAMES;
use crate::panels::panel::{Panel, TableOf};
use crate::panels::sheets::sheet::state_of;
use crate::panels::sheets::{Column, Sheet};
use crate::panels::step_marks::{cursors, point};
use crate::panels::{digits, entry};
use crate::state::State;
use crate::state::tracker::confidence_of;
use crate::theme;

/// A line of a plot: a column of the run, which declares its name and unit, with a colour and a shape.
struct Series {
    column: &'static str,
    colour: Color32,
    mark: Mark,
    shape: MarkerShape,
    /// Whether a step belongs to the line.
    is_meant: fn(&RunView, &StepRow) -> bool,
}

impl Series {
    fn name(&self) -> &'static str {
        records::row_quantity(self.column).map_or(self.column, |quantity| quantity.label.as_ref())
    }

    /// Returns a function that reads the value of a step in `unit`, for use on any number of steps.
    fn reader(&self, unit: Unit) -> impl Fn(&RunView, &StepRow) -> Option<f64> {
        let declared = records::row_quantity(self.column).map_or(unit, |quantity| quantity.unit);
        let factor = unit.per_base() / declared.per_base();
        let field = FIELDS.iter().find(|(column, _)| *column == self.column).map(|(_, field)| *field);
        let is_meant = self.is_meant;
        move |run, row| Some(field?(row)? * factor).filter(|_| is_meant(run, row))
    }
}

/// Reads a number of a row.
type Field = fn(&StepRow) -> Option<f64>;

/// The plotted columns with their fields, because every frame reads them for all steps.
const FIELDS: [(&str, Field); 7] = [
    ("ncc", |row| row.ncc),
    ("stereo_score", |row| row.stereo_score),
    ("inliers", |row| row.inliers.map(|count| count as f64)),
    ("confidence", |row| row.confidence),
    ("err_px", |row| row.err_px),
    ("err_m", |row| row.err_m),
    ("sigma_m", |row| row.sigma_m),
];

/// One plot with its lines and thresholds.
struct Chart {
    title: &'static str,
    unit: Unit,
    series: Vec<Series>,
    thresholds: Vec<f64>,
    /// The label of the thresholds.
    threshold: String,
    /// Values that are always in view, so that small values do not look large.
    in_view: [f64; 2],
}

/// The panel “Over the steps”.
pub(crate) struct Plots;

impl Panel for Plots {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        state.run().is_none().then(|| state.missing_target())
    }

    fn table(&self) -> Option<TableOf> {
        Some(sheets)
    }
}

/// Shows the plots, one below the other over the same steps.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(run) = state.run() else { return };
    let charts = charts(state, run);
    let derived = &state.breakpoints.derived;
    let count = (charts.len() + derived.len()) as f32;
    ui.spacing_mut().item_spacing.y = 1.0;
    let axis = 16.0;
    // The first row of names also contains a button.
    let button = (ui.spacing().interact_size.y - NAMES).max(0.0);
    let height = ((ui.available_height() - axis - button - count * (NAMES + 2.0)) / count).max(24.0);
    for (i, chart) in charts.iter().enumerate() {
        let is_last = i + 1 == charts.len() && derived.is_empty();
        let (title, mut lines) = names_of(chart);
        lines.extend(state.others().iter().map(|o| (o.style.mark, o.style.colour, state.run_label(o.name))));
        if i == 0 && figure::is_on_paper() {
            let line = Mark::Stroke(overlay::StrokeStyle::Solid);
            lines.push((line, theme::accent(), format!("step {}", state.cursor.step)));
        }
        ui.horizontal(|ui| {
            // The button comes first, so that it stays in the panel if the names exceed the width.
            if i == 0 && !figure::is_on_paper() {
                choice(ui, out);
            }
            chart_legend::show(ui, &title, &lines);
        });
        let height = if is_last { height + axis } else { height };
        if let Some(step) = plot(ui, state, run, (chart, height, is_last), out) {
            out.push(Command::Go(Go::Step(step)));
        }
    }
    for at in 0..derived.len() {
        let is_last = at + 1 == derived.len();
        crate::breakpoints::derived_plot::show(
            ui,
            state,
            at,
            if is_last { height + axis } else { height },
            is_last,
            out,
        );
    }
}

/// The menu that adds any number that a stage declares to the plots.
fn choice(ui: &mut Ui, out: &mut Vec<Command>) {
    let stages = records::stages().iter().map(sightline_record::Stage::schema);
    let menu = ui.menu_button(RichText::new("plot …").size(11.0), |ui| {
        for schema in stages.filter(|schema| schema.quantities.iter().any(is_plotted)) {
            ui.menu_button(schema.stage.as_ref(), |ui| {
                ScrollArea::vertical().show(ui, |ui| {
                    for (name, quantity) in names_to_plot(schema) {
                        let chosen = entry(ui, false, &name).on_hover_text(quantity.description.as_ref());
                        if chosen.clicked() {
                            out.push(Command::Breakpoints(BreakpointCommand::Plot(name)));
                        }
                    }
                });
            });
        }
    });
    menu.response.on_hover_text("Plot any number that a stage declares");
}

/// The names of a stage's numbers, as used in expressions.
pub(crate) fn names_to_plot(schema: &StageSchema) -> impl Iterator<Item = (String, &Quantity)> {
    // The columns of the row have no prefix.
    let stage = if schema.path.is_empty() { String::new() } else { format!("{}.", schema.stage) };
    let plotted = schema.quantities.iter().filter(|quantity| is_plotted(quantity));
    plotted.flat_map(move |quantity| {
        let stage = stage.clone();
        quantity.columns().into_iter().map(move |column| (format!("{stage}{column}"), quantity))
    })
}

fn is_plotted(quantity: &Quantity) -> bool {
    quantity.kind != Kind::Word
}

/// The plots as one table: a column for every line, followed by those of the compared runs, and the derived values.
pub(crate) fn sheets(state: &State) -> Result<Vec<Sheet>, String> {
    let run = state.run().ok_or_else(|| state.missing_target())?;
    let (charts, others) = (charts(state, run), state.others());
    let mut columns = vec![Column::new("state", "")];
    for (chart, line) in charts.iter().flat_map(|chart| chart.series.iter().map(move |line| (chart, line))) {
        let name = if chart.series.len() > 1 {
            format!("{} {}", chart.title, line.name())
        } else {
            chart.title.to_owned()
        };
        columns.push(Column::new(&name, chart.unit.symbol()));
        let beside = others.iter().map(|other| {
            Column::new(format!("{name}, {}", state.run_label(other.name)), chart.unit.symbol())
        });
        columns.extend(beside);
    }
    columns.extend(state.breakpoints.derived.iter().map(|derived| {
        let unit = derived.answer.as_ref().map_or("", |answer| answer.unit.as_str());
        let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
        Column::new(format!("{}{unit}", derived.expression), "")
    }));
    let beside: Vec<HashMap<usize, &StepRow>> = others
        .iter()
        .map(|other| {
            other
                .run
                .rows
                .iter()
                .filter_map(|row| Some((state.own_aligned_step(other.name, row.step)?, row)))
                .collect()
        })
        .collect();
    let mut sheet = Sheet::over_steps("Over the steps", columns);
    let lines = charts.iter().flat_map(|chart| chart.series.iter().map(|line| line.reader(chart.unit)));
    let lines: Vec<_> = lines.collect();
    for row in &run.rows {
        let mut cells = vec![state_of(row)];
        for value in &lines {
            cells.push(value(run, row).into());
            for (other, rows) in others.iter().zip(&beside) {
                let there = rows.get(&row.step).and_then(|row| value(other.run, row));
                cells.push(there.into());
            }
        }
        cells.extend(
            (0..state.breakpoints.derived.len())
                .map(|at| crate::breakpoints::derived_plot::value(state, at, row.step).into()),
        );
        sheet.step(row.step, state.cursor.step, cells);
    }
    Ok(vec![sheet])
}

const fn series(column: &'static str, colour: Color32, mark: Mark, shape: MarkerShape) -> Series {
    Series { column, colour, mark, shape, is_meant: |_, _| true }
}

/// The plots that this run has data for.
fn charts(state: &State, run: &RunView) -> Vec<Chart> {
    let colour = theme::run(run.number);
    let (ring, diamond) = (Mark::Ring, Mark::Diamond);
    let mut charts = match run.settings.tracker {
        TrackerKind::Template => vec![scores(state, colour)],
        TrackerKind::Features | TrackerKind::Combined => {
            vec![confidence(state, colour), inliers(state, colour)]
        }
        _ => vec![confidence(state, colour)],
    };
    let mut position = vec![series("sigma_m", theme::weak(), diamond, MarkerShape::Diamond)];
    if run.rows.iter().any(|row| row.err_m.is_some()) {
        charts.push(Chart {
            title: "pixel error",
            unit: Unit::Pixel,
            series: vec![series("err_px", colour, ring, MarkerShape::Circle)],
            thresholds: Vec::new(),
            threshold: String::new(),
            in_view: [0.0, 1.0],
        });
        position.push(series("err_m", colour, ring, MarkerShape::Circle));
    }
    charts.push(Chart {
        title: "position error",
        unit: Unit::Centimetre,
        series: position,
        thresholds: Vec::new(),
        threshold: String::new(),
        in_view: [0.0, 1.0],
    });
    charts
}

/// The scores of a template run with their thresholds.
fn scores(state: &State, colour: Color32) -> Chart {
    let limits = &state.run_settings().limits;
    Chart {
        title: "scores",
        unit: Unit::One,
        series: vec![
            series("ncc", colour, Mark::Ring, MarkerShape::Circle),
            series("stereo_score", theme::text(), Mark::Square, MarkerShape::Square),
        ],
        thresholds: vec![limits.ncc_min, limits.stereo_ncc_min],
        threshold: "threshold".to_owned(),
        in_view: [0.9, 1.0],
    }
}

/// The confidence of a run by features, with the thresholds of loss and recovery (R184, R185).
fn confidence(state: &State, colour: Color32) -> Chart {
    let limits = &state.run_settings().limits;
    let (lost, back) = (limits.confidence_min, limits.confidence_return);
    let line = series("confidence", colour, Mark::Ring, MarkerShape::Circle);
    Chart {
        title: "confidence",
        unit: Unit::One,
        series: vec![Series { is_meant: |run, row| confidence_of(run, row).is_some(), ..line }],
        thresholds: vec![lost, back],
        threshold: format!("lost below {lost}, back at {back}"),
        in_view: [0.0, 1.0],
    }
}

/// The number of inliers of a run by features.
fn inliers(state: &State, colour: Color32) -> Chart {
    let half = state.run_settings().features.confidence_matches;
    Chart {
        title: "inliers",
        unit: Unit::One,
        series: vec![series("inliers", colour, Mark::Dot, MarkerShape::Circle)],
        thresholds: vec![half],
        threshold: "confidence one half".to_owned(),
        in_view: [0.0, half],
    }
}

/// The title and the names in the row above a plot.
fn names_of(chart: &Chart) -> (String, Vec<(Mark, Color32, String)>) {
    let symbol = chart.unit.symbol();
    let unit = if symbol.is_empty() { String::new() } else { format!(", {symbol}") };
    let mut names: Vec<_> = chart.series.iter().map(|s| (s.mark, s.colour, s.name().to_owned())).collect();
    if !chart.thresholds.is_empty() {
        names.push((Mark::Stroke(overlay::StrokeStyle::Dashed), theme::failed(), chart.threshold.clone()));
    }
    (format!("{}{unit}", chart.title), names)
}

/// One plot. Returns the clicked step.
fn plot(
    ui: &mut Ui,
    state: &State,
    run: &RunView,
    (chart, height, is_last): (&Chart, f32, bool),
    out: &mut Vec<Command>,
) -> Option<usize> {
    let last = state.stop_count().saturating_sub(1) as f64;
    let plot =
        over_steps(Plot::new((chart.title, state.traverse.as_ref().map(|t| t.id.clone()))), last, is_last)
            .height(height)
            .include_y(chart.in_view[0])
            .include_y(chart.in_view[1])
            .set_margin_fraction(vec2(0.0, 0.12))
            .label_formatter(|near| {
                let (HoverPosition::NearDataPoint { position, .. } | HoverPosition::Elsewhere { position }) =
                    near;
                Some(readout(state, run, chart, step_of(position.x, last)?))
            });
    let response = plot.show(ui, |plot| {
        cursors(plot, state);
        for &value in &chart.thresholds {
            let line = HLine::new("", value).color(theme::failed()).style(LineStyle::dashed_dense());
            plot.hline(line.width(1.0).allow_hover(false));
        }
        for line in &chart.series {
            paint_series(plot, run, chart.unit, line);
        }
        for other in state.others() {
            chart.series.iter().for_each(|line| paint_other(plot, state, run, &other, (chart.unit, line)));
        }
        let clicked = plot.response().clicked().then(|| plot.pointer_coordinate()).flatten();
        clicked.map(|at: PlotPoint| at.x.round().clamp(0.0, last) as usize)
    });
    point(&response, last, out);
    let plotted: Vec<(&str, f64)> = state.row().map(|row| plotted_values(chart, row)).unwrap_or_default();
    crate::breakpoints::panel::menu(&response.response, &plotted, out);
    response.inner
}

/// The values of a chart at a step, one a line: the selected run's, then those of the compared runs.
fn readout(state: &State, run: &RunView, chart: &Chart, step: usize) -> String {
    let symbol = chart.unit.symbol();
    let unit = if symbol.is_empty() { String::new() } else { format!(" {symbol}") };
    let mut words = format!("step {step}");
    let row = crate::state::row_of(run, step);
    for line in &chart.series {
        let value = line.reader(chart.unit);
        if let Some(value) = row.and_then(|row| value(run, row)) {
            words += &format!("\n{} {}{unit}", line.name(), digits(value));
        }
        for other in state.others() {
            let mut rows = other.run.rows.iter();
            let there = rows.find(|row| state.own_aligned_step(other.name, row.step) == Some(step));
            if let Some(value) = there.and_then(|row| value(other.run, row)) {
                words +=
                    &format!("\n{}, {} {}{unit}", line.name(), state.run_label(other.name), digits(value));
            }
        }
    }
    words
}

/// The values of a chart at a row, as expressions with their values.
fn plotted_values(chart: &Chart, row: &StepRow) -> Vec<(&'static str, f64)> {
    let columns = chart.series.iter().map(|line| line.column);
    columns.filter_map(|column| Some((column, records::row_value(row, column)?))).collect()
}

/// A line over the steps, broken at those without a value.
fn paint_series(plot: &mut PlotUi<'_>, run: &RunView, unit: Unit, line: &Series) {
    let value = line.reader(unit);
    let point = |row: &StepRow| value(run, row).filter(|v| v.is_finite()).map(|v| [row.step as f64, v]);
    let points: Vec<Option<[f64; 2]>> = run.rows.iter().map(point).collect();
    for polyline in polylines(&points) {
        plot.line(Line::new(line.name(), polyline.clone()).color(line.colour).width(1.5).allow_hover(false));
        plot.points(
            Points::new(line.name(), decimate::marks(polyline))
                .color(line.colour)
                .radius(2.5)
                .shape(line.shape),
        );
    }
}

/// A line of a compared run over the steps of the selected one; lines other than the main one are dashed.
fn paint_other(
    plot: &mut PlotUi<'_>,
    state: &State,
    run: &RunView,
    other: &Other<'_>,
    (unit, line): (Unit, &Series),
) {
    let value = line.reader(unit);
    let point = |row: &StepRow| {
        let step = state.own_aligned_step(other.name, row.step)?;
        value(other.run, row).filter(|v| v.is_finite()).map(|v| [step as f64, v])
    };
    let points: Vec<Option<[f64; 2]>> = other.run.rows.iter().map(point).collect();
    let is_main = line.colour == theme::run(run.number);
    let (colour, name) = (other.style.colour, format!("{}, {}", line.name(), state.run_label(other.name)));
    for polyline in polylines(&points) {
        let style = if is_main { LineStyle::Solid } else { LineStyle::dashed_loose() };
        plot.line(Line::new("", polyline.clone()).color(colour).style(style).width(1.5).allow_hover(false));
        if is_main {
            let points = Points::new(name.clone(), decimate::marks(polyline)).color(colour).radius(3.0);
            plot.points(points.shape(shape(other.style.mark)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plotted_fields_are_those_of_their_columns() {
        let row: StepRow = serde_json::from_value(serde_json::json!({
            "step": 3, "state": "tracking", "ncc": 0.5, "stereo_score": 0.25, "inliers": 7, "confidence": 0.75, "err_px": 2.5,
            "err_m": 0.125, "sigma_m": 0.0625, "position_in_rover": [1, 2, 3],
            "covariance_in_rover": [1, 0, 0, 0, 1, 0, 0, 0, 1],
        }))
        .unwrap();
        for (column, field) in FIELDS {
            assert!(field(&row).is_some() && field(&row) == records::row_value(&row, column), "{column}");
        }
    }
}
