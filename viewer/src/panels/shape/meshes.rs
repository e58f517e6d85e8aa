//! Both meshes in space, the earlier one transformed by the registration, with the target and its covariance ellipsoid
//! (R188, R203).

use egui::{Align2, Sense, Shape, Stroke, Ui, vec2};
use nalgebra::Matrix3;
use sightline_geometry::frames::{Point3, Vector3};
use sightline_track::locate::shape_tracker::rows::Facet;
use sightline_track::trace::ArrayName;

use crate::command::Command;
use crate::drawing::overlay;
use crate::drawing::overlay::{Mark, paint_line, paint_mark};
use crate::panels;
use crate::panels::chart_legend;
use crate::panels::shape::part_context::{PartContext, ready, why_not};
use crate::panels::shape::scene::{OrthographicView, Scene};
use crate::shape_view::{Orbit, ShapeView};
use crate::theme;

/// The purpose of the part.
const PURPOSE: &str = "Both surfaces as meshes, registered.";
/// Maximum number of facets drawn.
const FACETS: usize = 6000;
/// Number of these that are reserved for the earlier mesh.
const LEAST: usize = 1500;
/// Facets farther from the registration's start than this multiple of the sensor's side are not drawn.
const NEAR: f64 = 0.75;
/// Length of the drawn half axes, in standard deviations.
const SIGMAS: f64 = 3.0;

/// Shows the part.
pub(crate) fn show(ui: &mut Ui, context: &PartContext<'_>, out: &mut Vec<Command>) {
    let Some(found) = &context.evidence.registration else {
        panels::missing(ui, PURPOSE, &why_not(context, "registration"));
        return;
    };
    let Some(fixed) = ready(ui, context.state.facets(ArrayName::MESH_FIXED), "earlier mesh") else { return };
    let Some(moving) = ready(ui, context.state.facets(ArrayName::MESH_MOVING), "present mesh") else {
        return;
    };
    let all = [fixed.len(), moving.len()];
    let start = Point3::from(found.start_in_rover);
    let near_m = found.sensor_side_m.map_or(f64::INFINITY, |side_m| NEAR * side_m);
    let [fixed, moving] = [fixed, moving].map(|mesh| near(mesh, &start, near_m));
    let Some((middle, reach_m)) = extent(&fixed, &moving) else {
        panels::missing(ui, PURPOSE, &why_not(context, "facets"));
        return;
    };
    let every_moving = every(moving.len(), FACETS - LEAST.min(fixed.len()));
    let every_fixed = every(fixed.len(), (FACETS - moving.len().div_ceil(every_moving)).max(LEAST));
    let run = theme::run(context.state.cursor.run);
    let thinned = |drawn: usize, all: usize| match drawn {
        drawn if drawn == all => format!("{all} facets"),
        drawn => format!("{drawn} of {all} facets"),
    };
    let (drawn_fixed, drawn_moving) =
        (fixed.len().div_ceil(every_fixed), moving.len().div_ceil(every_moving));
    let fixed_words = format!("step {}, {}", found.to_step, thinned(drawn_fixed, all[0]));
    let moving_words = format!("this step, {}", thinned(drawn_moving, all[1]));
    chart_legend::wrapped(
        ui,
        "drag rotates, wheel zooms, double click resets",
        &[
            (Mark::Stroke(overlay::StrokeStyle::Solid), theme::mesh_earlier(), fixed_words),
            (Mark::Dot, theme::mesh_present(), moving_words),
            (Mark::Ring, run, "target, axes of 3σ".to_owned()),
        ],
    );
    let orbit = context.state.shape_view.orbit;
    let (rect, response) = ui.allocate_exact_size(
        vec2(ui.available_width(), ui.available_height().max(160.0)),
        Sense::click_and_drag(),
    );
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, "meshes in space"));
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 0.0, theme::well());
    let camera = context.trace.point_mast.left.model.centre();
    let view = OrthographicView::new(&camera, middle, reach_m, orbit, rect);
    let mut scene = Scene::new(view);
    scene.facets(moving.iter().step_by(every_moving), theme::mesh_present(), true);
    scene.facets(fixed.iter().step_by(every_fixed), theme::mesh_earlier(), false);
    painter.add(scene.shape());
    target(&painter, context, &view, run);
    scale_bar(&painter, &view, rect);
    if let Some(orbit) = orbit_from_input(ui, &response, orbit) {
        out.push(Command::SetShapeView(ShapeView { orbit, ..context.state.shape_view }));
    }
}

/// The facets whose first corner is within `near_m` of a place; all facets if there are none.
fn near(mesh: &[Facet], place: &Point3, near_m: f64) -> Vec<Facet> {
    let is_near = |facet: &&Facet| (Point3::from(facet[0].map(f64::from)) - place).norm() <= near_m;
    let near: Vec<Facet> = mesh.iter().filter(is_near).copied().collect();
    if near.is_empty() { mesh.to_vec() } else { near }
}

/// Decimation interval with which at most `most` of `count` facets are drawn.
fn every(count: usize, most: usize) -> usize {
    count.div_ceil(most.max(1)).max(1)
}

