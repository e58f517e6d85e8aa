//! The score of point stereo along the epipolar curve (K§4.4, R73–R77).
//!
//! The axis is inverse range, 1/R, with ticks in metres: disparity is linear in it (d = f_p B / R for two parallel cameras
//! side by side), so that a peak has the same width everywhere, and far is left as in the right image.

use egui::{Align2, Color32, RichText, Ui, vec2};
use egui_plot::{
    Axis, GridInput, GridMark, HLine, Line, LineStyle, MarkerShape, Plot, PlotPoint, PlotUi, Points, Span,
    Text, VLine,
};
use sightline_track::locate::template::point_stereo::PointStereo;
use sightline_track::trace::StepTrace;

use crate::command::Command;
use crate::drawing::overlay;
use crate::drawing::overlay::Mark;
use crate::hovered::Hovered;
use crate::panels::chart::polylines;
use crate::panels::chart_legend;
use crate::panels::image_right::target_curve;
use crate::panels::panel::{Panel, TableOf};
use crate::panels::sheets;
use crate::state::State;
use crate::theme;

/// Ranges that may have a tick, m.
const TICKS_M: [f64; 22] = [
    0.5, 0.6, 0.8, 1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0,
    50.0, 100.0,
];

/// Minimum distance of two ticks, as a share of the axis.
const TICK_GAP: f64 = 0.09;

/// The panel “Stereo scores”.
pub(crate) struct StereoProfile;

impl Panel for StereoProfile {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        searched(state).is_none().then(|| state.missing_template())
    }

    fn table(&self) -> Option<TableOf> {
        Some(sheets::scores::stereo_profile)
    }
}

/// The stereo search at the current step.
fn searched(state: &State) -> Option<&PointStereo> {
    state.trace()?.template()?.point_stereo.as_ref()
}

/// Shows the profile.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let (Some(trace), Some(stereo)) = (state.trace(), searched(state)) else { return };
    let threshold = state.run_settings().limits.stereo_ncc_min;
    let predicted = predicted_range(trace);
    let run = theme::run(state.cursor.run);
    chart_legend::wrapped(ui, "", &names_of(run, predicted.is_some()));
    for words in sentences(stereo, predicted) {
        ui.add(egui::Label::new(words).truncate());
    }
    let plot = Plot::new("stereo profile")
        .height(ui.available_height() - 2.0)
        .allow_scroll(false)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_boxed_zoom(false)
        .allow_axis_zoom_drag(false)
        .include_y(0.0)
        .include_y(1.0)
        .set_margin_fraction(vec2(0.03, 0.08))
        .y_axis_min_width(26.0)
        .x_axis_label(theme::note("range, m (even in disparity)"))
        .y_axis_label(theme::note("score"))
        .x_grid_spacer(marks)
        .x_axis_formatter(|mark: GridMark, _: &std::ops::RangeInclusive<f64>| {
            format!("{:.3}", 1.0 / mark.value).trim_end_matches('0').trim_end_matches('.').to_owned()
        })
        .label_formatter(|_| None)
        .coordinates_formatter(
            egui_plot::Corner::LeftBottom,
            egui_plot::CoordinatesFormatter::new(|at, _| format!("{:.2} m, score {:.2}", 1.0 / at.x, at.y)),
        );
    let hovered = match state.hovered.filter(|_| state.marks) {
        Some(Hovered::Right(pixel)) => target_curve(state).and_then(|curve| curve.nearest(pixel)),
        _ => None,
    };
    let hovered = plot.show(ui, |plot| {
        paint(plot, stereo, predicted, threshold, run);
        if let Some((range_m, _)) = hovered {
            plot.vline(VLine::new("", 1.0 / range_m).color(theme::accent()).width(1.0).allow_hover(false));
        }
        plot.pointer_coordinate().filter(|_| plot.response().hovered())
    });
    let range_m = hovered.inner.filter(|at| at.x > 0.0).map(|at| 1.0 / at.x);
    out.extend(range_m.map(|range_m| Command::Hover(Hovered::Range(range_m))));
}

fn names_of(run: Color32, is_predicted: bool) -> Vec<(Mark, Color32, String)> {
    let mut names = vec![
        (Mark::Stroke(overlay::StrokeStyle::Solid), theme::search(), "searched".to_owned()),
        (Mark::Ring, run, "best".to_owned()),
        (Mark::Stroke(overlay::StrokeStyle::Dashed), theme::failed(), "threshold".to_owned()),
    ];
    if is_predicted {
        names.push((
            Mark::Stroke(overlay::StrokeStyle::Dotted),
            theme::prediction(),
            "predicted ± 3σ".to_owned(),
        ));
    }
    names
}

