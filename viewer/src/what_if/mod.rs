//! The trial at a step and its scores, which are requested only while they are shown.

pub(crate) mod panel;
mod update;

use std::sync::Arc;

use sightline_session::what_if::{Ghost, WhatIf};

use crate::cache::StepKey;
use crate::drawing::raster::Raster;

/// A trial: changes to a step that are tried without a new run.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The step.
    pub of: StepKey,
    /// The change.
    pub what_if: WhatIf,
    /// Result of the newest answered change (the ghost); `None` before the first answer.
    pub ghost: Option<Ghost>,
    /// Whether the result was requested with its scores.
    pub has_scores: bool,
    /// Why the server refused the newest change.
    pub refused: Option<String>,
}

/// The scores that are shown during a trial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scores {
    /// The run's scores beside the trial's.
    #[default]
    Both,
    /// The run's scores.
    Recorded,
    /// The trial's scores.
    Tried,
}

impl Scores {
    /// All choices.
    pub const ALL: [Self; 3] = [Self::Both, Self::Recorded, Self::Tried];

    /// The label of the choice.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Both => "both",
            Self::Recorded => "recorded",
            Self::Tried => "what if",
        }
    }
}

/// The last texture of the trial's scores, with the step and the change that it shows.
pub(crate) type ScoresTexture = egui::mutex::Mutex<Option<((StepKey, WhatIf), Arc<Raster>)>>;
