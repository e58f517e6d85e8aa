//! Progress of runs: their next computation, cancelling and resuming them, and restoring a saved session. Steps are never
//! saved: the same input gives the same bits.

use std::sync::Arc;

use super::breakpoints::Breakpoints;
pub use super::view::SAVED_FORMAT;
use super::view::{SavedRun, SavedSession, SavedTarget};
use super::{Pending, Run, Session, TargetRecord};
use crate::driving::{Steering, check_command};
use crate::step::RunStep;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::Traverse;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;

/// The reason of a cancelled run.
const CANCELLED: &str = "cancelled";

/// The next computation of a run.
#[derive(Clone, Debug)]
pub enum Next {
    /// Its first step: the designation under the run's own settings.
    Designate {
        /// The designation.
        designation: Designation,
        /// The run's configuration.
        settings: Arc<Settings>,
    },
    /// The step after its last one.
    Advance(Pending),
    /// The stages of the world after a pause at the last stop: pointing the mast, taking the images.
    Prepare {
        /// The run's last whole step; the mast is pointed at its target.
        last: Arc<RunStep>,
        /// The stage before which the drive pauses next; `None` without a pause.
        before: Option<CycleStage>,
    },
    /// A drive to the next stop, on the estimates of these steps.
    Drive {
        /// The driving run and its command.
        steering: Box<Steering>,
        /// The run's steps so far; the last one is at the last stop.
        steps: Vec<Arc<RunStep>>,
    },
    /// Nothing: the run is complete or stopped, or is not needed.
    Nothing,
}

impl Session {
    /// Restores a saved session. Its runs have no steps yet; [`Session::next`] returns the computations that create them.
    ///
    /// # Errors
    /// [`Error::Request`] for another version of the format, or if a target or run is inconsistent.
    pub fn restored(saved: &SavedSession, stop_count: usize) -> Result<Self> {
        if saved.format != SAVED_FORMAT {
            let format = saved.format;
            return Err(Error::Request(format!(
                "version {format} of the saved form is not known; this program reads version {SAVED_FORMAT}"
            )));
        }
        let restore = |(number, target)| restored_target(number, target, stop_count);
        let targets = saved.targets.iter().enumerate().map(restore).collect::<Result<_>>()?;
        let breakpoints = Breakpoints::restored(&saved.breakpoints);
        let new = Self::new(&saved.id, &saved.traverse, stop_count);
        let (steering, visits) = (saved.steering.clone(), saved.visits.clone());
        let mut session = Self { targets, breakpoints, steering, visits, ..new };
        // The order of removal is not saved; the order of the numbers replaces it.
        for (number, record) in saved.targets.iter().enumerate() {
            if record.removed && !record.runs.is_empty() {
                session.note_removal(number);
            }
        }
        // An invalid cursor is ignored, so that the targets are not lost.
        let _ = session.move_cursor(saved.cursor);
        Ok(session)
    }

    /// The next computation of a run. Copies the steps that a fork shares with its parent first.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such target or run.
    pub fn next(&mut self, target: usize, run: usize) -> Result<Next> {
        let designation = self.target(target)?.designation;
        let current = self.any_run(target, run)?;
        if current.stopped.is_some() || !self.is_needed(target, run) {
            return Ok(Next::Nothing);
        }
        if current.steps.is_empty() {
            match current.fork.filter(|fork| fork.from_step > designation.step) {
                None => return Ok(Next::Designate { designation, settings: Arc::clone(&current.settings) }),
                Some(fork) => {
                    let kept = self.any_run(target, fork.run)?.steps_before(fork.from_step);
                    let current = self.run_mut(target, run)?;
                    match kept {
                        Some(kept) => current.steps = kept,
                        None => {
                            current.stopped = Some(format!(
                                "run {}, from which it branched, has not reached that step",
                                fork.run
                            ));
                        }
                    }
                }
            }
        }
        if let Some(prepare) = self.preparation(target, run)? {
            return Ok(prepare);
        }
        if let Some(pending) = self.pending(target, run)? {
            return Ok(Next::Advance(pending));
        }
        Ok(self.drive_of(target, run).unwrap_or(Next::Nothing))
    }

