//! On the map: goal and planned path of the cursor's stop, and the path by wheel odometry alone with its 3σ ellipses.

use egui::{Color32, Stroke};
use egui_plot::{Line, LineStyle, MarkerShape, PlotUi, Points, Polygon};
use nalgebra::Matrix2;
use sightline_geometry::frames::{Point3, Pose};
use sightline_rover::driving::{Motion, Reckoned};

use crate::drawing::{decimate, ellipse};
use crate::state::State;
use crate::theme;

/// Points along a planned arc.
const SAMPLES: usize = 24;

/// Draws goodness map, paths, goal, tolerance and planned path of the cursor's stop.
pub(crate) fn paint(plot: &mut PlotUi<'_>, state: &State) {
    super::hazards::paint(plot, state);
    paint_wheels(plot, state);
    let (Some(cycle), Some(stop)) = (state.cycle_at(state.cursor.step), state.stop()) else { return };
    super::paths::paint(plot, state, &stop.site_from_rover.to_pose());
    let [north, east] = cycle.goal.in_site_m;
    let tolerance_m =
        state.drive().and_then(|drive| drive.steering.as_ref()).map_or(0.0, |s| s.command.tolerance_m);
    let circle: Vec<[f64; 2]> = (0..=SAMPLES)
        .map(|k| (k as f64 / SAMPLES as f64 * std::f64::consts::TAU).sin_cos())
        .map(|(sine, cosine)| [east + tolerance_m * sine, north + tolerance_m * cosine])
        .collect();
    plot.line(Line::new("", circle).color(theme::accent()).width(1.0));
    let goal = Points::new("goal", vec![[east, north]]).color(theme::accent()).radius(5.0);
    plot.points(goal.shape(MarkerShape::Cross));
    if let Some(motion @ Motion::Arc { .. }) = &cycle.motion {
        let path = path(&stop.site_from_rover.to_pose(), motion);
        plot.line(
            Line::new("planned", path).color(theme::accent()).style(LineStyle::dashed_dense()).width(1.5),
        );
    }
}

/// Draws the path by wheel odometry alone with ellipses, and the ellipse of the estimate at the cursor's stop.
fn paint_wheels(plot: &mut PlotUi<'_>, state: &State) {
    let Some(drive) = state.drive() else { return };
    let places: Vec<[f64; 2]> = drive.cycles.iter().map(|cycle| at(&cycle.by_wheels)).collect();
    for piece in decimate::path(&places) {
        let line = Line::new("by wheels alone", piece).color(theme::weak());
        plot.line(line.style(LineStyle::dashed_loose()).width(1.0));
    }
    for cycle in decimate::evenly(&drive.cycles, decimate::ELLIPSES) {
        paint_ellipse(plot, &cycle.by_wheels, theme::weak(), 0.7);
    }
    if let Some(cycle) = state.cycle_at(state.cursor.step) {
        paint_ellipse(plot, &cycle.estimated, theme::accent(), 1.5);
    }
}

/// Draws the 3σ ellipse of a position.
fn paint_ellipse(plot: &mut PlotUi<'_>, place: &Reckoned, colour: Color32, width: f32) {
    let Some(points) = outline(place) else { return };
    let polygon = Polygon::new("", points).fill_color(Color32::TRANSPARENT).allow_hover(false);
    plot.polygon(polygon.stroke(Stroke::new(width, colour)));
}

/// The outline of the 3σ ellipse of a position, east and north, m; `None` if its covariance is 0.
fn outline(place: &Reckoned) -> Option<Vec<[f64; 2]>> {
    let [[xx, xy, _], [_, yy, _], _] = place.covariance;
    let outline = ellipse::outline(&Matrix2::new(yy, xy, xy, xx), 3.0).filter(|_| xx + yy > 0.0)?;
    let [east, north] = at(place);
    Some(outline.iter().map(|d| [east + d.x, north + d.y]).collect())
}

fn at(place: &Reckoned) -> [f64; 2] {
    let [north, east] = place.position_m;
    [east, north]
}

/// Points along a motion of the rover, east and north, m.
pub(super) fn path(site_from_rover: &Pose, motion: &Motion) -> Vec<[f64; 2]> {
    let after = |k: usize| {
        let ([ahead_m, right_m], _) = motion.after(k as f64 / SAMPLES as f64);
        site_from_rover * Point3::new(ahead_m, right_m, 0.0)
    };
    (0..=SAMPLES).map(after).map(|point| [point.y, point.x]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_planned_arc_turns_to_the_side_of_its_curvature() {
        let motion = |length_m, curvature_per_m| Motion::Arc { length_m, curvature_per_m };
        let quarter = path(&Pose::identity(), &motion(std::f64::consts::FRAC_PI_2, 1.0));
        let [east, north] = quarter[SAMPLES];
        assert!((east - 1.0).abs() < 1e-12 && (north - 1.0).abs() < 1e-12);
        assert_eq!(path(&Pose::identity(), &motion(2.0, 0.0))[SAMPLES], [0.0, 2.0]);
    }

    #[test]
    fn an_ellipse_is_long_in_the_direction_that_is_known_least() {
        let place = Reckoned {
            position_m: [4.0, 1.0],
            heading_rad: 0.0,
            // 10 cm along north, 1 cm along east.
            covariance: [[0.01, 0.0, 0.0], [0.0, 0.0001, 0.0], [0.0; 3]],
        };
        let points = outline(&place).unwrap();
        let reach =
            |k: usize, middle: f64| points.iter().map(|point| (point[k] - middle).abs()).fold(0.0, f64::max);
        assert!((reach(0, 1.0) - 0.03).abs() < 1e-3 && (reach(1, 4.0) - 0.3).abs() < 1e-3);
        assert!(outline(&Reckoned { covariance: [[0.0; 3]; 3], ..place }).is_none());
    }
}
