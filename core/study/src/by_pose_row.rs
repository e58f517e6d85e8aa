//! Columns of poses and odometry in a study's table: performance of the drive's odometry, and causes of losses.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use sightline_geometry::estimate::quantile::median;
use sightline_geometry::frames::Pose;
use sightline_recordings::Traverse;

use super::by_pose::{ByPose, Loss, LossCause};
use super::run::Run;

/// Performance of odometry in one drive, against the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DriveOdometry {
    /// Number of planned stops.
    pub stops_planned: usize,
    /// Number of driven stops.
    pub stops: usize,
    /// Number of measured motions.
    pub measured: usize,
    /// Number of accepted ones.
    pub accepted: usize,
    /// Largest slip along the motion of an accepted measurement, as a fraction of the wheels' motion; `None` without
    /// any.
    pub slip_max: Option<f64>,
    /// Distance between the estimated and the true pose at the last stop, m; `None` without truth.
    pub pose_err_m: Option<f64>,
    /// Angle between them, degrees.
    pub pose_err_deg: Option<f64>,
}

impl DriveOdometry {
    /// Compares a drive with `planned` planned stops with its truth.
    pub fn of(drive: &Traverse, planned: usize) -> Self {
        let motions = || drive.index().stops.iter().filter_map(|stop| stop.odometry.as_ref());
        let accepted = || motions().filter(|motion| motion.update.accepted);
        let slips = accepted().filter_map(|motion| motion.update.slip).map(|slip| slip.along);
        let last = drive.stop_count() - 1;
        let truth = drive.true_site_from_rover(last);
        let apart: Option<Pose> = truth.map(|truth| truth.inverse() * drive.site_from_rover(last));
        Self {
            stops_planned: planned,
            stops: drive.stop_count(),
            measured: motions().count(),
            accepted: accepted().count(),
            slip_max: slips.reduce(f64::max),
            pose_err_m: apart.map(|apart| apart.translation.vector.norm()),
            pose_err_deg: apart.map(|apart| apart.rotation.angle().to_degrees()),
        }
    }

    /// Returns whether slip ended the drive.
    pub fn is_cut_short(&self) -> bool {
        self.stops < self.stops_planned
    }

    /// Columns of the table.
    pub(super) fn columns(&self) -> BTreeMap<String, Value> {
        [
            ("stops_planned", self.stops_planned.into()),
            ("stops_driven", self.stops.into()),
            ("motions_measured", self.measured.into()),
            ("motions_accepted", self.accepted.into()),
            ("slip_max", self.slip_max.into()),
            ("pose_err_m", self.pose_err_m.into()),
            ("pose_err_deg", self.pose_err_deg.into()),
        ]
        .map(|(name, value): (&str, Value)| (name.to_owned(), value))
        .into()
    }
}

/// Causes of losses; empty if the study does not record them.
pub(super) fn columns(runs: &[&Run]) -> BTreeMap<String, Value> {
    let asked: Vec<&ByPose> = runs.iter().filter_map(|run| run.by_pose.as_ref()).collect();
    if asked.is_empty() {
        return BTreeMap::new();
    }
    let losses = || asked.iter().filter_map(|target| target.loss.as_ref());
    let of = |cause: LossCause| losses().filter(|loss| loss.cause == cause).count();
    let steps: Vec<f64> = losses().map(|loss: &Loss| loss.step as f64).collect();
    let off: Vec<f64> = losses().filter_map(|loss| loss.off_px).collect();
    [
        ("not_driven", asked.iter().filter(|target| target.not_driven).count().into()),
        ("lost_by_pose", (of(LossCause::Window) + of(LossCause::Correction)).into()),
        ("lost_by_window", of(LossCause::Window).into()),
        ("lost_by_correction", of(LossCause::Correction).into()),
        ("lost_hidden", of(LossCause::Hidden).into()),
        ("lost_by_match", of(LossCause::Match).into()),
        ("loss_step_median", median(&steps).into()),
        ("prediction_off_px_median", median(&off).into()),
    ]
    .map(|(name, value): (&str, Value)| (name.to_owned(), value))
    .into()
}
