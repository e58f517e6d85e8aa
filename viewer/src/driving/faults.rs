//! Faults that the user injects into a drive.

use egui::{CollapsingHeader, ComboBox, DragValue, Label, Ui};
use sightline_session::faults::NewFault;
use sightline_world::scenario::{Fault, FaultKind};

use crate::command::Command;
use crate::driving::DrivingCommand;
use crate::state::State;
use crate::{panels, theme};

/// Default duration of a new fault, stops.
const STOPS: u32 = 3;

/// Shows the faults of the next drive or branch.
pub(super) fn form(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let mut faults = state.driving.faults.clone();
    CollapsingHeader::new(theme::label("inject faults")).id_salt("faults").show(ui, |ui| {
        let help = "They are injected into the world of the next drive or branch; this one stays as it is.";
        ui.add(Label::new(theme::note(help)).wrap());
        let mut removed = None;
        for (index, fault) in faults.iter_mut().enumerate() {
            ui.horizontal_wrapped(|ui| {
                row(ui, state, (index, fault));
                if ui.small_button("×").accessible_name(format!("remove fault {}", index + 1)).clicked() {
                    removed = Some(index);
                }
            });
        }
        if let Some(index) = removed {
            faults.remove(index);
        }
        if ui.small_button("Add a fault").clicked() {
            faults.push(new(state));
        }
    });
    if faults != state.driving.faults {
        out.push(Command::Drive(DrivingCommand::Faults(faults)));
    }
}

/// A fault at the stops after the cursor's; without a drive, after the first stop.
fn new(state: &State) -> NewFault {
    let from_step = if state.is_on_commands() { state.cursor.step } else { 0 };
    let from_stop = from_step as u32 + 1;
    let to_stop = from_stop + STOPS - 1;
    NewFault { kind: FaultKind::Occluder, from_stop, to_stop, target: state.cursor.target }
}

fn row(ui: &mut Ui, state: &State, (index, fault): (usize, &mut NewFault)) {
    let number = index + 1;
    let kinds = ComboBox::from_id_salt(("fault", index)).width(140.0).selected_text(word(fault.kind));
    let shown = kinds.show_ui(ui, |ui| {
        for kind in FaultKind::ALL {
            if panels::entry(ui, fault.kind == kind, word(kind)).on_hover_text(effect(kind)).clicked() {
                fault.kind = kind;
            }
        }
    });
    shown.response.accessible_name(format!("kind of fault {number}")).on_hover_text(effect(fault.kind));
    let stop = |value| DragValue::new(value).range(1..=9999);
    ui.add(stop(&mut fault.from_stop).prefix("from stop "))
        .accessible_name(format!("first stop of fault {number}"));
    ui.add(stop(&mut fault.to_stop).prefix("to stop "))
        .accessible_name(format!("last stop of fault {number}"));
    fault.to_stop = fault.to_stop.max(fault.from_stop);
    let targets = state.session.iter().flat_map(|session| &session.targets);
    if fault.kind.is_of_target() {
        let label = |number: Option<usize>| {
            let found = targets.clone().find(|target| Some(target.number) == number);
            found.map_or("first target", |target| target.label.as_str())
        };
        let list = ComboBox::from_id_salt(("target of fault", index)).selected_text(label(fault.target));
        let shown = list.show_ui(ui, |ui| {
            for target in targets.clone() {
                if panels::entry(ui, fault.target == Some(target.number), &target.label).clicked() {
                    fault.target = Some(target.number);
                }
            }
        });
        shown.response.accessible_name(format!("target of fault {number}"));
    }
}

/// Shows the faults of a drive on one line.
pub(super) fn list(ui: &mut Ui, faults: &[Fault]) {
    if faults.is_empty() {
        return;
    }
    let words: Vec<String> = faults.iter().map(in_words).collect();
    let text = format!("injected faults: {}", words.join("; "));
    ui.add(Label::new(theme::note(text).color(theme::lost())).wrap());
}

fn in_words(fault: &Fault) -> String {
    let kind = word(fault.kind);
    match (fault.kind, fault.to_stop - fault.from_stop) {
        (FaultKind::PoseJump, _) | (_, 0) => format!("{kind} at stop {}", fault.from_stop),
        _ => format!("{kind} at stops {} to {}", fault.from_stop, fault.to_stop),
    }
}

fn word(kind: FaultKind) -> &'static str {
    match kind {
        FaultKind::Occluder => "occluder",
        FaultKind::Shadow => "shadow",
        FaultKind::FeatureStarvation => "feature starvation",
        FaultKind::PoseJump => "pose jump",
        FaultKind::CameraDropOut => "camera drop-out",
    }
}

fn effect(kind: FaultKind) -> &'static str {
    match kind {
        FaultKind::Occluder => {
            "A block of 0.6 m is in front of the target, a third of the way from the camera"
        }
        FaultKind::Shadow => "The shadow of a block of 0.8 m falls on the target",
        FaultKind::FeatureStarvation => "Dust takes 95 % of the contrast of every image",
        FaultKind::PoseJump => "At the first stop, the estimated heading jumps by 7° to the right",
        FaultKind::CameraDropOut => "The cameras on the mast give no images",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_says_its_stops() {
        let fault = |kind, from_stop, to_stop| Fault { kind, from_stop, to_stop, target_m: None };
        assert_eq!(in_words(&fault(FaultKind::Shadow, 4, 6)), "shadow at stops 4 to 6");
        assert_eq!(in_words(&fault(FaultKind::CameraDropOut, 4, 4)), "camera drop-out at stop 4");
        assert_eq!(in_words(&fault(FaultKind::PoseJump, 4, 6)), "pose jump at stop 4");
    }
}
