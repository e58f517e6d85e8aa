//! Faults that a person injects into a drive to see how the executive copes with them (R208).
//!
//! | fault | what it does at its stops |
//! |---|---|
//! | `occluder` | a grey block of 0.6 m stands before the target, a third of the way from the camera |
//! | `shadow` | the shadow of a block of 0.8 m that stands 2 m from the target towards the sun, out of the picture, lies on it |
//! | `feature_starvation` | dust in the air takes 95 % of the contrast of every image |
//! | `pose_jump` | at the first of them the estimated heading jumps by 7° to the right |
//! | `camera_drop_out` | the cameras on the mast give no images |

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::events::in_order;
use super::range::within;
use sightline_geometry::error::{Error, Result};

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FaultKind {
    /// Something stands before the target.
    Occluder,
    /// A shadow falls on the target.
    Shadow,
    /// The images lose their contrast, and with it their features.
    FeatureStarvation,
    /// The estimated heading jumps.
    PoseJump,
    /// The main pair gives no images.
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

    /// Whether it concerns one target, whose position it needs.
    pub const fn is_of_target(self) -> bool {
        matches!(self, Self::Occluder | Self::Shadow)
    }
}

/// An injected fault, from one stop to another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = InjectedFault)]
pub struct Fault {
    /// What goes wrong.
    pub kind: FaultKind,
    /// The first stop at which it does.
    pub from_stop: u32,
    /// The last stop at which it does.
    pub to_stop: u32,
    /// The position of the target that it concerns, site frame, m; left out: the targets' centre.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_m: Option<[f64; 3]>,
}

impl Fault {
    /// Whether it is there at a stop.
    pub(crate) fn covers(&self, stop: u32) -> bool {
        (self.from_stop..=self.to_stop).contains(&stop)
    }

    /// Refuses stops in the wrong order and positions out of range.
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
