//! The context shared by the parts of the panel “Shape”, and the text of a part without data.

use egui::Ui;
use sightline_session::step::RunStep;
use sightline_track::locate::shape_tracker::ShapeEvidence;

use crate::cache::Slot;
use crate::panels;
use crate::state::State;

/// The context of a part.
#[derive(Clone, Copy)]
pub(super) struct PartContext<'a> {
    pub(super) state: &'a State,
    pub(super) trace: &'a RunStep,
    pub(super) evidence: &'a ShapeEvidence,
}

/// Why a part of this step has no data.
pub(super) fn why_not(context: &PartContext<'_>, what: &str) -> String {
    let evidence = context.evidence;
    let reason = evidence.registration.as_ref().and_then(|found| found.reason.as_ref());
    let why = reason.or(evidence.missing.as_ref()).unwrap_or(&evidence.why);
    format!("No {what} at step {}: {why}.", context.trace.step)
}

/// The item in a slot; if it is not loaded, shows a sentence and returns `None`.
pub(super) fn ready<'a, T>(ui: &mut Ui, slot: Slot<'a, T>, what: &str) -> Option<&'a T> {
    match slot {
        Slot::Ready(item) => return Some(item),
        Slot::Failed(problem) => {
            panels::missing(ui, "", &format!("The {what} cannot be shown: {}", problem.detail));
        }
        Slot::Absent | Slot::Loading => panels::missing(ui, "", &format!("Loading the {what} …")),
    }
    None
}
