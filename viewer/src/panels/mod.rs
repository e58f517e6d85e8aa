//! The panels: read-only data in, commands out. Each file shows one thing.

pub(crate) mod panel;
pub(crate) mod list;
pub(crate) mod bars;
pub(crate) mod card;
pub(crate) mod chart;
pub(crate) mod broken;
pub(crate) mod budget;
pub(crate) mod epipolar;
pub(crate) mod exposure;
pub(crate) mod features;
pub(crate) mod gates;
pub(crate) mod history;
pub(crate) mod image_right;
pub(crate) mod images_left;
pub(crate) mod inspector;
pub(crate) mod legend;
pub(crate) mod machine;
pub(crate) mod map;
pub(crate) mod messages;
pub(crate) mod names;
pub(crate) mod playing;
pub(crate) mod plots;
pub(crate) mod runs;
pub(crate) mod numbers;
pub(crate) mod run_tree;
pub(crate) mod step_marks;
pub(crate) mod score_marks;
pub(crate) mod settings;
pub(crate) mod shape;
pub(crate) mod sheets;
pub(crate) mod stereo_profile;
pub(crate) mod status_line;
pub(crate) mod strip;
pub(crate) mod surface;
pub(crate) mod targets;
pub(crate) mod timeline;
pub(crate) mod tolerances;
pub(crate) mod uncertainty;
pub(crate) mod view_menu;

use egui::{Align, Layout, RichText, Ui, UiBuilder};

pub(crate) use sightline_session::format::number as digits;

use crate::theme;

/// A panel that has nothing to show: what it is for, and the sentence that says how to fill it.
pub(crate) fn missing(ui: &mut Ui, purpose: &str, sentence: &str) {
    let space = ui.available_rect_before_wrap();
    let builder = UiBuilder::new().max_rect(space.shrink(6.0)).layout(Layout::top_down(Align::Center));
    let mut middle = ui.new_child(builder);
    middle.add_space((space.height() / 2.0 - 24.0).clamp(0.0, 80.0));
    middle.add(egui::Label::new(RichText::new(sentence).color(theme::text())).wrap());
    if !purpose.is_empty() {
        middle.add(egui::Label::new(theme::note(purpose)).wrap());
    }
    ui.advance_cursor_after_rect(space);
}

/// An entry of an open list. Whoever chooses it closes the list: by pointer and key it closes by itself, by a screen reader not.
pub(crate) fn entry(ui: &mut Ui, is_chosen: bool, words: &str) -> egui::Response {
    let response = ui.selectable_label(is_chosen, words);
    if response.clicked() {
        ui.close();
    }
    response
}
