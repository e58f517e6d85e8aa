//! The scenario: every parameter of a simulated traverse, read from and written to TOML.
//!
//! A field that is left out takes its default; an unknown field is rejected by name. Equal scenarios give the same
//! bits. Defaults describe a Spirit-like rover on a plain with the rock abundance of Gusev's rockier places; none may
//! be tuned on a tracker's results.
//!
//! Frames: the site frame is level (+z down). Its x axis is the direction of the drive, unless `drive.heading_deg` and
//! `drive.start_bearing_deg` differ from 0. Its origin is near the rover's place at the first stop, 0.294 m above the mean
//! plane, like the rover frame of a rover on flat ground. Angles of the sun are measured in it (domain.md 1.5).
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

/// Every parameter of a simulated traverse.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Scenario {
    /// Short name.
    pub name: String,
    /// What the scenario stages, from which source, and the assumptions made.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub description: String,
    /// Seed of all random numbers: relief, rocks, texture, pose errors, noise, choice of targets.
    pub seed: u64,
    /// The relief of the ground.
    pub terrain: TerrainSettings,
    /// Number and sizes of the rocks.
    pub rocks: RockSettings,
    /// Albedo and micro-relief of soil and rock.
    pub texture: TextureSettings,
    /// The sun and the sky.
    pub sun: SunSettings,
    /// The detector and the optics.
    pub camera: CameraSettings,
    /// The drive.
    pub drive: DriveSettings,
    /// The rover's wheels, odometry and tracks.
    pub rover: RoverSettings,
    /// Changes during the drive.
    pub events: EventSettings,
    /// Objects of known shape.
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

    /// The scenario as TOML with every field.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).unwrap_or_default()
    }
}
