//! The verdict on one update and the states of tracking (K§4.6, R89–R91).

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::gate::Gate;

/// The verdict on one update.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Verdict {
    /// The gates, in the order in which the tracker lists them.
    pub gates: Vec<Gate>,
    /// Whether all gates are passed.
    pub good: bool,
    /// Whether the update is used: it is good, and the target had not failed before.
    pub accepted: bool,
    /// Why the update is not good, as one sentence; null if it is.
    pub reason: Option<String>,
    /// The state before this update.
    pub state_before: TrackingState,
    /// The state after this update.
    pub state: TrackingState,
}

/// The tracking state (Kim09 §4.6); `tracking` is the papers' "normal".
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum TrackingState {
    /// No target.
    #[default]
    Cleared,
    /// The last update was good.
    Tracking,
    /// This many consecutive updates were bad, and a retry is allowed.
    Lost {
        /// Bad updates in a row, the detecting one included.
        count: u32,
    },
    /// Too many bad updates; stays until the target is cleared.
    Failed,
}

impl TrackingState {
    /// The name, as in records.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Cleared => "cleared",
            Self::Tracking => "tracking",
            Self::Lost { .. } => "lost",
            Self::Failed => "failed",
        }
    }

    /// Whether the target is lost or failed.
    pub const fn is_lost(self) -> bool {
        matches!(self, Self::Lost { .. } | Self::Failed)
    }
}
