//! Visual odometry along the path that Spirit drove at site 137, in a rendered world.
//!
//! At 131 drive counters (April to July 2009) the rover's pose was recorded: drives backwards of 0.5 m a step, and the
//! stretch where the wheels sank in and the rover moved by millimetres a command. Here these poses are the true ones in a
//! simulated world with the site's slope. At each the mast looks at the ground ahead, a pair is rendered, and the motion
//! since the pose before is measured and compared with the recorded one. Gaps of the record, 5 m, 3 m and 2 m, are steps as
//! they are.
//!
//! | module | what |
//! |---|---|
//! | [`rvf`] | the recorded poses, one for each drive counter |
//! | [`path`] | the poses in the world, its ground, the motion by wheels and gyro |
//! | [`report`] | updates beside the truth |
//!
//! The images are rendered: light, texture and relief are those of the simulation, not of Mars. Frames: site of the world
//! (level, z down) and rover, m.

pub mod path;
pub mod report;
pub mod rvf;

use std::path::Path as Folder;

use sightline_geometry::camera::{Mast, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pose, PoseRecord};
use sightline_recordings::{DrivenTraverse, Traverse};
use sightline_rover::visual_odometry::look::look;
use sightline_rover::visual_odometry::{MeasuredMotion, OdometryMode, OdometryPreset};
use sightline_world::rover::driven::DrivenStop;

use self::path::Path;
use self::report::{SpiritReport, SpiritStep};

/// Time from stop to stop, s; nothing in the world depends on it.
const PAUSE_S: f64 = 60.0;

/// A replay of the path in one world.
#[derive(Clone, Copy, Debug)]
pub struct Replay<'a> {
    /// The path.
    pub path: &'a Path,
    /// The seed of the world and of the errors of wheels and gyro.
    pub seed: u64,
    /// Side of the images, px: 1024, 512, 256 or 128.
    pub image_size: u32,
    /// Samples along each side of a pixel.
    pub samples_per_axis: u32,
}

impl Replay<'_> {
    /// Replays the path in a folder that is removed afterwards; `tell` is called with the number of updates that are done.
    ///
    /// # Errors
    /// A world that cannot be made, a folder that cannot be written, or [`Error::Cancelled`].
    pub fn run(
        &self,
        folder: &Folder,
        cancel: Cancel<'_>,
        tell: &mut dyn FnMut(usize),
    ) -> Result<SpiritReport> {
        let outcome = self.replayed(folder, cancel, tell);
        // A failure to remove leaves a folder in the way of nobody.
        let _ = std::fs::remove_dir_all(folder);
        outcome
    }

    fn replayed(
        &self,
        folder: &Folder,
        cancel: Cancel<'_>,
        tell: &mut dyn FnMut(usize),
    ) -> Result<SpiritReport> {
        let scenario = self.path.scenario(self.seed, self.image_size, self.samples_per_axis)?;
        let by_wheels = self.path.by_wheels(&scenario);
        let stops = driven(&self.path.poses, &by_wheels);
        let world = DrivenTraverse::begin_at(&scenario, stops, folder, cancel)?;
        let traverse = world.traverse();
        let poses = &self.path.poses;
        let [mut estimated, mut wheels] = [poses[0]; 2];
        let mut steps = Vec::new();
        for (number, predicted) in (1..).zip(&by_wheels) {
            let how = (OdometryMode::Full, OdometryPreset::Sightline);
            let found = MeasuredMotion::measure(traverse, number, None, how, cancel)?.update;
            let truth = poses[number].inv_mul(&poses[number - 1]);
            steps.push(SpiritStep::new(self.path.drives[number], &found, &truth, predicted));
            wheels *= predicted.inverse();
            estimated *= found.accepted_motion().unwrap_or(*predicted).inverse();
            tell(number);
        }
        let path_m = self.path.length_m();
        let end_error = |pose: &Pose| {
            let off_m = (pose.translation.vector - poses[poses.len() - 1].translation.vector).norm();
            [off_m, 100.0 * off_m / path_m[0]]
        };
        let report = SpiritReport {
            seed: self.seed,
            counters: poses.len(),
            path_m,
            slope_deg: [self.path.slope_deg, self.path.slope_azimuth_deg],
            mean_tilt_deg: self.path.mean_tilt_deg,
            camera_height_m: camera_height_m(traverse, poses)?,
            end_error: end_error(&estimated),
            wheels_end_error: end_error(&wheels),
            ..SpiritReport::default()
        };
        Ok(report.with_steps(steps))
    }
}

/// The stops of the drive; the estimated poses are those of wheels and gyro, and the mast looks as odometry wants it.
fn driven(poses: &[Pose], by_wheels: &[Pose]) -> Vec<DrivenStop> {
    let mast = Mast::spirit();
    let mut angles = look(&mast, None, &Pose::identity());
    let mut estimated = poses[0];
    let mut stops = vec![stop(0, [&poses[0], &estimated], angles, 0.0)];
    for ((number, pose), predicted) in (1..).zip(&poses[1..]).zip(by_wheels) {
        angles = look(&mast, angles.map(|before| before.azimuth_rad), predicted);
        estimated *= predicted.inverse();
        stops.push(stop(number, [pose, &estimated], angles, predicted.translation.vector.norm()));
    }
    stops
}

/// One stop; `poses` are the true and the estimated one.
fn stop(number: usize, poses: [&Pose; 2], mast_angles: Option<MastAngles>, wheels_m: f64) -> DrivenStop {
    let [truth, estimate] = poses.map(PoseRecord::from);
    DrivenStop {
        time_s: PAUSE_S * number as f64,
        true_site_from_rover: truth,
        site_from_rover: estimate,
        attitude_error_rad: [0.0; 3],
        mast_angles,
        odometry_look: None,
        metered_px: None,
        wheels_m,
        drive_s: 0.0,
        completed: 1.0,
        touched_rocks: 0,
        wheel_places_m: Vec::new(),
        odometry: None,
        odometry_alone: false,
        mast_target: None,
        handed_to: None,
        measured_tilt_deg: None,
        awaits: None,
    }
}

/// Least and greatest height of the left camera above the bare ground, m.
///
/// # Errors
/// A camera in the ground: the path does not lie on it.
fn camera_height_m(traverse: &Traverse, poses: &[Pose]) -> Result<[f64; 2]> {
    let world = traverse.world().ok_or_else(|| Error::Request("the replay has no world".to_owned()))?;
    let heights = poses.iter().enumerate().map(|(number, pose)| {
        let centre = traverse.left_camera(number).moved(pose).model.centre();
        world.ground_z_at(centre.x, centre.y) - centre.z
    });
    let [low_m, high_m] = heights
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], height| [low.min(height), high.max(height)]);
    if low_m <= 0.0 {
        return Err(Error::Request(format!("a camera stands {:.2} m below the ground", -low_m)));
    }
    Ok([low_m, high_m])
}

#[cfg(test)]
mod tests;
