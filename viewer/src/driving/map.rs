//! The goal and the planned path on the map, at the stop that is looked at.

use egui_plot::{Line, LineStyle, MarkerShape, PlotUi, Points};
use sightline_geometry::frames::{Point3, Pose};
use sightline_rover::driving::Motion;

use crate::state::State;
use crate::theme;

/// Points along a planned arc.
const SAMPLES: usize = 24;

/// Draws goal, tolerance and planned path of the cursor's stop.
pub(crate) fn paint(plot: &mut PlotUi<'_>, state: &State) {
    let (Some(cycle), Some(stop)) = (state.cycle_at(state.cursor.step), state.stop()) else { return };
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
    if let Some(Motion::Arc { length_m, curvature_per_m }) = cycle.motion {
        let path = arc(&stop.site_from_rover.to_pose(), length_m, curvature_per_m);
        plot.line(
            Line::new("planned", path).color(theme::accent()).style(LineStyle::dashed_dense()).width(1.5),
        );
    }
}

/// Points along an arc from the rover, east and north, m.
fn arc(site_from_rover: &Pose, length_m: f64, curvature_per_m: f64) -> Vec<[f64; 2]> {
    let along = (0..=SAMPLES).map(|k| length_m * k as f64 / SAMPLES as f64);
    let in_rover = along.map(|s| {
        let turn = curvature_per_m * s;
        if turn.abs() < 1e-9 {
            Point3::new(s, 0.0, 0.0)
        } else {
            Point3::new(turn.sin() / curvature_per_m, (1.0 - turn.cos()) / curvature_per_m, 0.0)
        }
    });
    in_rover.map(|point| site_from_rover * point).map(|point| [point.y, point.x]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_planned_arc_turns_to_the_side_of_its_curvature() {
        let quarter = arc(&Pose::identity(), std::f64::consts::FRAC_PI_2, 1.0);
        let [east, north] = quarter[SAMPLES];
        assert!((east - 1.0).abs() < 1e-12 && (north - 1.0).abs() < 1e-12);
        assert_eq!(arc(&Pose::identity(), 2.0, 0.0)[SAMPLES], [0.0, 2.0]);
    }
}
