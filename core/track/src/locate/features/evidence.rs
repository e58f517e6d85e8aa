//! The evidence of the feature tracker, step by step, and the tables that the views draw (R170).

use std::sync::Arc;

use nalgebra::SMatrix;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::anchor::Carried;
use super::detect::StopFeatures;
use crate::array_name::ArrayName;
use crate::locate::template::evidence::TemplateEvidence;
use sightline_geometry::estimate::motion_parameters::MotionParameters;
use sightline_geometry::estimate::ransac::Refit;
use sightline_geometry::frames::Pose;
use sightline_record::{ArrayKind, ArrayView, Declaration, Record, Stage, Unit, Unsent};

/// The evidence of the feature tracker; a step that was not reached is null.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FeatureEvidence {
    /// Point stereo of the designated pixel; at the designation only.
    pub designation: Option<Box<TemplateEvidence>>,
    /// The features of this stop.
    pub detect: Option<Detected>,
    /// The remembered stops from which a motion was measured, newest first.
    pub anchors: Vec<AnchorTried>,
    /// The matches with the chosen stop.
    pub match_features: Option<MatchedFeatures>,
    /// The motion since the chosen stop.
    pub fit_motion: Option<FittedMotion>,
    /// The covariance of that motion by the bootstrap.
    pub bootstrap: Option<Bootstrapped>,
    /// The stop of the recording; `None` if the traverse has no store.
    #[serde(skip)]
    #[schema(ignore)]
    pub stop: Option<usize>,
    /// The target's position, carried to this stop by the motions.
    #[serde(skip)]
    #[schema(ignore)]
    pub carried: Option<Carried>,
    /// The features of this stop.
    #[serde(skip)]
    #[schema(ignore)]
    pub features: Option<Arc<StopFeatures>>,
    /// One row per feature of the left image, with the columns of [`FeatureColumn`].
    #[serde(skip)]
    #[schema(ignore)]
    pub table: Unsent<Table>,
    /// One row per bootstrap set: the target's position and pixel, in [`CLOUD_COLUMNS`] columns.
    #[serde(skip)]
    #[schema(ignore)]
    pub cloud: Unsent<Table>,
}

/// Counts of step `detect`, with the stereo matches.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Detected {
    /// Features of the left image.
    pub left: usize,
    /// Features of the right image.
    pub right: usize,
    /// Number of features matched in the other image.
    pub stereo_matches: usize,
    /// Number of these with a triangulated point.
    pub points: usize,
    /// Median distance of the points from the left camera, m; null without points.
    pub median_range_m: Option<f64>,
}

/// The motion from one remembered stop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AnchorTried {
    /// The step of the remembered stop.
    pub step: usize,
    /// Number of matched points.
    pub matches: usize,
    /// Number of inliers of the motion.
    pub inliers: usize,
    /// Confidence from the number of inliers, 0 to 1.
    pub confidence: f64,
    /// Largest 1σ axis of the target's position after this motion, m; null without a motion.
    pub sigma_m: Option<f64>,
    /// Why there is no motion, as one sentence; null if there is one.
    pub missing: Option<String>,
    /// Whether the target is located from this stop.
    pub chosen: bool,
}

/// The matches with the features of an earlier stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MatchedFeatures {
    /// The step of the earlier stop.
    pub from_step: usize,
    /// Number of points of the earlier stop.
    pub then: usize,
    /// Number of points of this stop.
    pub now: usize,
    /// Number of matches between the two stops.
    pub matches: usize,
    /// Whether the prior was dropped because too few matches were consistent with the pose estimates.
    #[serde(default)]
    pub prior_given_up: bool,
}

/// The rigid motion since the earlier stop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct FittedMotion {
    /// Translation: the earlier rover frame's origin in the current one, m.
    pub translation_m: [f64; 3],
    /// Rotation from the earlier rover frame to the current one: roll, pitch and yaw, deg.
    pub roll_pitch_yaw_deg: [f64; 3],
    /// Number of inliers.
    pub inliers: usize,
    /// RMS residual of the inliers, m.
    pub rms_m: f64,
    /// Median residual of the inliers, m.
    pub median_m: f64,
    /// Number of inliers of each hypothesis.
    pub consensus_by_draw: Vec<u32>,
    /// The refits of the motion until the set of inliers no longer changed.
    pub refits: Vec<Refit>,
    /// Distance between the target moved by the motion and the prediction, m.
    pub correction_m: f64,
}

impl FittedMotion {
    /// The rigid transform from the earlier rover frame to the current one.
    pub fn now_from_then(&self) -> Pose {
        let [roll_rad, pitch_rad, yaw_rad] = self.roll_pitch_yaw_deg.map(f64::to_radians);
        MotionParameters { translation_m: self.translation_m, roll_rad, pitch_rad, yaw_rad }.to_pose()
    }
}

/// The covariance of the motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Bootstrapped {
    /// Number of bootstrap sets.
    pub sets: usize,
    /// Covariance of translation (m) and roll, pitch, yaw (rad).
    #[schema(value_type = Vec<f64>)]
    pub covariance: SMatrix<f64, 6, 6>,
    /// 1σ of each coordinate of the translation, m.
    pub sigma_translation_m: [f64; 3],
    /// 1σ of each angle, deg.
    pub sigma_rotation_deg: [f64; 3],
}

/// A table of numbers, row-major.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Number of columns.
    pub columns: u32,
    /// All rows; NaN for a missing number.
    pub values: Vec<f32>,
}

