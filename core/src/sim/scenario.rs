//! The scenario: every number from which a simulated traverse follows, read from and written to TOML.
//!
//! A field that is left out takes its default; a field that does not exist is refused by name. Two equal
//! scenarios give the same bits. Defaults describe a Spirit-like rover on a plain with the rock abundance
//! of Gusev's rockier places; none may be chosen by looking at a tracker's result.
//!
//! Frames: the site frame is level (+z down), its x axis is the direction of the drive, its origin lies on
//! the mean ground below which the first stop's middle wheels stand, 0.294 m above the mean plane: where the
//! rover frame of a rover on flat ground would be. Angles of the sun are measured in it (domain.md 1.5).
//! Sources: domain.md 2.1 (block average), 5.1 (detector), 5.5 (odometry), 10 (rocks, ground), 11 (light,
//! sensor); papers.md R21 (window rule), R104–R106 (steps), R227 (seeds).

use std::path::Path;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::error::{Error, Result};
use crate::traverse::OdometryError;

/// Every number from which a simulated traverse follows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// A short name.
    pub name: String,
    /// The seed of everything random: relief, rocks, texture, pose errors, noise, choice of targets.
    pub seed: u64,
    /// The relief of the ground.
    pub terrain: TerrainSettings,
    /// How many rocks of which size.
    pub rocks: RockSettings,
    /// Albedo and micro-relief of soil and rock.
    pub texture: TextureSettings,
    /// The sun and the sky.
    pub sun: SunSettings,
    /// The detector and the optics.
    pub camera: CameraSettings,
    /// The way that the rover drives.
    pub drive: DriveSettings,
    /// 1σ errors of the pose estimate, step by step (default 1 % along, 0.5 % across, 0.1°: domain.md 5.5).
    pub odometry_error: OdometryError,
    /// The rule that chooses the targets.
    pub targets: TargetRule,
}

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

/// The sun, with hard shadows, and the light of the sky.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SunSettings {
    /// Where the sun stands, deg, clockwise from above, 0 straight ahead of the drive, 90 on the right.
    pub azimuth_deg: f64,
    /// Its height above the horizon, deg.
    pub elevation_deg: f64,
    /// The sky's part of the light on level ground (0.35: optical depth 0.4, sun at 45°, domain.md 11.1).
    pub diffuse_fraction: f64,
    /// L of the lunar–Lambert law, 0 = Lambert (0.5: domain.md 11.2).
    pub lunar_lambert: f64,
}

impl Default for SunSettings {
    fn default() -> Self {
        Self { azimuth_deg: 115.0, elevation_deg: 42.0, diffuse_fraction: 0.35, lunar_lambert: 0.5 }
    }
}

/// The detector and the optics (domain.md 5.1 and 11.3).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CameraSettings {
    /// Side of the square image, px: 1024, 512, 256 or 128; smaller ones are block averages (domain.md 2.1).
    pub image_size: u32,
    /// σ of the optics' Gaussian blur, px of the image (0.5–0.7: domain.md 11.3).
    pub blur_px: f64,
    /// Samples along each axis of a pixel, 1 to 8; the pixel's value is their mean over its area.
    pub samples_per_axis: u32,
    /// Bits of a recorded pixel: 12, or 8 (the 12-bit number scaled down).
    pub bit_depth: u32,
    /// Electrons per number of the 12-bit converter (42: 170 ke⁻ / 4095).
    pub gain_electrons_per_dn: f64,
    /// Read noise, electrons (30).
    pub read_noise_electrons: f64,
    /// Number that the converter gives in the dark, DN of 12 bits (20).
    pub bias_dn: f64,
    /// Pixel-to-pixel spread of the response, relative, fixed for each camera (0.01).
    pub response_spread: f64,
    /// Mean of the first left image, fraction of full scale; the exposure is then kept for all images (ours).
    pub mean_level: f64,
}

impl Default for CameraSettings {
    fn default() -> Self {
        Self {
            image_size: 1024,
            blur_px: 0.6,
            samples_per_axis: 4,
            bit_depth: 12,
            gain_electrons_per_dn: 42.0,
            read_noise_electrons: 30.0,
            bias_dn: 20.0,
            response_spread: 0.01,
            mean_level: 0.4,
        }
    }
}

