//! The parameters of a registration, with their defaults and sources.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::mesh::MeshSettings;
use super::nelder_mead::SimplexSettings;
use sightline_geometry::estimate::weighted_motion::Loss;

/// How the motion is refined.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// As in the paper.
    #[default]
    SimplexL1,
    /// Robust least squares along the normals.
    PointToPlane,
}

/// The modern method's parameters.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PlaneSettings {
    /// Most steps.
    pub steps_max: u32,
    /// Ends below this shift, m, and this turn, rad.
    pub small: f64,
    /// How the weight of a pixel falls off with its residual.
    pub loss: Loss,
}

impl Default for PlaneSettings {
    fn default() -> Self {
        Self { steps_max: 40, small: 1e-5, loss: Loss::Cauchy }
    }
}

/// How surfaces are registered.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ShapeSettings {
    /// How meshes are made.
    pub mesh: MeshSettings,
    /// Pixels of a side of the virtual sensor.
    pub sensor_px: usize,
    /// What the sensor spans beyond the rock, as a share of its half width: ground holds the rock's height and tilt.
    pub margin: f64,
    /// How far the coarse search goes to each side, m; none: half the rock's width.
    pub search_half_range_m: Option<f64>,
    /// Least share of the fixed surface's pixels that both surfaces must cover.
    pub overlap_min: f64,
    /// Half the side of the windows whose planes give the normals, px.
    pub normal_radius_px: usize,
    /// What a surface misses that the noise of its points does not tell, 1σ along the normal, m: facets, and the window of
    /// stereo. Counts where noise is known.
    pub model_sigma_m: f64,
    /// Error of the target that all pixels share, 1σ on each axis, m: stereo's window makes what is convex smaller.
    pub common_sigma_m: f64,
    /// How the motion is refined.
    pub method: Method,
    /// The paper's method.
    pub simplex: SimplexSettings,
    /// The modern one.
    pub plane: PlaneSettings,
    /// When the result is not to be used.
    pub checks: CheckSettings,
}

impl Default for ShapeSettings {
    /// 40 % overlap (R196), search by half the rock's width (R200), Nelder–Mead (R201); the rest is ours. The shared error is
    /// fitted on rocks whose points a window of 2 to 3 cm smooths (docs/shape.md).
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

/// When a registration is not to be used; all ours.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CheckSettings {
    /// Triangles that a surface needs at least.
    pub triangles_min: usize,
    /// Largest 1σ of the target in its weakest direction, m.
    pub sigma_max_m: f64,
    /// How many times the surfaces may differ as much as their noise explains.
    pub misfit_max: f64,
    /// How far the refinement may turn from the start, rad.
    pub turn_max_rad: f64,
    /// How far two minima of the coarse surface must be apart to be two, as a share of the half width.
    pub apart: f64,
    /// By what factor the other minimum must be higher than the best.
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
