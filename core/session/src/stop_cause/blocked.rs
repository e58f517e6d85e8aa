//! Causes on the hazard map: ground beyond a limit on every path, an obstacle that blocks an approach, and obstacles that
//! move with the rover.

use std::collections::BTreeMap;

use sightline_geometry::frames::Point3;
use sightline_rover::driving::{Motion, PathChoice, StopHazards, StopReason, Veto};
use sightline_rover::hazards::{GoodnessCell, HazardTerm};

use super::words::{listed, metres};
use super::{Found, StopCause, StoppedDrive};

/// Minimum rise of a cell since the previous stop that counts as risen, m.
const RISEN_M: f32 = 0.1;
/// Minimum number of risen cells at a stop: up to nine rise at the foot of a rock, which is measured better from near.
const RISEN_CELLS: usize = 10;
/// Cells must rise at `RISEN_STOPS` of the last `LAST_STOPS` stops; they do not rise at stops where the rover turns.
const LAST_STOPS: usize = 20;
const RISEN_STOPS: usize = 3;
/// Two stops suffice if the mean of their risen cells, relative to the rover, differs by at most `SAME_PLACE_M` although
/// the rover has moved by `MOVED_M` or more.
const SAME_PLACE_M: f64 = 0.15;
const MOVED_M: f64 = 0.3;

impl StoppedDrive<'_> {
    /// The path choice at the last stop.
    fn choice(&self) -> Option<&PathChoice> {
        self.cycles.last()?.choice.as_ref()
    }

    /// A false obstacle: ground ahead of the rover that rises from stop to stop.
    pub(super) fn false_obstacle(&self) -> Option<Found> {
        let stays = matches!(
            self.reason()?,
            StopReason::NoSafePath
                | StopReason::GoalBlocked
                | StopReason::LimitCycle
                | StopReason::StopLimit
                | StopReason::Time
        );
        if !stays {
            return None;
        }
        let pairs = self.hazards.windows(2);
        let risen: Vec<(usize, Vec<[f64; 2]>)> = pairs
            .map(|pair| (pair[1].step, risen_between(&pair[0], &pair[1])))
            .filter(|(_, cells)| cells.len() >= RISEN_CELLS)
            .collect();
        let last = self.steps.last()?.step;
        let lately = risen.iter().filter(|(step, _)| step + LAST_STOPS > last).count();
        if lately < RISEN_STOPS && !self.moves_with_the_rover(&risen) {
            return None;
        }
        let (from, _) = risen.first()?;
        let (at, cells) = risen.last()?;
        let rover_from_site = self.stops.site_from_rover(*at).inverse();
        let ahead = |cell: &[f64; 2]| (rover_from_site * Point3::new(cell[0], cell[1], 0.0)).x;
        let mut ahead_m: Vec<f64> = cells.iter().map(ahead).collect();
        ahead_m.sort_by(f64::total_cmp);
        let counts = risen.iter().map(|(_, cells)| cells.len());
        let (fewest, most) = (counts.clone().min()?, counts.max()?);
        let counts = if fewest == most { fewest.to_string() } else { format!("{fewest} to {most}") };
        let sentence = format!(
            "The obstacle is false: since stop {from} it is ahead of the rover wherever that stands, on ground that was measured lower at \
             the stop before."
        );
        let where_is = format!(
            "At {} of the stops since then, {counts} cells are more than {:.0} cm higher than at the stop before; at stop {at} \
             they are about {} ahead.",
            risen.len(),
            100.0 * RISEN_M,
            metres(ahead_m[ahead_m.len() / 2])
        );
        let what = "Either its stereo matches are false, or something that moves with the rover is in view: look at the images of the \
                    hazard pair."
            .to_owned();
        Some(Found { cause: StopCause::FalseObstacle, sentence, evidence: vec![where_is, what] })
    }

    /// Whether the risen cells of the last two stops with such cells are at the same place relative to the rover, although
    /// it has moved.
    fn moves_with_the_rover(&self, risen: &[(usize, Vec<[f64; 2]>)]) -> bool {
        let [.., before, last] = risen else { return false };
        let from_rover = |(step, cells): &(usize, Vec<[f64; 2]>)| {
            let sum = cells.iter().fold([0.0; 2], |sum, cell| [sum[0] + cell[0], sum[1] + cell[1]]);
            let [x, y] = sum.map(|sum| sum / cells.len() as f64);
            let site_from_rover = self.stops.site_from_rover(*step);
            let origin = site_from_rover.translation.vector;
            let seen = site_from_rover.inverse() * Point3::new(x, y, origin.z);
            ([seen.x, seen.y], [origin.x, origin.y])
        };
        let distance_m = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let ((seen_before, was_at), (seen, is_at)) = (from_rover(before), from_rover(last));
        distance_m(seen_before, seen) <= SAME_PLACE_M && distance_m(was_at, is_at) >= MOVED_M
    }

    /// Ground beyond a limit on every path, or on every arc ahead of a rover that turns to and fro.
    pub(super) fn no_safe_path(&self) -> Option<Found> {
        let turns = self.stops_without_arc()?;
        let choice = self.choice().or_else(|| self.round()?.last()?.choice.as_ref())?;
        let mut by_term = BTreeMap::<HazardTerm, Vec<Veto>>::new();
        for veto in choice.candidates.iter().filter_map(|candidate| candidate.veto) {
            by_term.entry(veto.term).or_default().push(veto);
        }
        let (term, vetoes) = by_term.iter().max_by_key(|(_, vetoes)| vetoes.len())?;
        let turns = (!turns.is_empty()).then(|| {
            let stops = listed("stop", &turns);
            format!(
                "The rover only turns and backs up ({stops}): at none of these stops an arc ahead is safe."
            )
        });
        let others: Vec<String> = by_term
            .iter()
            .filter(|(other, _)| *other != term)
            .map(|(other, vetoes)| format!("{} by {}", vetoes.len(), other.word()))
            .collect();
        let others = (!others.is_empty()).then(|| format!("Other vetoes: {}.", others.join(", ")));
        let last = self.cycles.last()?;
        let points = last.range_points.map(|points| {
            format!("The hazard pair of {} gives {points} points.", listed("stop", &[last.step]))
        });
        let is_fixed = self.choice().is_some() && self.of_limits().is_empty();
        let fixed = is_fixed.then(|| "No single raised limit opens a path.".to_owned());
        let evidence = [turns, Some(nearest(vetoes)?), others, points, fixed].into_iter().flatten().collect();
        let sentence = vetoed(vetoes, choice.candidates.len())?;
        Some(Found { cause: StopCause::NoSafePath, sentence, evidence })
    }

    /// An obstacle that blocks an approach.
    pub(super) fn approach_not_clear(&self) -> Option<Found> {
        let last = self.cycles.last()?;
        if self.reason()? != StopReason::NoSafePath || !self.command.is_approach(last.arrival_actions) {
            return None;
        }
        let detail = last.ending.as_ref()?.detail.as_ref()?;
        let final_m = self.command.final_standoff_m;
        let arrived = format!(
            "The rover has arrived at {} from the target; the approach would have led it on to {}, straight or by one arc.",
            metres(self.command.standoff_m),
            metres(final_m)
        );
        let others =
            "A larger final_standoff_m, another offset of the goal or no approach leaves this ground free."
                .to_owned();
        let sentence = format!("No path is safe: {detail}.");
        Some(Found { cause: StopCause::NoSafePath, sentence, evidence: vec![arrived, others] })
    }

    /// The stops between which a rover without a safe arc ahead turned to and fro; empty if it did not move. `None` if it
    /// has a safe arc, or ended for another reason.
    fn stops_without_arc(&self) -> Option<Vec<usize>> {
        match self.reason()? {
            StopReason::NoSafePath => Some(Vec::new()),
            StopReason::GoalBlocked => {
                let choice = self.choice()?;
                let encloses = choice.blocked_goal.is_some_and(|blocked| blocked.ground.is_none());
                (encloses && has_no_arc(choice)).then(Vec::new)
            }
            StopReason::LimitCycle => {
                let round = self.round()?;
                let has_none = round.iter().all(|cycle| cycle.choice.as_ref().is_some_and(has_no_arc));
                has_none.then(|| round.iter().map(|cycle| cycle.step).collect())
            }
            _ => None,
        }
    }
}

