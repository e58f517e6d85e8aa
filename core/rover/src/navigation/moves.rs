//! The motions of the search for a way: their footprints and costs.
//!
//! ```text
//! motions  arcs of `STEP_M` ahead with `CURVATURES` times the tightest curvature, straight back, turns of `HEADING_DEG`
//! last     within `LAST_M` of the goal: one arc, backwards within `LAST_BACKWARDS_M`, or a turn to it and a straight line
//! cost     F Δs of an arc, `TURN_M_PER_RAD` |Δψ| of a turn      (F: `route.rs`)
//! ```
//! Their footprints are computed once. A motion that starts on bad ground is evaluated by [`Path`], whose rules for
//! leaving it apply.
//!
//! Frame: site, horizontal.

use crate::driving::motion::Motion;
use crate::driving::select_path::ArcNavigator;

use super::ground::{Ground, Part};
use super::path::{Footprint, Path, Stance, is_unknown_behind};
use super::route::Route;
use super::settings::NavigatorSettings;

pub(super) const HEADING_DEG: f64 = 15.0;
pub(super) const STEP_M: f64 = 0.3;
const CURVATURES: [f64; 5] = [0.0, -0.5, 0.5, -1.0, 1.0];
const TURN_M_PER_RAD: f64 = 1.0;
const LAST_M: f64 = 1.5;
const LAST_BACKWARDS_M: f64 = 0.5;

/// The motions of a search over a ground.
pub(super) struct Moves<'a> {
    pub(super) ground: &'a Ground<'a>,
    settings: &'a NavigatorSettings,
    footprints: Vec<Footprint>,
}

/// A stance as the start of motions.
pub(super) struct Start {
    stance: Stance,
    sine: f64,
    cosine: f64,
    /// Whether no disc of the footprint of any motion is on bad ground.
    is_free: bool,
}

impl Footprint {
    /// Cost of the motion for a mean cost of the ground, m.
    pub(super) fn cost_m(&self, mean_cost: f64) -> f64 {
        match self.motion {
            Motion::Arc { length_m, .. } => length_m.abs() * mean_cost,
            Motion::Turn { angle_rad } => TURN_M_PER_RAD * angle_rad.abs(),
        }
    }
}

impl Start {
    /// The stance after one of the motions.
    pub(super) fn after(&self, footprint: &Footprint) -> Stance {
        let (moved, turned_rad) = footprint.moved;
        Stance { at_m: self.place(moved), heading_rad: self.stance.heading_rad + turned_rad }
    }

    /// Whether no disc of the footprint of any motion is on bad ground.
    pub(super) fn is_free(&self) -> bool {
        self.is_free
    }

    /// Converts a position ahead and to the right to the site frame, m.
    fn place(&self, [ahead, right]: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.stance.at_m;
        [x + self.cosine * ahead - self.sine * right, y + self.sine * ahead + self.cosine * right]
    }
}

impl<'a> Moves<'a> {
    pub(super) fn new(ground: &'a Ground<'a>, settings: &'a NavigatorSettings) -> Self {
        let max = settings.curvature_max_per_m;
        let arc = |length_m: f64, curvature_per_m: f64| Motion::Arc { length_m, curvature_per_m };
        let turns = [-1.0, 1.0].map(|side| Motion::Turn { angle_rad: side * HEADING_DEG.to_radians() });
        let arcs = CURVATURES.into_iter().map(|part| arc(STEP_M, part * max));
        let motions = arcs.chain([arc(-STEP_M, 0.0)]).chain(turns);
        let footprints = motions.map(|motion| Footprint::new(&motion, 0.0, settings)).collect();
        Self { ground, settings, footprints }
    }

    /// Distance of the leading disc from the rover's origin, m.
    pub(super) fn reach_m(&self) -> f64 {
        self.settings.reach_m
    }

    /// The footprints of the motions.
    pub(super) fn footprints(&self) -> &[Footprint] {
        &self.footprints
    }

    /// Prepares a stance as the start of motions.
    pub(super) fn start(&self, stance: Stance) -> Start {
        let (sine, cosine) = stance.heading_rad.sin_cos();
        let start = Start { stance, sine, cosine, is_free: true };
        let ends_m = [self.settings.reach_m, -self.settings.reach_m];
        let is_free = !self.ground.is_bad_at(stance.at_m, Part::Origin)
            && !ends_m.iter().any(|ahead| self.ground.is_bad_at(start.place([*ahead, 0.0]), Part::End));
        Start { is_free, ..start }
    }

    /// Cost of one of the motions on the way to the goal of a route; `None` if it is vetoed.
    pub(super) fn cost(&self, start: &Start, footprint: &Footprint, route: &Route<'_>) -> Option<f64> {
        if !start.is_free {
            return self.cost_of(&self.path(&start.stance, footprint), footprint, route);
        }
        let (mut sum, mut count) = (0.0, 0.0);
        let is_safe = self.visit(start, footprint, |index| {
            sum += route.cost_of(index);
            count += 1.0;
        });
        is_safe.then(|| footprint.cost_m(sum / count))
    }

    /// Whether one of the motions passes the vetoes.
    pub(super) fn is_safe(&self, start: &Start, footprint: &Footprint) -> bool {
        if !start.is_free {
            return !self.path(&start.stance, footprint).is_bad();
        }
        self.visit(start, footprint, |_| ())
    }

