//! What every part of the panel “Shape” is given, and what it says where it has no data.

use egui::Ui;
use sightline_session::step::RunStep;
use sightline_track::locate::shape_tracker::ShapeEvidence;

use crate::cache::Slot;
use crate::panels;
use crate::state::State;

/// What a part of the panel is given.
#[derive(Clone, Copy)]
pub(super) struct Look<'a> {
    pub(super) state: &'a State,
    pub(super) trace: &'a RunStep,
    pub(super) evidence: &'a ShapeEvidence,
}

/// Why a part of this step has no data.
pub(super) fn why_not(look: &Look<'_>, what: &str) -> String {
    let evidence = look.evidence;
    let reason = evidence.registration.as_ref().and_then(|found| found.reason.as_ref());
    let why = reason.or(evidence.missing.as_ref()).unwrap_or(&evidence.why);
    format!("No {what} at step {}: {why}.", look.trace.step)
}

/// What is in a slot; a sentence on the screen where it is not there.
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
