//! The ground: relief, rocks and their texture.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::within;
use crate::error::Result;

/// The relief of the ground: a fractal height field on a regular grid, and a plane beyond it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TerrainSettings {
    /// Side of a cell of the height field, m (0.01 to 0.10; ours).
    pub cell_m: f64,
    /// RMS difference of height between two places 1 m apart, m (0.02: domain.md 10.4).
    pub rms_at_1m_m: f64,
    /// Hurst exponent: the RMS difference grows as distance to this power (0.8: domain.md 10.4).
    pub hurst: f64,
    /// The longest wavelength of the relief, m; beyond it the ground is level on average (ours).
    pub longest_wavelength_m: f64,
}

impl Default for TerrainSettings {
    fn default() -> Self {
        Self { cell_m: 0.02, rms_at_1m_m: 0.02, hurst: 0.8, longest_wavelength_m: 6.0 }
    }
}

/// Rocks by the size distribution of Golombek & Rapp, and a cluster near the targets' centre.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RockSettings {
    /// Fraction k of the area that rocks cover (0.09; Spirit's plain 0.05, Pathfinder 0.19: domain.md 10.2).
    pub area_fraction: f64,
    /// The smallest rock near the approach, m of diameter; grows with distance from it (ours).
    pub smallest_m: f64,
    /// The largest rock, m of diameter (ours).
    pub largest_m: f64,
    /// How far rocks are scattered ahead of the first stop, m (ours).
    pub farthest_m: f64,
    /// Mean ratio of the height above ground to the diameter (0.5: domain.md 10.3, Viking 2).
    pub height_ratio: f64,
    /// Rocks of the cluster around the targets' centre (ours).
    pub cluster_count: u32,
    /// Radius of the cluster, m (ours).
    pub cluster_radius_m: f64,
    /// The smallest rock of the cluster, m of diameter (ours).
    pub cluster_smallest_m: f64,
    /// The largest rock of the cluster, m of diameter (ours: a rock worth driving to).
    pub cluster_largest_m: f64,
}

impl Default for RockSettings {
    fn default() -> Self {
        Self {
            area_fraction: 0.09,
            smallest_m: 0.04,
            largest_m: 0.6,
            farthest_m: 100.0,
            height_ratio: 0.5,
            cluster_count: 14,
            cluster_radius_m: 1.3,
            cluster_smallest_m: 0.25,
            cluster_largest_m: 0.9,
        }
    }
}

/// Albedo and micro-relief. Contrast on Mars is low: about one part in eight (ours).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TextureSettings {
    /// Mean albedo of the soil, without unit.
    pub soil_albedo: f64,
    /// Mean albedo of the rocks, without unit; each rock differs by 15 % (1σ).
    pub rock_albedo: f64,
    /// Standard deviation of the albedo within one surface, relative, all octaves together.
    pub albedo_std: f64,
    /// Standard deviation of one component of the soil's micro-slope, m/m, all octaves together.
    pub soil_slope_std: f64,
    /// The same for rocks.
    pub rock_slope_std: f64,
    /// How much of the soil's albedo lies as dust on a rock's face that looks straight up, 0 to 1.
    pub dust: f64,
    /// The longest wavelength of the texture, m.
    pub longest_m: f64,
    /// The shortest wavelength of the texture, m (below the 1.6 mm that a pixel spans at 2 m).
    pub shortest_m: f64,
}

impl Default for TextureSettings {
    fn default() -> Self {
        Self {
            soil_albedo: 0.26,
            rock_albedo: 0.19,
            albedo_std: 0.12,
            soil_slope_std: 0.12,
            rock_slope_std: 0.25,
            dust: 0.45,
            longest_m: 0.4,
            shortest_m: 0.0015,
        }
    }
}

impl TerrainSettings {
    pub(super) fn validate(&self) -> Result<()> {
        within("terrain.cell_m", self.cell_m, 0.01, 0.10)?;
        within("terrain.rms_at_1m_m", self.rms_at_1m_m, 0.0, 0.2)?;
        within("terrain.hurst", self.hurst, 0.1, 1.5)?;
        within("terrain.longest_wavelength_m", self.longest_wavelength_m, 0.1, 50.0)
    }
}

impl RockSettings {
    pub(super) fn validate(&self) -> Result<()> {
        within("rocks.area_fraction", self.area_fraction, 0.0, 0.4)?;
        within("rocks.smallest_m", self.smallest_m, 0.02, 0.5)?;
        within("rocks.largest_m", self.largest_m, self.smallest_m * 1.01, 2.0)?;
        within("rocks.farthest_m", self.farthest_m, 1.0, 150.0)?;
        within("rocks.height_ratio", self.height_ratio, 0.1, 1.0)?;
        within("rocks.cluster_count", f64::from(self.cluster_count), 0.0, 200.0)?;
        within("rocks.cluster_radius_m", self.cluster_radius_m, 0.1, 10.0)?;
        within("rocks.cluster_smallest_m", self.cluster_smallest_m, 0.02, self.cluster_largest_m / 1.01)?;
        within("rocks.cluster_largest_m", self.cluster_largest_m, 0.03, 2.0)
    }
}

impl TextureSettings {
    pub(super) fn validate(&self) -> Result<()> {
        within("texture.soil_albedo", self.soil_albedo, 0.02, 0.9)?;
        within("texture.rock_albedo", self.rock_albedo, 0.02, 0.9)?;
        within("texture.albedo_std", self.albedo_std, 0.0, 0.5)?;
        within("texture.soil_slope_std", self.soil_slope_std, 0.0, 1.0)?;
        within("texture.rock_slope_std", self.rock_slope_std, 0.0, 1.0)?;
        within("texture.dust", self.dust, 0.0, 1.0)?;
        within("texture.longest_m", self.longest_m, 0.01, 10.0)?;
        within("texture.shortest_m", self.shortest_m, 0.0005, self.longest_m)
    }
}
