//! The stereo pairs of a drive's hazard map, as check boxes.

use egui::{Checkbox, Ui};
use sightline_rover::driving::{DriveCommand, HAZARD_CAMERAS_MAX};

use crate::state::State;
use crate::theme;

const HELP: &str = "The hazard map is made from the checked pairs, up to four. Without a check it is made from the first pair on the \
                    body that looks ahead.";

/// Shows a check box for every pair in addition to the main one, if the navigator needs a map.
pub(super) fn field(ui: &mut Ui, state: &State, command: &mut DriveCommand) {
    if !command.navigator.needs_map() {
        return;
    }
    let cameras = state.stop().map(|stop| stop.cameras.as_slice()).unwrap_or_default();
    let mut names: Vec<_> =
        cameras.iter().filter(|camera| camera.right_size.is_some()).map(|camera| camera.name).collect();
    // A pair that only another drive has can be unchecked here.
    names.extend(command.hazard_cameras.iter().filter(|&name| !cameras.iter().any(|c| c.name == *name)));
    if names.is_empty() {
        return;
    }
    ui.label(theme::label("hazard map from"));
    for name in names {
        let was_checked = command.hazard_cameras.contains(&name);
        let mut is_checked = was_checked;
        let is_free = was_checked || command.hazard_cameras.len() < HAZARD_CAMERAS_MAX;
        let shown = ui.add_enabled(is_free, Checkbox::new(&mut is_checked, name.as_str()));
        shown.on_hover_text(HELP).on_disabled_hover_text(HELP);
        if was_checked && !is_checked {
            command.hazard_cameras.retain(|other| *other != name);
        }
        if !was_checked && is_checked {
            command.hazard_cameras.push(name);
        }
    }
}

#[cfg(test)]
mod tests {
    use sightline_api::wire::StopCameraView;
    use sightline_rover::driving::NavigatorKind;

    use crate::command::Command;
    use crate::driving::{DrivingCommand, panel};
    use crate::tests::{Shown, fixture};

    const CAMERAS: [(&str, bool); 3] = [("front_hazcam", true), ("left_wedge", true), ("mono", false)];

    /// The form of a drive with these pairs of the hazard map, with all limits open.
    fn form(navigator: NavigatorKind, checked: &'static [&'static str]) -> Shown<'static> {
        let with_cameras = move |context: &egui::Context| {
            let mut state = fixture::at_step(context, 0);
            let camera = |(name, is_pair): (&str, bool)| StopCameraView {
                name: name.parse().unwrap(),
                left_size: [64, 64],
                right_size: is_pair.then_some([64, 64]),
                mast: None,
            };
            let traverse = state.traverse.as_mut().unwrap();
            (traverse.simulated, traverse.stops[0].cameras) = (true, CAMERAS.map(camera).to_vec());
            state.driving.command.navigator = navigator;
            state.driving.command.hazard_cameras = checked.iter().map(|name| name.parse().unwrap()).collect();
            state
        };
        let mut shown = Shown::new([900.0, 700.0], with_cameras, panel::show);
        shown.click("tracked stops, odometry, offset, limits");
        shown
    }

    fn after_click(checked: &'static [&'static str], name: &str) -> Vec<String> {
        let asked = form(NavigatorKind::Gestalt, checked).click(name);
        let [Command::Drive(DrivingCommand::Form(command))] = asked.as_slice() else { panic!("{asked:?}") };
        command.hazard_cameras.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn pairs_are_checked_and_unchecked() {
        assert_eq!(after_click(&[], "left_wedge"), ["left_wedge"]);
        assert_eq!(after_click(&["left_wedge"], "front_hazcam"), ["left_wedge", "front_hazcam"]);
        assert_eq!(after_click(&["left_wedge", "front_hazcam"], "left_wedge"), ["front_hazcam"]);
        assert_eq!(after_click(&["of_another_drive"], "of_another_drive"), Vec::<String>::new());
    }

    #[test]
    fn a_single_camera_and_a_navigator_without_a_map_have_no_box() {
        let with_map = form(NavigatorKind::Gestalt, &[]);
        assert!(with_map.has("hazard map from") && !with_map.has("mono"));
        assert!(!form(NavigatorKind::Arcs, &[]).has("hazard map from"));
    }
}