    /// Visits the cells under the rover's origin (`None` outside the window) up to the first veto; returns whether there
    /// is no veto. The motion must start on free ground, and its footprint is evaluated only over the driven part.
    fn visit(&self, start: &Start, footprint: &Footprint, mut visit: impl FnMut(Option<usize>)) -> bool {
        let is_backwards = footprint.is_backwards();
        for disc in &footprint.discs {
            let index = self.ground.map.grid.index_at(start.place(disc.place_m));
            let is_safe = match index {
                Some(index) if self.ground.is_bad(index, Part::of(disc.number)) => false,
                Some(index) => {
                    !is_backwards || !is_unknown_behind(&self.ground.map.cells[index], self.settings)
                }
                None => !is_backwards,
            };
            if !is_safe {
                return false;
            }
            if disc.number == 0 {
                visit(index);
            }
        }
        true
    }

    /// The path of a footprint.
    fn path(&self, stance: &Stance, footprint: &Footprint) -> Path<'a> {
        Path::along(self.ground, stance, footprint, self.settings)
    }

    /// Cost of a path; `None` if it is vetoed.
    fn cost_of(&self, path: &Path<'_>, footprint: &Footprint, route: &Route<'_>) -> Option<f64> {
        (!path.is_bad()).then(|| footprint.cost_m(route.mean_cost(path.centres())))
    }

    /// Whether neither the disc at the rover's origin nor the leading one is on bad ground.
    pub(super) fn can_stand(&self, stance: &Stance) -> bool {
        !self.ground.is_bad_at(stance.at_m, Part::Origin)
            && !self.ground.is_bad_at(stance.place([self.settings.reach_m, 0.0]), Part::End)
    }

    /// The last motions to a goal in reverse order, if it is near and they are safe: one arc, or a turn and a straight
    /// line.
    pub(super) fn last(&self, stance: &Stance, goal_m: [f64; 2]) -> Option<Vec<Motion>> {
        let [ahead, right] = stance.seen(goal_m);
        let length_m = ahead.hypot(right);
        if length_m > LAST_M {
            return None;
        }
        let curvature_max_per_m = self.settings.curvature_max_per_m;
        let navigator = ArcNavigator { curvature_max_per_m, reverse_max_m: LAST_BACKWARDS_M };
        let arc = navigator.motion([ahead, right], f64::INFINITY);
        if matches!(arc, Motion::Arc { .. }) && self.is_safe_from(stance, &arc) {
            return Some(vec![arc]);
        }
        let turn = Motion::Turn { angle_rad: right.atan2(ahead) };
        let straight = Motion::Arc { length_m, curvature_per_m: 0.0 };
        let is_safe =
            self.is_safe_from(stance, &turn) && self.is_safe_from(&stance.after(&turn, 1.0), &straight);
        is_safe.then(|| vec![straight, turn])
    }

    /// Whether a motion from a stance passes the vetoes.
    fn is_safe_from(&self, stance: &Stance, motion: &Motion) -> bool {
        let start = self.start(*stance);
        let is_backwards = matches!(*motion, Motion::Arc { length_m, .. } if length_m < 0.0);
        // The end alone excludes most motions ahead.
        if start.is_free && !is_backwards && !self.can_stand(&stance.after(motion, 1.0)) {
            return false;
        }
        self.is_safe(&start, &Footprint::new(motion, 0.0, self.settings))
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::super::limits::VetoLimits;
    use super::super::tests::{Rock, known, pose, rocks_height};
    use super::*;
    use crate::hazards::HazardSettings;

    #[test]
    fn motions_are_judged_as_paths_from_any_stance() {
        let rocks = [[2.0, 0.5], [-1.0, 2.5], [0.5, -3.0], [4.0, -1.5]];
        let rocks = rocks.map(|at| Rock { at, radius: 0.3, height: 0.4 });
        let map =
            known(&pose([0.0, 0.0], 0.0), &HazardSettings::default(), |x, y| rocks_height(&rocks, x, y));
        let settings = NavigatorSettings::default();
        let ground = Ground::new(&map, VetoLimits::new(&map.settings, &settings));
        let (moves, route) = (Moves::new(&ground, &settings), Route::new(&ground, [5.0, 0.0], &settings));
        let mut random = rand_pcg::Pcg64::seed_from_u64(7);
        let mut counts = [0; 3];
        for _ in 0..3000 {
            let at_m = [0, 1].map(|_| random.random_range(-8.5..8.5));
            let stance = Stance { at_m, heading_rad: random.random_range(-3.2..3.2) };
            let start = moves.start(stance);
            for footprint in moves.footprints() {
                let path = Path::new(&ground, &stance, &footprint.motion, 0.0, &settings);
                assert_eq!(
                    moves.is_safe(&start, footprint),
                    !path.is_bad(),
                    "{stance:?} {:?}",
                    footprint.motion
                );
                let cost = moves.cost(&start, footprint, &route);
                assert_eq!(cost.is_some(), !path.is_bad());
                let of_path = footprint.cost_m(route.mean_cost(path.centres()));
                assert!(
                    cost.is_none_or(|cost| (cost - of_path).abs() < 1e-9 && cost > 0.0),
                    "{cost:?} {of_path}"
                );
                counts[usize::from(path.is_bad())] += 1;
                counts[2] += usize::from(!start.is_free());
            }
        }
        assert!(counts.iter().all(|count| *count > 1000), "{counts:?}");
    }
}
