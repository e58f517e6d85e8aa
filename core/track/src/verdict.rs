//! The verdict on one update and the states of tracking (K§4.6, R89–R91).

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::gate::Gate;

/// The verdict on one update.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Verdict {
    /// The gates, in the order in which the tracker lists them.
    pub gates: Vec<Gate>,
    /// Whether all of them are met.
    pub good: bool,
    /// Whether the update is used: good, and the target had not failed before.
    pub accepted: bool,
    /// Why not, as one sentence.
    pub reason: Option<String>,
    /// The state before this update.
    pub state_before: TrackingState,
    /// The state after it.
    pub state: TrackingState,
}

/// Where tracking stands (Kim09 §4.6): the words of the house, of which `tracking` is the papers' "normal".
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum TrackingState {
    /// No target.
    #[default]
    Cleared,
    /// The last update was good.
    Tracking,
    /// This many updates were bad, and a retry is allowed.
    Lost {
        /// Bad updates in a row, the detecting one included.
        count: u32,
    },
    /// Too many bad updates; stays until the target is cleared.
    Failed,
}

impl TrackingState {
    /// The state's word.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Cleared => "cleared",
            Self::Tracking => "tracking",
            Self::Lost { .. } => "lost",
            Self::Failed => "failed",
        }
    }

    /// Whether the target counts as lost.
    pub const fn is_lost(self) -> bool {
        matches!(self, Self::Lost { .. } | Self::Failed)
    }
}
