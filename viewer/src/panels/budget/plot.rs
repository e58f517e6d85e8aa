//! Predicted against achieved: the budget's 3σ with and without tracking over range, and the run's errors (R47).
//!
//! Range is in metres; the error is in centimetres on a logarithmic scale, because the errors with and without tracking
//! differ by an order of magnitude (R45).

use egui::{Color32, Ui, vec2};
use egui_plot::{GridInput, GridMark, HLine, Line, LineStyle, MarkerShape, Plot, PlotUi, Points};
use sightline_geometry::estimate::error_budget::{Approach, PLACEMENT_NEED_M, StereoPair};
use sightline_session::step::StepRow;
use sightline_session::view::RunView;

use crate::drawing::decimate;
use crate::drawing::overlay;
use crate::drawing::overlay::Mark;
use crate::panels::chart::{few_marks, plain};
use crate::panels::chart_legend;
use crate::state::{State, run_letter};
use crate::theme;

/// Height of the plot, points.
const HEIGHT: f32 = 190.0;

/// Errors with a tick, cm.
const TICKS_CM: [f64; 13] = [0.01, 0.03, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 300.0];

/// Smaller errors are drawn at this value, m: a logarithmic scale has no zero.
const LEAST_M: f64 = 1e-4;

/// Samples of the calculator's curves.
const SAMPLES: usize = 60;

/// The lines of the plot: range in m and error in m.
struct Curves {
    without: Vec<[f64; 2]>,
    with: Vec<[f64; 2]>,
    achieved: Vec<[f64; 2]>,
}

/// Shows the plot of the selected run, or of the calculator if no run has a budget.
pub(crate) fn show(ui: &mut Ui, state: &State, pair: Option<&StereoPair>) {
    let of_run = state.run().map(of_run).filter(|curves| !curves.with.is_empty());
    let source = match (&of_run, state.run()) {
        (Some(_), Some(run)) => format!("run {} over range, 3σ, cm", run_letter(run.number)),
        _ => "the calculator over range, 3σ, cm".to_owned(),
    };
    let Some(curves) = of_run.or_else(|| Some(of_calculator(pair?, &state.calculator.approach))) else {
        ui.label(theme::note("Predicted against achieved needs a run, or a pair of cameras."));
        return;
    };
    let run = theme::run(state.cursor.run);
    chart_legend::show(ui, &source, &[]);
    chart_legend::wrapped(ui, "", &names_of(&curves, run));
    if curves.achieved.is_empty() {
        ui.label(theme::note("Achieved errors need a traverse whose truth is known."));
    } else {
        ui.label(theme::note(sentence(&curves)));
    }
    let plot = Plot::new("budget")
        .height(HEIGHT)
        .allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .set_margin_fraction(vec2(0.03, 0.06))
        .y_axis_min_width(34.0)
        .x_axis_label(theme::note("range, m"))
        .x_grid_spacer(few_marks)
        .x_axis_formatter(plain)
        .y_grid_spacer(marks)
        .y_axis_formatter(|mark: GridMark, _: &std::ops::RangeInclusive<f64>| {
            let tick_cm = 10_f64.powf(mark.value);
            format!("{}", (tick_cm * 100.0).round() / 100.0)
        })
        .label_formatter(|_| None)
        .coordinates_formatter(
            egui_plot::Corner::RightBottom,
            egui_plot::CoordinatesFormatter::new(|at, _| {
                format!("{:.2} m, {:.2} cm", at.x, 10_f64.powf(at.y))
            }),
        );
    plot.show(ui, |plot| paint(plot, &curves, run));
}

fn names_of(curves: &Curves, run: Color32) -> Vec<(Mark, Color32, String)> {
    let mut names = vec![
        (Mark::Stroke(overlay::StrokeStyle::Dashed), theme::lost(), "without tracking".to_owned()),
        (Mark::Stroke(overlay::StrokeStyle::Solid), theme::prediction(), "with tracking".to_owned()),
        (Mark::Stroke(overlay::StrokeStyle::Dotted), theme::failed(), "3 cm needed".to_owned()),
    ];
    if !curves.achieved.is_empty() {
        names.push((Mark::Ring, run, "achieved".to_owned()));
    }
    names
}

