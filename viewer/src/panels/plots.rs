//! Plots over the steps of a run: scores, or confidence and inliers; pixel error; position error with its 1 σ.

use std::collections::HashMap;

use egui::{Color32, Id, Ui, vec2};
use egui_plot::{
    GridInput, GridMark, HLine, HoverPosition, Line, LineStyle, MarkerShape, Plot, PlotPoint, PlotUi, Points,
};
use sightline_core::session::view::RunView;
use sightline_core::settings::TrackerKind;
use sightline_core::trace::StepRow;

use super::names::{self, HEIGHT as NAMES};
use super::sheets::sheet::state_of;
use super::sheets::{Column, Sheet};
use super::step_marks::{cursors, point};
use crate::command::{Command, Go};
use crate::overlay::{self, Mark};
use crate::state::State;
use crate::state::compare::Other;
use crate::state::tracker::confidence_of;
use crate::{panels, theme, thin};

/// What the panel is for.
const PURPOSE: &str = "Scores or confidence, and errors of the run, step by step.";

/// A line of a plot: its name, colour and shape, and how a step's value is got.
struct Series {
    name: &'static str,
    colour: Color32,
    mark: Mark,
    shape: MarkerShape,
    value: fn(&RunView, &StepRow) -> Option<f64>,
}

/// One plot with its lines and thresholds.
struct Chart {
    title: &'static str,
    unit: &'static str,
    series: Vec<Series>,
    thresholds: Vec<f64>,
    /// What the thresholds are.
    threshold: String,
    /// Values that are always in view, so that nothing looks large that is not.
    in_view: [f64; 2],
}

/// Shows the plots, one below the other over the same steps.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(run) = state.run() else {
        panels::missing(ui, PURPOSE, &state.missing_target());
        return;
    };
    let charts = charts(state, run);
    let derived = &state.ask.derived;
    let count = (charts.len() + derived.len()) as f32;
    ui.spacing_mut().item_spacing.y = 1.0;
    let axis = 16.0;
    let height = ((ui.available_height() - axis - count * (NAMES + 2.0)) / count).max(24.0);
    for (i, chart) in charts.iter().enumerate() {
        let is_last = i + 1 == charts.len() && derived.is_empty();
        let (title, mut lines) = names_of(chart);
        lines.extend(state.others().iter().map(|o| (o.look.mark, o.look.colour, state.run_label(o.name))));
        names::show(ui, &title, &lines);
        let height = if is_last { height + axis } else { height };
        if let Some(step) = plot(ui, state, run, (chart, height, is_last), out) {
            out.push(Command::Go(Go::Step(step)));
        }
    }
    for at in 0..derived.len() {
        let is_last = at + 1 == derived.len();
        super::derived::show(ui, state, at, if is_last { height + axis } else { height }, is_last, out);
    }
}

/// The plots as one table: every line a column, the compared runs beside it, and what is derived.
pub(super) fn sheets(state: &State) -> Result<Vec<Sheet>, String> {
    let run = state.run().ok_or_else(|| state.missing_target())?;
    let (charts, others) = (charts(state, run), state.others());
    let mut columns = vec![Column::new("state", "")];
    for (chart, line) in charts.iter().flat_map(|chart| chart.series.iter().map(move |line| (chart, line))) {
        let name = if chart.series.len() > 1 {
            format!("{} {}", chart.title, line.name)
        } else {
            chart.title.to_owned()
        };
        columns.push(Column::new(&name, chart.unit));
        let beside = others
            .iter()
            .map(|other| Column::new(format!("{name}, {}", state.run_label(other.name)), chart.unit));
        columns.extend(beside);
    }
    columns.extend(state.ask.derived.iter().map(|derived| {
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
                .filter_map(|row| Some((state.own_beside(other.name, row.step)?, row)))
                .collect()
        })
        .collect();
    let mut sheet = Sheet::over_steps("Over the steps", columns);
    for row in &run.rows {
        let mut cells = vec![state_of(row)];
        for line in charts.iter().flat_map(|chart| &chart.series) {
            cells.push((line.value)(run, row).into());
            for (other, rows) in others.iter().zip(&beside) {
                cells.push(rows.get(&row.step).and_then(|row| (line.value)(other.run, row)).into());
            }
        }
        cells
            .extend((0..state.ask.derived.len()).map(|at| super::derived::value(state, at, row.step).into()));
        sheet.step(row.step, state.cursor.step, cells);
    }
    Ok(vec![sheet])
}

fn series(
    name: &'static str,
    colour: Color32,
    mark: Mark,
    shape: MarkerShape,
    value: fn(&RunView, &StepRow) -> Option<f64>,
) -> Series {
    Series { name, colour, mark, shape, value }
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
        TrackerKind::Shape => vec![confidence(state, colour)],
    };
    let mut position = vec![series("σ", theme::weak(), diamond, MarkerShape::Diamond, |_, row| {
        row.sigma_m.map(|v| v * 100.0)
    })];
    if run.rows.iter().any(|row| row.err_m.is_some()) {
        let error = series("error", colour, ring, MarkerShape::Circle, |_, row| row.err_px);
        charts.push(Chart {
            title: "pixel error",
            unit: "px",
            series: vec![error],
            thresholds: Vec::new(),
            threshold: String::new(),
            in_view: [0.0, 1.0],
        });
        position
            .push(series("error", colour, ring, MarkerShape::Circle, |_, row| row.err_m.map(|v| v * 100.0)));
    }
    charts.push(Chart {
        title: "position error",
        unit: "cm",
        series: position,
        thresholds: Vec::new(),
        threshold: String::new(),
        in_view: [0.0, 1.0],
    });
    charts
}

