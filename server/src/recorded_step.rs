//! A recorded step with the steps that computing it again needs.

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

/// A recorded step with what came before it.
pub(crate) struct RecordedStep {
    /// The session.
    pub live: Arc<LiveSession>,
    /// The run's designation.
    pub first: Arc<RunStep>,
    /// The step before; none at the designation.
    pub last: Option<Arc<RunStep>>,
    /// The step.
    pub recorded: Arc<RunStep>,
    /// The numbers of its target and run.
    of: (usize, usize),
    /// The run's configuration.
    pub settings: Arc<Settings>,
    /// Where a person put its prediction in the left image, px.
    pub prediction_px: Option<Pixel>,
}

impl RecordedStep {
    /// The recorded step that the path names.
    ///
    /// # Errors
    /// A problem when there is none.
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

    /// Makes the step ready to be computed again: its images rendered, the template's image back in place.
    ///
    /// # Errors
    /// Those of the files.
    pub(crate) fn prepare(&mut self, cancel: &CancelFlag) -> ApiResult<()> {
        // A step of a paused drive is computed again up to the pause.
        if self.recorded.paused_before().is_none_or(|before| before > CycleStage::Capture) {
            let camera = self.recorded.update.target.designation.camera;
            self.live.traverse().make_camera_ready(self.recorded.step, camera, cancel)?;
        }
        if let Some(last) = &self.last {
            self.last = Some(runner::with_image(&self.live.traverse(), last)?);
        }
        Ok(())
    }

    /// What its stages take on Mars, and took here.
    pub(crate) fn times(&self) -> Vec<StageTime> {
        let open = self.live.traverse();
        let report = |world: &DrivenTraverse| world.report(self.recorded.step + 1);
        let report = open.driven.as_ref().and_then(|driven| driven.with(report));
        times(&self.recorded, report.map(|report| report.duration_s))
    }

    /// The step's view against the first and the newest `count` templates of its run before it, oldest first (R72).
    ///
    /// # Errors
    /// Those of the images.
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
        let kept = renewals.iter().enumerate().filter(|(i, _)| *i == 0 || *i >= oldest).map(|(_, step)| step);
        let steps = kept
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

    /// The steps before it that took a new template, the designation first.
    fn renewals(&self) -> ApiResult<Vec<Arc<RunStep>>> {
        self.live.with(|session| {
            let steps = &session.run(self.of.0, self.of.1)?.steps;
            let earlier = steps.iter().take_while(|step| step.step < self.recorded.step);
            Ok(earlier.filter(|step| step.update.template_renewed).cloned().collect())
        })
    }

    /// From what the step is computed again.
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
