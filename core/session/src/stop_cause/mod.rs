//! Why a drive stopped: the root cause with its evidence, and changes that lead to another decision on the same images.
//!
//! | reason of the stop | cause | evidence |
//! |---|---|---|
//! | `slip` | `order_of_events` | the time ran out during the motion; the slip of the wheel motion is within the limit |
//! | any but `arrived` | `featureless_ground` | visual odometry refused its last motions for lack of points or matches |
//! | any but `arrived` | `repeating_ground` | … because another motion fits equally well |
//! | blocked | `false_obstacle` | ground ahead of the rover rises from stop to stop (`blocked`) |
//! | `no_safe_path` in an approach after arrival | `no_safe_path` | the obstacle that blocks it (`blocked`) |
//! | `no_safe_path`, or `limit_cycle` or `goal_blocked` without a safe arc | `no_safe_path` | the most frequent veto |
//! | `limit_cycle` | `limit_cycle` | the stops at one place, and the motions between them |
//!
//! If the target of a drive was lost and no cause of this table applies, the sentence is the cause of the loss (`loss`).
//!
//! *Blocked*: `no_safe_path`, `goal_blocked`, `limit_cycle`, `stop_limit`, `time`. The inputs are estimates, decisions and
//! results of the stages; scenario and truth are not used.
//!
//! Source: docs/driving.md, *Why a drive stopped*; the rules are ours.

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
    /// The ground exceeds a limit on every path.
    NoSafePath,
    /// The obstacle moves with the rover: a false match, or a part of the rover.
    FalseObstacle,
    /// The same decisions repeat at the same position.
    LimitCycle,
    /// A check used the whole command although an earlier event had ended the motion.
    OrderOfEvents,
    /// The ground has too little texture for visual odometry.
    FeaturelessGround,
    /// The ground has a repeating texture, so that visual odometry has more than one solution.
    RepeatingGround,
}

/// Why a drive stopped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StopExplanation {
    /// The stop.
    pub step: usize,
    /// The reason that the drive reports.
    pub reason: StopReason,
    /// The root cause; null if the evidence supports none.
    pub cause: Option<StopCause>,
    /// The cause as a sentence; without a cause, the root cause of a loss, else the reason.
    pub sentence: String,
    /// Further sentences of evidence.
    pub evidence: Vec<String>,
    /// Changes that alter the decision at this stop, each verified on the images already taken.
    pub changes: Vec<DecisionChange>,
}

/// The inputs of an explanation: a drive up to the stop at which it ended.
#[derive(Clone, Copy)]
struct StoppedDrive<'a> {
    stops: &'a dyn Stops,
    command: &'a DriveCommand,
    /// The steps; the first is the designation.
    steps: &'a [&'a StepTrace],
    /// The decisions at their stops.
    cycles: &'a [Cycle],
    /// The hazard maps of these stops; empty for a navigator without maps.
    hazards: &'a [Arc<StopHazards>],
}

/// A cause with its sentences.
struct Found {
    cause: StopCause,
    sentence: String,
    evidence: Vec<String>,
}

/// A cache of the last explanation: computing one takes up to seconds.
#[derive(Debug, Default)]
pub struct Explained {
    last: Option<(DriveCommand, Vec<Cycle>, Option<StopExplanation>)>,
}

impl Explained {
    /// Why a drive with these steps and decisions stopped; `None` while it goes on, and after it was completed.
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
            // Never cancelled: these maps already exist, because the decisions used them.
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

    /// The decisions of the last round: since the rover's previous visit to its current place.
    fn round(&self) -> Option<Vec<&Cycle>> {
        let last = self.cycles.last()?.step;
        let visits = visits(self.stops, [self.since()?, last]);
        let before = *visits.iter().rev().nth(1)?;
        Some(self.cycles.iter().filter(|cycle| (before..last).contains(&cycle.step)).collect())
    }

    /// A limit cycle: the stops at one place, and the motions of the last round.
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

    /// The largest distance between the ends of a round's motions and their commanded ends, as a sentence.
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
