//! The stages of a step in running order, each with its question and the accessor of its evidence.
//!
//! ```text
//! step ─► predict ─► point_mast ─► capture ─► the steps of locate ─► locate ─► judge ─► update
//! ```
//! The quantities, arrays and gates are declared beside each evidence type (`impl Record`). `session::records` adds
//! the row of a step and its comparison with the truth; tables, comparisons, expressions, logs and pages are views of
//! that list. A quantity or an array is added in one file; a step of `locate` needs its own file and a field in the
//! evidence of its tracker.

use std::sync::LazyLock;

use sightline_record::{ArrayDecl, ArrayView, Stage};

use crate::locate::template::memory::TemplateMemory;
use crate::locate::{self, Evidence};
use crate::settings::TrackerKind;
use crate::trace::StepTrace;

static STAGES: LazyLock<Vec<Stage<StepTrace>>> = LazyLock::new(stages);

/// The stages of all trackers, in running order.
pub fn stages() -> Vec<Stage<StepTrace>> {
    let mut stages = vec![
        Stage::of("predict", "Where should the target be now, by dead reckoning?", StepTrace::prediction)
            .at("predict"),
        Stage::of(
            "point_mast",
            "Which pointing centres the prediction, and where does it appear?",
            StepTrace::pointing,
        )
        .at("point_mast"),
        Stage::of("capture", "What was photographed, and how well is it exposed?", StepTrace::capture)
            .at("capture"),
    ];
    let of_trackers = locate::stages().into_iter();
    stages.extend(of_trackers.map(|stage| stage.within(evidence, &["locate.evidence"])));
    stages.extend([
        Stage::of("locate", "Where is the target now?", StepTrace::located).at("locate"),
        Stage::of("judge", "Can the match be trusted?", StepTrace::verdict).at("judge"),
        Stage::of("update", "What does this stop leave to the next?", StepTrace::updated)
            .with(|t: &StepTrace| t.updated()?.target.memory.template(), TemplateMemory::declare)
            .at("update"),
    ]);
    stages
}

fn evidence(trace: &StepTrace) -> Option<&Evidence> {
    Some(&trace.located()?.evidence)
}

/// The stages of a tracker shown to a user, in running order: the six of every tracker, with its own steps after `locate`.
pub fn stages_of(tracker: TrackerKind) -> impl Iterator<Item = &'static str> {
    let before = ["predict", "point_mast", "capture", "locate"].into_iter();
    before.chain(locate::steps(tracker).iter().copied()).chain(["judge", "update"])
}

/// The declarations of all arrays, in the order of the stages.
pub(crate) fn arrays() -> impl Iterator<Item = &'static ArrayDecl> {
    STAGES.iter().flat_map(|stage| &stage.schema().arrays)
}

/// Returns the array with this name; `None` if its stage did not make it at this step.
pub fn array<'a>(trace: &'a StepTrace, name: &str) -> Option<ArrayView<'a>> {
    STAGES.iter().find_map(|stage| stage.array(trace, name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_step_of_a_tracker_is_a_stage_of_the_record() {
        let names: Vec<_> = stages().iter().map(|stage| stage.schema().stage.clone()).collect();
        for tracker in TrackerKind::ALL {
            for name in stages_of(tracker) {
                assert!(names.iter().any(|known| known == name), "{}: {name}", tracker.word());
            }
        }
    }
}
