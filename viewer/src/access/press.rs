//! Maximum duration of a click.
//!
//! egui does not count a press of more than 0.8 s as a click. A mouse needs no such limit: on a slow machine a short press
//! appears long, and some users press slowly. On a touch screen a long press is the secondary click, which opens menus.

use egui::{Context, InputOptions};

/// Sets the maximum duration for the pointer in use.
pub(crate) fn limit(context: &Context) {
    let is_touched = context.input(egui::InputState::any_touches);
    let longest_s = if is_touched { InputOptions::default().max_click_duration } else { f64::INFINITY };
    context.options_mut(|options| options.input_options.max_click_duration = longest_s);
}

#[cfg(test)]
mod tests {
    use egui::{Event, Modifiers, PointerButton, RawInput, TouchDeviceId, TouchId, TouchPhase, pos2};

    use super::*;

    /// Whether a press of 2 s clicks a button.
    fn is_click(touches: bool) -> bool {
        let context = Context::default();
        let mut is_clicked = false;
        let mut paint = |time_s: f64, events: Vec<Event>| {
            let input = RawInput { time: Some(time_s), events, ..RawInput::default() };
            let mut output = context.run_ui(input, |ui| {
                limit(ui.ctx());
                is_clicked |= ui.button("Back").clicked();
            });
            output.textures_delta.clear();
        };
        let place = pos2(15.0, 15.0);
        let pressed = |pressed: bool, phase: TouchPhase| {
            let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
            let touch =
                Event::Touch { device_id: TouchDeviceId(0), id: TouchId(0), phase, pos: place, force: None };
            let press = Event::PointerButton { pos: place, button, pressed, modifiers };
            if touches { vec![touch, press] } else { vec![press] }
        };
        paint(0.0, Vec::new());
        paint(0.1, vec![Event::PointerMoved(place)]);
        paint(0.2, pressed(true, TouchPhase::Start));
        paint(1.9, Vec::new());
        paint(2.2, pressed(false, TouchPhase::End));
        is_clicked
    }

    #[test]
    fn a_long_press_of_the_mouse_is_a_click_and_one_of_a_finger_is_not() {
        assert!(is_click(false));
        assert!(!is_click(true));
    }
}
