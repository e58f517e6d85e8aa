//! Waiting targets: those to which the rover drives after the current one (R207). Decides when the mast looks at one of
//! them, so that its appearance changes little between its tracker's updates.
//!
//! ```text
//! due    if |p − p_seen| > step_fraction · |t − p|
//! ```
//! | symbol | meaning |
//! |---|---|
//! | p | position of the rover, site frame, m |
//! | p_seen | its position at the last stop where the pair was pointed at the target, or showed it |
//! | t | the target as designated, site frame, m |
//!
//! The motions to the current target have the same limit. The mast is pointed at the designated position; the tracker uses
//! its own prediction. A look is a separate stop, and so is the look back at the current target. `stops_max` counts
//! neither.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::{Point3, Pose};
use sightline_track::target::Designation;
use sightline_track::trace::StepTrace;

use super::command::DriveCommand;
use super::odometry::has_looked_back;
use crate::pair::{self, StopPair};
use crate::pipeline::Stops;
use crate::sight::{has_stayed, is_another_look, is_in_view};

/// A target to which the rover drives afterwards.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct WaitingTarget {
    /// The designation of the target.
    pub designation: Designation,
    /// The position of the target at the designation, site frame, m.
    pub in_site_m: [f64; 3],
}

impl WaitingTarget {
    /// Position in the rover frame, m.
    pub(super) fn in_rover(&self, site_from_rover: &Pose) -> Point3 {
        site_from_rover.inverse_transform_point(&self.in_site_m.into())
    }

    /// Whether the pair was pointed at the target at a stop, or showed it.
    fn is_seen(&self, stops: &dyn Stops, step: usize) -> bool {
        // A look without images is not repeated before the rover has moved.
        if stops.mast_target(step) == Some(self.designation) {
            return true;
        }
        let has_images = !stops.is_odometry_alone(step) && !stops.has_dropped_out(step);
        let pair = self.mast_pair(stops, step).filter(|_| has_images);
        pair.is_some_and(|pair| is_in_view(&pair, &self.in_rover(&stops.site_from_rover(step))))
    }

    /// The pair in which the target is tracked at a stop, if it is on the mast.
    fn mast_pair<'a>(&self, stops: &'a dyn Stops, step: usize) -> Option<StopPair<'a>> {
        let pair = pair::of_stop(stops, step, self.designation.camera).ok()?;
        Some(pair).filter(|pair| pair.mast_angles.is_some())
    }

    /// Whether the rover has moved far enough since the target was last seen for a look at it.
    fn is_due(&self, stops: &dyn Stops, step: usize, step_fraction: f64) -> bool {
        if self.mast_pair(stops, step).is_none() {
            return false;
        }
        let place = |step: usize| stops.site_from_rover(step).translation.vector;
        let here = place(step);
        let seen = (self.designation.step..=step).rev().find(|stop| self.is_seen(stops, *stop));
        let moved_m = (here - place(seen.unwrap_or(self.designation.step))).norm();
        moved_m > step_fraction * (Point3::from(self.in_site_m).coords - here).norm()
    }
}

/// The waiting target at which the mast looks next from a stop; `None` if none is due, without a mast, and if the mast
/// looked back at the tracks because odometry was refused.
pub(super) fn due<'a>(
    stops: &dyn Stops,
    command: &'a DriveCommand,
    step: usize,
) -> Option<&'a WaitingTarget> {
    stops.mast().filter(|_| command.look_at_waiting && !has_looked_back(stops, step))?;
    command.waiting.iter().find(|target| target.is_due(stops, step, command.step_fraction))
}

/// The waiting target at which the mast is pointed at a stop, if any.
pub(super) fn looked_at<'a>(
    stops: &dyn Stops,
    command: &'a DriveCommand,
    step: usize,
) -> Option<&'a WaitingTarget> {
    let designation = stops.mast_target(step)?;
    command.waiting.iter().find(|target| target.designation == designation)
}

/// Number of stops since the designation, excluding looks at another target and looks back.
pub(super) fn stops_beside_looks(stops: &dyn Stops, first: &StepTrace, last: usize) -> usize {
    let designation = first.update.target.designation;
    let is_look = |step: &usize| has_stayed(stops, *step) && !is_another_look(stops, *step, designation);
    last + 1 - first.step - (first.step + 1..=last).filter(is_look).count()
}
