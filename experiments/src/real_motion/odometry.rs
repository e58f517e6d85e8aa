//! The motion that visual odometry finds between recorded frames.
//!
//! Odometry assumes a rover: z points down, and the ground is at z = 0 under the wheels. The recordings give the cameras in
//! the frame of the rig, so each recording has a mounting, the pose of its rig in a level rover frame:
//!
//! | recording | height of the left camera, m | depression, deg | source |
//! |---|---|---|---|
//! | KITTI | 1.65 | 0 | the description of the car |
//! | EuRoC, AprilGrid pair | 1.29 | 21.9 | plane through the stereo points of the floor, mean of both frames |
//! | EuRoC, standing still | 0.92 | 21.5 | the same, first frame |
//!
//! Neither recording has wheels, so the prediction is one of these:
//!
//! | set | prediction | use of the truth |
//! |---|---|---|
//! | KITTI | no turn, 1.2 m forward for each frame | none |
//! | EuRoC pair | true motion, turn 1° off about (1, 1, 1), way 20 % too long and 10° aside | its errors are those stated |
//! | EuRoC still | no motion | none |
//! | EuRoC still, spinning | no turn, 0.3 m forward: wheels that spin on the spot | none |
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | X | `Mounting::rover_from_rig` | m |
//! | T | `OdometryRow::after_from_before` | m, rover frames before and after |
//! | X⁻¹ T X | `Row::now_from_then` | m, rig frames |

use std::path::Path;

use nalgebra::{Matrix3, Matrix6, Rotation3, Translation3, Unit, UnitQuaternion, Vector6};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use sightline_geometry::camera::{Cahv, Camera, CameraModel};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::{Pose, PoseRecord, Vector3};
use sightline_rover::visual_odometry::{
    OdometryInput, OdometrySettings, OdometryUpdate, OdometryView, update,
};

use super::odometry_matches::{PairMatches, pair_matches};
use super::{Recording, Row, Set, euroc, kitti};

/// Way of the KITTI car from frame to frame, m.
const KITTI_STEP_M: f64 = 1.2;
/// Way that spinning wheels report, m.
const SPINNING_M: f64 = 0.3;
/// Error of the predicted turn of the EuRoC pair, deg, about (1, 1, 1) of the rover frame.
const TURN_ERROR_DEG: f64 = 1.0;
/// Length of the predicted way of the EuRoC pair as a part of the true one.
const WAY_SCALE: f64 = 1.2;
/// Error of the direction of that way, deg, about the vertical.
const WAY_ASIDE_DEG: f64 = 10.0;

/// One motion by visual odometry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct OdometryRow {
    /// The motion in the frame of the rig, and its error against the truth.
    #[serde(flatten)]
    pub row: Row,
    /// Corners of the left image before.
    pub corners: usize,
    /// Corners with a position by stereo.
    pub points: usize,
    /// Whether all gates are passed.
    pub accepted: bool,
    /// Why there is no update, as one sentence; null for an accepted one.
    pub refusal: Option<String>,
    /// The prediction, from the rover frame before to that after.
    pub predicted_after_from_before: PoseRecord,
    /// The motion that was found, likewise; null where none was.
    pub after_from_before: Option<PoseRecord>,
    /// Its turn, deg.
    pub found_rotation_deg: Option<f64>,
    /// Its way, of the origin of the rig, m.
    pub found_translation_m: Option<f64>,
    /// Largest 1σ axes of translation (rover's origin, m) and turn (deg) by its covariance.
    pub sigma: Option<[f64; 2]>,
    /// Squared error over the covariance, with 6 degrees of freedom; the error of the truth is part of it.
    pub nees: Option<f64>,
}

/// The rows with the matches behind them.
pub(crate) struct OdometryMotions {
    /// One for each pair of frames.
    pub rows: Vec<OdometryRow>,
    /// The inliers of each, in the same order.
    pub matches: Vec<PairMatches>,
}