/// The best match, the left–right check and the searched interval, in words.
fn sentences(stereo: &PointStereo, predicted: Option<(f64, f64)>) -> [RichText; 3] {
    let at_end = if stereo.at_end { ", AT THE END of the interval" } else { "" };
    let disparity = stereo.disparity_px.map_or_else(String::new, |px| format!(", disparity {px:.2} px"));
    let best = format!(
        "best {:.3} m, score {:.3}{disparity}, {:+.2} px beside the curve{at_end}",
        stereo.range_m, stereo.score, stereo.across_px
    );
    let back = match stereo.left_right_px {
        Some(px) => format!("left–right check: {px:.2} px"),
        None => "left–right check: no match".to_owned(),
    };
    let colour = if stereo.at_end { theme::lost() } else { theme::text() };
    let ranges = stereo.curve.iter().map(|point| point.range_m);
    let (near, far) = ranges.fold((f64::INFINITY, 0.0_f64), |(near, far), r| (near.min(r), far.max(r)));
    let prior = predicted.map_or_else(
        || "no prediction: the whole curve".to_owned(),
        |(range_m, sigma_m)| format!("predicted {range_m:.3} m ± {:.3} m (3σ)", 3.0 * sigma_m),
    );
    let interval = format!("searched {near:.2} to {far:.2} m, {} positions; {prior}", stereo.curve.len());
    [theme::note(best).color(colour), theme::note(back), theme::note(interval)]
}

/// Predicted distance from the left camera and its 1σ along the line of sight, m.
fn predicted_range(trace: &StepTrace) -> Option<(f64, f64)> {
    let (prediction, pointing) = (trace.prediction()?, &trace.point_mast);
    let away = prediction.position_in_rover - pointing.left.model.centre();
    let range_m = away.norm();
    let along = away / range_m.max(1e-9);
    let variance = along.dot(&(prediction.covariance_in_rover * along));
    Some((range_m, variance.max(0.0).sqrt()))
}

/// Ticks at round ranges, which are unevenly spaced; ticks that would crowd are omitted.
fn marks(input: GridInput) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let gap = (high - low) * TICK_GAP;
    let mut marks: Vec<GridMark> = Vec::new();
    for range_m in TICKS_M {
        let value = 1.0 / range_m;
        let is_inside = (low..=high).contains(&value);
        if is_inside && marks.last().is_none_or(|last| last.value - value >= gap) {
            marks.push(GridMark { value, step_size: high - low });
        }
    }
    marks
}

fn paint(
    plot: &mut PlotUi<'_>,
    stereo: &PointStereo,
    predicted: Option<(f64, f64)>,
    threshold: f64,
    run: Color32,
) {
    if let Some((range_m, sigma_m)) = predicted {
        let far = 1.0 / (range_m + 3.0 * sigma_m);
        let near = 1.0 / (range_m - 3.0 * sigma_m).max(0.1);
        let fill = theme::prediction().gamma_multiply(0.15);
        plot.span(Span::new("", far..=near).axis(Axis::X).fill(fill).border_width(0.0));
        let line = VLine::new("", 1.0 / range_m).color(theme::prediction()).style(LineStyle::dotted_dense());
        plot.vline(line.width(1.5).allow_hover(false));
    }
    let line = HLine::new("", threshold).color(theme::failed()).style(LineStyle::dashed_dense());
    plot.hline(line.width(1.0).allow_hover(false));
    let point = |p: &sightline_track::locate::template::point_stereo::CurvePoint| {
        Some([1.0 / p.range_m, f64::from(p.score.filter(|score| score.is_finite())?)])
    };
    for polyline in polylines(&stereo.curve.iter().map(point).collect::<Vec<_>>()) {
        plot.line(Line::new("", polyline).color(theme::search()).width(1.5));
    }
    let best = [1.0 / stereo.range_m, stereo.score];
    plot.vline(VLine::new("", best[0]).color(run).width(1.0).allow_hover(false));
    plot.points(Points::new("", best).color(run).radius(5.0).shape(MarkerShape::Circle).filled(false));
    let words = theme::note(format!("  {:.2}", stereo.score)).color(theme::strong());
    let text = Text::new("", PlotPoint::new(best[0], best[1]), words);
    plot.text(text.anchor(Align2::LEFT_TOP));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_stand_at_round_ranges_and_do_not_crowd() {
        let bounds = (1.0 / 20.0, 1.0);
        let marks = marks(GridInput { bounds, base_step_size: 0.1 });
        let ranges: Vec<f64> = marks.iter().map(|mark| (1e6 / mark.value).round() / 1e6).collect();
        assert!(ranges.contains(&1.0) && ranges.contains(&2.0), "{ranges:?}");
        assert!(ranges.iter().all(|range| TICKS_M.contains(range)));
        let apart = marks.windows(2).all(|pair| pair[0].value - pair[1].value >= 0.95 * TICK_GAP);
        assert!(apart, "{ranges:?}");
    }

    #[test]
    fn the_predicted_sigma_is_that_along_the_line_of_sight() {
        let trace = crate::tests::fixture::trace(2);
        let (range_m, sigma_m) = predicted_range(&trace).unwrap();
        // The fixture's prediction has 4 cm (forward) and 2 cm (across): the line of sight is mostly forward.
        assert!((0.02..=0.04).contains(&sigma_m) && (5.0..8.0).contains(&range_m), "{range_m} {sigma_m}");
    }
}
