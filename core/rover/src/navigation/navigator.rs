//! The navigator on the goodness map: candidate paths, their votes and the choice.
//!
//! ```text
//! aim          the goal, or the nearest place to it where the rover can stand (`stand.rs`)
//! manoeuvre    the turn or backward motion at the start of the way to the aim (`search.rs`), if any; it is chosen
//! candidates   `curvature_count` arcs, and the arc or turn to a point `look_ahead_m` along the way
//!              if that turn is vetoed: an arc backwards to that point
//!              if none passes: a turn to either side, by the smallest multiple of `turn_deg` after which an arc passes
//!              if none passes: straight back by `back_up_m`
//!              if none passes: the previous motion, backwards, if it was an arc ahead; it has no veto. If the rover would
//!              stay because it can reach no nearer place, only if a way from there leads nearer to the goal
//! goal         exp(−(Δψ/goal_width)²)     Δψ: heading at the end of the path relative to the way from there
//! steer        1 − |κ − κ_now|/(2 κ_max);  0 for a turn
//! vote         w_h · hazard + w_g · goal + w_s · steer
//! choice       the best vote without a veto among paths with goal ≥ `GOAL_MIN`, else among all; ties: the smaller |κ|
//! ```
//! | symbol | name | unit |
//! |---|---|---|
//! | κ, κ_now | curvature of the path, and of the previous motion | 1/m |
//! | κ_max | `curvature_max_per_m` | 1/m |
//!
//! The previous motion is reversed when a rock appears higher from a short distance than from farther away, and the ground
//! straight behind was not seen. It has no veto because the wheels have just passed that ground.
//!
//! Without a way the candidates follow the route (`route.rs`), and without a route the straight line. A turn after which
//! no arc passes has the veto of the arc that gets farthest: a rover in a closed pocket has no safe path, instead of
//! turning endlessly.
//!
//! Departures from domain.md 8.2: way and route, the arc or turn to them, paths that lead away from them only without
//! another, the leading disc, turns that lead to an arc, both kinds of backing up, and the lower quality of ground near
//! bad cells. Without a map the choice is that of [`ArcNavigator`].
//!
//! Frame: site, horizontal. Source: domain.md 8.2; papers.md R9.

use crate::driving::motion::Motion;
use crate::driving::path_choice::{Candidate, PathChoice, PathTerms, Veto};
use crate::driving::select_path::{ArcNavigator, Navigator, PathInput};
use crate::hazards::goodness::GoodnessMap;

use super::counterfactual::{LimitChange, counterfactual};
use super::ground::Ground;
use super::limits::VetoLimits;
use super::moves::Moves;
use super::path::{Path, Stance};
use super::route::Route;
use super::search::{self, Found, Search};
use super::settings::NavigatorSettings;
use super::stand::Aim;
use super::way::Way;

/// Within this distance of the end of the way's first part a path counts as arrived, and its heading does not matter, m.
const AT_END_M: f64 = 0.02;
/// A path with a smaller goal term leads away from the way.
const GOAL_MIN: f64 = 0.1;
/// Smallest reduction of the distance to the goal for which a way counts as leading nearer, m.
const NEARER_M: f64 = 0.3;
/// Stances from which a way is searched before testing whether the goal is enclosed.
const STANCES_MAX: usize = 6000;
/// Upper limit of the number of stances in a pocket that encloses a goal.
const POCKET_STANCES_MAX: usize = 1500;

/// A navigator that avoids the hazards of a goodness map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HazardNavigator {
    /// Settings.
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
        let moves = Moves::new(&ground, settings);
        let mut decision =
            Decision { settings, ground: &ground, input, start, aim_m: goal_m, route: None, way: None };
        let mut aim = Aim::of(&moves, start, goal_m);
        if settings.has_route {
            aim = decision.find_way(&moves, aim);
        } else {
            decision.aim_m = aim.at_m;
        }
        let blocked_goal = aim.blocked;
        let stays = blocked_goal.is_some_and(|blocked| blocked.is_near(distance_m(start.at_m, goal_m)));
        let route_m = decision.line();
        let manoeuvre = decision.manoeuvre().filter(|_| !stays);
        if stays || decision.way.as_ref().is_some_and(Way::begins_with_manoeuvre) {
            // Arcs cannot follow it: they are evaluated by the route.
            decision.way = None;
        }
        if stays {
            decision.aim_m = goal_m;
        }
        let mut candidates = decision.candidates();
        let way_back =
            || decision.way_back().filter(|back| !stays || decision.leads_nearer(&back.motion, goal_m));
        let before_others = manoeuvre.or_else(|| is_blocked(&candidates).then(way_back).flatten());
        let chosen = match before_others {
            Some(motion) => {
                candidates.push(motion);
                Some(candidates.len() - 1)
            }
            None if stays => None,
            None => best(&candidates),
        };
        PathChoice { chosen, candidates, route_m, blocked_goal }
    }
}