/// Measures the recordings of a data folder that drive or stand; rectified frames go to `frames` if it is given.
///
/// # Errors
/// A recording that is missing, incomplete or damaged, or a frame that cannot be written.
pub(crate) fn measure(data: &Path, frames: Option<&Path>) -> Result<OdometryMotions> {
    let recordings = [
        kitti::read(data, usize::MAX)?,
        euroc::read(data, Set::EurocPair)?,
        euroc::read(data, Set::EurocStill)?,
    ];
    let mut motions = OdometryMotions { rows: Vec::new(), matches: Vec::new() };
    for recording in &recordings {
        if let Some(folder) = frames {
            recording.write_frames(folder)?;
        }
        let (rows, matches): (Vec<_>, Vec<_>) = recording.odometry()?.into_iter().unzip();
        motions.rows.extend(rows);
        motions.matches.extend(matches);
    }
    Ok(motions)
}

impl Recording {
    /// Measures all its pairs by visual odometry; frames of a rig that stands also with wheels that spin.
    ///
    /// # Errors
    /// None in practice: nobody cancels an update.
    pub(super) fn odometry(&self) -> Result<Vec<(OdometryRow, PairMatches)>> {
        let still = self.pairs.iter().filter(|(set, ..)| *set == Set::EurocStill);
        let spinning = still.map(|&(_, then, now)| (Set::EurocSpinning, then, now));
        let pairs: Vec<(Set, usize, usize)> = self.pairs.iter().copied().chain(spinning).collect();
        pairs.par_iter().map(|pair| self.odometry_of(*pair)).collect()
    }

    /// The motion of one pair.
    fn odometry_of(&self, (set, then, now): (Set, usize, usize)) -> Result<(OdometryRow, PairMatches)> {
        let rover_from_rig = Mounting::of(set).rover_from_rig();
        let cameras = [0, 1].map(|eye| moved(&self.cameras[eye], &rover_from_rig));
        let [before, after] = [then, now].map(|frame| OdometryView {
            pair: &self.frames[frame].pair,
            left: &cameras[0],
            right: &cameras[1],
            mast_angles: None,
        });
        let (then, now) = (&self.frames[then], &self.frames[now]);
        let now_from_then = now.world_from_rig.inverse() * then.world_from_rig;
        let truth = rover_from_rig * now_from_then * rover_from_rig.inverse();
        let predicted = predicted(set, &truth);
        let update = update(&OdometryInput {
            before,
            after,
            predicted_after_from_before: &predicted,
            mast: None,
            settings: &settings(set),
            cancel: Cancel::default(),
        })?;
        let found = update.after_from_before.map(PoseRecord::to_pose);
        let found = found.map(|found| rover_from_rig.inverse() * found * rover_from_rig);
        let pair = format!("{} to {}", then.name, now.name);
        let row = Row {
            matches: update.matches,
            inliers: update.inliers,
            ..Row::new(set, pair, &now_from_then, &then.about_in_rig, found)
        };
        let matches = pair_matches(&row, &cameras, &update, &truth);
        Ok((odometry_row(row, &update, &predicted, &truth), matches))
    }
}

/// The row of an update; `predicted` and `truth` are from the rover frame before to that after.
fn odometry_row(row: Row, update: &OdometryUpdate, predicted: &Pose, truth: &Pose) -> OdometryRow {
    let found_in_rig = row.now_from_then.map(PoseRecord::to_pose);
    let covariance = update.covariance;
    let axis = |covariance: &Matrix6<f64>, at: usize| {
        let block: Matrix3<f64> = covariance.fixed_view::<3, 3>(at, at).into_owned();
        block.symmetric_eigenvalues().max().max(0.0).sqrt()
    };
    let found = update.after_from_before.map(PoseRecord::to_pose);
    OdometryRow {
        corners: update.corners,
        points: update.points,
        accepted: update.accepted,
        refusal: update.refusal(),
        predicted_after_from_before: PoseRecord::from(predicted),
        after_from_before: update.after_from_before,
        found_rotation_deg: found_in_rig.map(|found| found.rotation.angle().to_degrees()),
        found_translation_m: found_in_rig.map(|found| found.translation.vector.norm()),
        sigma: covariance.map(|covariance| [axis(&covariance, 0), axis(&covariance, 3).to_degrees()]),
        nees: found.zip(covariance).and_then(|(found, covariance)| nees(truth, &found, covariance)),
        row,
    }
}