/// The sentence for vetoes of one term that, among `count` paths, leave none.
fn vetoed(vetoes: &[Veto], count: usize) -> Option<String> {
    let values = || vetoes.iter().map(|veto| veto.value);
    let (least, most) = (values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max));
    let Veto { term, limit, .. } = *vetoes.first()?;
    let part = if vetoes.len() == count { "all".to_owned() } else { format!("{} of", vetoes.len()) };
    let ground = match term {
        HazardTerm::Unknown => "the share of unknown cells".to_owned(),
        _ => format!("the {} of the ground", term.word()),
    };
    let [least, most, limit] = [least, most, limit].map(|value| term.text(value));
    Some(format!(
        "No path is safe: {ground} vetoes {part} {count} paths; it is {least} to {most}, limit {limit}."
    ))
}

/// The sentence for the failing cell nearest to its limit.
fn nearest(vetoes: &[Veto]) -> Option<String> {
    let least = vetoes.iter().min_by(|a, b| a.value.total_cmp(&b.value))?;
    let term = least.term;
    Some(format!(
        "The failing cell nearest to its limit is at x {:.1} m, y {:.1} m of the site, {} along its path: {} {} ({} over the limit).",
        least.in_site_m[0],
        least.in_site_m[1],
        metres(least.along_m),
        term.word(),
        term.text(least.value),
        term.text(least.value - least.limit)
    ))
}

/// Whether every arc ahead is vetoed.
pub(super) fn has_no_arc(choice: &PathChoice) -> bool {
    let is_ahead = |motion: &Motion| matches!(*motion, Motion::Arc { length_m, .. } if length_m > 0.0);
    let mut arcs = choice.candidates.iter().filter(|candidate| is_ahead(&candidate.motion));
    arcs.all(|candidate| candidate.veto.is_some())
}

/// Centres of the cells that are higher than measured at the previous stop, site frame, m.
fn risen_between(before: &StopHazards, now: &StopHazards) -> Vec<[f64; 2]> {
    let grid = &now.map.grid;
    let is_risen = |(at, cell): &([f64; 2], &GoodnessCell)| {
        let was = before.map.cell_at(*at).and_then(|cell| cell.height_m);
        // z points down.
        was.zip(cell.height_m).is_some_and(|(was, is)| was - is > RISEN_M)
    };
    let cells = now.map.cells.iter().enumerate().map(|(index, cell)| (grid.centre_m(index), cell));
    cells.filter(is_risen).map(|(at, _)| at).collect()
}
