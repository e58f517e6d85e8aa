//! The handles of the image as sliders, for users who cannot drag in images.

use egui::{Slider, Ui};
use serde_json::json;
use sightline_geometry::frames::Pixel;
use sightline_track::settings::TrackerKind;
use sightline_track::trace::StepTrace;

use crate::command::Command;
use crate::state::State;
use crate::theme;
use crate::what_if::panel::values::{predicted, side};
use crate::why::WhyCommand;

/// Range of the prediction sliders, px in either direction.
const REACH_PX: f64 = 200.0;

/// Shows the sliders of the sizes and the prediction, and the buttons that apply or discard the trial.
pub(crate) fn form(ui: &mut Ui, state: &State, trace: &StepTrace, out: &mut Vec<Command>) {
    if state.tracker() == TrackerKind::Template {
        for (name, key, high) in
            [("search window", "search_window_px", 511), ("template", "template_size_px", 101)]
        {
            if let Some(value) = side(state, key) {
                size(ui, state, (name, key), (value, high), out);
            }
        }
    }
    displacement(ui, state, trace, out);
    let Some(trial) = state.trial() else {
        ui.label(theme::note("Drag a slider, a limit above, or a handle in the left image."));
        return;
    };
    ui.horizontal_wrapped(|ui| {
        let state_word = trial.ghost.as_ref().map_or("computing …", |ghost| ghost.row.state.as_str());
        ui.label(format!("this step would be: {state_word}"));
        if ui.button("Run as branch").on_hover_text("Key R").clicked() {
            out.push(Command::Why(WhyCommand::Branch));
        }
        if ui.button("Drop").on_hover_text("Key Esc").clicked() {
            out.push(Command::Why(WhyCommand::Discard));
        }
    });
}

fn size(
    ui: &mut Ui,
    state: &State,
    (name, key): (&str, &str),
    (value, high): (u64, u64),
    out: &mut Vec<Command>,
) {
    let low = if key == "search_window_px" { 21 } else { 5 };
    let mut number = value;
    let label = theme::note(format!("try {name}"));
    let slider = Slider::new(&mut number, low..=high.max(value)).step_by(2.0).suffix(" px").text(label);
    if ui.add(slider).changed() {
        let odd = number | 1;
        let in_run = state.setting("template", key).and_then(|value| value.as_u64());
        let value = (in_run != Some(odd)).then(|| json!(odd));
        out.push(Command::Why(WhyCommand::Change { key: key.to_owned(), value }));
    }
}

/// Shows the displacement of the prediction from the one of the run.
fn displacement(ui: &mut Ui, state: &State, trace: &StepTrace, out: &mut Vec<Command>) {
    let recorded = trace.point_mast.predicted_left;
    let Some((recorded, now)) = recorded.zip(predicted(state, trace)) else { return };
    let mut by = [now.x - recorded.x, now.y - recorded.y];
    let mut changed = false;
    for (axis, value) in ["x", "y"].iter().zip(by.iter_mut()) {
        let range = -REACH_PX.max(value.abs())..=REACH_PX.max(value.abs());
        let label = theme::note(format!("move prediction {axis}"));
        changed |= ui.add(Slider::new(value, range).max_decimals(1).suffix(" px").text(label)).changed();
    }
    if changed {
        let tenth = |v: f64| (v * 10.0).round() / 10.0;
        let to = Pixel::new(tenth(recorded.x + by[0]), tenth(recorded.y + by[1]));
        let is_back = by.iter().all(|v| v.abs() < 0.05);
        out.push(Command::Why(WhyCommand::Displace((!is_back).then_some(to))));
    }
}
