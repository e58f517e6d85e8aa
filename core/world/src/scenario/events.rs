//! Events of a drive: the sun moves, clouds pass, objects occlude the target, the rover casts its shadow.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::faults::{Fault, FaultKind};
use super::range::within;
use sightline_geometry::camera::CameraName;
use sightline_geometry::error::{Error, Result};

/// Changes from stop to stop; none by default.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct EventSettings {
    /// Rate of the sun's azimuth, degrees per hour of the drive (0; on Mars 14.6).
    pub sun_azimuth_deg_per_h: f64,
    /// Rate of the sun's elevation, degrees per hour of the drive (0).
    pub sun_elevation_deg_per_h: f64,
    /// Whether the rover's body casts its shadow, and is visible to cameras that look down on it.
    pub rover_body: bool,
    /// Clouds that pass in front of the sun (Kim09 §5.5).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub clouds: Vec<Cloud>,
    /// Objects between the cameras and the targets' centre (Kim09 §4.6, Kim09 §5.5, Deans05 §3).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub occluders: Vec<Occluder>,
    /// Reflections in the lenses of further pairs, in which stereo sees a surface that does not exist.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ghosts: Vec<Ghost>,
    /// Faults that the user injected into the drive.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<Fault>,
}

/// A cloud in front of the sun, from one stop to another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Cloud {
    /// First stop with the cloud.
    pub from_stop: u32,
    /// Last stop with the cloud.
    pub to_stop: u32,
    /// Transmitted fraction of the direct light, 0 to 1 (0.05: domain.md 11.1).
    #[serde(default = "opaque")]
    pub direct: f64,
}

fn opaque() -> f64 {
    0.05
}

/// A grey block on the line of sight from the left camera to the targets' centre, upright and facing the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Occluder {
    /// First stop with the block.
    pub from_stop: u32,
    /// Last stop with the block.
    pub to_stop: u32,
    /// Position of its centre on the line of sight: 0 at the camera, 1 at the targets' centre.
    pub at: f64,
    /// Width, m.
    pub width_m: f64,
    /// Height, m.
    pub height_m: f64,
    /// Offset of its centre to the right of the line of sight, m.
    #[serde(default)]
    pub aside_m: f64,
}

/// A reflection in the lenses of a further pair, from one stop to another. Both images show it like an upright
/// blotched patch across the rover's path; it moves with the rover.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = LensGhost)]
pub struct Ghost {
    /// Name of the pair in `camera.further`.
    pub camera: CameraName,
    /// First stop at which it is visible.
    pub from_stop: u32,
    /// Last stop at which it is visible.
    pub to_stop: u32,
    /// Its apparent centre in the rover frame, m: ahead, to the right, below the origin.
    pub at_m: [f64; 3],
    /// Apparent width, m.
    pub width_m: f64,
    /// Apparent height, m.
    pub height_m: f64,
    /// Radiance that its brightest blotches add, as a fraction of the image's mean radiance (1).
    #[serde(default = "bright")]
    pub brightness: f64,
}

fn bright() -> f64 {
    1.0
}

impl EventSettings {
    /// Whether a fault of this kind is injected at a stop.
    pub fn has_fault(&self, kind: FaultKind, stop: u32) -> bool {
        self.faults.iter().any(|fault| fault.kind == kind && fault.covers(stop))
    }

    /// Whether there is an occluder at any stop.
    pub fn has_occluders(&self) -> bool {
        let is_occluder = |fault: &Fault| fault.kind == FaultKind::Occluder;
        !self.occluders.is_empty() || self.faults.iter().any(is_occluder)
    }

    pub(crate) fn validate(&self) -> Result<()> {
        within("events.sun_azimuth_deg_per_h", self.sun_azimuth_deg_per_h, -360.0, 360.0)?;
        within("events.sun_elevation_deg_per_h", self.sun_elevation_deg_per_h, -90.0, 90.0)?;
        for (index, cloud) in self.clouds.iter().enumerate() {
            let key = |field: &str| format!("events.clouds[{index}].{field}");
            in_order(&key("to_stop"), cloud.from_stop, cloud.to_stop)?;
            within(&key("direct"), cloud.direct, 0.0, 1.0)?;
        }
        for (index, occluder) in self.occluders.iter().enumerate() {
            let key = |field: &str| format!("events.occluders[{index}].{field}");
            in_order(&key("to_stop"), occluder.from_stop, occluder.to_stop)?;
            within(&key("at"), occluder.at, 0.05, 0.98)?;
            within(&key("width_m"), occluder.width_m, 0.01, 10.0)?;
            within(&key("height_m"), occluder.height_m, 0.01, 10.0)?;
            within(&key("aside_m"), occluder.aside_m, -10.0, 10.0)?;
        }
        for (index, ghost) in self.ghosts.iter().enumerate() {
            let key = |field: &str| format!("events.ghosts[{index}].{field}");
            in_order(&key("to_stop"), ghost.from_stop, ghost.to_stop)?;
            within(&key("at_m[0]"), ghost.at_m[0], 0.3, 20.0)?;
            within(&key("at_m[1]"), ghost.at_m[1], -10.0, 10.0)?;
            within(&key("at_m[2]"), ghost.at_m[2], -10.0, 10.0)?;
            within(&key("width_m"), ghost.width_m, 0.05, 10.0)?;
            within(&key("height_m"), ghost.height_m, 0.05, 10.0)?;
            within(&key("brightness"), ghost.brightness, 0.0, 10.0)?;
        }
        self.faults.iter().enumerate().try_for_each(|(index, fault)| fault.validate(index))?;
        Ok(())
    }
}

pub(super) fn in_order(key: &str, from_stop: u32, to_stop: u32) -> Result<()> {
    if to_stop >= from_stop {
        return Ok(());
    }
    Err(Error::setting(key, format!("{to_stop} is before from_stop, which is {from_stop}")))
}
