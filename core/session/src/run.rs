//! A run: one configuration over one target, step by step.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::step::RunStep;
use sightline_geometry::frames::Pixel;
use sightline_track::settings::Settings;

/// Where a run left another.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Fork {
    /// The run it left.
    pub run: usize,
    /// The first step that was computed with the new settings.
    pub from_step: usize,
    /// Where the prediction of that step was put in the left image, px; null: where dead reckoning has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prediction_px: Option<Pixel>,
}

impl Fork {
    /// Leaves `run` at `from_step`.
    pub const fn new(run: usize, from_step: usize) -> Self {
        Self { run, from_step, prediction_px: None }
    }
}

/// One configuration over one target. Steps shared with the run it forked from are the same values.
#[derive(Clone, Debug)]
pub struct Run {
    /// The configuration.
    pub settings: Arc<Settings>,
    /// Where it left another run.
    pub fork: Option<Fork>,
    /// The steps so far; the first is the designation.
    pub steps: Vec<Arc<RunStep>>,
    /// The step after which a person stopped it.
    pub stop_after: Option<usize>,
    /// Why it stopped before the last stop: `cancelled`, or what went wrong.
    pub stopped: Option<String>,
    /// Whether the person removed it; numbers of the others stay as they are.
    pub removed: bool,
}

impl Run {
    /// A run that begins with `steps`.
    pub fn new(settings: Arc<Settings>, fork: Option<Fork>, steps: Vec<Arc<RunStep>>) -> Self {
        Self { settings, fork, steps, stop_after: None, stopped: None, removed: false }
    }

    /// The steps without the one at which a drive is paused between two stages.
    pub fn whole_steps(&self) -> &[Arc<RunStep>] {
        &self.steps[..self.steps.len() - usize::from(self.begun().is_some())]
    }

    /// The last step where a drive is paused between two of its stages.
    pub fn begun(&self) -> Option<&Arc<RunStep>> {
        self.steps.last().filter(|last| last.is_begun())
    }

    /// The record of a stop, where it was computed.
    pub fn step(&self, step: usize) -> Option<&Arc<RunStep>> {
        let first = self.steps.first()?.step;
        self.steps.get(step.checked_sub(first)?)
    }
}