    /// The pending stages of the world at the last stop, if this run drives and is not paused before them.
    fn preparation(&self, target: usize, number: usize) -> Result<Option<Next>> {
        let run = self.any_run(target, number)?;
        let steering = self.steering.as_ref().filter(|s| (s.target, s.run) == (target, number));
        let (Some(steering), Some(awaits), Some(last)) = (steering, self.awaits, run.whole_steps().last())
        else {
            return Ok(None);
        };
        let before = steering.halt_within(last.step + 1);
        let is_next = last.step + 2 == self.stop_count && run.stop_after.is_none();
        let goes_on = is_next && before.is_none_or(|before| before > awaits);
        Ok(goes_on.then(|| Next::Prepare { last: Arc::clone(last), before }))
    }

    /// The drive to the next stop, if this run drives, has completed its step at the last stop, and is not paused.
    fn drive_of(&self, target: usize, number: usize) -> Option<Next> {
        let steering =
            self.steering.as_ref().filter(|steering| (steering.target, steering.run) == (target, number))?;
        let run = self.run(target, number).ok()?;
        let last = run.steps.last().filter(|last| !last.is_begun())?.step;
        let waits = steering.halt().is_some_and(|halt| last >= halt.stop) || run.stop_after.is_some();
        (last + 1 == self.stop_count && !waits)
            .then(|| Next::Drive { steering: Box::new(steering.clone()), steps: run.steps.clone() })
    }

    /// Sets the driving run and its command.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such target or run, or its target is not located yet; [`Error::Setting`] for a
    /// command that is invalid for the target.
    pub fn steer(&mut self, traverse: &Traverse, mut steering: Steering) -> Result<()> {
        self.check_then(steering.target, &steering.then)?;
        let run = self.run(steering.target, steering.run)?;
        let first = run.steps.first().ok_or_else(|| {
            Error::Request("the target is not located yet; wait for the run's first step".to_owned())
        })?;
        // A changed command for the current target keeps the stop at which the drive to it began.
        if let Some(present) = self.steering.as_ref().filter(|present| present.target == steering.target) {
            steering.command.since = steering.command.since.or(present.command.since);
        }
        steering.command.waiting = self.waiting(&steering.then);
        check_command(traverse, &steering.command, &first.trace)?;
        if steering.pause.is_some() && steering.pause_at.is_none() {
            let problem = "a pause before or after a stage needs the stop, in `pause_at`";
            return Err(Error::setting("pause", problem));
        }
        self.steering = Some(steering);
        Ok(())
    }

    /// Stops a run after its last step so far; this survives a restart.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such target or run.
    pub fn cancel(&mut self, target: usize, run: usize) -> Result<()> {
        let run = self.run_mut(target, run)?;
        run.stop_after = run.steps.last().map(|last| last.step).or(run.stop_after);
        run.stopped = Some(CANCELLED.to_owned());
        Ok(())
    }

    /// Resumes a stopped run.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such target or run.
    pub fn resume(&mut self, target: usize, run: usize) -> Result<()> {
        let run = self.run_mut(target, run)?;
        (run.stop_after, run.stopped) = (None, None);
        Ok(())
    }

    /// Stops a run because of an error; after a restart it is tried again.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such target or run.
    pub fn fail(&mut self, target: usize, run: usize, why: impl Into<String>) -> Result<()> {
        self.run_mut(target, run)?.stopped = Some(why.into());
        Ok(())
    }

    /// Mutable access to a run of a target.
    ///
    /// # Errors
    /// [`Error::Request`] if there is none with this number.
    pub fn run_mut(&mut self, target: usize, run: usize) -> Result<&mut Run> {
        let found = self.target_mut(target)?.runs.get_mut(run);
        found.ok_or_else(|| Error::Request(format!("target {target} has no run {run}")))
    }
}

impl Run {
    /// The steps before `from_step`; `None` if the run has not reached it.
    pub(crate) fn steps_before(&self, from_step: usize) -> Option<Vec<Arc<RunStep>>> {
        let kept: Vec<_> =
            self.whole_steps().iter().filter(|trace| trace.step < from_step).cloned().collect();
        kept.last().is_some_and(|last| last.step + 1 == from_step).then_some(kept)
    }

