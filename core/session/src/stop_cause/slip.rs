//! Causes in the measurement of motion: a check after the motion was ended early, and ground on which visual odometry fails.

use sightline_rover::driving::ending::refusals;
use sightline_rover::driving::{SlipCheck, StopReason};
use sightline_rover::visual_odometry::{MeasuredMotion, OdometryMode};

use super::words::listed;
use super::{Found, StopCause, StoppedDrive};
use crate::format::number;
use crate::why::odometry::refusal;

/// Minimum number of consecutive refused motions.
const REFUSALS_MIN: usize = 3;
/// Gates that fail if another motion fits equally well.
const OF_REPETITION: [&str; 2] = ["odometry_ambiguity", "odometry_repetition"];

impl StoppedDrive<'_> {
    /// A slip value that only reflects the early end of the motion.
    pub(super) fn order_of_events(&self) -> Option<Found> {
        let last = self.cycles.last()?;
        let ending = last.ending.as_ref().filter(|ending| ending.reason == StopReason::Slip)?;
        let before = self.cycles.iter().rev().nth(1)?;
        let part = before.time_up_after.filter(|_| self.command.slip_check == SlipCheck::Command)?;
        let of_wheels = self.stops.measured_motion(last.step)?.update.slip?.along;
        if of_wheels > self.command.slip_max {
            return None;
        }
        let percent = |part: f64| format!("{:.0} %", 100.0 * part);
        let sentence = format!(
            "The order of events, not slip, ended the drive: the time was used up after {} of the motion to stop {}, the rover ended the \
             motion there, and the slip check then compared with the whole command.",
            percent(part),
            last.step
        );
        let evidence = format!(
            "It reports a slip of {} (limit {}); of what the wheels drove the slip is {}.",
            percent(ending.value?),
            percent(self.command.slip_max),
            percent(of_wheels)
        );
        let time = format!(
            "Time on Mars at this stop: {} min, limit {} min.",
            number(last.flight_minutes),
            number(self.command.flight_minutes_max)
        );
        Some(Found { cause: StopCause::OrderOfEvents, sentence, evidence: vec![evidence, time] })
    }

    /// Ground on which visual odometry refused its last motions.
    pub(super) fn unusable_ground(&self) -> Option<Found> {
        if self.command.odometry == OdometryMode::Off {
            return None;
        }
        let (first, last) = (self.since()?, self.steps.last()?.step);
        let count = refusals(self.stops, [first, last]);
        let is_reason = self.reason()? == StopReason::OdometryRefused;
        if count < REFUSALS_MIN && !is_reason {
            return None;
        }
        let measured = |step: usize| Some((step, self.stops.measured_motion(step)?));
        let mut refused: Vec<(usize, &MeasuredMotion)> =
            (first + 1..=last).rev().filter_map(measured).take(count).collect();
        refused.reverse();
        let repeats = |measured: &MeasuredMotion| {
            let failed =
                |name: &str| measured.update.gates.iter().any(|gate| gate.name == name && !gate.passed);
            // With few points, more than one motion always fits.
            OF_REPETITION.into_iter().any(failed) && !failed("odometry_inliers")
        };
        let repeating = refused.iter().filter(|(_, measured)| repeats(measured)).count();
        let stops: Vec<usize> = refused.iter().map(|(step, _)| *step).collect();
        let (cause, ground) = if 2 * repeating > count {
            (StopCause::RepeatingGround, "repeats itself: more than one motion fits")
        } else {
            (StopCause::FeaturelessGround, "has too little texture for visual odometry")
        };
        let sentence = format!(
            "The ground {ground}. Its updates at {} were refused, and the pose there is that of wheels and gyro.",
            listed("stop", &stops)
        );
        let (step, update) = *refused.last()?;
        let counts = &update.update;
        let evidence = format!(
            "At stop {step}: {} corners, {} of them with a position by stereo, {} matched; {}.",
            counts.corners,
            counts.points,
            counts.matches,
            refusal(update)?
        );
        Some(Found { cause, sentence, evidence: vec![evidence] })
    }
}
