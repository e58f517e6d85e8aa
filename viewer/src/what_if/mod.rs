//! What is tried at a step, and the scores that come of it: asked for while they are looked at, and made a texture of
//! when they are shown.

pub(crate) mod panel;
mod update;

use std::sync::Arc;

use sightline_session::what_if::{Ghost, WhatIf};

use crate::cache::StepKey;
use crate::drawing::raster::Raster;

/// What is tried at a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The step.
    pub of: StepKey,
    /// The change.
    pub what_if: WhatIf,
    /// What came of the newest change that was answered.
    pub ghost: Option<Ghost>,
    /// Whether its scores were asked for with it.
    pub has_scores: bool,
    /// Why the newest change could not be tried.
    pub refused: Option<String>,
}

/// Which scores are shown while a change is tried.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scores {
    /// Those of the run beside those of what is tried.
    #[default]
    Both,
    /// Those of the run.
    Recorded,
    /// Those of what is tried.
    Tried,
}

impl Scores {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Both, Self::Recorded, Self::Tried];

    /// Its words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Both => "both",
            Self::Recorded => "recorded",
            Self::Tried => "what if",
        }
    }
}

/// The texture of the scores that were shown last, with what they are of.
pub(crate) type Shown = egui::mutex::Mutex<Option<((StepKey, WhatIf), Arc<Raster>)>>;