/// The scores of a template run with what is asked of them.
fn scores(state: &State, colour: Color32) -> Chart {
    let limit = |key: &str| state.setting("limits", key).and_then(|v| v.as_f64());
    Chart {
        title: "scores",
        unit: "",
        series: vec![
            series("ncc", colour, Mark::Ring, MarkerShape::Circle, |_, row| row.ncc),
            series("stereo", theme::prediction(), Mark::Square, MarkerShape::Square, |_, row| {
                row.stereo_score
            }),
        ],
        thresholds: limit("ncc_min").into_iter().chain(limit("stereo_ncc_min")).collect(),
        threshold: "least allowed".to_owned(),
        in_view: [0.9, 1.0],
    }
}

/// The confidence of a run by features, with where the target is lost and where it returns (R184, R185).
fn confidence(state: &State, colour: Color32) -> Chart {
    let limit = |key: &str| state.setting("limits", key).and_then(|v| v.as_f64());
    let [lost, back] = ["confidence_min", "confidence_return"].map(limit);
    let name = |limit: Option<f64>| limit.map_or_else(|| "none".to_owned(), |v| v.to_string());
    Chart {
        title: "confidence",
        unit: "",
        series: vec![series("confidence", colour, Mark::Ring, MarkerShape::Circle, confidence_of)],
        thresholds: lost.into_iter().chain(back).collect(),
        threshold: format!("lost below {}, back at {}", name(lost), name(back)),
        in_view: [0.0, 1.0],
    }
}

/// Its matches that agree with the motion.
fn inliers(state: &State, colour: Color32) -> Chart {
    let half = state.setting("features", "confidence_matches").and_then(|v| v.as_f64());
    let value = |_: &RunView, row: &StepRow| row.inliers.map(|count| count as f64);
    Chart {
        title: "inliers",
        unit: "",
        series: vec![series("inliers", colour, Mark::Dot, MarkerShape::Circle, value)],
        thresholds: half.into_iter().collect(),
        threshold: "confidence one half".to_owned(),
        in_view: [0.0, half.unwrap_or_default()],
    }
}

/// What the row above a plot names.
fn names_of(chart: &Chart) -> (String, Vec<(Mark, Color32, String)>) {
    let unit = if chart.unit.is_empty() { String::new() } else { format!(", {}", chart.unit) };
    let mut names: Vec<_> = chart.series.iter().map(|s| (s.mark, s.colour, s.name.to_owned())).collect();
    if !chart.thresholds.is_empty() {
        names.push((Mark::Stroke(overlay::Line::Dashed), theme::failed(), chart.threshold.clone()));
    }
    (format!("{}{unit}", chart.title), names)
}

/// One plot. Returns the step that was clicked.
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
            .label_formatter(|near| match near {
                HoverPosition::NearDataPoint { plot_name, position, .. } => {
                    Some(format!("step {}\n{plot_name} {:.3}", position.x, position.y))
                }
                HoverPosition::Elsewhere { .. } => None,
            });
    let response = plot.show(ui, |plot| {
        cursors(plot, state);
        for &value in &chart.thresholds {
            let line = HLine::new("", value).color(theme::failed()).style(LineStyle::dashed_dense());
            plot.hline(line.width(1.0).allow_hover(false));
        }
        for line in &chart.series {
            paint_series(plot, run, line);
        }
        for other in state.others() {
            chart.series.iter().for_each(|line| paint_other(plot, state, run, &other, line));
        }
        let clicked = plot.response().clicked().then(|| plot.pointer_coordinate()).flatten();
        clicked.map(|at: PlotPoint| at.x.round().clamp(0.0, last) as usize)
    });
    point(&response, last, out);
    let plotted: Vec<(&str, f64)> = state.row().map(|row| asked_of(chart, row)).unwrap_or_default();
    super::breakpoints::menu(&response.response, &plotted, out);
    response.inner
}

