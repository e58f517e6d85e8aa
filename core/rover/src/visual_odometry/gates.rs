//! The gates of an odometry update: a value beyond its limit rejects the update.
//!
//! | gate | value | source |
//! |---|---|---|
//! | `odometry_inliers` | inliers of the motion | domain.md 9.2, step 8 |
//! | `odometry_inlier_share` | inliers over all matches | ours |
//! | `odometry_chi2` | χ² per degree of freedom of the residuals | domain.md 9.2, step 8 |
//! | `odometry_sigma_m` | largest 1σ axis of the translation | ours |
//! | `odometry_translation_m` | distance from the translation by wheel odometry | domain.md 9.2, step 8 |
//! | `odometry_attitude_deg` | angle from the rotation by gyro and accelerometers | domain.md 9.2, step 8 |
//! | `odometry_ambiguity` | inliers of another motion over those of the best | ours |
//! | `odometry_repetition` | score of another displacement along the motion over that of the motion | ours |
//!
//! Numbers continue those of the trackers (`locate::gate_kinds`).

use nalgebra::Matrix6;

use sightline_geometry::frames::Pose;
use sightline_track::gate::{Gate, GateKind, Side, Unit};

use super::motion::Fitted;
use super::settings::OdometrySettings;

/// Minimum of the allowed distance between the translations by vision and by wheels, m.
const TRANSLATION_MIN_M: f64 = 0.05;

const fn kind(number: u8, name: &'static str, label: &'static str, unit: Unit, side: Side) -> GateKind {
    GateKind { number, name, label, unit, side, setting: None }
}

const INLIERS: GateKind = kind(40, "odometry_inliers", "inliers", Unit::One, Side::AtLeast);
const INLIER_SHARE: GateKind = kind(41, "odometry_inlier_share", "inlier share", Unit::One, Side::AtLeast);
const CHI2: GateKind = kind(42, "odometry_chi2", "χ² per degree of freedom", Unit::One, Side::AtMost);
const SIGMA: GateKind = kind(43, "odometry_sigma_m", "σ of the translation", Unit::Metre, Side::AtMost);
const TRANSLATION: GateKind =
    kind(44, "odometry_translation_m", "translation against the wheels", Unit::Metre, Side::AtMost);
const ATTITUDE: GateKind =
    kind(45, "odometry_attitude_deg", "turn against the gyro", Unit::Degree, Side::AtMost);
const AMBIGUITY: GateKind = kind(46, "odometry_ambiguity", "ambiguity", Unit::One, Side::AtMost);
const REPETITION: GateKind = kind(47, "odometry_repetition", "repetition", Unit::One, Side::AtMost);

/// All gates, in order of evaluation.
pub(super) static KINDS: [GateKind; 8] =
    [INLIERS, INLIER_SHARE, CHI2, SIGMA, TRANSLATION, ATTITUDE, AMBIGUITY, REPETITION];

/// All gates of an update, with names and labels.
pub fn gate_kinds() -> &'static [GateKind] {
    &KINDS
}

/// Inputs of the gates.
pub(super) struct Judged<'a> {
    pub(super) predicted: &'a Pose,
    pub(super) fitted: Option<&'a Fitted>,
    pub(super) covariance: Option<&'a Matrix6<f64>>,
    pub(super) matches: usize,
    pub(super) ambiguity: f64,
    pub(super) repetition: f64,
}

/// Evaluates all gates; without a motion they have no value and fail.
pub(super) fn judge(judged: &Judged<'_>, settings: &OdometrySettings) -> Vec<Gate> {
    let Judged { predicted, fitted, covariance, matches, ambiguity, repetition } = judged;
    let named = |kind: GateKind, setting: &'static str, value: Option<f64>, limit: f64| {
        GateKind { setting: Some(setting), ..kind }.judge(value, limit)
    };
    let inliers = fitted.map(|fitted| fitted.inliers.len() as f64);
    let motion = fitted.map(|fitted| fitted.after_from_before);
    let displacement = |pose: &Pose| pose.inverse().translation.vector;
    let wheels = displacement(predicted);
    let apart_m = motion.map(|motion| (displacement(&motion) - wheels).norm());
    let turned_deg = motion.map(|motion| motion.rotation.angle_to(&predicted.rotation).to_degrees());
    let sigma_m = covariance.map(|covariance| {
        covariance.fixed_view::<3, 3>(0, 0).into_owned().symmetric_eigenvalues().max().max(0.0).sqrt()
    });
    vec![
        named(INLIERS, "inliers_min", inliers, f64::from(settings.inliers_min)),
        named(
            INLIER_SHARE,
            "inlier_share_min",
            inliers.map(|inliers| inliers / (*matches).max(1) as f64),
            settings.inlier_share_min,
        ),
        named(CHI2, "chi2_max", fitted.map(|fitted| fitted.chi2_per_dof), settings.chi2_max),
        named(SIGMA, "sigma_max_m", sigma_m, settings.sigma_max_m),
        named(TRANSLATION, "slip_max", apart_m, settings.slip_max * wheels.norm() + TRANSLATION_MIN_M),
        named(ATTITUDE, "attitude_max_deg", turned_deg, settings.attitude_max_deg),
        named(AMBIGUITY, "ambiguity_max", fitted.map(|_| *ambiguity), settings.ambiguity_max),
        named(REPETITION, "repetition_max", fitted.map(|_| *repetition), settings.repetition_max),
    ]
}
