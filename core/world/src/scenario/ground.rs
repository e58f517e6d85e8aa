//! The ground: relief, rocks and their texture.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::range::within;
use sightline_geometry::error::{Error, Result};

/// Largest number of individually placed rocks.
const PLACED_LIMIT: usize = 1000;

/// The relief of the ground: a fractal height field on a regular grid, a plane beyond it, and level ground far away.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TerrainSettings {
    /// Side of a cell of the height field, m (0.01 to 0.10; ours).
    pub cell_m: f64,
    /// RMS height difference between points 1 m apart, m (0.02: domain.md 10.4).
    pub rms_at_1m_m: f64,
    /// Hurst exponent: the RMS difference grows as distance to this power (0.8: domain.md 10.4).
    pub hurst: f64,
    /// The longest wavelength of the relief, m; beyond it the ground is level on average (ours).
    pub longest_wavelength_m: f64,
    /// Slope of the mean plane, deg (6 to 10 is a shallow incline, 15 to 20 a steep one: Kim09 §5.5).
    pub slope_deg: f64,
    /// Direction of steepest ascent, deg clockwise from above: 0 ahead, 90 to the right, 180 behind.
    pub slope_azimuth_deg: f64,
    /// Distance from the first stop to the end of the slope, m; beyond it the ground returns to the mean level, so
    /// that the horizon is level (60, ours: beyond the surroundings of a target at 10 m).
    pub slope_reach_m: f64,
    /// Height of sand ripples from trough to crest, m; 0 = none (ours; on Meridiani 0.01 to 0.05).
    pub ripple_height_m: f64,
    /// Mean spacing of the ripple crests, m (ours).
    pub ripple_wavelength_m: f64,
    /// Direction across the crests, deg clockwise from above, 0 ahead.
    pub ripple_azimuth_deg: f64,
}

impl Default for TerrainSettings {
    fn default() -> Self {
        Self {
            cell_m: 0.02,
            rms_at_1m_m: 0.02,
            hurst: 0.8,
            longest_wavelength_m: 6.0,
            slope_deg: 0.0,
            slope_azimuth_deg: 0.0,
            slope_reach_m: 60.0,
            ripple_height_m: 0.0,
            ripple_wavelength_m: 0.5,
            ripple_azimuth_deg: 0.0,
        }
    }
}

/// The kinds of rocks (`ground/shape.rs`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum RockShape {
    /// Broken rock with facets of all directions.
    Angular,
    /// A box with chamfered edges; a placed one has a flat face in the direction `yaw_deg`.
    #[default]
    Block,
    /// A low block with a flat top.
    Slab,
    /// A rounded rock.
    Cobble,
}

/// A rock at a position that the scenario gives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PlacedRock {
    /// Position relative to the targets' centre, m ahead.
    pub x_m: f64,
    /// Position relative to the targets' centre, m to the right.
    pub y_m: f64,
    /// Width across the direction that its face points in, m.
    pub diameter_m: f64,
    /// Height above the ground, m.
    pub height_m: f64,
    /// Direction that its face points in, deg clockwise from above: 0 ahead, 180 towards the rover.
    #[serde(default = "towards_the_rover_deg")]
    pub yaw_deg: f64,
    /// Kind of rock.
    #[serde(default)]
    pub shape: RockShape,
}

fn towards_the_rover_deg() -> f64 {
    180.0
}

/// A strip without high rocks from the first stop to a point near the targets' centre, for commanded drives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ClearPath {
    /// End of the strip for the rover frame's origin relative to the targets' centre, m along x of the site (−2: a standoff).
    pub to_x_m: f64,
    /// The same along y of the site, m (0).
    pub to_y_m: f64,
    /// Half of the strip's width, m (1.2: half of the wheel track, and room for arcs and for a moving goal; ours).
    pub half_width_m: f64,
    /// Height of the highest rock that remains in the strip, m (0.10: Kim09 §6).
    pub above_m: f64,
}

impl Default for ClearPath {
    fn default() -> Self {
        Self { to_x_m: -2.0, to_y_m: 0.0, half_width_m: 1.2, above_m: 0.10 }
    }
}

impl ClearPath {
    fn validate(&self) -> Result<()> {
        within("rocks.clear_path.to_x_m", self.to_x_m, -100.0, 100.0)?;
        within("rocks.clear_path.to_y_m", self.to_y_m, -100.0, 100.0)?;
        within("rocks.clear_path.half_width_m", self.half_width_m, 0.1, 10.0)?;
        within("rocks.clear_path.above_m", self.above_m, 0.0, 2.0)
    }
}

