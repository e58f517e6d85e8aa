//! The consistency of the covariances: NEES and NIS per step with chi-square bands, coverage, and a verdict per run.

use egui::{Id, RichText, Ui, UiBuilder, vec2};
use egui_plot::{HLine, Line, LineStyle, Plot, PlotPoint, PlotUi, Points, VLine};
use sightline_session::compare::RunName;
use sightline_session::metrics::uncertainty::{Consistency, Uncertainty};

use crate::command::{Command, Go};
use crate::compare::panel::mark;
use crate::compare::state::RunStyle;
use crate::drawing::decimate;
use crate::drawing::overlay;
use crate::drawing::overlay::Mark;
use crate::panels;
use crate::panels::chart::{few_marks, over_steps, plain, shape};
use crate::panels::chart_legend;
use crate::panels::pane::{Need, Pane};
use crate::panels::panel::{Panel, TableOf};
use crate::panels::sheets;
use crate::state::State;
use crate::theme;

/// The purpose of the panel.
const PURPOSE: &str = Pane::Uncertainty.about().help;

/// A run whose covariances are shown.
struct PlottedRun<'a> {
    name: RunName,
    style: RunStyle,
    found: &'a Uncertainty,
}

/// The panel “Uncertainty”.
pub(crate) struct UncertaintyPanel;

impl Panel for UncertaintyPanel {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        state.own_name().is_none().then(|| state.missing_target())
    }

    fn table(&self) -> Option<TableOf> {
        Some(sheets::steps::uncertainty)
    }

    fn needs(&self) -> &'static [Need] {
        &[Need::Metrics]
    }
}

/// Shows the verdicts and the plots.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(own) = state.own_name() else { return };
    let mut names = vec![(own, state.own_style())];
    names.extend(state.others().iter().map(|other| (other.name, other.style)));
    let shown: Vec<PlottedRun<'_>> = names
        .iter()
        .filter_map(|&(name, style)| {
            Some(PlottedRun { name, style, found: &state.metrics(name)?.uncertainty })
        })
        .collect();
    if shown.is_empty() {
        let why = state.metrics_problem(own).unwrap_or("The metrics of the run are being computed …");
        panels::missing(ui, PURPOSE, why);
        return;
    }
    for run in &shown {
        verdict(ui, state, run);
    }
    let area = ui.available_rect_before_wrap();
    let (left, right) = area.split_left_right_at_fraction(0.62);
    let mut steps = ui.new_child(UiBuilder::new().max_rect(left).id_salt("steps"));
    over_the_steps(&mut steps, state, &shown, out);
    let mut beside =
        ui.new_child(UiBuilder::new().max_rect(right.with_min_x(right.left() + 8.0)).id_salt("coverage"));
    coverage(&mut beside, &shown);
    ui.advance_cursor_after_rect(area);
}

fn verdict(ui: &mut Ui, state: &State, run: &PlottedRun<'_>) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing = vec2(5.0, 1.0);
        mark(ui, run.style);
        let words = format!("{}: {}.", state.run_label(run.name), run.found.sentence.trim_end_matches('.'));
        let caveat = "The steps of one run are not independent: the true band is wider than that of independent steps, \
                      hence “probably” until the mean leaves the band of a single value as well.";
        ui.label(RichText::new(words).size(12.0).color(theme::text())).on_hover_text(caveat);
        let nis = format!("{}.", run.found.nis_sentence.trim_end_matches('.'));
        ui.label(theme::note(nis)).on_hover_text("Over accepted updates; NIS needs no truth.");
    });
}

