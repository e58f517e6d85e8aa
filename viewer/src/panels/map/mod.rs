//! The map: the rover's path and the target's trail in the site frame, seen from above, north up.
//!
//! Site frame: +x north, +y east, +z down. On the map east is to the right, so a site point is drawn at (y, x).
//! The target's neighbourhood, where the positions converge, is shown beside the whole drive (`convergence`).

pub(crate) mod convergence;
mod hovered;
mod site;

use egui::{Color32, Rect, Ui, UiBuilder, vec2};
use egui_plot::{Arrows, Line, LineStyle, MarkerShape, Plot, PlotPoint, PlotPoints, PlotUi, Points};
use sightline_api::wire::StopView;
use sightline_geometry::frames::{Point3, Pose, PoseRecord};
use sightline_session::view::RunView;

use crate::command::{Command, Go};
use crate::drawing::decimate;
use crate::drawing::overlay;
use crate::drawing::overlay::Mark;
use crate::hovered::Hovered;
use crate::panels::chart_legend;
use crate::panels::map::site::{in_site, on_map, truth_in_site};
use crate::panels::numbers::fixed;
use crate::panels::pane::Need;
use crate::panels::panel::{Panel, TableOf};
use crate::panels::sheets;
use crate::state::{State, run_letter};
use crate::{driving, theme};

/// Largest distance from a stop at which a click selects it, points.
const CLICK_REACH: f32 = 14.0;

/// Panel height from which the rows of names are shown, points.
const NAMES_FROM: f32 = 190.0;

/// Room between the two maps, points.
const GAP: f32 = 8.0;

/// The panel “Map, site frame”.
pub(crate) struct Map;

impl Panel for Map {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }

    fn missing(&self, state: &State) -> Option<String> {
        driven(state).is_none().then(|| state.missing_target())
    }

    fn table(&self) -> Option<TableOf> {
        Some(sheets::places::map)
    }

    fn needs(&self) -> &'static [Need] {
        &[Need::Hazards]
    }
}

/// The stops of the drive; `None` without any.
fn driven(state: &State) -> Option<&[StopView]> {
    let stops = state.traverse.as_ref()?.stops.as_slice();
    (!stops.is_empty()).then_some(stops)
}

/// Shows the map.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(stops) = driven(state) else { return };
    if ui.available_height() >= NAMES_FROM {
        chart_legend::wrapped(ui, "", &names_of(state, stops));
    }
    let run = state.run().filter(|run| !run.rows.is_empty());
    let Some(run) = run else {
        drive(ui, state, stops, None, out);
        return;
    };
    // The drive keeps its aspect ratio, so that a long narrow one takes a strip; the target's neighbourhood gets the rest.
    let area = ui.available_rect_before_wrap();
    let (first, second) = split(area, aspect(stops, run));
    let part = |rect: Rect, salt: &str| UiBuilder::new().max_rect(rect).id_salt(salt.to_owned());
    drive(&mut ui.new_child(part(first, "drive")), state, stops, Some(run), out);
    let second = second.with_min_x(second.left() + GAP);
    convergence::show(&mut ui.new_child(part(second, "target")), state, stops, run);
    ui.advance_cursor_after_rect(area);
}

/// Width over height of the extent of the drive's map: path and trail.
fn aspect(stops: &[StopView], run: &RunView) -> f32 {
    let path = poses(stops, |stop| Some(stop.site_from_rover));
    let trail = convergence::shown(run, stops).into_iter().map(|at| on_map(&at.point_in_site));
    let all: Vec<[f64; 2]> = path.into_iter().chain(trail).collect();
    let side = |k: usize| {
        let values = || all.iter().map(|point| point[k]);
        values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
    };
    (side(0).max(0.1) / side(1).max(0.1)) as f32
}

/// The drive's part and the target's: side by side if the drive is narrow, one above the other if it is wide.
fn split(area: Rect, width_by_height: f32) -> (Rect, Rect) {
    if width_by_height * area.height() <= area.width() {
        let share = (width_by_height * area.height() / area.width() * 1.3 + 0.12).clamp(0.3, 0.5);
        area.split_left_right_at_fraction(share)
    } else {
        let share = (area.width() / width_by_height / area.height() * 1.3 + 0.12).clamp(0.35, 0.5);
        area.split_top_bottom_at_fraction(share)
    }
}

