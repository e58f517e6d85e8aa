//! One step of a checkout compared with the geometry of its staged drive (K§7.1, Table III, R130–R135).
//!
//! Magnification and roll are those of one update, from the previous stop to this one, by the formulas of K-Eq 6–10:
//! once from the tracker's estimates, which scale and roll the template if it is renewed at every stop, and once from
//! the true poses, cameras and target of the staged drive. The azimuth is that of the line of sight from the left camera
//! to the target in the site frame, which does not rotate with the rover (R135, E8); the bearing is relative to the
//! rover. Both increase clockwise, seen from above.
//!
//! Units: px, m, degrees, for readability. Frames: site and rover.

use serde::{Deserialize, Serialize};

use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Point3, Pose, Vector3};
use sightline_session::step::RunStep;
use sightline_session::track::Drive;
use sightline_track::locate::template::scale_roll::geometry;
use sightline_track::locate::template::settings::RollReference;

/// Estimated and true values of one update.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepRecord {
    /// Position of the rover, counted from 1 as in the paper.
    pub position: usize,
    /// Tracking state.
    pub state: String,
    /// Whether it is tracked according to the truth; `None` without truth.
    pub tracked: Option<bool>,
    /// Whether it was lost although its evidence was right.
    pub is_false_loss: bool,
    /// Magnification since the previous stop, from the estimates.
    pub magnification: Option<f64>,
    /// Magnification since the previous stop, from the truth.
    pub magnification_true: Option<f64>,
    /// Roll since the previous stop, from the estimates, degrees.
    pub roll_deg: Option<f64>,
    /// Roll since the previous stop, from the truth, degrees.
    pub roll_true_deg: Option<f64>,
    /// Change of the azimuth of the line of sight, from the estimates, degrees.
    pub azimuth_change_deg: Option<f64>,
    /// Change of the azimuth of the line of sight, from the truth, degrees.
    pub azimuth_change_true_deg: Option<f64>,
    /// True direction of the target relative to the rover's heading, degrees.
    pub bearing_deg: Option<f64>,
    /// True distance from the left camera, m.
    pub distance_m: Option<f64>,
    /// Score of the match.
    pub ncc: Option<f64>,
    /// Score of point stereo.
    pub stereo_score: Option<f64>,
    /// Distance between the match and the predicted pixel, px.
    pub correction_px: Option<f64>,
    /// Displacement of the target in the site frame since the designation, m.
    pub total_correction_m: f64,
    /// Error against the truth, px.
    pub err_px: Option<f64>,
    /// Error against the truth, m.
    pub err_m: Option<f64>,
}

/// Pose, left camera and target (rover frame) at a stop.
struct Stand<'a> {
    site_from_rover: Pose,
    camera: &'a Camera,
    target_in_rover: Point3,
}

impl StepRecord {
    /// Compares a step with the previous one.
    pub fn of<D: Drive>(drive: &D, before: Option<&RunStep>, trace: &RunStep) -> Self {
        let (row, target) = (trace.row(), &trace.update.target);
        let estimated = |trace: &RunStep| Stand {
            site_from_rover: drive.site_from_rover(trace.step),
            camera: drive.cameras(trace.step).0,
            target_in_rover: trace.update.target.position_in_rover,
        };
        let truly = |trace: &RunStep| {
            Some(Stand {
                site_from_rover: drive.true_site_from_rover(trace.step)?,
                camera: drive.true_left_camera(trace.step, target.designation.camera)?,
                target_in_rover: trace.truth.as_ref()?.position_in_rover,
            })
        };
        let by_estimate = before.map(|before| (estimated(before), estimated(trace)));
        let by_truth = before.and_then(truly).zip(truly(trace));
        let [seen, seen_true] = [&by_estimate, &by_truth]
            .map(|pair| pair.as_ref().and_then(|(then, now)| magnification_and_roll(then, now)));
        let turned = |pair: &Option<(Stand<'_>, Stand<'_>)>| {
            pair.as_ref().map(|(then, now)| wrapped_deg(now.azimuth_deg() - then.azimuth_deg()))
        };
        let now = truly(trace);
        let sight = now.as_ref().map(Stand::sight);
        let site_now = drive.site_from_rover(trace.step) * target.position_in_rover;
        Self {
            position: trace.step + 1,
            state: row.state,
            tracked: row.tracked,
            is_false_loss: trace.is_false_loss(),
            magnification: seen.map(|(scale, _)| scale),
            magnification_true: seen_true.map(|(scale, _)| scale),
            roll_deg: seen.map(|(_, roll)| roll.to_degrees()),
            roll_true_deg: seen_true.map(|(_, roll)| roll.to_degrees()),
            azimuth_change_deg: turned(&by_estimate),
            azimuth_change_true_deg: turned(&by_truth),
            bearing_deg: sight.map(|sight| sight.y.atan2(sight.x).to_degrees()),
            distance_m: sight.map(|sight| sight.norm()),
            ncc: row.ncc,
            stereo_score: row.stereo_score,
            correction_px: trace.update.correction_px,
            total_correction_m: (site_now - target.initial_position_in_site).norm(),
            err_px: row.err_px,
            err_m: row.err_m,
        }
    }
}

impl Stand<'_> {
    /// Vector from the left camera to the target, rover frame, m.
    fn sight(&self) -> Vector3 {
        self.target_in_rover - self.camera.model.centre()
    }

    /// Azimuth of the line of sight in the site frame, degrees.
    fn azimuth_deg(&self) -> f64 {
        let sight = self.site_from_rover * self.sight();
        sight.y.atan2(sight.x).to_degrees()
    }
}

/// Scale, and roll in rad, between two stops; `None` if the geometry is degenerate.
fn magnification_and_roll(then: &Stand<'_>, now: &Stand<'_>) -> Option<(f64, f64)> {
    let now_from_then = now.site_from_rover.inverse() * then.site_from_rover;
    let (scale, roll_rad, ..) =
        geometry(&then.target_in_rover, then.camera, &now_from_then, now.camera, RollReference::Horizontal)
            .ok()?;
    Some((scale, roll_rad))
}

/// Wraps an angle to −180° … 180°.
fn wrapped_deg(angle_deg: f64) -> f64 {
    (angle_deg + 180.0).rem_euclid(360.0) - 180.0
}
