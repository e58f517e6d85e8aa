//! Removing and restoring targets and runs; recorded data are not overwritten.
//!
//! Runs are a tree: a fork shares the steps before the fork with its parent. A removed run is hidden and its number is not
//! used again; it is still computed after a restart if a fork needs its steps.
//!
//! The last [`RESTORABLE_TARGETS`] removed targets can be restored. Older ones keep only their number and label, so that
//! the memory of a long session is bounded.

use crate::{Cursor, Run, Session};
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;

/// Number of removed targets of a session that can be restored.
pub const RESTORABLE_TARGETS: usize = 16;

impl Session {
    /// The number of targets that were not removed.
    pub fn target_count(&self) -> usize {
        self.targets.iter().filter(|record| !record.removed).count()
    }

    /// Removes a target; its number is not used again. Once more than [`RESTORABLE_TARGETS`] are removed, the one removed
    /// first loses its runs.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such target.
    pub fn remove_target(&mut self, target: usize) -> Result<()> {
        let record = self.target_mut(target)?;
        record.removed = true;
        let designation = record.designation;
        if let Some(steering) = &mut self.steering {
            steering.command.waiting.retain(|waiting| waiting.designation != designation);
        }
        if self.cursor.target == Some(target) {
            let other = self.targets.iter().rposition(|record| !record.removed);
            self.cursor = Cursor { target: other, run: 0, step: self.cursor.step };
        }
        self.note_removal(target);
        Ok(())
    }

    /// Records a target as the last one removed.
    pub(super) fn note_removal(&mut self, target: usize) {
        self.removals.push_back(target);
        while self.removals.len() > RESTORABLE_TARGETS {
            let oldest = self.removals.pop_front().and_then(|oldest| self.targets.get_mut(oldest));
            if let Some(record) = oldest {
                record.runs = Vec::new();
            }
        }
    }

    /// Restores a removed target, and selects it.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such target, or it was not removed, or too long ago.
    pub fn restore_target(&mut self, target: usize) -> Result<()> {
        let id = self.id.clone();
        let found = self.targets.get_mut(target).filter(|record| record.removed);
        let record =
            found.ok_or_else(|| Error::Request(format!("session {id} has no removed target {target}")))?;
        if record.runs.is_empty() {
            return Err(Error::Request(format!(
                "target {target} was removed too long ago: the last {RESTORABLE_TARGETS} removed targets can be restored"
            )));
        }
        record.removed = false;
        let run = record.runs.iter().rposition(|run| !run.removed).unwrap_or(0);
        self.removals.retain(|removed| *removed != target);
        self.cursor = Cursor { target: Some(target), run, step: self.cursor.step };
        Ok(())
    }

    /// Removes a run; its forks keep the shared steps. If it is selected, the cursor moves to its parent or another run.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such run, or it is the only one.
    pub fn remove_run(&mut self, target: usize, run: usize) -> Result<()> {
        let parent = self.run(target, run)?.fork.map(|fork| fork.run);
        let record = self.target(target)?;
        let others: Vec<usize> =
            (0..record.runs.len()).filter(|&other| other != run && !record.runs[other].removed).collect();
        let next = parent.filter(|parent| others.contains(parent)).or(others.first().copied());
        let next = next.ok_or_else(|| {
            Error::Request(format!("run {run} is the only one of target {target}: remove the target instead"))
        })?;
        self.run_mut(target, run)?.removed = true;
        if (self.cursor.target, self.cursor.run) == (Some(target), run) {
            self.cursor.run = next;
        }
        Ok(())
    }

    /// Restores a removed run.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such run, or it was not removed.
    pub fn restore_run(&mut self, target: usize, run: usize) -> Result<()> {
        if !self.any_run(target, run)?.removed {
            return Err(Error::Request(format!("run {run} of target {target} was not removed")));
        }
        self.run_mut(target, run)?.removed = false;
        Ok(())
    }

    /// Whether a run, or a fork of it, was not removed, so that its steps must be computed.
    pub fn is_needed(&self, target: usize, run: usize) -> bool {
        let Ok(record) = self.target(target) else { return false };
        let leaves = |child: &Run| child.fork.is_some_and(|fork| fork.run == run);
        record.runs.get(run).is_some_and(|found| !found.removed)
            || (run + 1..record.runs.len())
                .any(|child| leaves(&record.runs[child]) && self.is_needed(target, child))
    }

    /// Displaces the prediction of a run's first own step to a pixel of the left image; to be called before that step is
    /// computed.
    ///
    /// # Errors
    /// [`Error::Request`] if there is no such run, or it begins with a designation, which has no prediction.
    pub fn displace(&mut self, target: usize, run: usize, prediction_px: Pixel) -> Result<()> {
        let designated = self.target(target)?.designation.step;
        let fork = self.run_mut(target, run)?.fork.as_mut().filter(|fork| fork.from_step > designated);
        let fork = fork.ok_or_else(|| Error::Request(NO_PREDICTION.to_owned()))?;
        fork.prediction_px = Some(prediction_px);
        Ok(())
    }

    /// A run of a target, removed or not.
    ///
    /// # Errors
    /// [`Error::Request`] if there is none with this number.
    pub(crate) fn any_run(&self, target: usize, run: usize) -> Result<&Run> {
        let found = self.target(target)?.runs.get(run);
        found.ok_or_else(|| self.no_run(target, run))
    }

    pub(super) fn no_run(&self, target: usize, run: usize) -> Error {
        match self.target(target) {
            Ok(_) => Error::Request(format!("target {target} has no run {run}")),
            Err(error) => error,
        }
    }
}

/// Why a designation cannot be displaced.
pub(super) const NO_PREDICTION: &str =
    "prediction_px: the target is designated at this step, so that nothing is predicted: leave it out";

impl Run {
    /// The displaced prediction of a step in the left image, px; `None` if it is by dead reckoning.
    pub fn displaced_at(&self, step: usize) -> Option<Pixel> {
        self.fork.filter(|fork| fork.from_step == step).and_then(|fork| fork.prediction_px)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::TargetRecord;
    use sightline_track::settings::Settings;
    use sightline_track::target::Designation;

    /// A session with this number of targets, without steps.
    fn session(targets: usize) -> Session {
        let designation = Designation::new(0, Pixel::new(1.0, 2.0));
        let target = |number| TargetRecord {
            label: format!("target {number}"),
            designation,
            runs: vec![Run::new(Arc::new(Settings::default()), None, Vec::new())],
            removed: false,
        };
        Session { targets: (0..targets).map(target).collect(), ..Session::new("s1", "t", 3) }
    }

    #[test]
    fn old_removed_targets_give_their_runs_up() {
        let count = RESTORABLE_TARGETS + 3;
        let mut session = session(count);
        for target in 0..count - 1 {
            session.remove_target(target).unwrap();
        }
        assert_eq!(session.target_count(), 1);
        let kept = session.targets.iter().filter(|record| !record.runs.is_empty()).count();
        assert_eq!(kept, RESTORABLE_TARGETS + 1);
        assert!(session.restore_target(0).unwrap_err().to_string().contains("too long ago"));
        session.restore_target(5).unwrap();
        assert_eq!((session.target_count(), session.cursor.target), (2, Some(5)));

        let saved = session.saved();
        let restored = Session::restored(&saved, 3).unwrap();
        assert_eq!(restored.saved(), saved);
        assert!(restored.clone().restore_target(0).is_err() && restored.clone().restore_target(6).is_ok());
    }
}