/// The centre of the facets' bounding box, and the largest distance of a corner from it, m; `None` without facets.
fn extent(fixed: &[Facet], moving: &[Facet]) -> Option<(Point3, f64)> {
    let corners = || fixed.iter().chain(moving).flatten().map(|corner| Vector3::from(corner.map(f64::from)));
    let first = corners().next()?;
    let [low, high] =
        corners().fold([first, first], |[low, high], corner| [low.inf(&corner), high.sup(&corner)]);
    let middle = (low + high) / 2.0;
    let reach_m = corners().map(|corner| (corner - middle).norm()).fold(0.0, f64::max);
    Some((Point3::from(middle), reach_m))
}

/// The target with the half axes of its covariance.
fn target(
    painter: &egui::Painter,
    context: &PartContext<'_>,
    view: &OrthographicView,
    colour: egui::Color32,
) {
    let located = context.trace.located();
    let position = located.and_then(|located| located.position_in_rover);
    let Some(position) = position else {
        let at = painter.clip_rect().left_top() + vec2(8.0, 8.0);
        let words = "no target: the registration is not used";
        painter.text(at, Align2::LEFT_TOP, words, theme::image_font(), theme::lost());
        return;
    };
    if let Some(covariance) = located.and_then(|located| located.covariance_in_rover) {
        for axis in axes(&covariance) {
            let ends = [position - axis, position + axis].map(|end| view.project(&end).0);
            paint_line(painter, &ends, colour, overlay::StrokeStyle::Solid, 2.0);
        }
    }
    paint_mark(painter, view.project(&position).0, Mark::Ring, colour, 6.0);
}

/// The half axes of the covariance ellipsoid at `SIGMAS`, m; empty if not finite.
fn axes(covariance: &Matrix3<f64>) -> Vec<Vector3> {
    if covariance.iter().any(|value| !value.is_finite()) {
        return Vec::new();
    }
    let eigen = covariance.symmetric_eigen();
    let axis = |i: usize| eigen.eigenvectors.column(i) * eigen.eigenvalues[i].max(0.0).sqrt() * SIGMAS;
    (0..3).map(axis).collect()
}

/// A scale bar of one, two or five times a power of ten, at most a fifth of the width.
fn scale_bar(painter: &egui::Painter, view: &OrthographicView, rect: egui::Rect) {
    let room_m = f64::from(rect.width()) / 5.0 / view.scale;
    let power = 10f64.powf(room_m.log10().floor());
    let length_m = [5.0, 2.0, 1.0].into_iter().map(|n| n * power).find(|m| *m <= room_m).unwrap_or(power);
    let from = rect.left_bottom() + vec2(10.0, -10.0);
    let to = from + vec2((length_m * view.scale) as f32, 0.0);
    painter.add(Shape::line_segment([from, to], Stroke::new(2.0, theme::strong())));
    let words = format!("{} cm", panels::digits((length_m * 1e6).round() / 1e4));
    painter.text(from - vec2(0.0, 4.0), Align2::LEFT_BOTTOM, words, theme::digit_font(), theme::text());
}

/// The view that the pointer input leads to; `None` if unchanged.
fn orbit_from_input(ui: &Ui, response: &egui::Response, orbit: Orbit) -> Option<Orbit> {
    if response.double_clicked() {
        return Some(Orbit::default());
    }
    if response.dragged() && response.drag_delta() != egui::Vec2::ZERO {
        let by = response.drag_delta();
        return Some(orbit.turned(by.x, by.y));
    }
    response.hover_pos()?;
    let (scroll, zoom) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
    let factor = f64::from(zoom) * (f64::from(scroll) / 200.0).exp();
    (factor != 1.0).then(|| orbit.zoomed(factor))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_facets_are_drawn_than_said_and_few_are_drawn_whole() {
        assert_eq!(every(400, 4500), 1);
        assert!(20_000_usize.div_ceil(every(20_000, 4500)) <= 4500);
        assert_eq!(every(0, 10), 1);
    }

    #[test]
    fn far_facets_are_omitted_unless_all_are_far() {
        let facet = |x: f32| [[x, 0.0, 0.0], [x, 0.1, 0.0], [x, 0.0, 0.1]];
        let mesh = [facet(0.1), facet(0.4), facet(2.0)];
        assert_eq!(near(&mesh, &Point3::origin(), 0.5).len(), 2);
        assert_eq!(near(&mesh, &Point3::new(9.0, 0.0, 0.0), 0.5).len(), 3);
    }

    #[test]
    fn the_axes_are_three_sigma_long_and_none_are_drawn_of_what_is_not_known() {
        let axes = axes(&Matrix3::from_diagonal(&Vector3::new(4e-4, 1e-4, 1e-6)));
        let mut lengths: Vec<f64> = axes.iter().map(Vector3::norm).collect();
        lengths.sort_by(f64::total_cmp);
        for (length, expected) in lengths.iter().zip([0.003, 0.03, 0.06]) {
            assert!((length - expected).abs() < 1e-9, "{length}");
        }
        assert!(super::axes(&Matrix3::repeat(f64::NAN)).is_empty());
    }
}
