//! Sentences that explain why a panel is empty and what to do about it.

use crate::cache::Slot;
use crate::state::State;
use sightline_session::driving::DriveView;

impl State {
    /// Why the panels of a step are empty, and what to do.
    pub(crate) fn missing_step(&self) -> String {
        let Some(target) = self.target() else { return self.missing_target() };
        let step = self.cursor.step;
        if step < target.designation.step {
            let first = target.designation.step;
            return format!(
                "{} was designated at step {first}. Go there, or press PgDn for the next event.",
                target.label
            );
        }
        if let Some(sentence) = self.missing_by_pause(step) {
            return sentence;
        }
        if self.row().is_none() {
            return match (self.run_progress(), self.run().and_then(|run| run.stopped.as_deref())) {
                (Some(p), _) => {
                    format!("Step {step} is not computed yet: the run has done {} of {}.", p.k, p.n)
                }
                (None, Some(why)) => format!(
                    "The run stopped before step {step} ({why}). Press “Run from here” at an earlier step."
                ),
                (None, None) => {
                    format!("Step {step} is not computed yet. It appears here as soon as the run reaches it.")
                }
            };
        }
        match self.trace_at(step) {
            Slot::Failed(problem) => format!("Step {step} cannot be shown: {}", problem.detail),
            Slot::Ready(trace) if let Some(why) = trace.why_not_searched() => {
                format!("At step {step}, {why}. Step to a tracked stop to see a match.")
            }
            Slot::Ready(trace) => match (trace.fault(), trace.located()) {
                (Some(fault), _) => format!("The files of step {step} are at fault: {fault}"),
                (None, Some(located)) if located.missing.is_some() => {
                    located.missing.clone().unwrap_or_default()
                }
                _ if trace.prediction().is_none() => {
                    let next = self.next_step_words("for the first one");
                    format!("Target designated here; no match yet.{next}")
                }
                _ => "This stage was not reached at this step.".to_owned(),
            },
            Slot::Absent | Slot::Loading => format!("Loading step {step} …"),
        }
    }

    /// Where to go from an empty step; empty at the last stop.
    pub(crate) fn next_step_words(&self, purpose: &str) -> String {
        if self.cursor.step + 1 < self.stop_count() {
            return format!(" Press → {purpose}.");
        }
        let goes_on = |drive: &&DriveView| drive.cycles.last().is_none_or(|cycle| cycle.ending.is_none());
        match self.drive().filter(goes_on).map(|drive| drive.is_driving) {
            Some(true) => " The rover drives; its next stop is added here.".to_owned(),
            Some(false) => " The rover waits; continue in the panel Drive.".to_owned(),
            None => " This drive has no further stop.".to_owned(),
        }
    }

    /// Why there is no target, and how to get one.
    pub(crate) fn missing_target(&self) -> String {
        match (&self.traverse, &self.traverses) {
            (None, None) => "Asking the server for its traverses …".to_owned(),
            (None, Some(list)) if list.is_empty() => {
                "The server has no traverse. Import one with `sightline import`, or simulate one with `sightline simulate`.".to_owned()
            }
            (None, Some(_)) => "Opening the traverse …".to_owned(),
            (Some(_), _) => "No target yet. Click a rock in the left image, or press T for the map of trackability.".to_owned(),
        }
    }
}
