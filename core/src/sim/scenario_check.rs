//! What a scenario's settings may be: ranges within which a world can be made, each refused by name.
//!
//! The ranges keep sizes finite and geometry possible; they say nothing of what is plausible on Mars.
//! Units are those of the fields (`scenario.rs`). Sources: ours.

use crate::error::{Error, Result};

use super::scenario::Scenario;

/// The largest seed that every reader of the file takes exactly (TOML has 63 bits, a browser 53).
const MAX_SEED: u64 = 1 << 53;

/// Refuses a value outside `[low, high]`, or one that is no number.
fn within(key: &str, value: f64, low: f64, high: f64) -> Result<()> {
    if value >= low && value <= high {
        return Ok(());
    }
    Err(Error::setting(key, format!("{value} is outside {low} to {high}")))
}

impl Scenario {
    /// Refuses settings that no world can be made of, naming the first bad one.
    pub fn validate(&self) -> Result<()> {
        if self.seed > MAX_SEED {
            return Err(Error::setting("seed", format!("{} is above 2^53", self.seed)));
        }
        self.validate_ground()?;
        self.validate_light_and_camera()?;
        self.validate_drive_and_targets()
    }

    fn validate_ground(&self) -> Result<()> {
        let (terrain, rocks, texture) = (&self.terrain, &self.rocks, &self.texture);
        within("terrain.cell_m", terrain.cell_m, 0.01, 0.10)?;
        within("terrain.rms_at_1m_m", terrain.rms_at_1m_m, 0.0, 0.2)?;
        within("terrain.hurst", terrain.hurst, 0.1, 1.5)?;
        within("terrain.longest_wavelength_m", terrain.longest_wavelength_m, 0.1, 50.0)?;
        within("rocks.area_fraction", rocks.area_fraction, 0.0, 0.4)?;
        within("rocks.smallest_m", rocks.smallest_m, 0.02, 0.5)?;
        within("rocks.largest_m", rocks.largest_m, rocks.smallest_m * 1.01, 2.0)?;
        within("rocks.farthest_m", rocks.farthest_m, 1.0, 150.0)?;
        within("rocks.height_ratio", rocks.height_ratio, 0.1, 1.0)?;
        within("rocks.cluster_count", f64::from(rocks.cluster_count), 0.0, 200.0)?;
        within("rocks.cluster_radius_m", rocks.cluster_radius_m, 0.1, 10.0)?;
        within("rocks.cluster_smallest_m", rocks.cluster_smallest_m, 0.02, rocks.cluster_largest_m / 1.01)?;
        within("rocks.cluster_largest_m", rocks.cluster_largest_m, 0.03, 2.0)?;
        within("texture.soil_albedo", texture.soil_albedo, 0.02, 0.9)?;
        within("texture.rock_albedo", texture.rock_albedo, 0.02, 0.9)?;
        within("texture.albedo_std", texture.albedo_std, 0.0, 0.5)?;
        within("texture.soil_slope_std", texture.soil_slope_std, 0.0, 1.0)?;
        within("texture.rock_slope_std", texture.rock_slope_std, 0.0, 1.0)?;
        within("texture.dust", texture.dust, 0.0, 1.0)?;
        within("texture.longest_m", texture.longest_m, 0.01, 10.0)?;
        within("texture.shortest_m", texture.shortest_m, 0.0005, texture.longest_m)
    }

    fn validate_light_and_camera(&self) -> Result<()> {
        let (sun, camera) = (&self.sun, &self.camera);
        within("sun.azimuth_deg", sun.azimuth_deg, -360.0, 360.0)?;
        within("sun.elevation_deg", sun.elevation_deg, 5.0, 90.0)?;
        within("sun.diffuse_fraction", sun.diffuse_fraction, 0.0, 1.0)?;
        within("sun.lunar_lambert", sun.lunar_lambert, 0.0, 1.0)?;
        if ![1024, 512, 256, 128].contains(&camera.image_size) {
            return Err(Error::setting("camera.image_size", "choose 1024, 512, 256 or 128"));
        }
        within("camera.blur_px", camera.blur_px, 0.0, 3.0)?;
        within("camera.samples_per_axis", f64::from(camera.samples_per_axis), 1.0, 8.0)?;
        if ![12, 8].contains(&camera.bit_depth) {
            return Err(Error::setting("camera.bit_depth", "choose 12 or 8"));
        }
        within("camera.gain_electrons_per_dn", camera.gain_electrons_per_dn, 0.1, 1000.0)?;
        within("camera.read_noise_electrons", camera.read_noise_electrons, 0.0, 1000.0)?;
        within("camera.bias_dn", camera.bias_dn, 0.0, 1000.0)?;
        within("camera.response_spread", camera.response_spread, 0.0, 0.2)?;
        within("camera.mean_level", camera.mean_level, 0.02, 0.9)
    }

    fn validate_drive_and_targets(&self) -> Result<()> {
        let (drive, error, targets) = (&self.drive, &self.odometry_error, &self.targets);
        within("drive.end_distance_m", drive.end_distance_m, 1.8, 50.0)?;
        within("drive.start_distance_m", drive.start_distance_m, drive.end_distance_m, 50.0)?;
        within("drive.step_fraction", drive.step_fraction, 0.005, 0.5)?;
        let last_m = super::drive::distances_m(drive).last().copied().unwrap_or(0.0);
        within("drive.end_distance_m (distance of the last stop)", last_m, 1.7, 50.0)?;
        within("drive.pointing_error_deg", drive.pointing_error_deg, 0.0, 5.0)?;
        within("odometry_error.along_fraction", error.along_fraction, 0.0, 1.0)?;
        within("odometry_error.across_fraction", error.across_fraction, 0.0, 1.0)?;
        within("odometry_error.attitude_deg", error.attitude_deg, 0.0, 10.0)?;
        within("targets.count", f64::from(targets.count), 0.0, 10_000.0)?;
        within("targets.radius_m", targets.radius_m, 0.05, 20.0)?;
        within("targets.window_px", f64::from(targets.window_px), 1.0, 201.0)?;
        within("targets.shadow_fraction", targets.shadow_fraction, 0.0, 1.0)?;
        within("targets.same_rock_fraction", targets.same_rock_fraction, 0.0, 1.0)?;
        within("targets.incidence_deg", targets.incidence_deg, 0.0, 90.0)?;
        within("targets.depth_range_fraction", targets.depth_range_fraction, 0.0, 10.0)
    }
}
