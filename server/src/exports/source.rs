//! The input of exports: a snapshot of a session, its notes and its traverse.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use sightline_geometry::frames::Pixel;
use sightline_session::notes::Notes;
use sightline_session::{Run, Session, TargetRecord};
use sightline_track::trace::StepTrace;
use sightline_vision::image::GrayImage;

use super::kind::{ExportFormat, SessionPart};
use crate::commanded_drive;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::rerun_log::DriveLog;

/// A snapshot of a session; cheap, because the steps are shared.
pub(crate) struct Source {
    /// The session.
    pub session: Session,
    /// Its notes.
    pub notes: Notes,
    /// Its traverse.
    pub open: Arc<OpenTraverse>,
    /// Its commanded drive; `None` if the session is not steered.
    pub drive: Option<DriveLog>,
}

/// A run with its indices.
#[derive(Clone, Copy)]
pub(crate) struct NamedRun<'a> {
    /// The index of the target.
    pub target: usize,
    /// The target.
    pub record: &'a TargetRecord,
    /// The index of the run within the target.
    pub number: usize,
    /// The run.
    pub run: &'a Run,
}

impl Source {
    /// Takes a snapshot of the session.
    pub(crate) fn of(live: &LiveSession) -> Self {
        let (session, notes) = live.with(|session| (session.clone(), live.with_notes(|notes| notes.clone())));
        Self { session, notes, open: live.traverse(), drive: commanded_drive::log(live) }
    }

    /// Checks that the requested part exists and has a run with steps.
    ///
    /// # Errors
    /// A problem that names the missing part.
    pub(crate) fn check(&self, kind: ExportFormat, part: SessionPart) -> ApiResult<()> {
        let missing = |error: sightline_geometry::error::Error| ApiError::from(error).about_path();
        match (part.target, part.run) {
            (Some(target), Some(run)) => self.session.run(target, run).map(|_| ()).map_err(missing)?,
            (Some(target), None) => self.session.target(target).map(|_| ()).map_err(missing)?,
            (None, Some(_)) => return Err(ApiError::invalid("query", "run: needs target beside it")),
            (None, None) => {}
        }
        if self.runs(self.resolve_part(kind, part)).is_empty() {
            return Err(ApiError::conflict("There is nothing to export: no run has a step yet.")
                .hint("Pick a target first."));
        }
        Ok(())
    }

    /// The part that a kind shows: for kinds that show one run, by default the selected run.
    pub(crate) fn resolve_part(&self, kind: ExportFormat, part: SessionPart) -> SessionPart {
        if !kind.is_of_one_run() {
            return part;
        }
        let selected = SessionPart { target: self.session.cursor.target, run: Some(self.session.cursor.run) };
        let has_runs = |part: SessionPart| part.target.is_some() && !self.runs(part).is_empty();
        match part {
            SessionPart { run: Some(_), .. } => part,
            SessionPart { target: Some(target), .. } if selected.target != Some(target) => {
                SessionPart { run: Some(0), ..part }
            }
            _ if has_runs(selected) => selected,
            _ => {
                let first = self.runs(part).first().map(|run| (run.target, run.number));
                SessionPart { target: first.map(|(target, _)| target), run: first.map(|(_, run)| run) }
            }
        }
    }

    /// The runs of a part that have steps, without removed runs and targets.
    pub(crate) fn runs(&self, part: SessionPart) -> Vec<NamedRun<'_>> {
        let is_included = |target: usize| part.target.is_none_or(|wanted| wanted == target);
        let targets = self.session.targets.iter().enumerate();
        let targets = targets.filter(|(number, record)| !record.removed && is_included(*number));
        let of_target = targets.flat_map(|(target, record)| {
            let runs = record.runs.iter().enumerate().filter(|(_, run)| !run.removed);
            runs.map(move |(number, run)| NamedRun { target, record, number, run })
        });
        let is_included = |run: &NamedRun<'_>| part.run.is_none_or(|wanted| wanted == run.number);
        of_target.filter(|run| !run.run.steps.is_empty() && is_included(run)).collect()
    }

    /// The suggested file name, composed of the server's own names only.
    pub(crate) fn file_name(&self, kind: ExportFormat, part: SessionPart) -> String {
        let of = match (part.target, part.run) {
            (Some(target), Some(run)) => format!("-target-{target}-run-{run}"),
            (Some(target), None) => format!("-target-{target}"),
            _ => String::new(),
        };
        format!("sightline-{}{of}-{}", self.session.id, kind.name())
    }

    /// The left and right image of the pair used for tracking a step.
    ///
    /// # Errors
    /// As [`OpenTraverse::make_ready`]; also a damaged file, or a stop without the pair.
    pub(crate) fn images(
        &self,
        trace: &StepTrace,
        cancel: &AtomicBool,
    ) -> sightline_geometry::error::Result<[Arc<GrayImage>; 2]> {
        let camera = trace.update.target.designation.camera;
        self.open.make_camera_ready(trace.step, camera, cancel)?;
        let pair = self.open.traverse.capture_pair(trace.step, camera, cancel)?;
        Ok([pair.left, pair.right])
    }
}

/// The position of a step's target in the left image, px: the match, else the prediction, else the designation.
pub(crate) fn target_pixel(trace: &StepTrace) -> Option<Pixel> {
    let found = trace.located().and_then(|located| located.left_pixel);
    let predicted = || trace.point_mast.predicted_left;
    let designated = || {
        let designation = trace.update.target.designation;
        (designation.step == trace.step).then_some(designation.pixel)
    };
    found.or_else(predicted).or_else(designated)
}
