//! The navigator on the goodness map: candidate paths, their votes and the choice.
//!
//! ```text
//! candidates   `curvature_count` arcs, and the arc or turn to a point `look_ahead_m` along the route;
//!              if that turn is vetoed: an arc backwards to that point
//!              if none passes: a turn to either side, the least multiple of `turn_deg` after which an arc passes
//!              if none passes: straight back by `back_up_m`
//! goal         exp(−(Δψ/goal_width)²)     Δψ: heading at the end of the path against the route from there
//! steer        1 − |κ − κ_now|/(2 κ_max);  0 of a turn
//! vote         w_h · hazard + w_g · goal + w_s · steer      the best path without a veto; ties: the smaller |κ|
//! ```
//! | symbol | name | unit |
//! |---|---|---|
//! | κ, κ_now | curvature of the path, and of the motion before | 1/m |
//! | κ_max | `curvature_max_per_m` | 1/m |
//!
//! A turn after which no arc passes has the veto of the arc that gets farthest: a rover in a closed pocket has no safe path, instead
//! of turning for ever.
//!
//! Departures from domain.md 8.2: the route, the arc or turn to it, the leading disc, turns that lead to an arc, backing up, and
//! the lower quality of ground near bad cells. Without a map the choice is that of [`ArcNavigator`].
//!
//! Frame: site, horizontal. Source: domain.md 8.2; papers.md R9.

use crate::driving::motion::Motion;
use crate::driving::path_choice::{Candidate, PathChoice, PathTerms, Veto};
use crate::driving::select_path::{ArcNavigator, Navigator, PathInput};
use crate::hazards::goodness::GoodnessMap;

use super::counterfactual::{LimitChange, counterfactual};
use super::ground::Ground;
use super::limits::VetoLimits;
use super::path::{Path, Stance};
use super::route::Route;
use super::settings::NavigatorSettings;

/// Nearer to the goal than this a path has arrived: its heading does not matter, m.
const AT_GOAL_M: f64 = 0.02;

/// A navigator that avoids the hazards of a goodness map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HazardNavigator {
    /// Its settings.
    pub settings: NavigatorSettings,
}

impl Navigator for HazardNavigator {
    fn select_path(&self, input: &PathInput<'_>) -> PathChoice {
        match input.map {
            Some(map) => self.select_on(map, input),
            None => ArcNavigator::default().select_path(input),
        }
    }

    fn smallest_change(&self, input: &PathInput<'_>, choice: &PathChoice) -> Option<LimitChange> {
        counterfactual(choice, input, &self.settings, None).into_iter().next()
    }
}

impl HazardNavigator {
    fn select_on(&self, map: &GoodnessMap, input: &PathInput<'_>) -> PathChoice {
        let settings = &self.settings;
        let ground = Ground::new(map, VetoLimits::new(&map.settings, settings));
        let start = Stance::of(input.site_from_rover);
        let goal_m = start.place(input.goal_m);
        let route = settings.has_route.then(|| Route::new(&ground, goal_m, settings));
        let decision = Decision { settings, ground: &ground, input, start, goal_m, route };
        let mut candidates: Vec<Candidate> =
            decision.motions().iter().map(|motion| decision.judge(motion)).collect();
        candidates.extend(decision.backwards(candidates.last()));
        if is_blocked(&candidates) {
            candidates.extend([-1.0, 1.0].map(|side| decision.turn_to_an_arc(side)));
        }
        if is_blocked(&candidates) && settings.back_up_m > 0.0 {
            let back = Motion::Arc { length_m: -settings.back_up_m, curvature_per_m: 0.0 };
            candidates.push(decision.judge(&back));
        }
        let route_m = decision
            .route
            .as_ref()
            .map_or_else(|| vec![decision.start.at_m, goal_m], |route| route.points(decision.start.at_m));
        PathChoice { chosen: best(&candidates), candidates, route_m }
    }
}

/// Whether every path is vetoed.
fn is_blocked(candidates: &[Candidate]) -> bool {
    candidates.iter().all(|candidate| candidate.veto.is_some())
}

/// The index of the path with the highest vote among those without a veto; of equal votes, the straighter path.
fn best(candidates: &[Candidate]) -> Option<usize> {
    let bend = |candidate: &Candidate| candidate.motion.curvature_per_m().abs();
    let safe = candidates.iter().enumerate().filter(|(_, candidate)| candidate.veto.is_none());
    let best = safe.min_by(|(_, a), (_, b)| b.vote.total_cmp(&a.vote).then(bend(a).total_cmp(&bend(b))));
    best.map(|(index, _)| index)
}

/// What all paths of a decision have in common.
struct Decision<'a> {
    settings: &'a NavigatorSettings,
    ground: &'a Ground<'a>,
    input: &'a PathInput<'a>,
    start: Stance,
    goal_m: [f64; 2],
    route: Option<Route<'a>>,
}

