//! One step as a row of a table, with the declaration of its columns.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::Pixel;
use sightline_record::{Declaration, Record, Unit};
use sightline_track::cycle_stage::CycleStage;
use sightline_track::gate::Gate;

/// One row of a run: the columns of plots, tables and `sightline track`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StepRow {
    /// The stop, from 0.
    pub step: usize,
    /// The tracking state's word.
    pub state: String,
    /// Scale by the ratio of distances.
    pub scale: Option<f64>,
    /// Roll, deg.
    pub roll_deg: Option<f64>,
    /// Score of the match.
    pub ncc: Option<f64>,
    /// Score of point stereo.
    pub stereo_score: Option<f64>,
    /// Number of feature matches that are inliers of the motion.
    pub inliers: Option<usize>,
    /// Confidence of the locator, 0 to 1.
    pub confidence: Option<f64>,
    /// Error against the truth in the left image, px.
    pub err_px: Option<f64>,
    /// Error against the truth, m.
    pub err_m: Option<f64>,
    /// Largest 1σ axis of the position covariance, m.
    pub sigma_m: Option<f64>,
    /// Squared Mahalanobis distance of the error.
    pub nees: Option<f64>,
    /// Whether the target is tracked against the truth.
    pub tracked: Option<bool>,
    /// Estimated position in the rover frame, m.
    pub position_in_rover: [f64; 3],
    /// Covariance of the estimated position, m².
    #[schema(value_type = Vec<f64>)]
    pub covariance_in_rover: Matrix3<f64>,
    /// Located position in the left image, px.
    pub left_pixel: Option<Pixel>,
    /// Estimated distance from the left camera, m.
    pub range_m: Option<f64>,
    /// Correction of the distance, m: criterion 3.
    pub distance_correction_m: Option<f64>,
    /// Tolerance of the distance's correction at this step, m.
    pub distance_tolerance_m: Option<f64>,
    /// Correction of the position since the designation, m: criterion 4.
    pub position_correction_m: Option<f64>,
    /// Tolerance of the position's correction at this step, m.
    pub position_tolerance_m: Option<f64>,
    /// The paper's error budget of a drive without tracking at this range, m, 3σ [Kim09 Eq. 3].
    pub budget_without_m: Option<f64>,
    /// The paper's error budget of tracking that drifts by half a pixel of the first image, m, 3σ [Kim09 Eq. 5].
    pub budget_with_m: Option<f64>,
    /// Why an update was rejected, the fault of the stop's files, or where the drive is paused.
    pub reason: Option<String>,
    /// Whether the stop's files are damaged, so that nothing could be done.
    #[serde(default)]
    pub fault: bool,
    /// Whether the tracker did not search for the target; the schema omits it, because `reason` contains the cause.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schema(ignore)]
    pub not_searched: bool,
    /// Rejected updates in a row up to this step while the state is `lost`; `None` in other states.
    ///
    /// The schema omits it, because expressions name the same value in the record (`update.state`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(ignore)]
    pub lost_count: Option<u32>,
    /// The first stage that is not computed, at a step of a paused drive; the schema omits it, because `reason` names it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(ignore)]
    pub paused_before: Option<CycleStage>,
    /// The failed gates of the verdict; the schema omits them, because expressions name `judge.gates`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(ignore)]
    pub failed_gates: Vec<Gate>,
}

impl Record for StepRow {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("step", Unit::One, |row| row.step).describe("The stop, from 0.");
        r.quantity("state", Unit::One, |row| row.state.as_str().to_owned())
            .describe("The tracking state's word.");
        r.quantity("scale", Unit::One, |row| row.scale)
            .describe("Scale by the ratio of distances.")
            .formula("D_old / D_new", &["scale_roll.scale"]);
        r.quantity("roll_deg", Unit::Degree, |row| row.roll_deg)
            .describe("Roll of the template, clockwise on screen.")
            .formula("roll_rad · 180 / π", &["scale_roll.roll_rad"]);
        r.quantity("ncc", Unit::One, |row| row.ncc)
            .label("match score")
            .describe("Score of the match.")
            .formula("the score of the match", &["match_template.score"]);
        r.quantity("stereo_score", Unit::One, |row| row.stereo_score)
            .label("stereo score")
            .describe("Score of point stereo.")
            .formula("the score of point stereo", &["point_stereo.score"]);
        r.quantity("err_px", Unit::Pixel, |row| row.err_px)
            .label("error")
            .describe("Error against the truth in the left image.");
        r.quantity("err_m", Unit::Metre, |row| row.err_m).label("error").describe("Error against the truth.");
        r.quantity("sigma_m", Unit::Metre, |row| row.sigma_m)
            .label("σ")
            .describe("Largest 1σ axis of the position covariance.")
            .formula("√λ_max(Σ)", &["update.target.covariance_in_rover"]);
        r.quantity("nees", Unit::One, |row| row.nees).describe("Squared Mahalanobis distance of the error.");
        r.quantity("tracked", Unit::One, |row| row.tracked)
            .describe("Whether the target is tracked against the truth.");
        r.quantity("position_in_rover", Unit::Metre, |row| row.position_in_rover)
            .describe("Estimated position in the rover frame.");
        r.quantity("left_pixel", Unit::Pixel, |row| row.left_pixel)
            .describe("Located position in the left image.");
        r.quantity("range_m", Unit::Metre, |row| row.range_m)
            .describe("Estimated distance from the left camera.");
        declare_judged(r);
        r.quantity("inliers", Unit::One, |row| row.inliers)
            .describe("Number of feature matches that are inliers of the motion.");
        r.quantity("confidence", Unit::One, |row| row.confidence)
            .describe("Confidence of the locator, 0 to 1.");
        r.quantity("reason", Unit::One, |row| row.reason.clone())
            .describe("Why an update was rejected, or the fault of the stop's files.");
        r.quantity("covariance_in_rover", Unit::SquareMetre, |row| row.covariance_in_rover)
            .describe("Covariance of the estimated position in the rover frame.");
        r.quantity("fault", Unit::One, |row| row.fault)
            .describe("Whether the stop's files are damaged, so that nothing could be done.");
    }
}

fn declare_judged(r: &mut Declaration<StepRow>) {
    r.quantity("distance_correction_m", Unit::Metre, |row| row.distance_correction_m)
        .label("range change")
        .describe("Correction of the distance: criterion 3.");
    r.quantity("distance_tolerance_m", Unit::Metre, |row| row.distance_tolerance_m)
        .label("range change tolerance")
        .describe("Tolerance of the distance's correction at this step.");
    r.quantity("position_correction_m", Unit::Metre, |row| row.position_correction_m)
        .label("site position")
        .describe("Correction of the position since the designation: criterion 4.");
    r.quantity("position_tolerance_m", Unit::Metre, |row| row.position_tolerance_m)
        .label("site position tolerance")
        .describe("Tolerance of the position's correction at this step.");
    r.quantity("budget_without_m", Unit::Metre, |row| row.budget_without_m)
        .describe("Budget of a drive without tracking at this range, 3σ [Kim09 Eq. 3].");
    r.quantity("budget_with_m", Unit::Metre, |row| row.budget_with_m)
        .describe("Budget of tracking that drifts by half a pixel of the first image, 3σ [Kim09 Eq. 5].");
}
