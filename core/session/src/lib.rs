//! A session: one person's work on one traverse, with targets, their runs, and the cursor. No network, no files.
//!
//! A *run* is one configuration over one target. Its steps are recorded as they are computed, so that going back only reads.
//! A changed setting never overwrites a run: it forks a new run that shares the steps before the fork. The saved form is
//! small: [`Session::saved`] lists the person's actions. The session is recomputed from them bit for bit, because every step
//! is a function of its input.

pub mod counterfactual;
pub mod documents;
pub mod exports;
pub mod notes;
pub mod progress;
pub mod removal;
mod memory;
mod run;
pub mod shell;
pub mod step;
pub mod summary;
pub mod records;
pub mod marks;
pub mod track;
pub mod driving;
pub mod targeted_drive;
pub mod visits;
pub mod faults;
pub mod hazard_view;
pub mod pause;
pub mod view;
pub mod photometry;
pub mod format;
pub mod what_if;
pub mod why;
pub mod compare;
pub mod metrics;
pub mod expression;
pub mod breakpoints;
pub mod query;
pub mod replayed_drive;
pub mod reproduce;
pub mod stop_cause;
pub mod times;
#[cfg(test)]
mod breakpoint_tests;

use std::collections::VecDeque;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

pub use self::breakpoints::Breakpoints;
pub use self::progress::Next;
pub use self::run::{Fork, Run};
use crate::driving::Steering;
use crate::step::RunStep;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::settings::{Changes, Settings};
use sightline_track::target::Designation;

/// The selection that all panels show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Cursor {
    /// The number of the selected target; null before the first designation.
    pub target: Option<usize>,
    /// The number of the selected run within the target.
    pub run: usize,
    /// The selected stop.
    pub step: usize,
}

/// A designated target with its runs.
#[derive(Clone, Debug)]
pub struct TargetRecord {
    /// Its label.
    pub label: String,
    /// Its designation.
    pub designation: Designation,
    /// Its runs, by number; a fork has a larger number than its parent.
    pub runs: Vec<Run>,
    /// Whether it was removed; the other targets keep their numbers.
    pub removed: bool,
}

/// One person's work on one traverse.
#[derive(Clone, Debug)]
pub struct Session {
    /// The session's name in paths.
    pub id: String,
    /// The traverse's name in paths.
    pub traverse: String,
    /// Number of stops of the traverse.
    pub stop_count: usize,
    /// The targets, by number.
    pub targets: Vec<TargetRecord>,
    /// The current selection.
    pub cursor: Cursor,
    /// The breakpoints.
    pub breakpoints: Breakpoints,
    /// The driving run and its command; `None` before the first drive command.
    pub steering: Option<Steering>,
    /// The visits that have ended, of a drive to several targets.
    pub visits: Vec<visits::Visit>,
    /// The first stage for which the last stop of a paused drive is not ready: `point_mast` or `capture`; `None` if it is ready.
    pub awaits: Option<CycleStage>,
    /// The removed targets that can be restored, in order of removal.
    removals: VecDeque<usize>,
}

/// The inputs of the next step of a run.
#[derive(Clone, Debug)]
pub struct Pending {
    /// The designation.
    pub first: Arc<RunStep>,
    /// The last step so far.
    pub last: Arc<RunStep>,
    /// The run's configuration.
    pub settings: Arc<Settings>,
    /// The prediction of the step in the left image as displaced by a person, px; `None`: by dead reckoning.
    pub prediction_px: Option<Pixel>,
    /// The stage before which the step is paused; `None`: the whole step.
    pub before: Option<CycleStage>,
}

impl Session {
    /// A session without targets.
    pub fn new(id: impl Into<String>, traverse: impl Into<String>, stop_count: usize) -> Self {
        let (targets, cursor, breakpoints) = (Vec::new(), Cursor::default(), Breakpoints::default());
        let (id, traverse, removals) = (id.into(), traverse.into(), VecDeque::new());
        Self {
            id,
            traverse,
            stop_count,
            targets,
            cursor,
            breakpoints,
            steering: None,
            visits: Vec::new(),
            awaits: None,
            removals,
        }
    }

    /// Adds a target whose designation was computed, and selects it. Returns its number.
    pub fn add_target(&mut self, label: Option<String>, settings: Settings, first: Arc<RunStep>) -> usize {
        let number = self.targets.len();
        let designation = first.update.target.designation;
        let label = target_label(number, &label.unwrap_or_default());
        let run = Run::new(Arc::new(settings), None, vec![first]);
        self.targets.push(TargetRecord { label, designation, runs: vec![run], removed: false });
        self.cursor = Cursor { target: Some(number), run: 0, step: designation.step };
        number
    }