/// The whole drive.
fn drive(ui: &mut Ui, state: &State, stops: &[StopView], run: Option<&RunView>, out: &mut Vec<Command>) {
    let plot = Plot::new(("map", state.traverse.as_ref().map(|traverse| &traverse.id)))
        .data_aspect(1.0)
        .set_margin_fraction(vec2(0.12, 0.08))
        .show_grid([true, true])
        .x_axis_label(theme::note("east, m"))
        .y_axis_label(theme::note("north, m"));
    let hazards = driving::hazards::view(state);
    let plot = in_site(plot, move |at| {
        let ground = driving::hazards::words_at(hazards.as_deref(), [at.x, at.y]);
        format!("E {}  N {} m{ground}", fixed(at.x, 2), fixed(at.y, 2))
    });
    let response = plot.show(ui, |plot| {
        paint_paths(plot, stops, state.cursor.step);
        if let Some(run) = run {
            paint_trail(plot, stops, run, theme::run(run.number));
            for other in state.others() {
                paint_trail(plot, stops, other.run, other.style.colour);
            }
        }
        driving::map::paint(plot, state);
        if let Some((truth, _)) = truth_in_site(state) {
            let points = Points::new("", on_map(&truth)).color(theme::truth()).radius(6.0);
            plot.points(points.shape(MarkerShape::Plus));
        }
        nearest_stop(plot, stops)
    });
    hovered::paint(ui, state, stops, &response.transform);
    if let Some(step) = response.inner {
        out.push(Command::Hover(Hovered::Step(step)));
        if response.response.clicked() {
            out.push(Command::Go(Go::Step(step)));
        }
    }
}

/// The names in the row above the map.
fn names_of(state: &State, stops: &[StopView]) -> Vec<(Mark, Color32, String)> {
    let mut names = vec![(Mark::Stroke(overlay::StrokeStyle::Solid), theme::weak(), "path".to_owned())];
    if stops.iter().any(|stop| stop.true_site_from_rover.is_some()) {
        names.push((Mark::Stroke(overlay::StrokeStyle::Dotted), theme::truth(), "true".to_owned()));
    }
    if let Some(run) = state.run() {
        let name = format!("target, run {}", run_letter(run.number));
        names.push((Mark::Diamond, theme::run(run.number), name));
    }
    for other in state.others() {
        names.push((
            other.style.mark,
            other.style.colour,
            format!("target, {}", state.run_label(other.name)),
        ));
    }
    if let Some((_, off_m)) = truth_in_site(state) {
        names.push((
            Mark::Plus,
            theme::truth(),
            format!("truth, {:.0} cm off (site-frame drift of odometry)", off_m * 100.0),
        ));
    }
    if state.cycle_at(state.cursor.step).is_some() {
        names.push((Mark::Cross, theme::accent(), "goal".to_owned()));
        names.push((Mark::Stroke(overlay::StrokeStyle::Dashed), theme::accent(), "planned".to_owned()));
        names.push((
            Mark::Stroke(overlay::StrokeStyle::Dashed),
            theme::weak(),
            "by wheels alone, 3σ".to_owned(),
        ));
    }
    if state.cycle_at(state.cursor.step).is_some_and(|cycle| cycle.choice.is_some()) {
        names.push((Mark::Stroke(overlay::StrokeStyle::Dotted), theme::prediction(), "route".to_owned()));
        names.push((
            Mark::Stroke(overlay::StrokeStyle::Solid),
            theme::score(1.0),
            "path by its vote".to_owned(),
        ));
        names.push((Mark::Stroke(overlay::StrokeStyle::Dotted), theme::failed(), "vetoed path".to_owned()));
        names.push((Mark::Cross, theme::failed(), "first failing cell".to_owned()));
    }
    if let Some(raster) = state.hazards().ready() {
        names.push((Mark::Square, theme::goodness(100), "good ground".to_owned()));
        names.push((Mark::Square, theme::goodness(0), "bad ground".to_owned()));
        if let Some(why) = &raster.view.missing {
            names.push((Mark::Square, theme::lost(), format!("no range data here: {why}")));
        }
    }
    if state.cloud().ready().is_some() {
        names.push((Mark::Dot, theme::run(state.cursor.run), "bootstrap of this step".to_owned()));
    }
    names
}

