//! The row above an image: its contrast stretch, its legend, and its exposure.

use egui::{Align, ComboBox, DragValue, Layout, RichText, Ui};
use sightline_track::stages::capture::Capture;

use crate::command::Command;
use crate::drawing::raster::Raster;
use crate::drawing::stretch::Stretch;
use crate::panels::legend::{self, Entry};
use crate::state::State;
use crate::{figure, panels, theme};

/// Height of the row, points.
const HEIGHT: f32 = 20.0;

/// Share of saturated pixels above which the exposure is highlighted: the template may have lost detail.
const SATURATED_SHARE: f32 = 0.01;

/// Shows the row.
pub(crate) fn show(ui: &mut Ui, state: &State, raster: &Raster, entries: &[Entry], out: &mut Vec<Command>) {
    if figure::is_on_paper() {
        return legend::above_image(ui, entries, state, out);
    }
    ui.horizontal(|ui| {
        ui.set_height(HEIGHT);
        ui.spacing_mut().item_spacing.x = 4.0;
        choice(ui, state, raster, out);
        legend::button(ui, entries, state, out);
        if let Stretch::Manual { brightness, contrast, gamma } = state.stretch {
            by_hand(ui, [brightness, contrast, gamma], out);
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let words = state.trace_on_image().and_then(|trace| trace.capture()).map(exposure);
            if let Some((words, is_bad)) = words {
                let colour = if is_bad { theme::lost() } else { theme::weak() };
                let label = egui::Label::new(RichText::new(&words).small().color(colour)).truncate();
                ui.add(label).on_hover_text(format!(
                    "{words}\nThe exposure is chosen for this subframe around the prediction, not for the whole frame."
                ));
            }
        });
    });
}

fn choice(ui: &mut Ui, state: &State, raster: &Raster, out: &mut Vec<Command>) {
    ui.label(theme::note("stretch"));
    let present = state.stretch;
    let choice = ComboBox::from_id_salt("stretch").width(84.0);
    let shown = choice.selected_text(RichText::new(present.word()).size(11.0)).show_ui(ui, |ui| {
        for stretch in [Stretch::None, Stretch::Auto, Stretch::NEUTRAL] {
            let is_present = stretch.word() == present.word();
            if panels::entry(ui, is_present, stretch.word()).clicked() && !is_present {
                out.push(Command::SetStretch(stretch));
            }
        }
    });
    let response = shown.response.accessible_name(format!("stretch, {}", present.describe(raster.levels)));
    response.on_hover_text(present.describe(raster.levels));
}

fn by_hand(ui: &mut Ui, [mut brightness, mut contrast, mut gamma]: [f32; 3], out: &mut Vec<Command>) {
    let before = [brightness, contrast, gamma];
    for (value, name, prefix, range) in [
        (&mut brightness, "brightness", "b ", -1.0..=1.0),
        (&mut contrast, "contrast", "c ", 0.1..=20.0),
        (&mut gamma, "gamma", "γ ", 0.2..=5.0),
    ] {
        let drag = DragValue::new(value).range(range).speed(0.01).max_decimals(2).prefix(prefix);
        ui.add(drag).accessible_name(name).on_hover_text(name);
    }
    if [brightness, contrast, gamma] != before {
        out.push(Command::SetStretch(Stretch::Manual { brightness, contrast, gamma }));
    }
}

/// The size, mean grey value and saturated share of the exposure subframe in words, and whether too much of it is
/// saturated.
fn exposure(capture: &Capture) -> (String, bool) {
    let Some(size) = capture.subframe.map(|s| format!("{} × {} px", s.width, s.height)) else {
        return ("no subframe: the prediction lies outside".to_owned(), true);
    };
    let mean = capture.subframe_mean.map_or_else(|| "none".to_owned(), |mean| format!("{mean:.2}"));
    let share = capture.subframe_saturated.unwrap_or_default();
    let words = format!("subframe {size}: mean {mean}, {:.1} % saturated", share * 100.0);
    (words, share > SATURATED_SHARE)
}