    /// Renames a target.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such target.
    pub fn rename_target(&mut self, target: usize, label: &str) -> Result<()> {
        self.target_mut(target)?.label = target_label(target, label);
        Ok(())
    }

    /// Forks `run`: the steps before `from_step` are shared, the later ones are computed with changed settings.
    /// At the step of the designation, `redesignated` must be the designation under the new settings.
    /// Returns the number of the new run.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such target, run or step; [`Error::Setting`] for an invalid change.
    pub fn fork(
        &mut self,
        target: usize,
        run: usize,
        from_step: usize,
        changes: &Changes,
        redesignated: Option<Arc<RunStep>>,
    ) -> Result<usize> {
        let parent = self.run(target, run)?;
        let settings = Arc::new(parent.settings.with(changes)?);
        let kept: Vec<_> = match redesignated {
            Some(first) => vec![first],
            None => parent.whole_steps().iter().filter(|trace| trace.step < from_step).cloned().collect(),
        };
        if kept.is_empty() || kept.last().is_some_and(|last| last.step + 1 < from_step) {
            return Err(Error::Request(format!(
                "run {run} of target {target} has no step before step {from_step} yet"
            )));
        }
        let forked = Run::new(settings, Some(Fork::new(run, from_step)), kept);
        let record = self.target_mut(target)?;
        record.runs.push(forked);
        Ok(record.runs.len() - 1)
    }

    /// The inputs of the next step of a run; `None` if the run is complete, stopped, or paused with its drive.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such target or run.
    pub fn pending(&self, target: usize, run: usize) -> Result<Option<Pending>> {
        let run = self.any_run(target, run)?;
        let end = run.stop_after.map_or(self.stop_count, |stop| self.stop_count.min(stop + 1));
        let last = run.whole_steps().last().filter(|last| last.step + 1 < end && run.stopped.is_none());
        let Some(last) = last else { return Ok(None) };
        let before = self.halt_within(last.step + 1);
        let reached = run.begun().and_then(|begun| begun.paused_before()).unwrap_or(CycleStage::Predict);
        Ok(before.is_none_or(|before| before > reached).then(|| Pending {
            first: Arc::clone(&run.steps[0]),
            last: Arc::clone(last),
            settings: Arc::clone(&run.settings),
            prediction_px: run.displaced_at(last.step + 1),
            before,
        }))
    }

    /// Records the next step of a run; it replaces the last step if that was paused between stages.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such target or run, or the step is not the next one.
    pub fn record(&mut self, target: usize, run: usize, trace: Arc<RunStep>) -> Result<()> {
        let run = self.run_mut(target, run)?;
        let expected = run.whole_steps().last().map(|last| last.step + 1);
        if expected != Some(trace.step) {
            return Err(Error::Request(format!("step {} does not follow the run's last one", trace.step)));
        }
        run.steps.truncate(run.whole_steps().len());
        run.steps.push(trace);
        Ok(())
    }

    /// Moves the cursor.
    ///
    /// # Errors
    /// [`Error::Request`] if the target, run or stop does not exist.
    pub fn move_cursor(&mut self, cursor: Cursor) -> Result<()> {
        if let Some(target) = cursor.target {
            self.run(target, cursor.run)?;
        }
        if cursor.step >= self.stop_count {
            let count = self.stop_count;
            return Err(Error::Request(format!(
                "step {} does not exist: the traverse has {count} stops",
                cursor.step
            )));
        }
        self.cursor = cursor;
        Ok(())
    }

    /// A target that was not removed.
    ///
    /// # Errors
    /// [`Error::Request`] if there is none with this number.
    pub fn target(&self, target: usize) -> Result<&TargetRecord> {
        let found = self.targets.get(target).filter(|record| !record.removed);
        found.ok_or_else(|| Error::Request(format!("session {} has no target {target}", self.id)))
    }

    /// A run of a target that was not removed.
    ///
    /// # Errors
    /// [`Error::Request`] if there is none with this number.
    pub fn run(&self, target: usize, run: usize) -> Result<&Run> {
        let found = self.any_run(target, run).ok().filter(|found| !found.removed);
        found.ok_or_else(|| self.no_run(target, run))
    }

    fn target_mut(&mut self, target: usize) -> Result<&mut TargetRecord> {
        let message = format!("session {} has no target {target}", self.id);
        let found = self.targets.get_mut(target).filter(|record| !record.removed);
        found.ok_or(Error::Request(message))
    }
}

/// The given label; if blank, `target` and the number from 1.
fn target_label(number: usize, given: &str) -> String {
    let given = given.trim();
    if given.is_empty() { format!("target {}", number + 1) } else { given.to_owned() }
}
