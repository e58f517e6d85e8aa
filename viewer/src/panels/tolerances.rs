//! The tolerances of criteria 3 and 4 over the steps, each with the value compared with it (R86, K-Fig 5).
//!
//! Both grow with the distance driven and with the range of the stereo measurements that they compare; `stages::judge` has
//! the equations. A criterion fires if its value exceeds its tolerance: the plot marks this with a cross in vermilion.

use egui::{Color32, RichText, Ui, vec2};
use egui_plot::{Line, LineStyle, MarkerShape, Plot, PlotPoint, PlotUi, Points, VLine};
use sightline_session::step::StepRow;
use sightline_session::view::RunView;
use sightline_track::settings::TrackerKind;

use crate::command::{Command, Go};
use crate::drawing::decimate;
use crate::drawing::overlay;
use crate::drawing::overlay::Mark;
use crate::panels::chart::{few_marks, over_steps, plain, polylines};
use crate::panels::chart_legend;
use crate::panels::panel::{Panel, TableOf};
use crate::panels::sheets::{Cell, Column, Sheet};
use crate::state::State;
use crate::theme;

/// Height of the step numbers below the lower plot, points.
const AXIS: f32 = 16.0;

/// Height of the sentence above a plot, points.
const SENTENCE: f32 = 15.0;

/// A criterion with a tolerance.
struct Criterion {
    number: u8,
    title: &'static str,
    value_m: fn(&StepRow) -> Option<f64>,
    tolerance_m: fn(&StepRow) -> Option<f64>,
}

const CRITERIA: [Criterion; 2] = [
    Criterion {
        number: 3,
        title: "3 range change, cm",
        value_m: |row| row.distance_correction_m,
        tolerance_m: |row| row.distance_tolerance_m,
    },
    Criterion {
        number: 4,
        title: "4 site position since the designation, cm",
        value_m: |row| row.position_correction_m,
        tolerance_m: |row| row.position_tolerance_m,
    },
];

impl Criterion {
    /// The steps at which the value exceeds the tolerance, with the value in cm.
    fn fired(&self, run: &RunView) -> Vec<[f64; 2]> {
        let fires = |row: &StepRow| {
            let value_m = (self.value_m)(row)?;
            (value_m > (self.tolerance_m)(row)?).then_some([row.step as f64, value_m * 100.0])
        };
        run.rows.iter().filter_map(fires).collect()
    }
}

/// The largest number of firings that are marked: more would cover the plot.
const FIRED: usize = 100;

/// The panel “Tolerances”.
pub(crate) struct Tolerances;

impl Panel for Tolerances {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        let Some(run) = state.run() else { return Some(state.missing_target()) };
        if run.rows.iter().any(|row| row.distance_tolerance_m.is_some()) {
            return None;
        }
        let sentence = match run.settings.tracker {
            TrackerKind::Template => {
                "No update was judged yet: tolerances belong to the steps after the pick."
            }
            TrackerKind::Features | TrackerKind::Combined => {
                "Criteria 3 and 4 belong to the template tracker. This run is judged by its confidence alone: see \
                 “Gates” and “Over the steps”."
            }
            _ => "Criteria 3 and 4 belong to the template tracker. “Gates” shows what this run is judged by.",
        };
        Some(sentence.to_owned())
    }

    fn table(&self) -> Option<TableOf> {
        Some(sheets)
    }
}

/// Shows both criteria, one below the other over the same steps.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(run) = state.run() else { return };
    chart_legend::wrapped(ui, "", &names_of(run.number));
    ui.spacing_mut().item_spacing.y = 1.0;
    let count = CRITERIA.len() as f32;
    let height = (ui.available_height() - AXIS - count * (SENTENCE + 4.0)) / count;
    for (i, criterion) in CRITERIA.iter().enumerate() {
        let is_last = i + 1 == CRITERIA.len();
        let sentence = sentence(criterion, run, state.cursor.step);
        let label = ui.add(egui::Label::new(sentence.size(11.0)).truncate());
        label.on_hover_text("The correction against its tolerance, which changes with every update.");
        let height = height.max(30.0) + if is_last { AXIS } else { 0.0 };
        if let Some(step) = plot(ui, state, run, criterion, height, is_last) {
            out.push(Command::Go(Go::Step(step)));
        }
    }
}

/// Both criteria as one table.
pub(crate) fn sheets(state: &State) -> Result<Vec<Sheet>, String> {
    let run = state.run().ok_or_else(|| state.missing_target())?;
    let columns = CRITERIA.iter().flat_map(|criterion| {
        let name = criterion.title.trim_end_matches(", cm");
        [
            (name.to_owned(), "cm"),
            (format!("tolerance {}", criterion.number), "cm"),
            (format!("fired {}", criterion.number), ""),
        ]
    });
    let columns = columns.map(|(name, unit)| Column::new(name, unit)).collect();
    let mut sheet = Sheet::over_steps("Tolerances", columns);
    for row in &run.rows {
        let cells = CRITERIA.iter().flat_map(|criterion| {
            let (value, tolerance) = ((criterion.value_m)(row), (criterion.tolerance_m)(row));
            let fired = match value.zip(tolerance) {
                Some((value_m, tolerance_m)) => {
                    Cell::Word(if value_m > tolerance_m { "fired" } else { "no" }.to_owned())
                }
                None => Cell::Nothing,
            };
            let cm = |value: Option<f64>| Cell::from(value.map(|m| m * 100.0));
            [cm(value), cm(tolerance), fired]
        });
        sheet.step(row.step, state.cursor.step, cells.collect::<Vec<_>>());
    }
    Ok(vec![sheet])
}

