//! A run: one configuration over one target, step by step.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::step::RunStep;
use sightline_geometry::frames::Pixel;
use sightline_track::settings::Settings;

/// The fork of a run from its parent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Fork {
    /// The number of the parent run.
    pub run: usize,
    /// The first step that is computed with the new settings.
    pub from_step: usize,
    /// The displaced prediction of that step in the left image, px; null: by dead reckoning.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prediction_px: Option<Pixel>,
}

impl Fork {
    /// A fork from `run` at `from_step`.
    pub const fn new(run: usize, from_step: usize) -> Self {
        Self { run, from_step, prediction_px: None }
    }
}

/// One configuration over one target. Steps shared with the parent run are shared by pointer.
#[derive(Clone, Debug)]
pub struct Run {
    /// The configuration.
    pub settings: Arc<Settings>,
    /// Its fork from a parent run; `None` for the first run.
    pub fork: Option<Fork>,
    /// The steps so far; the first is the designation.
    pub steps: Vec<Arc<RunStep>>,
    /// The step after which a person stopped it; `None` if it was not stopped.
    pub stop_after: Option<usize>,
    /// Why it stopped before the last stop: `cancelled`, or an error; `None` if it did not.
    pub stopped: Option<String>,
    /// Whether it was removed; the other runs keep their numbers.
    pub removed: bool,
}

impl Run {
    /// A run that begins with `steps`.
    pub fn new(settings: Arc<Settings>, fork: Option<Fork>, steps: Vec<Arc<RunStep>>) -> Self {
        Self { settings, fork, steps, stop_after: None, stopped: None, removed: false }
    }

    /// The steps without a last step that is paused between two stages.
    pub fn whole_steps(&self) -> &[Arc<RunStep>] {
        &self.steps[..self.steps.len() - usize::from(self.begun().is_some())]
    }

    /// The last step, if it is paused between two stages.
    pub fn begun(&self) -> Option<&Arc<RunStep>> {
        self.steps.last().filter(|last| last.is_begun())
    }

    /// The step at a stop; `None` if it was not computed.
    pub fn step(&self, step: usize) -> Option<&Arc<RunStep>> {
        let first = self.steps.first()?.step;
        self.steps.get(step.checked_sub(first)?)
    }
}
