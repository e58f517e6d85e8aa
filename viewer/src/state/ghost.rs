//! What is tried at a step, and the scores that come of it: asked for while they are looked at, and made a texture of
//! when they are shown.

use std::sync::Arc;

use sightline_core::image::GrayImage;
use sightline_core::session::what_if::{Ghost, WhatIf};
use sightline_core::settings::TrackerKind;
use sightline_core::trace::ArrayName;

use super::State;
use super::undo::Deed;
use crate::cache::StepKey;
use crate::net::Request;
use crate::net::why::WhyRequest;
use crate::raster::Raster;

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
pub type Shown = egui::mutex::Mutex<Option<((StepKey, WhatIf), Arc<Raster>)>>;

impl State {
    /// Changes what is tried at the cursor's step.
    pub(super) fn try_out(&mut self, what_if: WhatIf) {
        let Some(key) = self.step_key(self.cursor.step).filter(|_| self.row().is_some()) else { return };
        let before = self.trial().map(|trial| trial.what_if.clone()).unwrap_or_default();
        if before == what_if {
            return;
        }
        self.did(Deed::Tried { of: key.clone(), before, after: what_if.clone() });
        self.set_trial(key, what_if);
    }

    pub(super) fn set_trial(&mut self, of: StepKey, what_if: WhatIf) {
        if what_if.is_empty() {
            self.why.trial = None;
            return;
        }
        // The last ghost stands until the new one is here, so that a drag does not flicker.
        let last = self.why.trial.take().filter(|trial| trial.of == of);
        let has_scores = last.as_ref().is_some_and(|trial| trial.has_scores);
        let ghost = last.and_then(|trial| trial.ghost);
        self.why.trial = Some(Trial { of, what_if, ghost, has_scores, refused: None });
        self.send_trial();
    }

    /// Asks for the newest change, unless an older one is under way.
    pub(super) fn send_trial(&mut self) {
        let Some(trial) = &self.why.trial else { return };
        let is_whole = trial.has_scores || !self.why.wants_scores;
        let is_answered =
            trial.ghost.as_ref().is_some_and(|ghost| ghost.what_if == trial.what_if) && is_whole;
        if self.why.trying.is_some() || is_answered || trial.refused.is_some() {
            return;
        }
        let (of, mut what_if) = (trial.of.clone(), trial.what_if.clone());
        if self.why.wants_scores {
            what_if.arrays.push(ArrayName::Surface);
        }
        self.why.trying = Some((of.clone(), what_if.clone()));
        self.outbox.push(Request::Why(WhyRequest::WhatIf { of, what_if }));
    }

    /// Says whether the scores of what is tried are looked at; what is tried is asked for again where they are missing.
    pub fn want_tried_scores(&mut self, is_seen: bool) {
        let is_wanted =
            is_seen && self.why.scores_shown != Scores::Recorded && self.tracker() == TrackerKind::Template;
        self.why.wants_scores = is_wanted;
        if is_wanted {
            self.send_trial();
        }
    }

    /// What was tried at the cursor's step, with its scores; none where it has none, or they are on their way.
    pub fn tried_scores(&self, context: &egui::Context) -> Option<(&Ghost, Arc<Raster>)> {
        let trial = self.trial()?;
        let ghost = trial.ghost.as_ref()?;
        let array = ghost.arrays.iter().find(|array| array.name == ArrayName::Surface)?;
        let of = (trial.of.clone(), ghost.what_if.clone());
        let mut shown = self.why.scores.lock();
        if let Some((_, raster)) = shown.as_ref().filter(|(known, _)| *known == of) {
            return Some((ghost, Arc::clone(raster)));
        }
        let values = array.values.iter().map(|value| value.unwrap_or(f32::NAN)).collect();
        let values = GrayImage::from_raw(array.size[0], array.size[1], values)?;
        let raster = Arc::new(Raster::from_values(context, ArrayName::Surface, values));
        *shown = Some((of, Arc::clone(&raster)));
        Some((ghost, raster))
    }
}
