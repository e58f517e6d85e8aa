//! What exports are made of: a session as it stands, its notes and its traverse.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use sightline_geometry::frames::Pixel;
use sightline_session::notes::Notes;
use sightline_session::{Run, Session, TargetRecord};
use sightline_track::trace::StepTrace;
use sightline_vision::image::GrayImage;

use super::kind::{Kind, Part};
use crate::driven;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::rerun_log::DriveLog;

/// A session as it stands; its steps are shared, so that this costs little.
pub(crate) struct Source {
    /// The session.
    pub session: Session,
    /// Its notes.
    pub notes: Notes,
    /// Its traverse.
    pub open: Arc<OpenTraverse>,
    /// Its drive; `None` where nobody drives.
    pub drive: Option<DriveLog>,
}

/// A run with its numbers.
#[derive(Clone, Copy)]
pub(crate) struct NamedRun<'a> {
    /// The target's number.
    pub target: usize,
    /// The target.
    pub record: &'a TargetRecord,
    /// The run's number within the target.
    pub number: usize,
    /// The run.
    pub run: &'a Run,
}

impl Source {
    /// The session as it stands now.
    pub(crate) fn of(live: &LiveSession) -> Self {
        let (session, notes) = live.with(|session| (session.clone(), live.with_notes(|notes| notes.clone())));
        Self { session, notes, open: live.traverse(), drive: driven::log(live) }
    }

    /// Checks that what is asked for is there.
    ///
    /// # Errors
    /// A problem that names what is not.
    pub(crate) fn check(&self, kind: Kind, part: Part) -> ApiResult<()> {
        let missing = |error: sightline_geometry::error::Error| ApiError::from(error).about_path();
        match (part.target, part.run) {
            (Some(target), Some(run)) => self.session.run(target, run).map(|_| ()).map_err(missing)?,
            (Some(target), None) => self.session.target(target).map(|_| ()).map_err(missing)?,
            (None, Some(_)) => return Err(ApiError::invalid("query", "run: needs target beside it")),
            (None, None) => {}
        }
        if self.runs(self.narrowed(kind, part)).is_empty() {
            return Err(ApiError::conflict("There is nothing to export: no run has a step yet.")
                .hint("Pick a target first."));
        }
        Ok(())
    }

    /// The part that a kind shows: of one run where it shows one, by default the one that is looked at.
    pub(crate) fn narrowed(&self, kind: Kind, part: Part) -> Part {
        if !kind.is_of_one_run() {
            return part;
        }
        let looked_at = Part { target: self.session.cursor.target, run: Some(self.session.cursor.run) };
        let is_there = |part: Part| part.target.is_some() && !self.runs(part).is_empty();
        match part {
            Part { run: Some(_), .. } => part,
            Part { target: Some(target), .. } if looked_at.target != Some(target) => {
                Part { run: Some(0), ..part }
            }
            _ if is_there(looked_at) => looked_at,
            _ => {
                let first = self.runs(part).first().map(|run| (run.target, run.number));
                Part { target: first.map(|(target, _)| target), run: first.map(|(_, run)| run) }
            }
        }
    }

    /// The runs of a part that have steps; removed ones and those of removed targets are left out.
    pub(crate) fn runs(&self, part: Part) -> Vec<NamedRun<'_>> {
        let is_meant = |target: usize| part.target.is_none_or(|wanted| wanted == target);
        let targets = self.session.targets.iter().enumerate();
        let targets = targets.filter(|(number, record)| !record.removed && is_meant(*number));
        let of_target = targets.flat_map(|(target, record)| {
            let runs = record.runs.iter().enumerate().filter(|(_, run)| !run.removed);
            runs.map(move |(number, run)| NamedRun { target, record, number, run })
        });
        let is_meant = |run: &NamedRun<'_>| part.run.is_none_or(|wanted| wanted == run.number);
        of_target.filter(|run| !run.run.steps.is_empty() && is_meant(run)).collect()
    }

    /// The name under which a file is saved: of our own names alone.
    pub(crate) fn file_name(&self, kind: Kind, part: Part) -> String {
        let of = match (part.target, part.run) {
            (Some(target), Some(run)) => format!("-target-{target}-run-{run}"),
            (Some(target), None) => format!("-target-{target}"),
            _ => String::new(),
        };
        format!("sightline-{}{of}-{}", self.session.id, kind.name())
    }

    /// The left and right image of the pair in which a step was tracked.
    ///
    /// # Errors
    /// As [`OpenTraverse::make_ready`]; a damaged file, and a stop that lacks the pair.
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

/// Where to look in the left image to see a step's target, px: where it was found, else where it should be.
pub(crate) fn place_of(trace: &StepTrace) -> Option<Pixel> {
    let found = trace.located().and_then(|located| located.left_pixel);
    let predicted = || trace.point_mast.predicted_left;
    let designated = || {
        let designation = trace.update.target.designation;
        (designation.step == trace.step).then_some(designation.pixel)
    };
    found.or_else(predicted).or_else(designated)
}
