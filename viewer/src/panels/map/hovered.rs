//! The pointer of another panel on the map of the drive: the line of sight of a pixel of the left image, and a stop.
//!
//! It is painted over the finished plot, so that it does not change the plot's limits.

use egui::{Painter, Pos2, Ui};
use egui_plot::{PlotPoint, PlotTransform};
use sightline_api::wire::StopView;
use sightline_geometry::frames::{Point3, Pose};

use crate::drawing::overlay::{Mark, StrokeStyle, paint_line, paint_mark, paint_words};
use crate::panels::map::site::on_map;
use crate::state::State;
use crate::theme;

/// Length of a drawn line of sight, and the ranges of its ticks, m.
const REACH_M: f64 = 100.0;
const TICKS_M: [f64; 6] = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0];

/// Minimum distance of two ticks, points.
const TICK_GAP: f32 = 28.0;

/// Paints the pointed stop and line of sight.
pub(crate) fn paint(ui: &Ui, state: &State, stops: &[StopView], transform: &PlotTransform) {
    let painter = ui.painter_at(*transform.frame());
    let place = |point: &Point3| {
        let [east, north] = on_map(point);
        transform.position_from_point(&PlotPoint::new(east, north))
    };
    if let Some(stop) = state.hovered_step().and_then(|step| stops.get(step)) {
        let at = place(&Point3::from(stop.site_from_rover.position_m));
        paint_mark(&painter, at, Mark::Ring, theme::accent(), 9.0);
    }
    if let Some((site_from_rover, sight)) = line_of_sight(state) {
        paint_sight(&painter, |range_m| place(&(site_from_rover * sight(range_m))));
    }
}

/// The estimated pose of the rover, and the points of the pointed pixel's line of sight by range.
fn line_of_sight(state: &State) -> Option<(Pose, impl Fn(f64) -> Point3)> {
    let pixel = state.hovered_left()?;
    let ray = state.stereo_cameras()?.0.ray(pixel)?;
    Some((state.stop()?.site_from_rover.to_pose(), move |range_m| ray.at(range_m)))
}

fn paint_sight(painter: &Painter, at: impl Fn(f64) -> Pos2) {
    paint_line(painter, &[at(0.0), at(REACH_M)], theme::accent(), StrokeStyle::Dashed, 1.0);
    let mut last = at(0.0);
    for range_m in TICKS_M {
        let here = at(range_m);
        if here.distance(last) < TICK_GAP || !painter.clip_rect().contains(here) {
            continue;
        }
        paint_mark(painter, here, Mark::Plus, theme::accent(), 4.0);
        paint_words(painter, here + egui::vec2(7.0, 0.0), &format!("{range_m} m"), theme::accent());
        last = here;
    }
}
