//! The choice of the camera whose images the two image panels show, at a stop with more than its main pair.

use egui::{ComboBox, Ui};
use sightline_geometry::camera::CameraName;

use crate::command::Command;
use crate::state::State;
use crate::{panels, theme};

/// Shows the choice: nothing at a stop with its main pair alone.
pub(crate) fn show(ui: &mut Ui, state: &State, out: &mut Vec<Command>) {
    let Some(stop) = state.stop() else { return };
    let shown = state.camera();
    if stop.cameras.is_empty() && shown.is_none() {
        return;
    }
    let further = stop.cameras.iter().map(|camera| Some(camera.name));
    let mut choices: Vec<_> = std::iter::once(None).chain(further).collect();
    if !choices.contains(&shown) {
        choices.push(shown);
    }
    ui.horizontal(|ui| {
        ui.label(theme::note("camera"));
        let choice = ComboBox::from_id_salt("camera").selected_text(word(shown)).show_ui(ui, |ui| {
            for camera in choices {
                if panels::entry(ui, camera == shown, &word(camera)).clicked() {
                    out.push(Command::ShowCamera(camera));
                }
            }
        });
        choice.response.accessible_name("Camera");
        if let Some(target) = state.target().filter(|_| !state.shows_targets_camera()) {
            let of = word(target.designation.camera);
            ui.label(theme::note(format!("{} is tracked in {of}: its marks are there", target.label)));
        }
    });
}

/// The display name of a camera.
pub(crate) fn word(camera: Option<CameraName>) -> String {
    camera.map_or_else(|| "main pair".to_owned(), |name| name.to_string())
}
