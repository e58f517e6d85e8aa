//! Why a drive stopped: the root cause with its evidence, and changes that lead to another decision on the same images.
//!
//! | reason of the stop | cause | evidence |
//! |---|---|---|
//! | `slip` | `order_of_events` | the time was used up during the motion, and the slip of what the wheels drove is within the limit |
//! | any but `arrived` | `featureless_ground` | visual odometry refused its last motions for want of points or matches |
//! | any but `arrived` | `repeating_ground` | … because another motion fits as well |
//! | no way on | `false_obstacle` | ground rises before the rover from stop to stop (`blocked`) |
//! | `no_safe_path` in an approach after arrival | `no_safe_path` | the obstacle in its way (`blocked`) |
//! | `no_safe_path`, or `limit_cycle` or `goal_blocked` without a safe arc | `no_safe_path` | the term that vetoes most paths, and by how much |
//! | `limit_cycle` | `limit_cycle` | the stops at one place, and what moves the rover away from the goal there |
//!
//! A drive whose target was lost has the root cause of that loss as its sentence (`loss`), and no cause of its own.
//!
//! *No way on*: `no_safe_path`, `goal_blocked`, `limit_cycle`, `stop_limit`, `time`. Estimates, decisions and results of the stages are
//! the only input: neither scenario nor truth.
//!
//! Source: driving.md 3; the rules are ours.

mod blocked;
mod changes;
mod loss;
mod slip;
pub mod words;

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

pub use self::changes::DecisionChange;
use sightline_geometry::cancel::Cancel;
use sightline_recordings::Traverse;
use sightline_rover::driving::ending::visits;
use sightline_rover::driving::{Cycle, DriveCommand, HazardMaps, StopHazards, StopReason};
use sightline_rover::pipeline::Stops;
use sightline_track::settings::Settings;
use sightline_track::trace::StepTrace;

use self::words::{listed, metres};
use crate::step::RunStep;

/// The root cause of a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StopCause {
    /// The ground exceeds a limit under every path.
    NoSafePath,
    /// The obstacle moves with the rover: a false match, or a part of the rover.
    FalseObstacle,
    /// The same decisions repeat at the same place.
    LimitCycle,
    /// A check compared with a motion that an earlier event had ended.
    OrderOfEvents,
    /// The ground has too little texture for visual odometry.
    FeaturelessGround,
    /// The ground repeats itself, so that visual odometry has more than one solution.
    RepeatingGround,
}

/// Why a drive stopped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StopExplanation {
    /// The stop.
    pub step: usize,
    /// The reason that the drive gives.
    pub reason: StopReason,
    /// The root cause; null where the evidence supports none beside the reason.
    pub cause: Option<StopCause>,
    /// The cause as a sentence; without a cause, the reason.
    pub sentence: String,
    /// Further sentences of evidence.
    pub evidence: Vec<String>,
    /// Changes that alter the decision at this stop, each verified on the images already taken.
    pub changes: Vec<DecisionChange>,
}

/// What an explanation is made from: a drive up to the stop at which it ended.
#[derive(Clone, Copy)]
struct StoppedDrive<'a> {
    stops: &'a dyn Stops,
    command: &'a DriveCommand,
    /// The first at the designation.
    steps: &'a [&'a StepTrace],
    /// The decisions at their stops.
    cycles: &'a [Cycle],
    /// The hazard maps of these stops; empty with a navigator without one.
    hazards: &'a [Arc<StopHazards>],
}

/// A cause with its words.
struct Found {
    cause: StopCause,
    sentence: String,
    evidence: Vec<String>,
}

/// The explanation of the last drive that was asked for, which is kept: deciding again takes up to seconds.
#[derive(Debug, Default)]
pub struct Explained {
    last: Option<(DriveCommand, Vec<Cycle>, Option<StopExplanation>)>,
}