    /// Why the run stopped before the last stop; `None` if it did not.
    pub fn why_stopped(&self) -> Option<String> {
        let reached = self.stop_after.is_some() && self.steps.last().map(|last| last.step) == self.stop_after;
        self.stopped.clone().or_else(|| reached.then(|| CANCELLED.to_owned()))
    }
}

fn restored_target(number: usize, saved: &SavedTarget, stop_count: usize) -> Result<TargetRecord> {
    let wrong = |what: String| Error::Request(format!("target {number}: {what}"));
    if saved.designation.step >= stop_count {
        let step = saved.designation.step;
        return Err(wrong(format!("step {step} does not exist: the traverse has {stop_count} stops")));
    }
    // A target that can no longer be restored has no runs.
    if saved.runs.is_empty() && !saved.removed {
        return Err(wrong("it has no run".to_owned()));
    }
    let runs = saved.runs.iter().enumerate().map(|(run, saved)| match saved.fork {
        Some(fork) if fork.run >= run => {
            Err(wrong(format!("run {run} branches from run {}, which is later", fork.run)))
        }
        _ => Ok(restored_run(saved)),
    });
    Ok(TargetRecord {
        label: saved.label.clone(),
        designation: saved.designation,
        removed: saved.removed,
        runs: runs.collect::<Result<_>>()?,
    })
}

fn restored_run(saved: &SavedRun) -> Run {
    let (stop_after, removed) = (saved.stop_after, saved.removed);
    Run { stop_after, removed, ..Run::new(Arc::new(saved.settings.clone()), saved.fork, Vec::new()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::breakpoints::Breakpoint;
    use crate::{Cursor, Fork};
    use sightline_geometry::frames::Pixel;

    fn saved() -> SavedSession {
        let designation = Designation::new(1, Pixel::new(3.0, 4.0));
        let run =
            |fork, stop_after| SavedRun { fork, settings: Settings::default(), stop_after, removed: false };
        SavedSession {
            format: SAVED_FORMAT,
            id: "s1".to_owned(),
            traverse: "t".to_owned(),
            cursor: Cursor { target: Some(0), run: 1, step: 2 },
            targets: vec![SavedTarget {
                label: "rock".to_owned(),
                designation,
                removed: false,
                runs: vec![run(None, Some(3)), run(Some(Fork::new(0, 3)), None)],
            }],
            breakpoints: vec![Breakpoint { number: 4, expression: "ncc < 0.6".to_owned(), on: false }],
            steering: None,
            visits: Vec::new(),
        }
    }

    #[test]
    fn a_restored_session_saves_to_the_same_form() {
        let saved = saved();
        assert_eq!(Session::restored(&saved, 9).unwrap().saved(), saved);
    }

    #[test]
    fn a_restored_run_begins_with_its_designation_and_a_fork_waits_for_its_parent() {
        let mut session = Session::restored(&saved(), 9).unwrap();
        assert!(
            matches!(session.next(0, 0).unwrap(), Next::Designate { designation, .. } if designation.step == 1)
        );
        assert!(matches!(session.next(0, 1).unwrap(), Next::Nothing));
        assert!(session.run(0, 1).unwrap().why_stopped().unwrap().contains("run 0"));
    }

    #[test]
    fn a_saved_form_that_names_what_cannot_exist_is_refused() {
        let refuse = |saved: &SavedSession, stops| Session::restored(saved, stops).unwrap_err().to_string();
        assert!(refuse(&SavedSession { format: 2, ..saved() }, 9).contains("version 2"));
        assert!(refuse(&saved(), 1).contains("step 1"));
        let mut circular = saved();
        circular.targets[0].runs[1].fork = Some(Fork::new(1, 3));
        assert!(refuse(&circular, 9).contains("run 1"));
    }

    #[test]
    fn a_cursor_that_points_nowhere_does_not_lose_the_targets() {
        let mut lost = saved();
        lost.cursor.run = 7;
        let session = Session::restored(&lost, 9).unwrap();
        assert_eq!((session.cursor, session.targets.len()), (Cursor::default(), 1));
    }
}
