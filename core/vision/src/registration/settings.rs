//! The parameters of a registration, with their defaults and sources.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::mesh::MeshSettings;
use super::nelder_mead::SimplexSettings;
use sightline_geometry::estimate::weighted_motion::Loss;

/// Method of refining the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Nelder–Mead on the mean absolute difference of depth, as in the paper.
    #[default]
    SimplexL1,
    /// Robust least squares along the normals.
    PointToPlane,
}

/// Settings of the point-to-plane refinement.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlaneSettings {
    /// Largest number of steps.
    pub steps_max: u32,
    /// Stops once every component of a step is below this; m for the translation, rad for the rotation.
    pub small: f64,
    /// Robust loss: weight of a pixel as a function of its residual.
    pub loss: Loss,
}

impl Default for PlaneSettings {
    fn default() -> Self {
        Self { steps_max: 40, small: 1e-5, loss: Loss::Cauchy }
    }
}

/// Settings of the shape registration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ShapeSettings {
    /// Settings of the meshes.
    pub mesh: MeshSettings,
    /// Side of the virtual sensor's image, px.
    pub sensor_px: usize,
    /// Margin of ground around the rock in the sensor's image, as a fraction of the rock's half width; it constrains
    /// height and tilt.
    pub margin: f64,
    /// Half range of the coarse search in x and in y, m; `None`: half the rock's width.
    pub search_half_range_m: Option<f64>,
    /// Least fraction of the fixed surface's pixels that both surfaces must cover.
    pub overlap_min: f64,
    /// Half the side of the windows in which planes are fitted for the normals, px.
    pub normal_radius_px: usize,
    /// Error of a surface beyond the noise of its points (facets, smoothing by the stereo window), 1σ along the normal,
    /// m. Used only where the noise of the points is known.
    pub model_sigma_m: f64,
    /// Error of the target common to all pixels, 1σ on each axis, m: smoothing by the stereo window shrinks convex
    /// shapes.
    pub common_sigma_m: f64,
    /// Method of refining the motion.
    pub method: Method,
    /// Settings of the paper's refinement.
    pub simplex: SimplexSettings,
    /// Settings of the point-to-plane refinement.
    pub plane: PlaneSettings,
    /// Limits beyond which the result is rejected.
    pub checks: CheckSettings,
}

impl Default for ShapeSettings {
    /// 40 % overlap (R196), search by half the rock's width (R200), Nelder–Mead (R201); the rest is ours. The common
    /// error is fitted on rocks whose points are smoothed over 2 to 3 cm (docs/shape.md).
    fn default() -> Self {
        Self {
            mesh: MeshSettings::default(),
            sensor_px: 64,
            margin: 0.4,
            search_half_range_m: None,
            overlap_min: 0.4,
            normal_radius_px: 2,
            model_sigma_m: 0.002,
            common_sigma_m: 0.0008,
            method: Method::default(),
            simplex: SimplexSettings::default(),
            plane: PlaneSettings::default(),
            checks: CheckSettings::default(),
        }
    }
}

/// Limits beyond which a registration is rejected; all ours.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CheckSettings {
    /// Least number of triangles of a surface.
    pub triangles_min: usize,
    /// Largest 1σ of the target in its least constrained direction, m.
    pub sigma_max_m: f64,
    /// Largest reduced misfit: RMS residual over its predicted σ.
    pub misfit_max: f64,
    /// Largest rotation of the refinement from the start, rad.
    pub turn_max_rad: f64,
    /// Least distance between separate minima of the coarse search, as a fraction of the half width.
    pub apart: f64,
    /// Least ratio of the second minimum of J to the best one.
    pub other_min: f64,
}

impl Default for CheckSettings {
    fn default() -> Self {
        Self {
            triangles_min: 100,
            sigma_max_m: 0.02,
            misfit_max: 1.8,
            turn_max_rad: 0.15,
            apart: 0.4,
            other_min: 1.15,
        }
    }
}
