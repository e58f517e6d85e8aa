//! A planned drive, with the motion between its stops measured in their images (R124–R126).

use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Pose, PoseRecord};
use sightline_rover::driving::DriveCommand;
use sightline_rover::visual_odometry::{MeasuredMotion, OdometryMode, OdometryPreset};

use super::Traverse;

impl Traverse {
    /// The same drive with visual odometry. The index in the folder is unchanged; missing images are rendered.
    ///
    /// * `Off`: the poses are those of the folder, by wheels and IMU.
    /// * `SlipCheck`: the same, and the drive ends at the first stop at which the measured slip along the motion
    ///   exceeds the default limit of a drive (0.9 of the wheels' motion): later stops are omitted.
    /// * `Full`: the poses (`site_from_rover`, m) are chained anew. The motion by wheels and IMU between two stops,
    ///   applied to the corrected pose of the first, is the prediction; an accepted update gives the pose, a rejected
    ///   one keeps the prediction.
    ///
    /// # Errors
    /// A folder or images that cannot be read, or [`sightline_geometry::error::Error::Cancelled`].
    pub fn with_odometry(
        &self,
        mode: OdometryMode,
        preset: OdometryPreset,
        cancel: Cancel<'_>,
    ) -> Result<Self> {
        let mut traverse = self.reopened()?;
        if mode == OdometryMode::Off {
            return Ok(traverse);
        }
        let wheels: Vec<Pose> = (0..traverse.stop_count()).map(|s| traverse.site_from_rover(s)).collect();
        for step in 1..wheels.len() {
            let by_wheels = wheels[step - 1].inverse() * wheels[step];
            let before = traverse.site_from_rover(step - 1);
            if mode == OdometryMode::Full {
                traverse.index.stops[step].site_from_rover = PoseRecord::from(&(before * by_wheels));
            }
            // If the rover did not move, there is nothing to measure.
            if wheels[step - 1] == wheels[step] {
                continue;
            }
            let measured = MeasuredMotion::measure(&traverse, step, None, (mode, preset), cancel)?;
            let is_stuck = mode == OdometryMode::SlipCheck && slips(&measured);
            let stop = &mut traverse.index.stops[step];
            if measured.corrects {
                stop.site_from_rover = PoseRecord::from(&measured.pose_after(&before));
            }
            stop.odometry = Some(measured);
            if is_stuck {
                traverse.truncate(step + 1);
                break;
            }
        }
        Ok(traverse)
    }
}

/// Whether the slip of an accepted update ends a drive.
fn slips(measured: &MeasuredMotion) -> bool {
    let slip = measured.update.slip.filter(|_| measured.update.accepted);
    slip.is_some_and(|slip| slip.along > DriveCommand::default().slip_max)
}