/// Rocks by the size distribution of Golombek & Rapp, a cluster near the targets' centre, and individually placed
/// ones.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RockSettings {
    /// Fraction k of the area that rocks cover (0.09; Spirit's plain 0.05, Pathfinder 0.19: domain.md 10.2).
    pub area_fraction: f64,
    /// Diameter of the smallest rock near the approach, m; it grows with the distance from it. A pixel spans 1.6 mm
    /// at 2 m and 8 mm at 10 m (ours: a pebble of 2 cm).
    pub smallest_m: f64,
    /// Diameter of the largest rock, m (ours: a boulder).
    pub largest_m: f64,
    /// Distance ahead of the first stop up to which rocks are scattered, m (ours).
    pub farthest_m: f64,
    /// Mean ratio of height above ground to diameter, for large rocks (0.5: domain.md 10.3, Viking 2; Viking 1
    /// 0.365).
    pub height_ratio: f64,
    /// Constant added to every rock's mean height, m (0.008: domain.md 10.3).
    pub height_offset_m: f64,
    /// Number of rocks in the cluster around the targets' centre (ours).
    pub cluster_count: u32,
    /// Radius of the cluster, m (ours).
    pub cluster_radius_m: f64,
    /// Diameter of the smallest rock of the cluster, m (ours).
    pub cluster_smallest_m: f64,
    /// Diameter of the largest rock of the cluster, m (ours: a rock worth driving to).
    pub cluster_largest_m: f64,
    /// Rocks at given positions; scattered rocks that overlap them are left out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub placed: Vec<PlacedRock>,
    /// Whether scattered rocks avoid the wheel paths of the planned drive (true). If false, they do not depend on the
    /// drive.
    #[serde(skip_serializing_if = "is_true")]
    pub off_planned_drive: bool,
    /// A strip from which scattered rocks are removed (none); placed rocks remain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clear_path: Option<ClearPath>,
}

// `serde` passes a reference.
#[expect(clippy::trivially_copy_pass_by_ref)]
const fn is_true(value: &bool) -> bool {
    *value
}

impl Default for RockSettings {
    fn default() -> Self {
        Self {
            area_fraction: 0.09,
            smallest_m: 0.02,
            largest_m: 1.0,
            farthest_m: 100.0,
            height_ratio: 0.5,
            height_offset_m: 0.008,
            cluster_count: 14,
            cluster_radius_m: 1.3,
            cluster_smallest_m: 0.25,
            cluster_largest_m: 0.9,
            placed: Vec::new(),
            off_planned_drive: true,
            clear_path: None,
        }
    }
}

/// Albedo and micro-relief.
///
/// Contrast on Mars is low: in windows of 21 × 21 px, standard deviation over mean has the median 0.04 to 0.05 in
/// Opportunity's navcam images of sol 4087 and 0.045 to 0.085 in Spirit's of sols 1869 and 1907; power falls as
/// f^−1.7 to f^−2.8 (`experiments/src/picture.rs`). With the defaults, images of soil are in these ranges.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TextureSettings {
    /// Mean albedo of the soil.
    pub soil_albedo: f64,
    /// Mean albedo of the rocks; individual rocks differ by 15 % (1σ).
    pub rock_albedo: f64,
    /// Standard deviation of the albedo within one surface, relative, all octaves together.
    pub albedo_std: f64,
    /// β of the albedo's power spectrum f^−β in two dimensions (2.1: about equal contrast in every octave; ours).
    pub spectrum_slope: f64,
    /// Fraction of the soil covered by grains of 2 to 18 mm, 0 to 0.4 (ours).
    pub grain_cover: f64,
    /// Fraction of the soil covered by smooth drifts of dust, 0 to 0.9 (ours).
    pub drift_cover: f64,
    /// Standard deviation of one component of the soil's micro-slope, m/m, all octaves together.
    pub soil_slope_std: f64,
    /// The same for rocks.
    pub rock_slope_std: f64,
    /// Dust cover of an upward-facing rock face, as a fraction of the soil's albedo, 0 to 1.
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
            rock_albedo: 0.23,
            albedo_std: 0.05,
            spectrum_slope: 2.1,
            grain_cover: 0.15,
            drift_cover: 0.25,
            soil_slope_std: 0.08,
            rock_slope_std: 0.25,
            dust: 0.45,
            longest_m: 0.4,
            shortest_m: 0.0015,
        }
    }
}