/// The squared error of a motion over its covariance: that of the small motion that follows it to the truth.
fn nees(truth: &Pose, found: &Pose, covariance: Matrix6<f64>) -> Option<f64> {
    let error = truth * found.inverse();
    let (shift, turn) = (error.translation.vector, error.rotation.scaled_axis());
    let error = Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z);
    Some(error.dot(&covariance.cholesky()?.solve(&error)))
}

/// How the left camera is mounted on the rover that a recording is taken for.
struct Mounting {
    /// Axes of a level rover from those of the rig: x forward, y right, z down.
    axes: Matrix3<f64>,
    height_m: f64,
    depression_deg: f64,
}

impl Mounting {
    fn of(set: Set) -> Self {
        // The rig frame of EuRoC is camera 0's: x right, y down, z forward.
        let from_camera = Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0);
        let (axes, height_m, depression_deg) = match set {
            Set::EurocPair => (from_camera, 1.29, 21.9),
            Set::EurocStill | Set::EurocSpinning => (from_camera, 0.92, 21.5),
            _ => (Matrix3::identity(), 1.65, 0.0),
        };
        Self { axes, height_m, depression_deg }
    }

    fn rover_from_rig(&self) -> Pose {
        let down = Rotation3::from_axis_angle(&Vector3::y_axis(), -self.depression_deg.to_radians());
        let turn = down * Rotation3::from_matrix_unchecked(self.axes);
        let turn = UnitQuaternion::from_rotation_matrix(&turn);
        Pose::from_parts(Translation3::new(0.0, 0.0, -self.height_m), turn)
    }
}

/// The settings for a recording; all others are those of the preset `sightline`.
///
/// KITTI: a street of 5 to 100 m, where the disparity is 76 to 4 px; 400 corners, as they spread over a wide image. A range
/// error of 1 % of a step of 1.2 m is 1.2 cm, so the gate of σ is 3 cm. EuRoC: a room of 0.6 to 15 m, which is the preset; the
/// prediction is a degree off, which is 8 px, so the search is 20 px.
fn settings(set: Set) -> OdometrySettings {
    let preset = OdometrySettings::default();
    match set {
        Set::KittiEveryFrame | Set::KittiEveryThird => OdometrySettings {
            corners_max: 400,
            range_min_m: 5.0,
            range_max_m: 100.0,
            search_px: 20,
            sigma_max_m: 0.03,
            ..preset
        },
        _ => OdometrySettings { search_px: 20, ..preset },
    }
}

/// The prediction for a set; `truth` is from the rover frame before to that after.
fn predicted(set: Set, truth: &Pose) -> Pose {
    let forward = |way_m: f64| Pose::translation(-way_m, 0.0, 0.0);
    match set {
        Set::KittiEveryFrame => forward(KITTI_STEP_M),
        Set::KittiEveryThird => forward(3.0 * KITTI_STEP_M),
        Set::EurocSpinning => forward(SPINNING_M),
        Set::EurocPair => disturbed(truth),
        _ => Pose::identity(),
    }
}

/// A true motion with the errors of turn and way that the module states.
fn disturbed(truth: &Pose) -> Pose {
    let true_motion = truth.inverse();
    let axis = Unit::new_normalize(Vector3::new(1.0, 1.0, 1.0));
    let turn_error = UnitQuaternion::from_axis_angle(&axis, TURN_ERROR_DEG.to_radians());
    let aside = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), WAY_ASIDE_DEG.to_radians());
    let way = aside * true_motion.translation.vector * WAY_SCALE;
    Pose::from_parts(Translation3::from(way), true_motion.rotation * turn_error).inverse()
}

/// A pinhole camera of the rig in the rover frame.
fn moved(camera: &Camera, rover_from_rig: &Pose) -> Camera {
    let Cahv { centre, axis, horizontal, vertical } = camera.model.linear();
    let [axis, horizontal, vertical] = [axis, horizontal, vertical].map(|vector| rover_from_rig * vector);
    let centre = rover_from_rig * centre;
    Camera {
        model: CameraModel::Cahv(Cahv::as_printed(centre, axis, horizontal, vertical)),
        size: camera.size,
    }
}
