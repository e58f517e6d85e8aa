//! Plots a derived column over the steps; any expression, without recomputing the run.

use egui::{RichText, Ui, vec2};
use egui_plot::{HoverPosition, Line, Plot, PlotPoint, Points};
use sightline_session::query::RunAnswer;

use crate::breakpoints::BreakpointCommand;
use crate::breakpoints::derived::Derived;
use crate::command::{Command, Go};
use crate::drawing::decimate;
use crate::panels::chart::{over_steps, polylines, step_of};
use crate::panels::digits;
use crate::panels::step_marks::{cursors, point};
use crate::state::State;
use crate::theme;

/// Maximum number of points of a line: about two per pixel column of a wide screen.
const POINTS: usize = 4000;

/// Shows one derived column: a row with its name, value and remove button, and its plot.
pub(crate) fn show(
    ui: &mut Ui,
    state: &State,
    at: usize,
    height: f32,
    is_last: bool,
    out: &mut Vec<Command>,
) {
    let Some(derived) = state.breakpoints.derived.get(at) else { return };
    let of_run = run_answer(state, derived);
    title(ui, state, derived, of_run, at, out);
    let last = state.stop_count().saturating_sub(1) as f64;
    let colour = theme::run(state.cursor.run);
    let id = ("derived", derived.expression.clone(), state.traverse.as_ref().map(|t| t.id.clone()));
    let name = derived.expression.clone();
    let plot = over_steps(Plot::new(id), last, is_last)
        .height(height)
        .set_margin_fraction(vec2(0.0, 0.12))
        .label_formatter(move |near| {
            let (HoverPosition::NearDataPoint { position, .. } | HoverPosition::Elsewhere { position }) =
                near;
            let step = step_of(position.x, last)?;
            Some(format!("step {step}\n{name} {}", digits(value_at(of_run, step)?)))
        });
    let response = plot.show(ui, |plot| {
        cursors(plot, state);
        for polyline in of_run.map(points).unwrap_or_default() {
            plot.line(Line::new("", polyline.clone()).color(colour).width(1.5).allow_hover(false));
            plot.points(Points::new("", decimate::marks(polyline)).color(colour).radius(2.5));
        }
        plot.pointer_coordinate()
    });
    point(&response, last, out);
    let pointer: Option<PlotPoint> = response.inner;
    let label = in_words(derived, of_run, state.cursor.step);
    response.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &label));
    if let Some(at) = pointer.filter(|_| response.response.clicked()) {
        out.push(Command::Go(Go::Step(at.x.round().clamp(0.0, last) as usize)));
    }
    if let Some(value) = value_at(of_run, state.cursor.step) {
        crate::breakpoints::panel::menu(&response.response, &[(&derived.expression, value)], out);
    }
}

fn title(
    ui: &mut Ui,
    state: &State,
    derived: &Derived,
    of_run: Option<&RunAnswer>,
    at: usize,
    out: &mut Vec<Command>,
) {
    ui.horizontal(|ui| {
        ui.set_height(crate::panels::chart_legend::HEIGHT);
        let unit = derived.answer.as_ref().map_or("", |answer| answer.unit.as_str());
        let unit = if unit.is_empty() { String::new() } else { format!(", {unit}") };
        ui.label(theme::note(format!("{}{unit}", derived.expression)).color(theme::text()));
        let words = match (&derived.problem, of_run) {
            (Some(problem), _) => problem.clone(),
            (None, None) if derived.answer.is_none() => "loading …".to_owned(),
            (None, None) => "not defined for this run: the expression compares other runs".to_owned(),
            (None, Some(_)) => match value_at(of_run, state.cursor.step) {
                Some(value) => digits(value),
                None => "missing at this step".to_owned(),
            },
        };
        ui.label(theme::note(words));
        let remove = ui.small_button(RichText::new("x").monospace());
        let remove = remove.accessible_name(format!("remove plot {}", derived.expression));
        if remove.on_hover_text("remove this plot").clicked() {
            out.push(Command::Breakpoints(BreakpointCommand::Unplot(at)));
        }
    });
}

/// The values for the selected run.
fn run_answer<'a>(state: &State, derived: &'a Derived) -> Option<&'a RunAnswer> {
    let target = state.cursor.target?;
    let runs = &derived.answer.as_ref()?.runs;
    runs.iter().find(|answer| answer.target == target && answer.run == state.cursor.run)
}

/// The value of a derived column at a step of the selected run.
pub(crate) fn value(state: &State, at: usize, step: usize) -> Option<f64> {
    let derived = state.breakpoints.derived.get(at)?;
    value_at(run_answer(state, derived), step)
}

fn value_at(of_run: Option<&RunAnswer>, step: usize) -> Option<f64> {
    let of_run = of_run?;
    *of_run.values.get(step.checked_sub(of_run.first_step)?)?
}

/// The line segments of the values. For a long run, each group of consecutive steps is reduced to its minimum and maximum,
/// so that peaks remain visible.
fn points(of_run: &RunAnswer) -> Vec<Vec<[f64; 2]>> {
    let at = |(k, value): (usize, &Option<f64>)| value.map(|value| [(of_run.first_step + k) as f64, value]);
    let all: Vec<Option<[f64; 2]>> = of_run.values.iter().enumerate().map(at).collect();
    let bundle = all.len().div_ceil(POINTS / 2).max(1);
    if bundle == 1 {
        return polylines(&all);
    }
    let ends = |few: &[Option<[f64; 2]>]| {
        let there = || few.iter().flatten().copied();
        let least = there().min_by(|a, b| a[1].total_cmp(&b[1]));
        let most = there().max_by(|a, b| a[1].total_cmp(&b[1]));
        match (least, most) {
            (Some(a), Some(b)) if a[0] > b[0] => [Some(b), Some(a)],
            both => [both.0, both.1],
        }
    };
    let fewer: Vec<Option<[f64; 2]>> = all.chunks(bundle).flat_map(ends).collect();
    polylines(&fewer)
}

/// A description of the plot.
fn in_words(derived: &Derived, of_run: Option<&RunAnswer>, step: usize) -> String {
    let values = || of_run.into_iter().flat_map(|answer| answer.values.iter().flatten().copied());
    let unit = derived.answer.as_ref().map_or("", |answer| answer.unit.as_str());
    let least = values().min_by(f64::total_cmp).map(digits);
    let most = values().max_by(f64::total_cmp).map(digits);
    let here = value_at(of_run, step).map_or_else(|| "missing".to_owned(), digits);
    match least.zip(most) {
        Some((least, most)) => {
            let text = format!(
                "plot of {}: {here} at step {step}, from {least} to {most} {unit}",
                derived.expression
            );
            text.trim_end().to_owned()
        }
        None => format!("plot of {}: no values", derived.expression),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_column_keeps_its_peaks_with_few_points() {
        let mut values = vec![Some(1.0); 10_000];
        (values[7_777], values[100]) = (Some(9.0), None);
        let answer = RunAnswer { target: 0, run: 0, first_step: 2, steps: 10_000, hits: Vec::new(), values };
        let drawn: Vec<[f64; 2]> = points(&answer).into_iter().flatten().collect();
        assert!(drawn.len() <= POINTS, "{}", drawn.len());
        assert!(drawn.contains(&[7_779.0, 9.0]));
        assert!(drawn.windows(2).all(|pair| pair[0][0] <= pair[1][0]));
    }
}