fn over_the_steps(ui: &mut Ui, state: &State, shown: &[PlottedRun<'_>], out: &mut Vec<Command>) {
    type CovariancePart = (&'static str, &'static str, fn(&Uncertainty) -> &Consistency);
    const PARTS: [CovariancePart; 2] = [
        ("NEES", "squared Mahalanobis distance of the error", |found| &found.nees),
        ("NIS", "squared Mahalanobis distance of match and prediction", |found| &found.nis),
    ];
    ui.spacing_mut().item_spacing.y = 1.0;
    let height = ((ui.available_height() - 16.0) / 2.0 - chart_legend::HEIGHT - 2.0).max(24.0);
    for (i, (title, meaning, of)) in PARTS.into_iter().enumerate() {
        let band = of(shown[0].found).band_of_one;
        let line = (
            Mark::Stroke(overlay::StrokeStyle::Dashed),
            theme::weak(),
            format!("95 % of single values: {:.2} to {:.1}", band[0], band[1]),
        );
        chart_legend::show(ui, title, &[line]);
        let is_last = i == 1;
        let height = if is_last { height + 16.0 } else { height };
        let words = summary(state, shown, title, meaning, of);
        if shown.iter().all(|run| of(run.found).steps.is_empty()) {
            let why = if title == "NIS" { &shown[0].found.nis_sentence } else { &shown[0].found.sentence };
            ui.allocate_ui(vec2(ui.available_width(), height), |ui| panels::missing(ui, "", why));
            continue;
        }
        if let Some(step) = plot(ui, state, shown, (title, of), (height, is_last), &words) {
            out.push(Command::Go(Go::Step(step)));
        }
    }
}

/// The contents of a plot in words, for screen readers.
fn summary(
    state: &State,
    shown: &[PlottedRun<'_>],
    title: &str,
    meaning: &str,
    of: fn(&Uncertainty) -> &Consistency,
) -> String {
    let run = |run: &PlottedRun<'_>| {
        let found = of(run.found);
        let mean = found.mean.map_or_else(|| "none".to_owned(), |mean| format!("{mean:.2}"));
        let outside = |value: f64| value < found.band_of_one[0] || value > found.band_of_one[1];
        let count = found.steps.iter().filter(|step| outside(step.value)).count();
        format!(
            "{}: mean {mean}, {count} of {} outside the band",
            state.run_label(run.name),
            crate::panels::numbers::counted(found.steps.len(), "step")
        )
    };
    let runs: Vec<String> = shown.iter().map(run).collect();
    format!("{title}, {meaning}, over the steps; {}", runs.join("; "))
}

fn plot(
    ui: &mut Ui,
    state: &State,
    shown: &[PlottedRun<'_>],
    (title, of): (&str, fn(&Uncertainty) -> &Consistency),
    (height, is_last): (f32, bool),
    words: &str,
) -> Option<usize> {
    let last = state.stop_count().saturating_sub(1) as f64;
    let band = of(shown[0].found).band_of_one;
    let plot = over_steps(Plot::new(("uncertainty", title)), last, is_last)
        .height(height)
        .include_y(0.0)
        .include_y(band[1])
        .set_margin_fraction(vec2(0.0, 0.12))
        .y_grid_spacer(few_marks)
        .y_axis_formatter(plain);
    let response = plot.show(ui, |plot| {
        plot.vline(
            VLine::new("", state.cursor.step as f64).color(theme::accent()).width(1.5).allow_hover(false),
        );
        for edge in band {
            let line = HLine::new("", edge).color(theme::weak()).style(LineStyle::dashed_dense());
            plot.hline(line.width(1.0).allow_hover(false));
        }
        for run in shown {
            let points = |step: usize| state.own_aligned_step(run.name, step).map(|step| step as f64);
            let points: Vec<[f64; 2]> = of(run.found)
                .steps
                .iter()
                .filter_map(|step| Some([points(step.step)?, step.value]))
                .collect();
            series(plot, points, run.style);
        }
        let clicked = plot.response().clicked().then(|| plot.pointer_coordinate()).flatten();
        clicked.map(|at: PlotPoint| at.x.round().clamp(0.0, last) as usize)
    });
    response.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, words));
    response.inner
}

fn series(plot: &mut PlotUi<'_>, points: Vec<[f64; 2]>, style: RunStyle) {
    let points = decimate::curve(points);
    plot.line(Line::new("", points.clone()).color(style.colour).width(1.5).allow_hover(false));
    plot.points(
        Points::new("", decimate::marks(points)).color(style.colour).radius(3.0).shape(shape(style.mark)),
    );
}

/// The share of errors within k σ against the expected share.
fn coverage(ui: &mut Ui, shown: &[PlottedRun<'_>]) {
    chart_legend::show(
        ui,
        "coverage",
        &[(Mark::Stroke(overlay::StrokeStyle::Dashed), theme::weak(), "expected".to_owned())],
    );
    if shown.iter().all(|run| run.found.coverage.is_empty()) {
        panels::missing(ui, "", "Coverage needs the truth, which this traverse does not have.");
        return;
    }
    let plot = Plot::new("coverage")
        .height(ui.available_height())
        .allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .include_x(0.0)
        .include_y(0.0)
        .include_y(1.0)
        .x_axis_label(theme::note("within k σ"))
        .y_axis_label(theme::note("share of steps"))
        .x_grid_spacer(few_marks)
        .x_axis_formatter(plain)
        .y_grid_spacer(few_marks)
        .y_axis_formatter(plain)
        .y_axis_min_width(24.0)
        .link_axis(Id::unique("coverage"), [false, false]);
    let response = plot.show(ui, |plot| {
        for (i, run) in shown.iter().enumerate() {
            if i == 0 {
                let expected: Vec<[f64; 2]> =
                    run.found.coverage.iter().map(|c| [c.sigmas, c.expected]).collect();
                let line = Line::new("", expected).color(theme::weak()).style(LineStyle::dashed_dense());
                plot.line(line.width(1.5).allow_hover(false));
            }
            series(plot, run.found.coverage.iter().map(|c| [c.sigmas, c.share]).collect(), run.style);
        }
    });
    let words =
        shown.first().and_then(|run| run.found.coverage.iter().find(|c| c.sigmas == 3.0)).map_or_else(
            || "coverage".to_owned(),
            |c| {
                let [share, expected] = [c.share, c.expected].map(|share| share * 100.0);
                format!("coverage: {share:.0} % of the steps within 3 σ, {expected:.0} % expected")
            },
        );
    response.response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &words));
}
