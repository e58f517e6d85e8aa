//! The inspector: the declared quantities of the selected stage, then the rest of its evidence as a tree.

mod motion;
mod quantities;
mod times;
mod tree;

use egui::{RichText, ScrollArea, Ui};
use serde_json::Value;
use sightline_record::{Unit, label};
use sightline_session::records;
use sightline_session::step::RunStep;
use sightline_track::settings::TrackerKind;

use self::tree::EvidencePath;
use crate::command::{Command, Stage, StageBarExtent};
use crate::compare::panel::readouts;
use crate::panels::panel::Panel;
use crate::state::State;
use crate::{driving, panels, theme};

/// The panel “Inspector”.
pub(crate) struct Inspector;

impl Panel for Inspector {
    fn show(&self, ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
        show(ui, state, out);
    }
}

/// Shows the record.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(state.stage().word()).strong().color(theme::strong()));
        ui.label(theme::note(state.stage().question()));
    });
    // The line is shown, empty, before the times are loaded, so that the rest does not move.
    ui.label(theme::note(times::line(state).unwrap_or_default())).on_hover_text(times::HELP);
    if state.stage().is_of_drive() {
        driving::stages::show(ui, state);
        return;
    }
    let Some(trace) = state.trace() else {
        panels::missing(ui, "", &state.missing_step());
        return;
    };
    let stages = recorded(trace, state.stage());
    if stages.is_empty() {
        panels::missing(ui, "", &not_reached(trace, state));
        return;
    }
    ScrollArea::vertical().auto_shrink(false).id_salt(state.stage()).show(ui, |ui| {
        readouts::record(ui, state, |trace| self::record(trace, state.stage()));
        if state.stage() == Stage::PREDICT {
            motion::show(ui, state, out);
        }
        for (index, stage) in stages.into_iter().enumerate() {
            if index > 0 {
                ui.add_space(4.0);
                ui.label(theme::title(&label(&stage.schema().stage, Unit::One)));
                ui.label(theme::note(stage.schema().question.as_ref()));
            }
            section(ui, trace, stage, out);
        }
        if let Some(truth) = records::stage("truth").filter(|truth| truth.is_reached(trace)) {
            ui.add_space(4.0);
            ui.label(theme::title("against the truth"));
            section(ui, trace, truth, out);
        }
    });
}

/// A stage of the record.
type RecordedStage = &'static sightline_record::Stage<RunStep>;

/// The reached stages of the record that a stage of the bar shows: its own first, then those that have no entry of their
/// own in the tracker's bar.
fn recorded(trace: &RunStep, stage: Stage) -> Vec<RecordedStage> {
    let tracker = trace.located().map_or_else(TrackerKind::default, |l| l.evidence.tracker());
    let mut of = Stage::PREDICT;
    let mut shown: Vec<RecordedStage> = Vec::new();
    for recorded in records::stages().iter().filter(|recorded| is_in_bar(recorded)) {
        let word = recorded.schema().stage.as_ref();
        let own = Stage::bar(tracker, StageBarExtent::Odometry).find(|stage| stage.word() == word);
        of = own.unwrap_or(if of.is_step_of_locate() { of } else { Stage::LOCATE });
        // `detect` records the counts of its next two steps.
        let counts = matches!(stage, Stage::MATCH_FEATURES | Stage::TRIANGULATE) && of == Stage::DETECT;
        if (of == stage || counts) && recorded.is_reached(trace) {
            shown.push(recorded);
        }
    }
    shown.sort_by_key(|recorded| recorded.schema().stage != stage.word());
    shown
}

/// Whether a stage of the record is shown with a stage of the bar: the row repeats others, and the truth is shown with
/// all.
fn is_in_bar(stage: &sightline_record::Stage<RunStep>) -> bool {
    let schema = stage.schema();
    !schema.path.is_empty() && schema.stage != "truth"
}

/// The quantities of a stage, then the rest of its evidence.
fn section(ui: &mut Ui, trace: &RunStep, stage: RecordedStage, out: &mut Vec<Command>) {
    quantities::show(ui, trace, stage, out);
    let place = EvidencePath { stage, path: String::new(), step: trace.step };
    tree::entries(ui, &place, &records::rest(stage, trace), out);
}

fn not_reached(trace: &RunStep, state: &State) -> String {
    let word = state.stage().word();
    if let Some(sentence) = state.missing_by_pause(trace.step) {
        return sentence;
    }
    if let Some(sentence) = state.missing_odometry().filter(|_| state.stage() == Stage::VISUAL_ODOMETRY) {
        return sentence;
    }
    match (trace.fault(), trace.prediction().is_none()) {
        (Some(fault), _) => format!("{word} was not reached: {fault}"),
        (None, true) => {
            let mut steps = Stage::of(state.tracker()).filter(|stage| stage.is_step_of_locate());
            let other = steps.find(|stage| is_reached(trace, *stage)).unwrap_or(Stage::LOCATE).word();
            let next = state.next_step_words("to see it");
            format!("{word} is not part of the designation.{next} Select {other} to see values of this step.")
        }
        (None, false) => format!("{word} was not reached: {}", state.missing_step()),
    }
}

/// Whether a stage was reached.
pub(crate) fn is_reached(trace: &RunStep, stage: Stage) -> bool {
    match stage {
        // The registration has evidence before its refinement has finished.
        Stage::REFINE_REGISTER => trace
            .shape()
            .and_then(|evidence| evidence.registration.as_ref())
            .is_some_and(|found| found.mean_m[2].is_some()),
        // The feature tracker triangulates in `detect`.
        Stage::TRIANGULATE if trace.features().is_some() => is_reached(trace, Stage::DETECT),
        _ => records::stage(stage.word()).is_some_and(|recorded| recorded.is_reached(trace)),
    }
}

/// The evidence of a stage as one tree; `None` if the stage was not reached.
pub(crate) fn record(trace: &RunStep, stage: Stage) -> Option<Value> {
    let mut stages = recorded(trace, stage).into_iter();
    let mut whole = records::evidence(stages.next()?, trace);
    for other in stages {
        whole[other.schema().stage.as_ref()] = records::evidence(other, trace);
    }
    Some(whole)
}