fn poses<'a>(stops: &'a [StopView], of: impl Fn(&StopView) -> Option<PoseRecord> + 'a) -> Vec<[f64; 2]> {
    let shown = decimate::evenly(stops, decimate::PLACES);
    shown.filter_map(of).map(|pose| on_map(&Point3::from(pose.position_m))).collect()
}

fn paint_paths(plot: &mut PlotUi<'_>, stops: &[StopView], step: usize) {
    let truth = poses(stops, |stop| stop.true_site_from_rover);
    for piece in decimate::path(&truth) {
        let line = Line::new("true path", piece).color(theme::truth());
        plot.line(line.style(LineStyle::dotted_loose()).width(1.5));
    }
    let estimated = poses(stops, |stop| Some(stop.site_from_rover));
    for piece in decimate::path(&estimated) {
        plot.line(Line::new("estimated path", piece).color(theme::weak()).width(1.5));
    }
    plot.points(
        Points::new("estimated path", decimate::marks(estimated))
            .color(theme::weak())
            .radius(2.0)
            .shape(MarkerShape::Circle),
    );
    if let Some(stop) = stops.get(step) {
        paint_rover(plot, &stop.site_from_rover.to_pose(), stops);
    }
}

/// The rover as an arrow from its origin along its heading.
fn paint_rover(plot: &mut PlotUi<'_>, site_from_rover: &Pose, stops: &[StopView]) {
    let length_m = (span_m(stops) * 0.12).clamp(0.4, 20.0);
    let nose = site_from_rover * Point3::new(length_m, 0.0, 0.0);
    let origin = on_map(&Point3::from(site_from_rover.translation.vector));
    let arrow = Arrows::new("", PlotPoints::from(vec![origin]), PlotPoints::from(vec![on_map(&nose)]));
    plot.arrows(arrow.color(theme::accent()).tip_length(9.0));
    plot.points(Points::new("", origin).color(theme::accent()).radius(5.0).shape(MarkerShape::Circle));
}

/// The longer side of the box around the path, m.
fn span_m(stops: &[StopView]) -> f64 {
    let side = |k: usize| {
        let values = || stops.iter().map(|stop| stop.site_from_rover.position_m[k]);
        values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
    };
    side(0).max(side(1))
}

/// The run's target positions from each stop, in the site frame.
fn paint_trail(plot: &mut PlotUi<'_>, stops: &[StopView], run: &RunView, colour: Color32) {
    let trail: Vec<[f64; 2]> =
        convergence::shown(run, stops).iter().map(|at| on_map(&at.point_in_site)).collect();
    for piece in decimate::path(&trail) {
        plot.line(Line::new("", piece).color(colour).width(1.0));
    }
    plot.points(
        Points::new("", decimate::marks(trail)).color(colour).radius(2.5).shape(MarkerShape::Diamond),
    );
}

/// The stop nearest to the pointer; `None` if none is within `CLICK_REACH`.
fn nearest_stop(plot: &PlotUi<'_>, stops: &[StopView]) -> Option<usize> {
    let pointer = plot.response().hover_pos().or(plot.response().interact_pointer_pos())?;
    let distance = |stop: &StopView| {
        let [east, north] = on_map(&Point3::from(stop.site_from_rover.position_m));
        plot.screen_from_plot(PlotPoint::new(east, north)).distance(pointer)
    };
    let all = stops.iter().map(distance).enumerate();
    all.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, d)| *d <= CLICK_REACH).map(|(step, _)| step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_drive_takes_a_strip_and_the_target_the_rest() {
        let area = Rect::from_min_size(egui::Pos2::ZERO, vec2(400.0, 300.0));
        let (drive, target) = split(area, 0.1);
        assert!(drive.height() == 300.0 && drive.width() <= 0.31 * 400.0 && target.width() > 0.6 * 400.0);
        let (drive, target) = split(area, 8.0);
        assert!(drive.width() == 400.0 && drive.height() < target.height());
    }
}