/// What a chart shows of a row, as expressions with their values.
fn asked_of(chart: &Chart, row: &StepRow) -> Vec<(&'static str, f64)> {
    let column = |line: &Series| match (chart.title, line.name) {
        (_, "ncc") => Some(("ncc", row.ncc?)),
        (_, "stereo") => Some(("stereo_score", row.stereo_score?)),
        (_, "confidence") => Some(("confidence", row.confidence?)),
        (_, "inliers") => Some(("inliers", row.inliers? as f64)),
        (_, "σ") => Some(("sigma_m", row.sigma_m?)),
        ("pixel error", _) => Some(("err_px", row.err_px?)),
        ("position error", _) => Some(("err_m", row.err_m?)),
        _ => None,
    };
    chart.series.iter().filter_map(column).collect()
}

/// A plot over the steps, which moves with its neighbours; only the lowest one has numbers of steps.
pub fn over_steps<'a>(plot: Plot<'a>, last: f64, is_last: bool) -> Plot<'a> {
    plot.allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .show_axes([is_last, true])
        .include_x(-0.4)
        .include_x(last + 0.4)
        .y_axis_min_width(30.0)
        .x_axis_formatter(
            |mark: GridMark, _: &std::ops::RangeInclusive<f64>| {
                if mark.value.fract() == 0.0 { format!("{}", mark.value) } else { String::new() }
            },
        )
        .link_axis(Id::unique("steps"), [true, false])
}

/// A line over the steps that have a value, broken where one has none.
fn paint_series(plot: &mut PlotUi<'_>, run: &RunView, line: &Series) {
    let point =
        |row: &StepRow| (line.value)(run, row).filter(|v| v.is_finite()).map(|v| [row.step as f64, v]);
    let points: Vec<Option<[f64; 2]>> = run.rows.iter().map(point).collect();
    for piece in pieces(&points) {
        plot.line(Line::new(line.name, piece.clone()).color(line.colour).width(1.5).allow_hover(false));
        plot.points(
            Points::new(line.name, thin::marks(piece)).color(line.colour).radius(2.5).shape(line.shape),
        );
    }
}

/// A line of a compared run over the steps of this one; what is not the run's own colour is dashed.
fn paint_other(plot: &mut PlotUi<'_>, state: &State, run: &RunView, other: &Other<'_>, line: &Series) {
    let point = |row: &StepRow| {
        let step = state.own_beside(other.name, row.step)?;
        (line.value)(other.run, row).filter(|v| v.is_finite()).map(|v| [step as f64, v])
    };
    let points: Vec<Option<[f64; 2]>> = other.run.rows.iter().map(point).collect();
    let is_main = line.colour == theme::run(run.number);
    let (colour, name) = (other.look.colour, format!("{}, {}", line.name, state.run_label(other.name)));
    for piece in pieces(&points) {
        let style = if is_main { LineStyle::Solid } else { LineStyle::dashed_loose() };
        plot.line(Line::new("", piece.clone()).color(colour).style(style).width(1.5).allow_hover(false));
        if is_main {
            let points = Points::new(name.clone(), thin::marks(piece)).color(colour).radius(3.0);
            plot.points(points.shape(super::uncertainty::shape(other.look.mark)));
        }
    }
}

/// Two to four ticks at round numbers, however low a plot is.
pub(super) fn few_marks(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let wanted = (high - low).max(1e-9) / 2.5;
    let decade = 10_f64.powf(wanted.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * decade).into_iter().find(|step| *step >= wanted);
    let step = step.unwrap_or(10.0 * decade);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last).map(|i| GridMark { value: i as f64 * step, step_size: high - low }).collect()
}

/// A tick's number with the digits that it needs.
pub(super) fn plain(mark: GridMark, _: &std::ops::RangeInclusive<f64>) -> String {
    format!("{}", (mark.value * 1e6).round() / 1e6)
}

/// The runs of consecutive points, each no longer than its curve needs.
pub(super) fn pieces(points: &[Option<[f64; 2]>]) -> Vec<Vec<[f64; 2]>> {
    let runs = points.split(Option::is_none);
    let pieces = runs.filter(|run| !run.is_empty()).map(|run| run.iter().copied().flatten().collect());
    pieces.map(thin::curve).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_stand_at_few_round_numbers() {
        let values = |low: f64, high: f64| -> Vec<f64> {
            few_marks(GridInput { bounds: (low, high), base_step_size: 1.0 })
                .iter()
                .map(|m| m.value)
                .collect()
        };
        assert_eq!(values(-1.0, 12.3), vec![0.0, 10.0]);
        assert_eq!(values(0.0, 1.1), vec![0.0, 0.5, 1.0]);
        assert_eq!(values(-2.0, 43.0), vec![0.0, 20.0, 40.0]);
    }

    #[test]
    fn a_line_is_broken_where_there_is_no_value() {
        let points = [None, Some([1.0, 2.0]), Some([2.0, 3.0]), None, Some([4.0, 1.0])];
        assert_eq!(pieces(&points), vec![vec![[1.0, 2.0], [2.0, 3.0]], vec![[4.0, 1.0]]]);
        assert!(pieces(&[None, None]).is_empty());
    }
}