/// The number of errors within the predicted budget, in words.
fn sentence(curves: &Curves) -> String {
    let budgets = curves.with.iter().map(|with| with[0].to_bits()).zip(&curves.with);
    let by_range: std::collections::HashMap<u64, &[f64; 2]> = budgets.collect();
    let pairs =
        curves.achieved.iter().filter_map(|error| Some((error[1], by_range.get(&error[0].to_bits())?[1])));
    let (mut within, mut all) = (0, 0);
    for (error_m, budget_m) in pairs {
        all += 1;
        within += usize::from(error_m <= budget_m);
    }
    format!("{within} of {all} errors are within the 3σ predicted with tracking")
}

fn of_run(run: &RunView) -> Curves {
    let column = |of: fn(&StepRow) -> Option<f64>| -> Vec<[f64; 2]> {
        let rows = decimate::evenly(&run.rows, decimate::PLACES);
        rows.filter_map(|row| Some([row.range_m?, of(row)?])).collect()
    };
    Curves {
        without: column(|row| row.budget_without_m),
        with: column(|row| row.budget_with_m),
        achieved: column(|row| row.err_m),
    }
}

fn of_calculator(pair: &StereoPair, approach: &Approach) -> Curves {
    let ranges = (0..SAMPLES).map(|i| {
        let share = i as f64 / (SAMPLES - 1) as f64;
        approach.start_m + (approach.end_m - approach.start_m) * share
    });
    let budgets = ranges.map(|end_m| (end_m, pair.budget(&Approach { end_m, ..*approach })));
    let (without, with) = budgets
        .map(|(range_m, budget)| ([range_m, budget.without_tracking_m], [range_m, budget.with_tracking_m]))
        .unzip();
    Curves { without, with, achieved: Vec::new() }
}

/// Ticks at round numbers of centimetres.
fn marks(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let values = TICKS_CM.iter().map(|tick_cm| tick_cm.log10()).filter(|value| (low..=high).contains(value));
    values.map(|value| GridMark { value, step_size: high - low }).collect()
}

fn paint(plot: &mut PlotUi<'_>, curves: &Curves, run: Color32) {
    let place = |points: &[[f64; 2]]| -> Vec<[f64; 2]> {
        points.iter().map(|[range_m, error_m]| [*range_m, (error_m.max(LEAST_M) * 100.0).log10()]).collect()
    };
    let need = HLine::new("", (PLACEMENT_NEED_M * 100.0).log10()).color(theme::failed());
    plot.hline(need.style(LineStyle::dotted_dense()).width(1.5).allow_hover(false));
    let without = Line::new("", place(&curves.without)).color(theme::lost()).style(LineStyle::dashed_dense());
    plot.line(without.width(1.5));
    plot.line(Line::new("", place(&curves.with)).color(theme::prediction()).width(1.5));
    let achieved = Points::new("", place(&curves.achieved)).color(run).radius(3.0);
    plot.points(achieved.shape(MarkerShape::Circle));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fixture;

    #[test]
    fn errors_are_counted_against_the_budget_of_their_own_step() {
        let curves = Curves {
            without: Vec::new(),
            with: vec![[10.0, 0.4], [5.0, 0.1], [2.0, 0.02]],
            achieved: vec![[10.0, 0.1], [5.0, 0.2], [2.0, 0.02]],
        };
        assert_eq!(sentence(&curves), "2 of 3 errors are within the 3σ predicted with tracking");
    }

    #[test]
    fn a_run_brings_its_own_budget_and_errors() {
        let state = fixture::at_step(&egui::Context::default(), 2);
        let run = state.run().unwrap();
        let curves = of_run(run);
        assert_eq!((curves.with.len(), curves.achieved.len()), (run.rows.len(), run.rows.len()));
        let row = &run.rows[2];
        assert_eq!(curves.with[2], [row.range_m.unwrap(), row.budget_with_m.unwrap()]);
        assert_eq!(curves.without[2][1], row.budget_without_m.unwrap());
        assert_eq!(curves.achieved[2][1], 0.02);
    }
}