/// Whether every path is vetoed.
fn is_blocked(candidates: &[Candidate]) -> bool {
    candidates.iter().all(|candidate| candidate.veto.is_some())
}

/// Index of the path with the highest vote among those without a veto, preferring those that do not lead away from the
/// way; for equal votes, the straighter path.
fn best(candidates: &[Candidate]) -> Option<usize> {
    let bend = |candidate: &Candidate| candidate.motion.curvature_per_m().abs();
    let safe = || candidates.iter().enumerate().filter(|(_, candidate)| candidate.veto.is_none());
    let leads_there = |candidate: &Candidate| candidate.terms.goal >= GOAL_MIN;
    let is_led = safe().any(|(_, candidate)| leads_there(candidate));
    let best = safe()
        .filter(|(_, candidate)| leads_there(candidate) || !is_led)
        .min_by(|(_, a), (_, b)| b.vote.total_cmp(&a.vote).then(bend(a).total_cmp(&bend(b))));
    best.map(|(index, _)| index)
}

fn distance_m(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Inputs common to all paths of a decision.
struct Decision<'a> {
    settings: &'a NavigatorSettings,
    ground: &'a Ground<'a>,
    input: &'a PathInput<'a>,
    start: Stance,
    aim_m: [f64; 2],
    route: Option<Route<'a>>,
    way: Option<Way>,
}

