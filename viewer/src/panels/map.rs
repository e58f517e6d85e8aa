//! The map: the rover's path and the target's trail in the site frame, seen from above, north up.
//!
//! Site frame: +x north, +y east, +z down. On the map east is to the right, so a site point is drawn at (y, x).

use egui::{Ui, vec2};
use egui_plot::{
    Arrows, Line, LineStyle, MarkerShape, Plot, PlotPoint, PlotPoints, PlotUi, Points, Polygon, Text,
};
use nalgebra::Matrix2;
use sightline_core::frames::{Point3, Pose, PoseRecord, Vector3};
use sightline_core::session::view::RunView;
use sightline_core::session::wire::StopView;

use crate::command::{Command, Go};
use crate::state::{State, run_letter};
use crate::{ellipse, panels, theme};

/// How near to a stop a click must be to go there, points.
const CLICK_REACH: f32 = 14.0;

/// East and north of a point of the site frame.
fn on_map(point_in_site: &Point3) -> [f64; 2] {
    [point_in_site.y, point_in_site.x]
}

/// Shows the map.
pub fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(traverse) = state.traverse.as_ref().filter(|t| !t.stops.is_empty()) else {
        panels::missing(ui, &state.missing_target());
        return;
    };
    let stops = &traverse.stops;
    let plot = Plot::new(("map", &traverse.id))
        .data_aspect(1.0)
        .set_margin_fraction(vec2(0.12, 0.12))
        .show_grid([true, true])
        .y_axis_min_width(24.0)
        .allow_boxed_zoom(false)
        .label_formatter(|_| None)
        .coordinates_formatter(
            egui_plot::Corner::RightBottom,
            egui_plot::CoordinatesFormatter::new(|at, _| format!("E {:.2}  N {:.2} m", at.x, at.y)),
        )
        .legend(
            egui_plot::Legend::default()
                .position(egui_plot::Corner::LeftTop)
                .text_style(egui::TextStyle::Small)
                .background_alpha(0.6),
        );
    let response = plot.show(ui, |plot| {
        paint_paths(plot, stops, state.cursor.step);
        if let Some(run) = state.run() {
            paint_trail(plot, state, stops, run);
        }
        plot.response().clicked().then(|| nearest_stop(plot, stops)).flatten()
    });
    if let Some(step) = response.inner {
        out.push(Command::Go(Go::Step(step)));
    }
}

fn poses<'a>(stops: &'a [StopView], of: impl Fn(&StopView) -> Option<PoseRecord> + 'a) -> Vec<[f64; 2]> {
    stops.iter().filter_map(of).map(|pose| on_map(&Point3::from(pose.position_m))).collect()
}

fn paint_paths(plot: &mut PlotUi<'_>, stops: &[StopView], step: usize) {
    let truth = poses(stops, |stop| stop.true_site_from_rover);
    if !truth.is_empty() {
        plot.line(
            Line::new("true path", truth).color(theme::TRUTH).style(LineStyle::dotted_loose()).width(1.5),
        );
    }
    let estimated = poses(stops, |stop| Some(stop.site_from_rover));
    plot.line(Line::new("estimated path", estimated.clone()).color(theme::PREDICTION).width(1.5));
    plot.points(
        Points::new("estimated path", estimated)
            .color(theme::PREDICTION)
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
    plot.arrows(arrow.color(theme::ACCENT).tip_length(9.0));
    plot.points(Points::new("", origin).color(theme::ACCENT).radius(5.0).shape(MarkerShape::Circle));
}

/// The longer side of the box around the path, m.
fn span_m(stops: &[StopView]) -> f64 {
    let side = |k: usize| {
        let values = || stops.iter().map(|stop| stop.site_from_rover.position_m[k]);
        values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
    };
    side(0).max(side(1))
}

/// Where the run placed the target from each stop, and what is known of it at the cursor's.
fn paint_trail(plot: &mut PlotUi<'_>, state: &State, stops: &[StopView], run: &RunView) {
    let colour = theme::run(run.number);
    let trail: Vec<[f64; 2]> = run
        .rows
        .iter()
        .filter_map(|row| {
            let stop = stops.get(row.step)?;
            Some(on_map(&(stop.site_from_rover.to_pose() * Point3::from(row.position_in_rover))))
        })
        .collect();
    let name = format!("target, run {}", run_letter(run.number));
    plot.line(Line::new(&name, trail.clone()).color(colour).width(1.0));
    plot.points(Points::new(&name, trail).color(colour).radius(2.5).shape(MarkerShape::Diamond));
    let (Some(trace), Some(stop)) = (state.trace(), state.stop()) else { return };
    let site_from_rover = stop.site_from_rover.to_pose();
    let target = &trace.update.target;
    let centre = site_from_rover * target.position_in_rover;
    let rotation = site_from_rover.rotation.to_rotation_matrix();
    let in_site = rotation.matrix() * target.covariance_in_rover * rotation.matrix().transpose();
    let from_above = Matrix2::new(in_site[(1, 1)], in_site[(1, 0)], in_site[(0, 1)], in_site[(0, 0)]);
    for (sigmas, style) in [(1.0, LineStyle::Solid), (3.0, LineStyle::dashed_dense())] {
        let Some(outline) = ellipse::outline(&from_above, sigmas) else { continue };
        let [east, north] = on_map(&centre);
        let points: Vec<[f64; 2]> = outline.iter().map(|d| [east + d.x, north + d.y]).collect();
        let polygon = Polygon::new("", points).style(style).allow_hover(false);
        plot.polygon(polygon.fill_color(egui::Color32::TRANSPARENT).stroke(egui::Stroke::new(1.5, colour)));
    }
    plot.points(
        Points::new(&name, on_map(&centre))
            .color(colour)
            .radius(5.0)
            .shape(MarkerShape::Diamond)
            .filled(false),
    );
    paint_truth(plot, state, &centre);
}

/// The true position, carried by the true pose.
fn paint_truth(plot: &mut PlotUi<'_>, state: &State, estimate_in_site: &Point3) {
    let Some(truth) = state.trace().and_then(|trace| trace.truth.as_ref()) else { return };
    let Some(true_pose) = state.stop().and_then(|stop| stop.true_site_from_rover) else { return };
    let point = true_pose.to_pose() * truth.position_in_rover;
    plot.points(
        Points::new("truth", on_map(&point)).color(theme::TRUTH).radius(6.0).shape(MarkerShape::Plus),
    );
    let offset: Vector3 = estimate_in_site - point;
    let [east, north] = on_map(estimate_in_site);
    let words = format!("  {:.0} cm off in the site frame", offset.norm() * 100.0);
    plot.text(
        Text::new("", PlotPoint::new(east, north), theme::note(words).color(theme::TEXT))
            .anchor(egui::Align2::LEFT_TOP)
            .allow_hover(false),
    );
}

/// The stop nearest to the pointer, where one is near.
fn nearest_stop(plot: &PlotUi<'_>, stops: &[StopView]) -> Option<usize> {
    let pointer = plot.response().interact_pointer_pos()?;
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
    fn north_is_up_and_east_is_right() {
        assert_eq!(on_map(&Point3::new(3.0, 1.0, 0.0)), [1.0, 3.0]);
    }
}