fn names_of(run: usize) -> Vec<(Mark, Color32, String)> {
    vec![
        (Mark::Ring, theme::run(run), "value".to_owned()),
        (Mark::Stroke(overlay::StrokeStyle::Dashed), theme::lost(), "tolerance".to_owned()),
        (Mark::Cross, theme::failed(), "fired".to_owned()),
    ]
}

/// Value and tolerance at the cursor's step, and the steps at which the criterion fired, in words.
fn sentence(criterion: &Criterion, run: &RunView, step: usize) -> RichText {
    let here = crate::state::row_of(run, step);
    let pair = here.and_then(|row| Some(((criterion.value_m)(row)?, (criterion.tolerance_m)(row)?)));
    let title = criterion.title;
    let now = match pair {
        Some((value_m, tolerance_m)) => {
            format!("{title}: {:.1} of {:.1} at step {step}", value_m * 100.0, tolerance_m * 100.0)
        }
        None => format!("{title}: nothing to judge at step {step}"),
    };
    let fired: Vec<String> = criterion.fired(run).iter().map(|[step, _]| format!("{step}")).collect();
    if fired.is_empty() {
        return theme::note(format!("{now}; never fired")).color(theme::text());
    }
    theme::note(format!("{now}; fired at {}", fired.join(", "))).color(theme::lost())
}

/// One plot. Returns the clicked step.
fn plot(
    ui: &mut Ui,
    state: &State,
    run: &RunView,
    criterion: &Criterion,
    height: f32,
    is_last: bool,
) -> Option<usize> {
    let last = state.stop_count().saturating_sub(1) as f64;
    let plot = over_steps(Plot::new(("tolerance", criterion.number)), last, is_last)
        .height(height)
        .include_y(0.0)
        .set_margin_fraction(vec2(0.0, 0.14))
        .y_grid_spacer(few_marks)
        .y_axis_formatter(plain)
        .label_formatter(|_| None);
    let response = plot.show(ui, |plot| {
        let cursor = VLine::new("", state.cursor.step as f64).color(theme::accent()).width(1.5);
        plot.vline(cursor.allow_hover(false));
        paint(plot, run, criterion);
        let clicked = plot.response().clicked().then(|| plot.pointer_coordinate()).flatten();
        clicked.map(|at: PlotPoint| at.x.round().clamp(0.0, last) as usize)
    });
    response.inner
}

fn paint(plot: &mut PlotUi<'_>, run: &RunView, criterion: &Criterion) {
    let line = |of: fn(&StepRow) -> Option<f64>| -> Vec<Vec<[f64; 2]>> {
        let point = |row: &StepRow| of(row).map(|v| [row.step as f64, v * 100.0]);
        polylines(&run.rows.iter().map(point).collect::<Vec<_>>())
    };
    for polyline in line(criterion.tolerance_m) {
        plot.line(Line::new("", polyline).color(theme::lost()).style(LineStyle::dashed_dense()).width(1.5));
    }
    for polyline in line(criterion.value_m) {
        let colour = theme::run(run.number);
        plot.line(Line::new("", polyline.clone()).color(colour).width(1.5));
        plot.points(
            Points::new("", decimate::marks(polyline)).color(colour).radius(2.5).shape(MarkerShape::Circle),
        );
    }
    for &[step, value_cm] in decimate::evenly(&criterion.fired(run), FIRED) {
        let mark = Points::new("", [step, value_cm]).color(theme::failed()).radius(6.0);
        plot.points(mark.shape(MarkerShape::Cross));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::fixture;

    #[test]
    fn a_criterion_fires_where_its_value_exceeds_its_tolerance_and_nowhere_else() {
        let state = fixture::at_step(&egui::Context::default(), 2);
        let mut run = state.run().unwrap().clone();
        assert!(CRITERIA.iter().all(|criterion| criterion.fired(&run).is_empty()));
        run.rows[3].distance_correction_m = run.rows[3].distance_tolerance_m.map(|m| m + 0.001);
        run.rows[4].position_correction_m = run.rows[4].position_tolerance_m;
        let fired = CRITERIA[0].fired(&run);
        assert_eq!(fired.len(), 1);
        assert_eq!(fired[0][0], 3.0);
        assert!(CRITERIA[1].fired(&run).is_empty(), "a value at its tolerance is within it");
    }
}