impl TerrainSettings {
    pub(crate) fn validate(&self) -> Result<()> {
        within("terrain.cell_m", self.cell_m, 0.01, 0.10)?;
        within("terrain.rms_at_1m_m", self.rms_at_1m_m, 0.0, 0.2)?;
        within("terrain.hurst", self.hurst, 0.1, 1.5)?;
        within("terrain.longest_wavelength_m", self.longest_wavelength_m, 0.1, 50.0)?;
        within("terrain.slope_deg", self.slope_deg, 0.0, 35.0)?;
        within("terrain.slope_azimuth_deg", self.slope_azimuth_deg, -360.0, 360.0)?;
        within("terrain.slope_reach_m", self.slope_reach_m, 30.0, 10_000.0)?;
        within("terrain.ripple_height_m", self.ripple_height_m, 0.0, 0.3)?;
        // A crest needs eight vertices; otherwise the grid would determine its shape.
        let least_m = if self.ripple_height_m > 0.0 { 8.0 * self.cell_m } else { 0.01 };
        within("terrain.ripple_wavelength_m", self.ripple_wavelength_m, least_m, 20.0)?;
        within("terrain.ripple_azimuth_deg", self.ripple_azimuth_deg, -360.0, 360.0)
    }
}

impl PlacedRock {
    fn validate(&self) -> Result<()> {
        within("rocks.placed.x_m", self.x_m, -100.0, 150.0)?;
        within("rocks.placed.y_m", self.y_m, -100.0, 100.0)?;
        within("rocks.placed.diameter_m", self.diameter_m, 0.02, 2.0)?;
        within("rocks.placed.height_m", self.height_m, 0.01, 2.0)?;
        within("rocks.placed.yaw_deg", self.yaw_deg, -360.0, 360.0)
    }
}

impl RockSettings {
    pub(crate) fn validate(&self) -> Result<()> {
        within("rocks.area_fraction", self.area_fraction, 0.0, 0.4)?;
        within("rocks.smallest_m", self.smallest_m, 0.02, 0.5)?;
        within("rocks.largest_m", self.largest_m, self.smallest_m * 1.01, 2.0)?;
        within("rocks.farthest_m", self.farthest_m, 1.0, 150.0)?;
        within("rocks.height_ratio", self.height_ratio, 0.1, 1.0)?;
        within("rocks.height_offset_m", self.height_offset_m, 0.0, 0.05)?;
        within("rocks.cluster_count", f64::from(self.cluster_count), 0.0, 200.0)?;
        within("rocks.cluster_radius_m", self.cluster_radius_m, 0.1, 10.0)?;
        within("rocks.cluster_smallest_m", self.cluster_smallest_m, 0.02, self.cluster_largest_m / 1.01)?;
        within("rocks.cluster_largest_m", self.cluster_largest_m, 0.03, 2.0)?;
        if self.placed.len() > PLACED_LIMIT {
            let problem = format!("has {} rocks, but may have at most {PLACED_LIMIT}", self.placed.len());
            return Err(Error::setting("rocks.placed", problem));
        }
        self.placed.iter().try_for_each(PlacedRock::validate)?;
        self.clear_path.as_ref().map_or(Ok(()), ClearPath::validate)
    }
}

impl TextureSettings {
    pub(crate) fn validate(&self) -> Result<()> {
        within("texture.soil_albedo", self.soil_albedo, 0.02, 0.9)?;
        within("texture.rock_albedo", self.rock_albedo, 0.02, 0.9)?;
        within("texture.albedo_std", self.albedo_std, 0.0, 0.5)?;
        within("texture.spectrum_slope", self.spectrum_slope, 0.0, 5.0)?;
        within("texture.grain_cover", self.grain_cover, 0.0, 0.4)?;
        within("texture.drift_cover", self.drift_cover, 0.0, 0.9)?;
        within("texture.soil_slope_std", self.soil_slope_std, 0.0, 1.0)?;
        within("texture.rock_slope_std", self.rock_slope_std, 0.0, 1.0)?;
        within("texture.dust", self.dust, 0.0, 1.0)?;
        within("texture.longest_m", self.longest_m, 0.01, 10.0)?;
        within("texture.shortest_m", self.shortest_m, 0.0005, self.longest_m)
    }
}
