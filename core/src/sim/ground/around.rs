//! What the placing of rocks must know of a drive that is more than a straight line: where it looks, where its wheels
//! go.
//!
//! A place is worth a rock when it lies in the wedge that some stop sees: within `2 m + 0.46 a` of the line of sight
//! to the targets' centre, a metres ahead of the stop (half of 46° and a margin for shadows). Rocks keep clear of
//! the wheels' lines on flat ground, and high ones of the belly.
//!
//! Frame: site, m. Sources: domain.md 2.6 (field of view), 5.4 (wheels).

use crate::sim::rover::drive::{TrueDrive, goal_m, planned};
use crate::sim::scenario::{Course, DriveSettings};

/// Half of a wheel's width and a margin, m.
const WHEEL_M: f64 = 0.13;
/// How far the belly reaches from the rover's middle, m (ours).
const BELLY_REACH_M: f64 = 0.6;
/// How far to the side of a line of sight a place is seen, at the stop itself, m.
const ASIDE_M: f64 = 2.0;
/// What is added to that for each metre ahead.
const WIDENING: f64 = 0.46;

/// Where a drive of moves looks and goes.
#[derive(Clone, Debug, PartialEq)]
pub struct Around {
    goal_m: [f64; 2],
    stops_m: Vec<[f64; 2]>,
    wheels_m: Vec<[f64; 2]>,
    middles_m: Vec<[f64; 2]>,
}

impl Around {
    /// Of a drive; nothing for a straight approach along x, whose wedge and lane are known without it.
    pub fn new(drive: &DriveSettings) -> Option<Self> {
        if drive.course == Course::Approach && drive.heading_deg == 0.0 {
            return None;
        }
        let TrueDrive { stops, legs } = planned(drive).ok()?;
        let stands = || legs.iter().flat_map(|leg| &leg.stands);
        let place = |pose: &crate::frames::Pose| [pose.translation.x, pose.translation.y];
        Some(Self {
            goal_m: goal_m(drive),
            stops_m: stops.iter().map(|stop| place(&stop.site_from_rover)).collect(),
            wheels_m: stands()
                .flat_map(|stand| stand.contacts_in_site.map(|point| [point.x, point.y]))
                .collect(),
            middles_m: stands().map(|stand| place(&stand.site_from_rover)).collect(),
        })
    }

    /// Whether some stop looks at a place.
    pub fn sees(&self, x_m: f64, y_m: f64) -> bool {
        self.stops_m.iter().any(|stop| {
            let sight = [self.goal_m[0] - stop[0], self.goal_m[1] - stop[1]];
            let length_m = sight[0].hypot(sight[1]).max(1e-9);
            let (ux, uy) = (sight[0] / length_m, sight[1] / length_m);
            let (dx, dy) = (x_m - stop[0], y_m - stop[1]);
            let (ahead_m, aside_m) = (dx * ux + dy * uy, (dy * ux - dx * uy).abs());
            ahead_m > 0.0 && aside_m <= ASIDE_M + WIDENING * ahead_m
        })
    }

    /// Whether a rock of this reach (m) would stand under a wheel, or one higher than the belly under the rover.
    pub fn is_in_the_way(&self, x_m: f64, y_m: f64, reach_m: f64, touches_belly: bool) -> bool {
        let near = |places: &[[f64; 2]], by_m: f64| {
            places.iter().any(|place| (place[0] - x_m).powi(2) + (place[1] - y_m).powi(2) < by_m * by_m)
        };
        near(&self.wheels_m, reach_m + WHEEL_M)
            || touches_belly && near(&self.middles_m, reach_m + BELLY_REACH_M)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::scenario::Move;

    #[test]
    fn a_crab_sees_behind_the_targets_from_all_its_stops_and_keeps_its_wheels_free() {
        let crab = Move::Crab { angle_deg: 70.0, stops: 14 };
        let drive = DriveSettings {
            course: Course::Moves,
            start_distance_m: 7.0,
            moves: vec![crab],
            ..DriveSettings::default()
        };
        let around = Around::new(&drive).unwrap();
        let [x_m, y_m] = goal_m(&drive);
        // 40 m behind the centre in the first and in the last line of sight; beside and behind the first stop.
        let last = 70f64.to_radians();
        assert!(
            around.sees(x_m + 40.0, y_m) && around.sees(x_m + 40.0 * last.cos(), y_m + 40.0 * last.sin())
        );
        assert!(!around.sees(x_m - 40.0, y_m) && !around.sees(x_m, y_m - 40.0));
        // A front wheel of the first stop stands at (0.70, 0.53) of the rover.
        assert!(around.is_in_the_way(0.70, 0.53, 0.05, false) && !around.is_in_the_way(1.5, 0.1, 0.05, true));
        // Between the wheels of a straight drive only the belly is in danger.
        let moves = vec![Move::Forward { distance_m: 1.0, stops: 1 }];
        let straight = Around::new(&DriveSettings { moves, ..drive }).unwrap();
        assert!(
            straight.is_in_the_way(0.5, 0.1, 0.05, true) && !straight.is_in_the_way(0.5, 0.1, 0.05, false)
        );
    }

    #[test]
    fn a_straight_approach_needs_none() {
        assert_eq!(Around::new(&DriveSettings::default()), None);
    }
}