impl Decision<'_> {
    fn goal_distance_m(&self) -> f64 {
        self.input.goal_m[0].hypot(self.input.goal_m[1])
    }

    /// Arcs, from the left to the right.
    fn arcs(&self) -> impl Iterator<Item = Motion> {
        let length_m = self.input.step_m.min(self.goal_distance_m());
        let (count, max) = (self.settings.curvature_count, self.settings.curvature_max_per_m);
        let curvature = move |k: u32| max * (2.0 * f64::from(k) / f64::from(count - 1) - 1.0);
        (0..count).map(move |k| Motion::Arc { length_m, curvature_per_m: curvature(k) })
    }

    /// Arcs, and the motion to the route.
    fn motions(&self) -> Vec<Motion> {
        self.arcs().chain([self.to_route(ArcNavigator::default().reverse_max_m)]).collect()
    }

    /// The arc or turn to the route; backwards if the route is behind within `reverse_max_m`.
    fn to_route(&self, reverse_max_m: f64) -> Motion {
        let navigator =
            ArcNavigator { curvature_max_per_m: self.settings.curvature_max_per_m, reverse_max_m };
        let ahead_m = self.start.seen(self.ahead_of(self.start.at_m));
        navigator.motion(ahead_m, self.input.step_m)
    }

    /// The arc backwards to the route, if the turn to it is vetoed.
    fn backwards(&self, to_route: Option<&Candidate>) -> Option<Candidate> {
        let is_needed = |candidate: &&Candidate| {
            candidate.veto.is_some() && matches!(candidate.motion, Motion::Turn { .. })
        };
        to_route.filter(is_needed)?;
        let motion = self.to_route(f64::INFINITY);
        matches!(motion, Motion::Arc { .. }).then(|| self.judge(&motion))
    }

    /// The least turn to a side, in multiples of `turn_deg`, after which an arc passes.
    fn turn_to_an_arc(&self, side: f64) -> Candidate {
        let turn_deg = self.settings.turn_deg;
        let turn = |k: usize| Motion::Turn { angle_rad: side * (k as f64 * turn_deg).to_radians() };
        let path = |start: &Stance, motion: &Motion| {
            Path::new(self.ground, start, motion, 0.0, self.settings).veto()
        };
        let mut farthest: Option<Veto> = None;
        for k in 1..=((180.0 / turn_deg) as usize).max(1) {
            if let Some(veto) = path(&self.start, &turn(k)) {
                farthest = farthest.or(Some(veto));
                break;
            }
            let turned = self.start.after(&turn(k), 1.0);
            for arc in self.arcs() {
                let Some(veto) = path(&turned, &arc) else { return self.judge(&turn(k)) };
                if farthest.is_none_or(|farthest| veto.along_m > farthest.along_m) {
                    farthest = Some(veto);
                }
            }
        }
        Candidate { veto: farthest, ..self.judge(&turn(1)) }
    }

    /// The point that a path heads for at a position, site frame, m.
    fn ahead_of(&self, at_m: [f64; 2]) -> [f64; 2] {
        match &self.route {
            Some(route) => route.ahead(at_m, self.settings.look_ahead_m),
            None => self.goal_m,
        }
    }

    fn judge(&self, motion: &Motion) -> Candidate {
        let settings = self.settings;
        let evaluated_min_m = settings.evaluated_min_m.min(self.goal_distance_m());
        let path = Path::new(self.ground, &self.start, motion, evaluated_min_m, settings);
        let goal = self.goal(motion, path.evaluated_m);
        let terms = PathTerms { hazard: path.hazard(), goal, steer: self.steer(motion) };
        let vote = settings.hazard_weight * terms.hazard
            + settings.goal_weight * terms.goal
            + settings.steer_weight * terms.steer;
        Candidate {
            motion: *motion,
            evaluated_m: path.evaluated_m,
            terms,
            vote,
            unknown_share: path.unknown_share(),
            veto: path.veto(),
        }
    }

    /// Agreement of the heading at the end of the evaluated path with the route from there.
    fn goal(&self, motion: &Motion, evaluated_m: f64) -> f64 {
        let (part, sign) = match *motion {
            Motion::Arc { length_m, .. } => {
                (evaluated_m / length_m.abs().max(1e-6), 1.0_f64.copysign(length_m))
            }
            Motion::Turn { .. } => (1.0, 1.0),
        };
        let end = self.start.after(motion, part);
        let [dx, dy] = [0, 1].map(|axis| self.goal_m[axis] - end.at_m[axis]);
        if dx.hypot(dy) <= AT_GOAL_M {
            return 1.0;
        }
        let [ahead, right] = end.seen(self.ahead_of(end.at_m));
        // Backwards, the heading is that of the rear.
        let off = (sign * right).atan2(sign * ahead) / self.settings.goal_width_deg.to_radians();
        (-off * off).exp()
    }

    fn steer(&self, motion: &Motion) -> f64 {
        match *motion {
            Motion::Turn { .. } => 0.0,
            Motion::Arc { curvature_per_m, .. } => {
                let change = (curvature_per_m - self.input.curvature_per_m).abs();
                (1.0 - change / (2.0 * self.settings.curvature_max_per_m)).max(0.0)
            }
        }
    }
}
