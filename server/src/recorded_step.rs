//! A recorded step with the earlier steps needed to recompute it.

use std::sync::Arc;

use sightline_api::location::AtStep;
use sightline_geometry::frames::Pixel;
use sightline_recordings::DrivenTraverse;
use sightline_session::step::RunStep;
use sightline_session::times::{StageTime, times};
use sightline_session::what_if::Base;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::locate::template::history::{AgainstEarlier, against_earlier};
use sightline_track::settings::Settings;

use crate::cancel::CancelFlag;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::runner;
use crate::state::AppState;

/// A recorded step with its predecessors.
pub(crate) struct RecordedStep {
    /// The session.
    pub live: Arc<LiveSession>,
    /// The first step of the run, with the designation.
    pub first: Arc<RunStep>,
    /// The previous step; `None` at the designation.
    pub last: Option<Arc<RunStep>>,
    /// The step.
    pub recorded: Arc<RunStep>,
    /// The indices of its target and run.
    of: (usize, usize),
    /// The run's configuration.
    pub settings: Arc<Settings>,
    /// The prediction in the left image, px, if the user moved it.
    pub prediction_px: Option<Pixel>,
}

impl RecordedStep {
    /// The recorded step named in the path.
    ///
    /// # Errors
    /// A problem if it does not exist.
    pub(crate) fn find(state: &AppState, at: &AtStep) -> ApiResult<Self> {
        let live = state.session(&at.session)?;
        let found = live.with(|session| {
            let run = session.run(at.target, at.run).map_err(|error| ApiError::from(error).about_path())?;
            let missing = || {
                let first = session.targets[at.target].designation.step;
                let is_coming = (first..session.stop_count).contains(&at.step);
                let detail = if is_coming { "was not computed yet" } else { "does not exist" };
                ApiError::not_found(format!("Step {} of this run {detail}.", at.step))
            };
            let recorded = run.step(at.step).cloned().ok_or_else(missing)?;
            let first = run.steps.first().cloned().ok_or_else(missing)?;
            let last = at.step.checked_sub(1).and_then(|last| run.step(last)).cloned();
            let prediction_px = run.displaced_at(at.step);
            Ok::<_, ApiError>((first, last, recorded, Arc::clone(&run.settings), prediction_px))
        });
        let (first, last, recorded, settings, prediction_px) = found?;
        Ok(Self { live, first, last, recorded, of: (at.target, at.run), settings, prediction_px })
    }

    /// Prepares the step for recomputation: renders its images and restores the template's image.
    ///
    /// # Errors
    /// Errors of reading or rendering images.
    pub(crate) fn prepare(&mut self, cancel: &CancelFlag) -> ApiResult<()> {
        // A step of a paused drive is recomputed up to the pause.
        if self.recorded.paused_before().is_none_or(|before| before > CycleStage::Capture) {
            let camera = self.recorded.update.target.designation.camera;
            self.live.traverse().make_camera_ready(self.recorded.step, camera, cancel)?;
        }
        if let Some(last) = &self.last {
            self.last = Some(runner::with_image(&self.live.traverse(), last)?);
        }
        Ok(())
    }

    /// Duration of its stages on Mars and on this machine.
    pub(crate) fn times(&self) -> Vec<StageTime> {
        let open = self.live.traverse();
        let report = |world: &DrivenTraverse| world.report(self.recorded.step + 1);
        let report = open.commanded.as_ref().and_then(|drive| drive.with(report));
        times(&self.recorded, report.map(|report| report.duration_s))
    }

    /// Compares the step's view with the first and the newest `count` earlier templates of its run, oldest first (R72).
    ///
    /// # Errors
    /// Errors of reading or rendering images.
    pub(crate) fn against_earlier(&self, count: usize) -> ApiResult<Vec<AgainstEarlier>> {
        if self.recorded.located().is_none_or(|located| located.left_pixel.is_none()) {
            return Ok(Vec::new());
        }
        let open = self.live.traverse();
        let traverse = &open.traverse;
        let image =
            traverse.capture_one(self.recorded.step, self.recorded.update.target.designation.camera, true)?;
        let renewals = self.renewals()?;
        let oldest = renewals.len().saturating_sub(count);
        let recent =
            renewals.iter().enumerate().filter(|(i, _)| *i == 0 || *i >= oldest).map(|(_, step)| step);
        let steps = recent
            .map(|step| runner::with_image(&self.live.traverse(), step))
            .collect::<Result<Vec<_>, _>>()?;
        let earlier = steps.iter().filter_map(|step| step.update.target.memory.template());
        Ok(against_earlier(
            &self.recorded,
            &image,
            &traverse.site_from_rover(self.recorded.step),
            earlier.map(|memory| &memory.appearance),
            &self.settings.template,
        ))
    }

    /// The earlier steps that took a new template, designation first.
    fn renewals(&self) -> ApiResult<Vec<Arc<RunStep>>> {
        self.live.with(|session| {
            let steps = &session.run(self.of.0, self.of.1)?.steps;
            let earlier = steps.iter().take_while(|step| step.step < self.recorded.step);
            Ok(earlier.filter(|step| step.update.template_renewed).cloned().collect())
        })
    }

    /// The input for recomputing the step.
    pub(crate) fn base(&self) -> Base<'_> {
        Base {
            first: &self.first,
            last: self.last.as_deref(),
            recorded: &self.recorded,
            settings: &self.settings,
            prediction_px: self.prediction_px,
        }
    }
}