impl<'a> Decision<'a> {
    /// Sets route and way to an aim; if no way leads there, to the nearest place with a way.
    fn find_way(&mut self, moves: &Moves<'_>, mut aim: Aim<'a>) -> Aim<'a> {
        loop {
            self.aim_m = aim.at_m;
            let route = Route::new(self.ground, aim.at_m, self.settings);
            let found = Search::new(moves, &route, self.start).run(STANCES_MAX);
            let is_unfinished = matches!(found, Found::Unfinished);
            let pocket = is_unfinished
                .then(|| search::pocket(moves, aim.at_m, &self.start, POCKET_STANCES_MAX))
                .flatten();
            self.route = Some(route);
            if let Some(other) = pocket.and_then(|pocket| aim.outside(&pocket)) {
                aim = other;
                continue;
            }
            if let Found::Nearest(way) = &found {
                self.aim_m = way.end();
                aim = aim.replaced_by(way.end());
            }
            self.way = match found {
                Found::Goal(way) | Found::Nearest(way) => Some(way),
                Found::Unfinished => None,
            };
            return aim;
        }
    }

    fn candidates(&self) -> Vec<Candidate> {
        let mut candidates: Vec<Candidate> = self.motions().iter().map(|motion| self.judge(motion)).collect();
        candidates.extend(self.backwards(candidates.last()));
        if is_blocked(&candidates) {
            candidates.extend([-1.0, 1.0].map(|side| self.turn_to_an_arc(side)));
        }
        if is_blocked(&candidates) && self.settings.back_up_m > 0.0 {
            let back = Motion::Arc { length_m: -self.settings.back_up_m, curvature_per_m: 0.0 };
            candidates.push(self.judge(&back));
        }
        candidates
    }

    /// The previous motion, reversed. A backward motion is not reversed: the rover would oscillate.
    fn way_back(&self) -> Option<Candidate> {
        match self.input.before? {
            Motion::Arc { length_m, curvature_per_m } if length_m > 0.0 => {
                let back = Motion::Arc { length_m: -length_m, curvature_per_m };
                Some(Candidate { veto: None, ..self.judge(&back) })
            }
            Motion::Arc { .. } | Motion::Turn { .. } => None,
        }
    }

    /// Whether a way from the end of a motion ends nearer to the goal than the rover is.
    fn leads_nearer(&self, motion: &Motion, goal_m: [f64; 2]) -> bool {
        let moves = Moves::new(self.ground, self.settings);
        let start = self.start.after(motion, 1.0);
        let mut there = Decision { start, aim_m: goal_m, route: None, way: None, ..*self };
        there.find_way(&moves, Aim::of(&moves, start, goal_m));
        let end_m = there.way.as_ref().map(Way::end);
        end_m.is_some_and(|end_m| distance_m(end_m, goal_m) + NEARER_M < distance_m(self.start.at_m, goal_m))
    }

    /// The motion at the start of the way, if it is a manoeuvre without a veto.
    fn manoeuvre(&self) -> Option<Candidate> {
        let candidate = self.judge(&self.way.as_ref()?.manoeuvre(self.input.step_m)?);
        let terms = PathTerms { goal: 1.0, ..candidate.terms };
        Some(Candidate { terms, vote: self.vote(&terms), ..candidate }).filter(|path| path.veto.is_none())
    }

    /// The line to follow: the way, the route or the straight line.
    fn line(&self) -> Vec<[f64; 2]> {
        match (&self.way, &self.route) {
            (Some(way), _) => way.points().to_vec(),
            (None, Some(route)) => route.points(self.start.at_m),
            (None, None) => vec![self.start.at_m, self.aim_m],
        }
    }

    /// Distance to the end of the way's first part or to the aim, whichever is smaller, m.
    fn end_distance_m(&self) -> f64 {
        let aim_m = distance_m(self.start.at_m, self.aim_m);
        self.way.as_ref().map_or(aim_m, |way| way.part_m().min(aim_m))
    }

    /// End of the way's first part, or the aim.
    fn end_m(&self) -> [f64; 2] {
        self.way.as_ref().map_or(self.aim_m, Way::part_end)
    }

    /// Arcs, from left to right.
    fn arcs(&self) -> impl Iterator<Item = Motion> {
        let length_m = self.input.step_m.min(self.end_distance_m());
        let (count, max) = (self.settings.curvature_count, self.settings.curvature_max_per_m);
        let curvature = move |k: u32| max * (2.0 * f64::from(k) / f64::from(count - 1) - 1.0);
        (0..count).map(move |k| Motion::Arc { length_m, curvature_per_m: curvature(k) })
    }

    /// Arcs, and the motion to the way.
    fn motions(&self) -> Vec<Motion> {
        self.arcs().chain([self.to_route(ArcNavigator::default().reverse_max_m)]).collect()
    }

    /// The arc or turn to the way; backwards if the way is behind within `reverse_max_m`.
    fn to_route(&self, reverse_max_m: f64) -> Motion {
        let navigator =
            ArcNavigator { curvature_max_per_m: self.settings.curvature_max_per_m, reverse_max_m };
        let ahead_m = self.start.seen(self.ahead_of(self.start.at_m));
        navigator.motion(ahead_m, self.input.step_m)
    }

    /// The arc backwards to the way, if the turn to it is vetoed.
    fn backwards(&self, to_route: Option<&Candidate>) -> Option<Candidate> {
        let is_needed = |candidate: &&Candidate| {
            candidate.veto.is_some() && matches!(candidate.motion, Motion::Turn { .. })
        };
        to_route.filter(is_needed)?;
        let motion = self.to_route(f64::INFINITY);
        matches!(motion, Motion::Arc { .. }).then(|| self.judge(&motion))
    }

    /// The smallest turn to a side, in multiples of `turn_deg`, after which an arc passes.
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

    /// The point that a path at a position heads for, site frame, m.
    fn ahead_of(&self, at_m: [f64; 2]) -> [f64; 2] {
        match (&self.way, &self.route) {
            (Some(way), _) => way.ahead(at_m, self.settings.look_ahead_m),
            (None, Some(route)) => route.ahead(at_m, self.settings.look_ahead_m),
            (None, None) => self.aim_m,
        }
    }

    fn judge(&self, motion: &Motion) -> Candidate {
        let settings = self.settings;
        let evaluated_min_m = settings.evaluated_min_m.min(self.end_distance_m());
        let path = Path::new(self.ground, &self.start, motion, evaluated_min_m, settings);
        let goal = self.goal(motion, path.evaluated_m);
        let terms = PathTerms { hazard: path.hazard(), goal, steer: self.steer(motion) };
        Candidate {
            motion: *motion,
            evaluated_m: path.evaluated_m,
            terms,
            vote: self.vote(&terms),
            unknown_share: path.unknown_share(),
            veto: path.veto(),
        }
    }

    fn vote(&self, terms: &PathTerms) -> f64 {
        let NavigatorSettings { hazard_weight, goal_weight, steer_weight, .. } = self.settings;
        hazard_weight * terms.hazard + goal_weight * terms.goal + steer_weight * terms.steer
    }

    /// Agreement of the heading at the end of the evaluated path with the way from there.
    fn goal(&self, motion: &Motion, evaluated_m: f64) -> f64 {
        let (part, sign) = match *motion {
            Motion::Arc { length_m, .. } => {
                (evaluated_m / length_m.abs().max(1e-6), 1.0_f64.copysign(length_m))
            }
            Motion::Turn { .. } => (1.0, 1.0),
        };
        let end = self.start.after(motion, part);
        if distance_m(end.at_m, self.end_m()) <= AT_END_M {
            return 1.0;
        }
        let [ahead, right] = end.seen(self.ahead_of(end.at_m));
        // Backwards, the heading is that of the rear.
        let off = (sign * right).atan2(sign * ahead) / self.settings.goal_width_deg.to_radians();
        (-off * off).exp()
    }

    fn curvature_before(&self) -> f64 {
        self.input.before.map_or(0.0, |motion| motion.curvature_per_m())
    }

    fn steer(&self, motion: &Motion) -> f64 {
        match *motion {
            Motion::Turn { .. } => 0.0,
            Motion::Arc { curvature_per_m, .. } => {
                let change = (curvature_per_m - self.curvature_before()).abs();
                (1.0 - change / (2.0 * self.settings.curvature_max_per_m)).max(0.0)
            }
        }
    }
}
