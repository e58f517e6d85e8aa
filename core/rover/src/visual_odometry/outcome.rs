//! The outcome of an update: the motion with its covariance and gates, and the fate of every corner.

use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::{Pose, PoseRecord};
use sightline_track::gate::Gate;

use super::coarse::CoarseSearch;

/// Fate of a corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Fate {
    /// Inlier of the motion.
    Inlier,
    /// Outlier of the motion.
    Outlier,
    /// No stereo match before the motion.
    NoStereo,
    /// Its range is beyond the limits.
    OutOfRange,
    /// It is out of view after the motion.
    OutOfView,
    /// No match between the stops.
    NoMatch,
    /// No stereo match after the motion.
    NoStereoAfter,
    /// No motion to compare with.
    Unused,
}

/// A corner with its fate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OdometryCorner {
    /// In the left image before, px of the whole image.
    #[schema(value_type = [f64; 2])]
    pub before_px: [f64; 2],
    /// Its match in the left image after, px of the whole image; null without one.
    pub after_px: Option<[f64; 2]>,
    /// Distance from the left camera before, m; null without a point.
    pub range_m: Option<f64>,
    /// Residual under the motion in standard deviations; null without match or motion.
    pub residual_sigmas: Option<f64>,
    /// Fate of the corner.
    pub fate: Fate,
}

/// Slip of a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[schema(as = OdometrySlip)]
pub struct Slip {
    /// Lost fraction of the wheels' motion, along it: 1 = the rover stayed.
    pub along: f64,
    /// Motion to the right of the wheels' motion, relative to it.
    pub aside: f64,
    /// 1σ error of `along`.
    pub along_sigma: f64,
}

/// The outcome of an update.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OdometryUpdate {
    /// Corners of the left image before.
    pub corners: usize,
    /// Corners with a position by stereo.
    pub points: usize,
    /// Points matched in both images after.
    pub matches: usize,
    /// Matches with constant mutual distances.
    pub consistent: usize,
    /// Inliers of the motion.
    pub inliers: usize,
    /// The search over translations; null if it is switched off or had too few points.
    pub coarse_search: Option<CoarseSearch>,
    /// The motion, accepted or not, from the rover frame before to that after; null if none was found.
    pub after_from_before: Option<PoseRecord>,
    /// Displacement of the rover's origin by the wheels, rover frame before, m.
    pub wheels_m: [f64; 3],
    /// Covariance of a small motion (translation in m, rotation in rad) about the rover's origin, applied after it, rover
    /// frame after.
    #[schema(value_type = Option<Vec<f64>>)]
    pub covariance: Option<SMatrix<f64, 6, 6>>,
    /// χ² per degree of freedom of the residuals.
    pub chi2_per_dof: Option<f64>,
    /// Mean change of the view over the inliers: 0.1 if windows grow by a tenth.
    pub change: Option<f64>,
    /// The slip of this motion; null without a motion, and if the wheels hardly moved.
    pub slip: Option<Slip>,
    /// Inliers of another motion, from another start of the coarse search, relative to those of the motion; 0 without one.
    pub ambiguity: f64,
    /// Score of another displacement along the motion of the wheels, relative to that of the motion; near 1 on ground with
    /// a repetitive pattern.
    #[serde(default)]
    pub repetition: f64,
    /// The gates.
    pub gates: Vec<Gate>,
    /// Why there is no motion, as one sentence.
    pub missing: Option<String>,
    /// Whether all gates are passed.
    pub accepted: bool,
    /// The corners, one by one.
    #[serde(skip)]
    #[schema(ignore)]
    pub table: Vec<OdometryCorner>,
}

impl OdometryUpdate {
    /// The motion if it is accepted.
    pub fn accepted_motion(&self) -> Option<Pose> {
        self.after_from_before.filter(|_| self.accepted).map(PoseRecord::to_pose)
    }

    /// Why there is no update, as one sentence; `None` for an accepted one.
    pub fn refusal(&self) -> Option<String> {
        if self.accepted {
            return None;
        }
        let failed = self.gates.iter().find(|gate| !gate.passed && gate.value.is_some());
        let sentence = failed.and_then(|gate| {
            let relation = if gate.at_least { "less" } else { "more" };
            let (value, unit) = (gate.value?, &gate.unit);
            let space = if unit.is_empty() { "" } else { " " };
            Some(format!(
                "no update: {} is {value:.3}{space}{unit}, {relation} than {:.3}{space}{unit}",
                gate.name, gate.limit
            ))
        });
        sentence.or_else(|| self.missing.as_ref().map(|why| format!("no update: {why}")))
    }
}