impl Explained {
    /// Why a drive with these steps and decisions stopped; `None` while it goes on, and where it has arrived.
    pub(crate) fn of(
        &mut self,
        stops: &Traverse,
        command: &DriveCommand,
        (steps, settings): (&[Arc<RunStep>], &Settings),
        cycles: &[Cycle],
        maps: &mut HazardMaps,
    ) -> Option<StopExplanation> {
        let ending = cycles.last()?.ending.as_ref()?;
        if matches!(ending.reason, StopReason::Arrived | StopReason::Completed) {
            return None;
        }
        if let Some((known, decided, explanation)) = &self.last
            && known == command
            && decided == cycles
        {
            return explanation.clone();
        }
        let is_lost = ending.reason == StopReason::Lost;
        let lost = is_lost.then(|| loss::loss(stops, steps, settings)).flatten();
        let steps: Vec<&StepTrace> = steps.iter().map(|step| &step.trace).collect();
        let map = |step: &&StepTrace| {
            // Never cancelled: the decisions were made on these maps.
            maps.at(stops, command, [steps[0], step], Cancel::default()).ok().flatten()
        };
        let hazards: Vec<Arc<StopHazards>> = steps.iter().map_while(map).collect();
        let drive = StoppedDrive { stops, command, steps: &steps, cycles, hazards: &hazards };
        let mut explanation = drive.explain();
        if let (Some(explanation), Some((sentence, evidence))) = (&mut explanation, lost)
            && explanation.cause.is_none()
        {
            (explanation.sentence, explanation.evidence) = (sentence, evidence);
        }
        self.last = Some((command.clone(), cycles.to_vec(), explanation.clone()));
        explanation
    }
}

impl StoppedDrive<'_> {
    /// Why the drive stopped; `None` while it goes on.
    fn explain(&self) -> Option<StopExplanation> {
        let last = self.cycles.last()?;
        let ending = last.ending.as_ref()?;
        let found = self.order_of_events().or_else(|| self.unusable_ground());
        let found = found.or_else(|| self.false_obstacle()).or_else(|| self.approach_not_clear());
        let found = found.or_else(|| self.no_safe_path()).or_else(|| self.limit_cycle());
        let cause = found.as_ref().map(|found| found.cause);
        let (sentence, evidence) = match found {
            Some(found) => (found.sentence, found.evidence),
            None => (words::ended(ending), Vec::new()),
        };
        Some(StopExplanation {
            step: last.step,
            reason: ending.reason,
            cause,
            sentence,
            evidence,
            changes: self.changes(ending),
        })
    }

    /// The stop at which the rover was sent to this target.
    fn since(&self) -> Option<usize> {
        self.command.since.or_else(|| Some(self.steps.first()?.step))
    }

    fn reason(&self) -> Option<StopReason> {
        Some(self.cycles.last()?.ending.as_ref()?.reason)
    }

    /// The decisions since the visit before the last one to one place.
    fn round(&self) -> Option<Vec<&Cycle>> {
        let last = self.cycles.last()?.step;
        let visits = visits(self.stops, [self.since()?, last]);
        let before = *visits.iter().rev().nth(1)?;
        Some(self.cycles.iter().filter(|cycle| (before..last).contains(&cycle.step)).collect())
    }

    /// Stops at one place, and what keeps the rover from the goal there.
    fn limit_cycle(&self) -> Option<Found> {
        let last = self.cycles.last()?;
        if self.reason()? != StopReason::LimitCycle {
            return None;
        }
        let visits = visits(self.stops, [self.since()?, last.step]);
        let round = self.round()?;
        let motions: Vec<String> =
            round.iter().filter_map(|cycle| cycle.motion.as_ref()).map(words::motion).collect();
        let distance_m = |cycle: &&Cycle| cycle.goal.distance_m;
        let nearest_m = round.iter().map(distance_m).fold(last.goal.distance_m, f64::min);
        let tolerance_m = self.command.tolerance_m;
        let sentence = format!(
            "The drive repeats itself: {} are at the same place, {} from the goal; on each round the rover comes no nearer to it than \
             {} (tolerance {}).",
            listed("stop", &visits),
            metres(last.goal.distance_m),
            metres(nearest_m),
            metres(tolerance_m)
        );
        let mut evidence = vec![format!("The last round: {}.", motions.join("; "))];
        evidence.extend(self.missed(&round));
        Some(Found { cause: StopCause::LimitCycle, sentence, evidence })
    }

    /// By how much the motions of a round ended beside their commanded ends.
    fn missed(&self, round: &[&Cycle]) -> Option<String> {
        let miss_m = |cycle: &&Cycle| {
            let ([ahead, right], _) = cycle.motion.as_ref()?.after(cycle.time_up_after.unwrap_or(1.0));
            let [from, to] = [cycle.step, cycle.step + 1].map(|step| self.stops.site_from_rover(step));
            let moved = from.inverse() * to;
            let moved = moved.translation.vector;
            Some((moved.x - ahead).hypot(moved.y - right))
        };
        let most_m = round.iter().filter_map(miss_m).reduce(f64::max)?;
        Some(format!(
            "Its motions end up to {} beside their commanded ends, by the pose estimate.",
            metres(most_m)
        ))
    }
}
