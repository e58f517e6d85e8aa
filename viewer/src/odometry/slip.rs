//! The slip over the stops as a plot.

use egui::{Role, Ui, WidgetInfo, vec2};
use egui_plot::{HLine, Line, Plot, PlotPoint, PlotUi, Points, VLine};

use crate::command::{Command, Go};
use crate::drawing::overlay::{self, Mark};
use crate::panels::chart::{few_marks, over_steps, plain, polylines, shape};
use crate::panels::chart_legend;
use crate::state::State;
use crate::theme;

/// Height of the plot, points.
const HEIGHT: f32 = 110.0;

/// Shows the slip along and across the motion by the wheels, in percent of that motion.
pub(super) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let lines = [
        (Mark::Ring, theme::run(0), "along the motion".to_owned()),
        (Mark::Square, theme::run(1), "to the right".to_owned()),
        (Mark::Stroke(overlay::StrokeStyle::Solid), theme::accent(), "this step".to_owned()),
    ];
    chart_legend::wrapped(ui, "slip, % of the wheels’ motion", &lines);
    let last = state.stop_count().saturating_sub(1) as f64;
    let [along, aside] = series(state);
    let plot = over_steps(Plot::new("slip"), last, true)
        .height(HEIGHT)
        .include_y(0.0)
        .include_y(5.0)
        .set_margin_fraction(vec2(0.0, 0.12))
        .y_grid_spacer(few_marks)
        .y_axis_formatter(plain);
    let response = plot.show(ui, |plot| {
        plot.hline(HLine::new("", 0.0).color(theme::weak()).width(1.0).allow_hover(false));
        plot.vline(
            VLine::new("", state.cursor.step as f64).color(theme::accent()).width(1.5).allow_hover(false),
        );
        curve(plot, &along, (theme::run(0), Mark::Ring));
        curve(plot, &aside, (theme::run(1), Mark::Square));
        let clicked = plot.response().clicked().then(|| plot.pointer_coordinate()).flatten();
        clicked.map(|at: PlotPoint| at.x.round().clamp(0.0, last) as usize)
    });
    response.response.widget_info(|| WidgetInfo::labeled(Role::Image, true, words(&along)));
    if let Some(step) = response.inner {
        out.push(Command::Go(Go::Step(step)));
    }
}

/// Slip along and across, percent, at every stop; `None` where it was not measured or was refused.
fn series(state: &State) -> [Vec<Option<[f64; 2]>>; 2] {
    let slips: Vec<_> = (0..state.stop_count())
        .map(|step| {
            let update = &state.measured_motion(step)?.update;
            update.slip.filter(|_| update.accepted).map(|slip| (step as f64, slip))
        })
        .collect();
    let along = slips.iter().map(|slip| slip.map(|(step, slip)| [step, 100.0 * slip.along]));
    let aside = slips.iter().map(|slip| slip.map(|(step, slip)| [step, 100.0 * slip.aside]));
    [along.collect(), aside.collect()]
}

fn curve(plot: &mut PlotUi<'_>, points: &[Option<[f64; 2]>], (colour, mark): (egui::Color32, Mark)) {
    for polyline in polylines(points) {
        plot.line(Line::new("", polyline).color(colour).width(1.5).allow_hover(false));
    }
    let points: Vec<[f64; 2]> = points.iter().copied().flatten().collect();
    plot.points(Points::new("", points).color(colour).radius(3.0).shape(shape(mark)));
}

/// A description of the plot.
fn words(along: &[Option<[f64; 2]>]) -> String {
    let known: Vec<f64> = along.iter().flatten().map(|point| point[1]).collect();
    let range = known.iter().fold(None, |range: Option<[f64; 2]>, &value| {
        Some(range.map_or([value; 2], |[low, high]| [low.min(value), high.max(value)]))
    });
    match range {
        None => "slip over the steps: no accepted update".to_owned(),
        Some([low, high]) => {
            format!("slip over the steps: {low:.1} to {high:.1} % along the motion at {} steps", known.len())
        }
    }
}
