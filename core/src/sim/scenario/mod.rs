//! The scenario: every number from which a simulated traverse follows, read from and written to TOML.
//!
//! A field that is left out takes its default; a field that does not exist is refused by name. Two equal
//! scenarios give the same bits. Defaults describe a Spirit-like rover on a plain with the rock abundance
//! of Gusev's rockier places; none may be chosen by looking at a tracker's result.
//!
//! Frames: the site frame is level (+z down), its x axis is the direction of the drive (unless
//! `drive.heading_deg` and `drive.start_bearing_deg` turn it away), its origin lies on
//! the mean ground below which the first stop's middle wheels stand, 0.294 m above the mean plane: where the
//! rover frame of a rover on flat ground would be. Angles of the sun are measured in it (domain.md 1.5).
//! Sources: domain.md 2.1 (block average), 5.1 (detector), 5.5 (odometry), 10 (rocks, ground), 11 (light,
//! sensor); papers.md R21 (window rule), R104–R106 (steps), R227 (seeds).

mod camera;
mod drive;
mod events;
mod fiducials;
mod ground;
mod light;
mod rover;
mod targets;

use std::path::Path;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::error::{Error, Result};
use crate::toml_text;
use crate::traverse::OdometryError;

pub use camera::{AutoExposureSettings, CameraRig, CameraSettings, ExposureMode, Quantisation};
pub use drive::{Course, DriveSettings, Move};
pub use events::{Cloud, EventSettings, Occluder};
pub use fiducials::Fiducial;
pub use ground::{PlacedRock, RockSettings, RockShape, TerrainSettings, TextureSettings};
pub use light::{Reflectance, SunSettings};
pub use rover::{ForcedSlip, HeadingJump, OdometryModel, RoverSettings, Soil};
pub use targets::{Arrangement, TargetRule};

/// The largest seed that every reader of the file takes exactly (TOML has 63 bits, a browser 53).
const MAX_SEED: u64 = 1 << 53;

/// Refuses a value outside `[low, high]`, or one that is no number.
fn within(key: &str, value: f64, low: f64, high: f64) -> Result<()> {
    if value >= low && value <= high {
        return Ok(());
    }
    Err(Error::setting(key, format!("{value} is outside {low} to {high}")))
}

/// Every number from which a simulated traverse follows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// A short name.
    pub name: String,
    /// What it stages, from which source, and what had to be assumed.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub description: String,
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
    /// The rover's wheels, its sense of place and its tracks.
    pub rover: RoverSettings,
    /// What changes during the drive.
    pub events: EventSettings,
    /// Marks of known shape.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub fiducials: Vec<Fiducial>,
    /// 1σ errors of the pose estimate, step by step (default 1 % along, 0.5 % across, 0.1°: domain.md 5.5).
    pub odometry_error: OdometryError,
    /// The rule that chooses the targets.
    pub targets: TargetRule,
}

impl Default for Scenario {
    fn default() -> Self {
        Self {
            name: "rocky plain".into(),
            description: String::new(),
            seed: 1,
            terrain: TerrainSettings::default(),
            rocks: RockSettings::default(),
            texture: TextureSettings::default(),
            sun: SunSettings::default(),
            camera: CameraSettings::default(),
            drive: DriveSettings::default(),
            rover: RoverSettings::default(),
            events: EventSettings::default(),
            fiducials: Vec::new(),
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

    /// Reads and checks a scenario; `path` only names the culprit in the message, beside key and allowed range.
    pub fn from_toml(text: &str, path: &Path) -> Result<Self> {
        let scenario: Self = toml_text::read(text).map_err(|problem| Error::format(path, problem))?;
        scenario.validate().map_err(|problem| Error::format(path, problem.to_string()))?;
        Ok(scenario)
    }

    /// Refuses settings that no world can be made of, naming the first bad one. The ranges keep sizes finite and
    /// geometry possible; they say nothing of what is plausible on Mars.
    pub fn validate(&self) -> Result<()> {
        if self.seed > MAX_SEED {
            return Err(Error::setting("seed", format!("{} is above 2^53", self.seed)));
        }
        self.terrain.validate()?;
        self.rocks.validate()?;
        self.texture.validate()?;
        self.sun.validate()?;
        self.camera.validate()?;
        self.drive.validate()?;
        self.rover.validate()?;
        self.events.validate()?;
        self.fiducials.iter().enumerate().try_for_each(|(index, fiducial)| fiducial.validate(index))?;
        let error = &self.odometry_error;
        within("odometry_error.along_fraction", error.along_fraction, 0.0, 1.0)?;
        within("odometry_error.across_fraction", error.across_fraction, 0.0, 1.0)?;
        within("odometry_error.attitude_deg", error.attitude_deg, 0.0, 10.0)?;
        self.targets.validate()
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
        let unknown = refused("seed = 2\n[sun]\nheight_deg = 3.0\n");
        assert!(
            unknown.starts_with("s.toml: line 3: sun.height_deg: unknown field `height_deg`"),
            "{unknown}"
        );
        assert!(!unknown.contains('\n'), "one sentence: {unknown}");
        assert!(refused("[sun]\nelevation_deg = -3.0\n").contains("sun.elevation_deg"));
        assert!(refused("[camera]\nimage_size = 1000\n").contains("camera.image_size"));
        assert!(refused("[drive]\nend_distance_m = nan\n").contains("drive.end_distance_m"));
        let cover = refused("[rocks]\narea_fraction = -0.1\n");
        assert!(
            ["s.toml", "rocks.area_fraction", "0 to 0.4"].iter().all(|part| cover.contains(part)),
            "{cover}"
        );
        let below =
            "[[fiducials]]\nkind = \"sphere\"\nx_m = 0.0\ny_m = 0.0\nheight_m = -1.0\nradius_m = 0.1\n";
        assert!(refused(below).contains("fiducials[0].height_m"));
    }
}
