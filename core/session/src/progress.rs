//! How a run comes forward: what it needs next, how it is cancelled and resumed, and how all of it begins
//! again from a saved session. Steps are never saved: the same input gives the same bits.

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

/// What a cancelled run says.
const CANCELLED: &str = "cancelled";

/// What a run needs next.
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
    /// The world's part of the stages before a pause at the last stop: pointing the mast, taking the images.
    Prepare {
        /// The run's last whole step, whose target the mast is pointed at.
        last: Arc<RunStep>,
        /// The stage before which the drive is paused again; `None`: it is not.
        before: Option<CycleStage>,
    },
    /// A drive to another stop, on the estimates of these steps.
    Drive {
        /// Who drives, and how.
        steering: Box<Steering>,
        /// The run's steps so far; the last is that of the last stop.
        steps: Vec<Arc<RunStep>>,
    },
    /// Nothing: it is complete, was stopped, or its target was removed.
    Nothing,
}

impl Session {
    /// The session of a saved form; its runs have no steps yet, and [`Session::next`] says how to get them.
    ///
    /// # Errors
    /// [`Error::Request`] for another version of the form, or when a target or run names what cannot exist.
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
        // Those removed before an earlier end of the program count as removed in the order of their numbers.
        for (number, record) in saved.targets.iter().enumerate() {
            if record.removed && !record.runs.is_empty() {
                session.note_removal(number);
            }
        }
        // A cursor that points nowhere is no reason to lose the targets.
        let _ = session.move_cursor(saved.cursor);
        Ok(session)
    }

    /// What a run needs next. A run that shares steps with the one it left takes them over here.
    ///
    /// # Errors
    /// [`Error::Request`] when there is no such target or run.
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

    /// What the world still has to do for the next stage at the last stop, where this run drives and is not to wait for it.
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

    /// The drive to another stop, where this run has located the target at the last stop, drives, and is not to wait.
    fn drive_of(&self, target: usize, number: usize) -> Option<Next> {
        let steering =
            self.steering.as_ref().filter(|steering| (steering.target, steering.run) == (target, number))?;
        let run = self.run(target, number).ok()?;
        let last = run.steps.last().filter(|last| !last.is_begun())?.step;
        let waits = steering.halt().is_some_and(|halt| last >= halt.stop) || run.stop_after.is_some();
        (last + 1 == self.stop_count && !waits)
            .then(|| Next::Drive { steering: Box::new(steering.clone()), steps: run.steps.clone() })
    }

    /// Lets a run drive under a command.
    ///
    /// # Errors
    /// [`Error::Request`] when there is no such target or run, or its target is not located yet; [`Error::Setting`] for a command
    /// that makes no sense for the target.
    pub fn steer(&mut self, traverse: &Traverse, mut steering: Steering) -> Result<()> {
        self.check_then(steering.target, &steering.then)?;
        let run = self.run(steering.target, steering.run)?;
        let first = run.steps.first().ok_or_else(|| {
            Error::Request("the target is not located yet; wait for the run's first step".to_owned())
        })?;
        // A changed command for the present target approaches it from the same place.
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

    /// Stops a run after its last step so far; that survives a restart.
    ///
    /// # Errors
    /// [`Error::Request`] when there is no such target or run.
    pub fn cancel(&mut self, target: usize, run: usize) -> Result<()> {
        let run = self.run_mut(target, run)?;
        run.stop_after = run.steps.last().map(|last| last.step).or(run.stop_after);
        run.stopped = Some(CANCELLED.to_owned());
        Ok(())
    }

    /// Lets a stopped run go on.
    ///
    /// # Errors
    /// [`Error::Request`] when there is no such target or run.
    pub fn resume(&mut self, target: usize, run: usize) -> Result<()> {
        let run = self.run_mut(target, run)?;
        (run.stop_after, run.stopped) = (None, None);
        Ok(())
    }

    /// Stops a run because something went wrong; after a restart it is tried again.
    ///
    /// # Errors
    /// [`Error::Request`] when there is no such target or run.
    pub fn fail(&mut self, target: usize, run: usize, why: impl Into<String>) -> Result<()> {
        self.run_mut(target, run)?.stopped = Some(why.into());
        Ok(())
    }

    /// A run of a target, to change it.
    ///
    /// # Errors
    /// [`Error::Request`] when there is none of that number.
    pub fn run_mut(&mut self, target: usize, run: usize) -> Result<&mut Run> {
        let found = self.target_mut(target)?.runs.get_mut(run);
        found.ok_or_else(|| Error::Request(format!("target {target} has no run {run}")))
    }
}

impl Run {
    /// The steps before `from_step`; none when the run has not come so far.
    pub(crate) fn steps_before(&self, from_step: usize) -> Option<Vec<Arc<RunStep>>> {
        let kept: Vec<_> =
            self.whole_steps().iter().filter(|trace| trace.step < from_step).cloned().collect();
        kept.last().is_some_and(|last| last.step + 1 == from_step).then_some(kept)
    }

    /// Why the run is not going on before the last stop.
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
    // A target that was removed long ago has none.
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
