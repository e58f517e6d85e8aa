//! Targets that wait while the rover drives to another one (R207): when the mast looks at one of them, so that its tracker sees it
//! change little by little.
//!
//! ```text
//! due    if |p − p_seen| > step_fraction · |t − p|
//! ```
//! | symbol | meaning |
//! |---|---|
//! | p | place of the rover, site frame, m |
//! | p_seen | its place at the last stop at which the pair was pointed at the target, or showed it |
//! | t | the target as it was designated, site frame, m |
//!
//! It is the rule by which the target that the rover drives to is looked at. The place of the designation is good enough to point the mast;
//! the tracker predicts by its own. A look is a stop of its own, and so is the look back at the other target.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::{Point3, Pose};
use sightline_track::target::Designation;

use super::command::DriveCommand;
use crate::pair;
use crate::pipeline::Stops;
use crate::sight::is_in_view;

/// A target to which the rover drives afterwards.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct WaitingTarget {
    /// Its designation.
    pub designation: Designation,
    /// Where that put it, site frame, m.
    pub in_site_m: [f64; 3],
}

impl WaitingTarget {
    /// Its place in the rover frame, m.
    pub(super) fn in_rover(&self, site_from_rover: &Pose) -> Point3 {
        site_from_rover.inverse_transform_point(&self.in_site_m.into())
    }

    /// Whether the pair was pointed at it at a stop, or showed it.
    fn is_seen(&self, stops: &dyn Stops, step: usize) -> bool {
        if stops.is_odometry_alone(step) {
            return false;
        }
        let pair = pair::of_stop(stops, step, self.designation.camera);
        let is_shown = |pair| is_in_view(&pair, &self.in_rover(&stops.site_from_rover(step)));
        stops.mast_target(step) == Some(self.designation) || pair.is_ok_and(is_shown)
    }

    /// Whether the rover has moved so far since it was last seen that it is to be looked at, at a stop.
    fn is_due(&self, stops: &dyn Stops, step: usize, step_fraction: f64) -> bool {
        let place = |step: usize| stops.site_from_rover(step).translation.vector;
        let here = place(step);
        let seen = (self.designation.step..=step).rev().find(|stop| self.is_seen(stops, *stop));
        let moved_m = (here - place(seen.unwrap_or(self.designation.step))).norm();
        moved_m > step_fraction * (Point3::from(self.in_site_m).coords - here).norm()
    }
}

/// The waiting target that the mast looks at next from a stop; `None` if none is due, or without a mast.
pub(super) fn due<'a>(
    stops: &dyn Stops,
    command: &'a DriveCommand,
    step: usize,
) -> Option<&'a WaitingTarget> {
    stops.mast().filter(|_| command.look_at_waiting)?;
    command.waiting.iter().find(|target| target.is_due(stops, step, command.step_fraction))
}

/// The waiting target at which the mast is to be pointed at a stop, because it was due at the one before.
pub(super) fn looked_at<'a>(
    stops: &dyn Stops,
    command: &'a DriveCommand,
    step: usize,
) -> Option<&'a WaitingTarget> {
    let designation = stops.mast_target(step)?;
    command.waiting.iter().find(|target| target.designation == designation)
}
