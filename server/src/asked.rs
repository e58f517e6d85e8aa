//! What a question about a step needs: the step, what came before it, and the image of its template.

use std::sync::Arc;

use sightline_core::frames::Pixel;
use sightline_core::session::what_if::Base;
use sightline_core::settings::Settings;
use sightline_core::trace::StepTrace;

use crate::live::{CancelFlag, LiveSession};
use crate::problem::{ApiError, ApiResult};
use crate::runner;
use crate::state::AppState;

/// The names of a step in a path: session, target, run, step.
pub type StepPath = (String, usize, usize, usize);

/// A recorded step with what came before it.
pub struct Asked {
    /// The session.
    pub live: Arc<LiveSession>,
    /// The run's designation.
    pub first: Arc<StepTrace>,
    /// The step before; none at the designation.
    pub last: Option<Arc<StepTrace>>,
    /// The step.
    pub recorded: Arc<StepTrace>,
    /// The run's configuration.
    pub settings: Arc<Settings>,
    /// Where a person put its prediction in the left image, px.
    pub prediction_px: Option<Pixel>,
}

impl Asked {
    /// The recorded step that the path names.
    ///
    /// # Errors
    /// A problem when there is none.
    pub fn find(state: &AppState, (session, target, run, step): &StepPath) -> ApiResult<Self> {
        let live = state.session(session)?;
        let found = live.with(|session| {
            let run = session.run(*target, *run).map_err(|error| ApiError::from(error).about_path())?;
            let missing = || ApiError::not_found(format!("Step {step} of this run is not there."));
            let recorded = run.step(*step).cloned().ok_or_else(missing)?;
            let first = run.steps.first().cloned().ok_or_else(missing)?;
            let last = step.checked_sub(1).and_then(|last| run.step(last)).cloned();
            let prediction_px = run.displaced_at(*step);
            Ok::<_, ApiError>((first, last, recorded, Arc::clone(&run.settings), prediction_px))
        });
        let (first, last, recorded, settings, prediction_px) = found?;
        Ok(Self { live, first, last, recorded, settings, prediction_px })
    }

    /// Makes the step ready to be computed again: its images rendered, the template's image back in place.
    ///
    /// # Errors
    /// Those of the files.
    pub fn prepare(&mut self, cancel: &CancelFlag) -> ApiResult<()> {
        self.live.traverse.make_ready(self.recorded.step, cancel)?;
        if let Some(last) = &self.last {
            self.last = Some(runner::with_image(&self.live.traverse, last)?);
        }
        Ok(())
    }

    /// From what the step is computed again.
    pub fn base(&self) -> Base<'_> {
        Base {
            first: &self.first,
            last: self.last.as_deref(),
            recorded: &self.recorded,
            settings: &self.settings,
            prediction_px: self.prediction_px,
        }
    }
}
