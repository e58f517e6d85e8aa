//! The result of stage 1: the predicted target at the current stop, from `predict` for all later stages.

use nalgebra::Matrix3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::Point3;

/// The predicted target at this stop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Prediction {
    /// Position in the rover frame of this stop, m.
    #[schema(value_type = [f64; 3])]
    pub position_in_rover: Point3,
    /// Position in the site frame, m.
    #[schema(value_type = [f64; 3])]
    pub position_in_site: Point3,
    /// Covariance in the rover frame, m².
    #[schema(value_type = Vec<f64>)]
    pub covariance_in_rover: Matrix3<f64>,
    /// Estimated distance driven since the last stop, m.
    pub step_length_m: f64,
    /// Estimated distance driven since the last accepted update, m.
    pub travelled_since_update_m: f64,
    /// Estimated distance driven since the designation, m.
    pub travelled_m: f64,
}
