//! Faults that the user injects into a drive to test how the executive handles them (R208).
//!
//! | fault | effect at its stops |
//! |---|---|
//! | `occluder` | a grey block of 0.6 m in front of the target, a third of the way from the camera to the target |
//! | `shadow` | the shadow of a block of 0.8 m falls on the target, from an unseen block 2 m away towards the sun |
//! | `feature_starvation` | dust in the air removes 95 % of the contrast of every image |
//! | `pose_jump` | at the first of them the estimated heading jumps by 7° to the right |
//! | `camera_drop_out` | the cameras on the mast deliver no images |

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::events::in_order;
use super::range::within;
use sightline_geometry::error::{Error, Result};

/// Kind of an injected fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// An object occludes the target.
    Occluder,
    /// A shadow falls on the target.
    Shadow,
    /// The images lose contrast, and with it their features.
    FeatureStarvation,
    /// The estimated heading jumps.
    PoseJump,
    /// The main pair delivers no images.
    CameraDropOut,
}

impl FaultKind {
    /// All kinds.
    pub const ALL: [Self; 5] =
        [Self::Occluder, Self::Shadow, Self::FeatureStarvation, Self::PoseJump, Self::CameraDropOut];

    /// Its name in a scenario.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Occluder => "occluder",
            Self::Shadow => "shadow",
            Self::FeatureStarvation => "feature_starvation",
            Self::PoseJump => "pose_jump",
            Self::CameraDropOut => "camera_drop_out",
        }
    }

    /// Whether it affects one target, whose position it needs.
    pub const fn is_of_target(self) -> bool {
        matches!(self, Self::Occluder | Self::Shadow)
    }
}

/// An injected fault, from one stop to another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = InjectedFault)]
pub struct Fault {
    /// Kind of the fault.
    pub kind: FaultKind,
    /// First stop with the fault.
    pub from_stop: u32,
    /// Last stop with the fault.
    pub to_stop: u32,
    /// Position of the target, site frame, m; the targets' centre if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_m: Option<[f64; 3]>,
}

impl Fault {
    /// Whether the fault is active at a stop.
    pub(crate) fn covers(&self, stop: u32) -> bool {
        (self.from_stop..=self.to_stop).contains(&stop)
    }

    /// Rejects stops in the wrong order and positions out of range.
    pub(super) fn validate(&self, index: usize) -> Result<()> {
        let key = |field: &str| format!("events.faults[{index}].{field}");
        in_order(&key("to_stop"), self.from_stop, self.to_stop)?;
        for (axis, value) in self.target_m.iter().flatten().enumerate() {
            within(&key(&format!("target_m[{axis}]")), *value, -1000.0, 1000.0)?;
        }
        if self.from_stop == 0 {
            return Err(Error::setting(
                key("from_stop"),
                "the target is designated at the first stop, 0; choose a later one",
            ));
        }
        Ok(())
    }
}