/// The straight approach: distances follow `start · (1 − step)^i` until `end` is reached (R104, R106).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct DriveSettings {
    /// Distance from the centre of the left camera to the targets' centre at the first stop, m (10: R108).
    pub start_distance_m: f64,
    /// The last stop is the first one at this distance or nearer, m (2: R106).
    pub end_distance_m: f64,
    /// Part of the remaining distance that a step takes away (0.10: R104).
    pub step_fraction: f64,
    /// 1σ error of each mast angle, deg; the index gives the measured angles, its truth the real cameras
    /// (0 by default; 0.05 is plausible: domain.md 4.5).
    pub pointing_error_deg: f64,
}

impl Default for DriveSettings {
    fn default() -> Self {
        Self { start_distance_m: 10.0, end_distance_m: 2.0, step_fraction: 0.10, pointing_error_deg: 0.0 }
    }
}

/// The rule that chooses targets; `targets.rs` states it in full.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct TargetRule {
    /// How many targets.
    pub count: u32,
    /// Greatest distance of a target's surface point from the targets' centre, m.
    pub radius_m: f64,
    /// Side of the square window on which the rule is tested, px of this image (21: R21; reduce it together
    /// with the image, 11 at 512 and 7 at 256, or few windows are even enough).
    pub window_px: u32,
    /// Greatest part of the window in shadow (0.20: R21).
    pub shadow_fraction: f64,
    /// Greatest range of depth inside the window, as a part of the distance (0.10: R21).
    pub depth_range_fraction: f64,
    /// Whether targets must lie on rocks, off their occluding boundaries (true: R20).
    pub on_rocks: bool,
    /// Least part of the window that lies on the same rock as the target (0.90, ours).
    pub same_rock_fraction: f64,
    /// Greatest angle between normal and line of sight, at the first and at the last stop, in 90 % of the window,
    /// degrees (70, ours): a face that turns its edge to the rover is no place to drive to.
    pub incidence_deg: f64,
}

impl Default for TargetRule {
    fn default() -> Self {
        Self {
            count: 20,
            radius_m: 1.6,
            window_px: 21,
            shadow_fraction: 0.20,
            depth_range_fraction: 0.10,
            on_rocks: true,
            same_rock_fraction: 0.90,
            incidence_deg: 70.0,
        }
    }
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            name: "rocky plain".into(),
            seed: 1,
            terrain: TerrainSettings::default(),
            rocks: RockSettings::default(),
            texture: TextureSettings::default(),
            sun: SunSettings::default(),
            camera: CameraSettings::default(),
            drive: DriveSettings::default(),
            odometry_error: OdometryError { along_fraction: 0.01, across_fraction: 0.005, attitude_deg: 0.1 },
            targets: TargetRule::default(),
        }
    }
}

impl Scenario {
    /// The scenario of the demonstration: a 10 m to 2 m straight approach over a rocky plain.
    pub fn demo() -> Self {
        Self { name: "straight approach, rocky plain".into(), ..Self::default() }
    }

    /// Reads and checks a scenario; `path` only names the culprit in the message.
    pub fn from_toml(text: &str, path: &Path) -> Result<Self> {
        let scenario: Self =
            toml::from_str(text).map_err(|problem| Error::format(path, problem.to_string()))?;
        scenario.validate()?;
        Ok(scenario)
    }

    /// The scenario as TOML, every field written.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scenario_survives_toml() {
        let mut scenario = Scenario::demo();
        scenario.sun.azimuth_deg = -33.25;
        let read = Scenario::from_toml(&scenario.to_toml(), Path::new("scenario.toml"));
        assert_eq!(read.unwrap(), scenario);
    }

    #[test]
    fn what_is_left_out_takes_its_default() {
        let read =
            Scenario::from_toml("seed = 9\n[sun]\nelevation_deg = 20.0\n", Path::new("s.toml")).unwrap();
        assert_eq!((read.seed, read.sun.elevation_deg), (9, 20.0));
        assert_eq!(read.rocks, RockSettings::default());
    }

    #[test]
    fn unknown_and_impossible_settings_are_refused_by_name() {
        let refused =
            |text: &str| Scenario::from_toml(text, Path::new("s.toml")).expect_err("refused").to_string();
        assert!(refused("[sun]\nheight_deg = 3.0\n").contains("height_deg"));
        assert!(refused("[sun]\nelevation_deg = -3.0\n").contains("sun.elevation_deg"));
        assert!(refused("[camera]\nimage_size = 1000\n").contains("camera.image_size"));
        assert!(refused("[drive]\nend_distance_m = nan\n").contains("drive.end_distance_m"));
    }
}
