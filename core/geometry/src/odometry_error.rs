//! The error model of the pose estimates of wheel odometry and inertial measurement.

use nalgebra::Matrix6;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// The error model of the pose estimate, by which `predict` increases the covariance (domain.md 5.5).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct OdometryError {
    /// 1σ error along the driven direction, as a fraction of the distance driven.
    pub along_fraction: f64,
    /// 1σ error across the driven direction, as a fraction of the distance driven.
    pub across_fraction: f64,
    /// 1σ error of each attitude angle per step, deg.
    pub attitude_deg: f64,
}

/// The error of the change of the pose estimate from one stop to the next.
#[derive(Clone, Debug, PartialEq)]
pub enum PoseChangeError {
    /// By the error model of wheels, gyro and accelerometers.
    Modelled(OdometryError),
    /// The covariance of a small motion (translation in m, rotation in rad) about the rover's origin, applied after
    /// the change; rover frame after.
    Measured(Box<Matrix6<f64>>),
}

impl Default for OdometryError {
    fn default() -> Self {
        Self { along_fraction: 0.02, across_fraction: 0.02, attitude_deg: 0.2 }
    }
}
