//! The site frame seen from above, as both maps show it.

use egui_plot::{Plot, PlotPoint};
use sightline_geometry::frames::Point3;

use crate::panels::chart::{few_marks, plain};
use crate::state::State;
use crate::theme;

/// East and north of a point in the site frame.
pub(super) fn on_map(point_in_site: &Point3) -> [f64; 2] {
    [point_in_site.y, point_in_site.x]
}

/// A plot seen from above: few ticks, and the position under the pointer in words.
pub(super) fn in_site<'a>(plot: Plot<'a>, words: impl Fn(&PlotPoint) -> String + 'a) -> Plot<'a> {
    plot.y_axis_min_width(22.0)
        .grid_color(theme::line())
        .x_grid_spacer(few_marks)
        .x_axis_formatter(plain)
        .y_grid_spacer(few_marks)
        .y_axis_formatter(plain)
        .allow_boxed_zoom(false)
        .label_formatter(|_| None)
        .coordinates_formatter(
            egui_plot::Corner::RightBottom,
            egui_plot::CoordinatesFormatter::new(move |at, _| words(at)),
        )
}

/// The true position in the site frame by the true pose, and its distance from the estimate, m.
pub(super) fn truth_in_site(state: &State) -> Option<(Point3, f64)> {
    let (trace, stop) = (state.trace()?, state.stop()?);
    let point = stop.true_site_from_rover?.to_pose() * trace.truth.as_ref()?.position_in_rover;
    let estimate = stop.site_from_rover.to_pose() * trace.update.target.position_in_rover;
    Some((point, (estimate - point).norm()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn north_is_up_and_east_is_right() {
        assert_eq!(on_map(&Point3::new(3.0, 1.0, 0.0)), [1.0, 3.0]);
    }
}
