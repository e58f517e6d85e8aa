//! Whether the path of an approach is clear: nothing in the map under the rover's box is higher than a wheel climbs.
//!
//! ```text
//! box       own_half_length_m ahead and behind, rover_radius_m to either side: wheels and body with a margin
//! height    lowest ground within step_reach_m of a cell − top of the cell
//! obstacle  a cell under the box during the motion, but not at its start, that is higher than the limit of a step
//! ```
//! The discs of [`HazardNavigator`](super::navigator::HazardNavigator) reach the target's own rock from 1.3 m away; the
//! box does not. Cells without range data are ignored.
//!
//! Frame: site, m.

use crate::driving::motion::Motion;
use crate::driving::select_path::ArcNavigator;
use crate::hazards::goodness::GoodnessMap;
use sightline_geometry::frames::Pose;

use super::limits::VetoLimits;
use super::path::Stance;
use super::settings::NavigatorSettings;

/// Sampling interval of the box along an arc, m, and angle along a turn, rad.
const SAMPLE_M: f64 = 0.05;
const SAMPLE_RAD: f64 = 0.05;

/// An obstacle that is too high for the rover to drive over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Obstacle {
    /// Centre of its cell, site frame, m.
    pub(crate) in_site_m: [f64; 2],
    /// Height over the surrounding ground, m.
    pub(crate) height_m: f64,
    /// Limit of a step, m.
    pub(crate) limit_m: f64,
}

/// The first obstacle under the rover on its path by arcs to a goal ahead and to the right of it, m; `None` if the path is
/// clear.
pub(crate) fn obstacle(map: &GoodnessMap, site_from_rover: &Pose, goal_m: [f64; 2]) -> Option<Obstacle> {
    let start = Stance::of(site_from_rover);
    let first = ArcNavigator::default().motion(goal_m, f64::INFINITY);
    let straight = |length_m: f64| Motion::Arc { length_m, curvature_per_m: 0.0 };
    let way = match first {
        Motion::Turn { .. } => vec![first, straight(goal_m[0].hypot(goal_m[1]))],
        Motion::Arc { .. } => vec![first],
    };
    let limit_m = VetoLimits::new(&map.settings, &NavigatorSettings::default()).step_m;
    let higher = |index: &usize| height_m(map, *index).is_some_and(|height_m| height_m > limit_m);
    let high: Vec<usize> = (0..map.cells.len()).filter(higher).collect();
    let mut from = start;
    for motion in way {
        for place in places(&from, &motion) {
            let is_met = |index: &&usize| {
                let at_m = map.grid.centre_m(**index);
                is_under(map, &place, at_m) && !is_under(map, &start, at_m)
            };
            if let Some(index) = high.iter().find(is_met) {
                let (in_site_m, height_m) = (map.grid.centre_m(*index), height_m(map, *index)?);
                return Some(Obstacle { in_site_m, height_m, limit_m });
            }
        }
        from = from.after(&motion, 1.0);
    }
    None
}

/// Whether a point is under the rover's box.
fn is_under(map: &GoodnessMap, stance: &Stance, at_m: [f64; 2]) -> bool {
    let [ahead, right] = stance.seen(at_m);
    ahead.abs() < map.settings.own_half_length_m && right.abs() < map.settings.rover_radius_m
}

/// Stances along a motion, including its end.
fn places(from: &Stance, motion: &Motion) -> impl Iterator<Item = Stance> {
    let count = match *motion {
        Motion::Arc { length_m, .. } => length_m.abs() / SAMPLE_M,
        Motion::Turn { angle_rad } => angle_rad.abs() / SAMPLE_RAD,
    };
    let count = count.ceil().max(1.0) as usize;
    let (from, motion) = (*from, *motion);
    (1..=count).map(move |k| from.after(&motion, k as f64 / count as f64))
}

/// Height of a cell over the lowest ground near it, m; `None` without range data.
fn height_m(map: &GoodnessMap, index: usize) -> Option<f64> {
    let top_m = map.cells[index].top_m?;
    let (side, cell_m) = (map.grid.side, map.grid.cell_m);
    let (row, column) = (index / side, index % side);
    let reach = (map.settings.step_reach_m / cell_m).round() as usize;
    let rows = row.saturating_sub(reach)..=(row + reach).min(side - 1);
    let columns = column.saturating_sub(reach)..=(column + reach).min(side - 1);
    let ground = rows.flat_map(|row| columns.clone().map(move |column| row * side + column));
    // z points down.
    let lowest_m = ground.filter_map(|index| map.cells[index].height_m).fold(top_m, f32::max);
    Some(f64::from(lowest_m - top_m))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Rock, known, pose, rocks_height};
    use super::*;
    use crate::hazards::HazardSettings;

    fn met(rock: Rock, goal_m: [f64; 2]) -> Option<Obstacle> {
        let stance = pose([0.0, 0.0], 0.0);
        let map = known(&stance, &HazardSettings::default(), |x, y| 0.1 * x + rocks_height(&[rock], x, y));
        obstacle(&map, &stance, goal_m)
    }

    #[test]
    fn a_rock_under_the_box_is_an_obstacle_and_one_beside_or_beyond_it_is_none() {
        let rock = |at: [f64; 2], height: f64| Rock { at, radius: 0.15, height };
        let ahead = [0.7, 0.0];
        let found = met(rock([1.3, 0.5], 0.3), ahead).expect("it is in the way of a wheel");
        assert!((found.in_site_m[0] - 1.3).hypot(found.in_site_m[1] - 0.5) < 0.25, "{found:?}");
        assert!((found.height_m - 0.3).abs() < 0.06 && (found.limit_m - 0.165).abs() < 1e-9, "{found:?}");
        assert_eq!(met(rock([1.3, 0.5], 0.1), ahead), None, "a wheel climbs it");
        assert_eq!(met(rock([1.3, 1.1], 0.3), ahead), None, "it is beside the way");
        // The target's own rock: its face is where the box ends.
        assert_eq!(met(rock([2.0, 0.0], 0.3), ahead), None);
        assert!(met(rock([1.7, 0.0], 0.3), ahead).is_some());
        // The rover is already over it.
        assert_eq!(met(rock([0.5, 0.0], 0.3), ahead), None);
    }

    #[test]
    fn the_way_to_a_goal_on_the_side_is_that_after_the_turn() {
        let rock = Rock { at: [0.2, 1.4], radius: 0.15, height: 0.3 };
        assert!(met(rock, [0.0, 0.8]).is_some());
        assert_eq!(met(rock, [0.7, 0.0]), None);
    }
}
