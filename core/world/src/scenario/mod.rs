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
mod faults;
mod fiducials;
mod ground;
mod light;
pub(crate) mod range;
mod rover;
mod targets;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::odometry_error::OdometryError;

pub use camera::{
    AutoExposureSettings, CameraRig, CameraSettings, ExposureMode, FULL_SCALE_DN, FurtherRig, Quantisation,
};
pub use drive::{Course, DriveSettings, Move};
pub use events::{Cloud, EventSettings, Ghost, Occluder};
pub use faults::{Fault, FaultKind};
pub use fiducials::Fiducial;
pub use ground::{ClearPath, PlacedRock, RockSettings, RockShape, TerrainSettings, TextureSettings};
pub use light::{Reflectance, SunSettings};
pub use rover::{ForcedSlip, HeadingJump, OdometryModel, RoverSettings, Soil};
pub use targets::{Arrangement, TargetRule};

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

    /// The scenario as TOML, every field written.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).unwrap_or_default()
    }
}