/// The columns of [`FeatureEvidence::table`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum FeatureColumn {
    /// Column of the feature in the left image, px.
    X,
    /// Its row, px.
    Y,
    /// Its scale, px.
    Sigma,
    /// Its orientation, rad, clockwise on screen from +x.
    Orientation,
    /// Column of its match in the right image, px.
    RightX,
    /// Its row, px.
    RightY,
    /// Distance from the left camera, m.
    Range,
    /// Column of its match in the left image of the earlier stop, px.
    ThenX,
    /// Its row, px.
    ThenY,
    /// Column of the earlier point, moved by the motion, in the current left image, px.
    MovedX,
    /// Its row, px.
    MovedY,
    /// Distance between the two points after the motion, m.
    Residual,
    /// 1 for an inlier of the motion, 0 for an outlier.
    Inlier,
}

impl FeatureColumn {
    /// Number of columns.
    pub const COUNT: usize = Self::Inlier as usize + 1;
}

/// The columns of [`FeatureEvidence::cloud`]: the target's position in the rover frame, m, and its pixel in the left image.
pub const CLOUD_COLUMNS: usize = 5;

impl<'a> From<&'a Table> for ArrayView<'a> {
    fn from(table: &'a Table) -> Self {
        Self::new(table.columns, &table.values)
    }
}

impl FeatureEvidence {
    /// The stages of this evidence, in running order and at their paths in it.
    pub(in crate::locate) fn stages() -> Vec<Stage<Self>> {
        vec![
            Stage::of("detect", "Which features do the two images have?", |e: &Self| e.detect.as_ref())
                .with(|e| Some(e), Self::declare_features)
                .at("detect"),
            Stage::of(
                "match_features",
                "Which features match in the right image and at an earlier stop?",
                |e: &Self| e.match_features.as_ref(),
            )
            .at("match_features"),
            Stage::of("fit_motion", "Which rigid transform has the most inliers?", |e: &Self| {
                e.fit_motion.as_ref()
            })
            .at("fit_motion"),
            Stage::of("bootstrap", "How certain is that transform?", |e: &Self| e.bootstrap.as_ref())
                .with(|e| Some(e), Self::declare_cloud)
                .at("bootstrap"),
        ]
    }

    /// Declares the arrays of `detect`.
    fn declare_features(r: &mut Declaration<Self>) {
        r.array(
            "features",
            ArrayKind::Table,
            "The features of the left image, a row each: position, scale, orientation, partners and residual",
            |e| e.table.view(),
        );
    }

    /// Declares the arrays of `bootstrap`.
    fn declare_cloud(r: &mut Declaration<Self>) {
        r.array(
            "cloud",
            ArrayKind::Table,
            "Target positions of the bootstrap sets, a row each: position in the rover frame and pixel",
            |e| e.cloud.view(),
        );
    }
}

impl Record for Detected {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("left", Unit::One, |d| d.left).describe("Number of features of the left image.");
        r.quantity("right", Unit::One, |d| d.right).describe("Number of features of the right image.");
        r.quantity("stereo_matches", Unit::One, |d| d.stereo_matches)
            .describe("Number of features matched in the other image.");
        r.quantity("points", Unit::One, |d| d.points).describe("Number of triangulated features.");
        r.quantity("median_range_m", Unit::Metre, |d| d.median_range_m)
            .describe("Median distance of the points from the left camera.");
    }
}

impl Record for MatchedFeatures {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("from_step", Unit::One, |m| m.from_step).describe("The earlier stop.");
        r.quantity("then", Unit::One, |m| m.then).describe("Number of points of the earlier stop.");
        r.quantity("now", Unit::One, |m| m.now).describe("Number of points of this stop.");
        r.quantity("matches", Unit::One, |m| m.matches).describe("Number of matches of the two.");
        r.quantity("prior_given_up", Unit::One, |m| m.prior_given_up)
            .describe("Whether the prior was dropped because too few matches were consistent with it.");
    }
}

impl Record for FittedMotion {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("translation_m", Unit::Metre, |m| m.translation_m)
            .describe("Translation: the earlier rover frame's origin in the present one.");
        r.quantity("roll_pitch_yaw_deg", Unit::Degree, |m| m.roll_pitch_yaw_deg)
            .describe("Roll, pitch and yaw.");
        r.quantity("inliers", Unit::One, |m| m.inliers).describe("Number of inliers.");
        r.quantity("rms_m", Unit::Metre, |m| m.rms_m).describe("RMS residual of the inliers.");
        r.quantity("median_m", Unit::Metre, |m| m.median_m).describe("Median residual of the inliers.");
        r.quantity("correction_m", Unit::Metre, |m| m.correction_m)
            .describe("Distance between the target moved by the motion and the prediction.");
    }
}

impl Record for Bootstrapped {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("sets", Unit::One, |b| b.sets).describe("Number of bootstrap sets.");
        r.quantity("sigma_translation_m", Unit::Metre, |b| b.sigma_translation_m)
            .describe("Standard deviation of each coordinate of the translation.");
        r.quantity("sigma_rotation_deg", Unit::Degree, |b| b.sigma_rotation_deg)
            .describe("Standard deviation of roll, pitch and yaw.");
    }
}

/// Names of the arrays of this stage that a panel draws individually.
impl ArrayName {
    /// The features of the left image: a row each, with the columns of [`FeatureColumn`].
    pub const FEATURES: Self = Self::new("features");
    /// Target positions of the bootstrap: a row each, position and pixel.
    pub const CLOUD: Self = Self::new("cloud");
}
