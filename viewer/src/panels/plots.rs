//! Plots over the steps of a run: scores, pixel error, and position error with its 1 σ.

use egui::{Id, Ui};
use egui_plot::{
    Corner, GridMark, HLine, Legend, Line, LineStyle, MarkerShape, Plot, PlotPoint, PlotUi, Points, VLine,
};
use sightline_core::session::view::RunView;
use sightline_core::trace::StepRow;

use crate::command::{Command, Go};
use crate::state::State;
use crate::{panels, theme};

/// Shows the plots, one below the other over the same steps.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(run) = state.run() else {
        panels::missing(ui, &state.missing_target());
        return;
    };
    let limit = |group: &str, key: &str| state.setting(group, key).and_then(|v| v.as_f64());
    let has_truth = run.rows.iter().any(|row| row.err_m.is_some());
    let count = if has_truth { 3.0 } else { 2.0 };
    let height = ((ui.available_height() - 4.0 * (count - 1.0)) / count).max(40.0);
    let mut frame = |ui: &mut Ui, name: &str, unit: &str, is_last: bool, paint: &dyn Fn(&mut PlotUi<'_>)| {
        if let Some(step) = plot(ui, state, (name, unit), height, is_last, paint) {
            out.push(Command::Go(Go::Step(step)));
        }
    };
    let colour = theme::run(run.number);
    frame(ui, "scores", "", false, &|plot| {
        series(plot, run, "ncc", colour, MarkerShape::Circle, |row| row.ncc);
        series(plot, run, "stereo", theme::PREDICTION, MarkerShape::Square, |row| row.stereo_score);
        threshold(plot, "ncc_min", limit("limits", "ncc_min"));
        threshold(plot, "stereo_ncc_min", limit("limits", "stereo_ncc_min"));
        plot.hline(HLine::new("", 1.0).color(egui::Color32::TRANSPARENT).allow_hover(false));
    });
    if has_truth {
        frame(ui, "pixel error", "px", false, &|plot| {
            series(plot, run, "err_px", colour, MarkerShape::Circle, |row| row.err_px);
            plot.hline(HLine::new("", 0.0).color(egui::Color32::TRANSPARENT).allow_hover(false));
        });
    }
    frame(ui, "position", "cm", true, &|plot| {
        series(plot, run, "σ", theme::WEAK, MarkerShape::Diamond, |row| row.sigma_m.map(|v| v * 100.0));
        series(plot, run, "err", colour, MarkerShape::Circle, |row| row.err_m.map(|v| v * 100.0));
        plot.hline(HLine::new("", 0.0).color(egui::Color32::TRANSPARENT).allow_hover(false));
    });
}

/// One plot. Returns the step that was clicked.
fn plot(
    ui: &mut Ui,
    state: &State,
    (name, unit): (&str, &str),
    height: f32,
    is_last: bool,
    paint: &dyn Fn(&mut PlotUi<'_>),
) -> Option<usize> {
    let label = if unit.is_empty() { name.to_owned() } else { format!("{name}, {unit}") };
    let last = state.stop_count().saturating_sub(1) as f64;
    let whole = |mark: GridMark| {
        if mark.value.fract() == 0.0 { format!("{}", mark.value) } else { String::new() }
    };
    let mut plot = Plot::new((name, &state.traverse.as_ref().map(|t| t.id.clone())))
        .height(height)
        .allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .show_axes([is_last, true])
        .include_x(-0.3)
        .include_x(last + 0.3)
        .y_axis_min_width(34.0)
        .y_axis_label(theme::note(label))
        .x_axis_formatter(move |mark, _| whole(mark))
        .link_axis(Id::unique("steps"), [true, false])
        .label_formatter(|_| None)
        .legend(Legend::default().position(Corner::LeftBottom).text_style(egui::TextStyle::Small).background_alpha(0.7));
    if is_last {
        plot = plot.x_axis_label(theme::note("step"));
    }
    let response = plot.show(ui, |plot| {
        plot.vline(VLine::new("", state.cursor.step as f64).color(theme::ACCENT).width(1.5).allow_hover(false));
        paint(plot);
        let clicked = plot.response().clicked().then(|| plot.pointer_coordinate()).flatten();
        clicked.map(|at: PlotPoint| at.x.round().clamp(0.0, last) as usize)
    });
    response.inner
}

/// A line over the steps that have a value, broken where one has none.
fn series(
    plot: &mut PlotUi<'_>,
    run: &RunView,
    name: &str,
    colour: egui::Color32,
    shape: MarkerShape,
    value: impl Fn(&StepRow) -> Option<f64>,
) {
    let points: Vec<Option<[f64; 2]>> =
        run.rows.iter().map(|row| value(row).filter(|v| v.is_finite()).map(|v| [row.step as f64, v])).collect();
    for piece in pieces(&points) {
        plot.line(Line::new(name, piece.clone()).color(colour).width(1.5));
        plot.points(Points::new(name, piece).color(colour).radius(2.5).shape(shape));
    }
}

/// The runs of consecutive points.
fn pieces(points: &[Option<[f64; 2]>]) -> Vec<Vec<[f64; 2]>> {
    let runs = points.split(Option::is_none);
    runs.filter(|run| !run.is_empty()).map(|run| run.iter().copied().flatten().collect()).collect()
}

fn threshold(plot: &mut PlotUi<'_>, name: &str, value: Option<f64>) {
    if let Some(value) = value {
        let line = HLine::new(name, value).color(theme::FAILED).style(LineStyle::dashed_dense());
        plot.hline(line.width(1.0).allow_hover(false));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_broken_where_there_is_no_value() {
        let points = [None, Some([1.0, 2.0]), Some([2.0, 3.0]), None, Some([4.0, 1.0])];
        assert_eq!(pieces(&points), vec![vec![[1.0, 2.0], [2.0, 3.0]], vec![[4.0, 1.0]]]);
        assert!(pieces(&[None, None]).is_empty());
    }
}
