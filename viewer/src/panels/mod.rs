//! The panels: read-only data in, commands out. Each file shows one thing.

pub mod bars;
pub mod breakpoints;
pub mod card;
pub mod broken;
pub mod budget;
pub mod compare;
pub mod export;
pub mod derived;
pub mod epipolar;
pub mod exposure;
pub mod features;
pub mod figure_menu;
pub mod gates;
pub mod help;
pub mod history;
pub mod image_right;
pub mod images_left;
pub mod inspector;
pub mod legend;
pub mod limits;
pub mod machine;
pub mod map;
pub mod messages;
pub mod names;
pub mod palette;
pub mod notes;
pub mod open;
pub mod playing;
pub mod plots;
pub mod runs;
mod numbers;
mod run_tree;
mod step_marks;
pub mod settings;
pub mod shape;
pub mod sheets;
pub mod stereo_profile;
pub mod strip;
pub mod studies;
pub mod surface;
pub mod targets;
pub mod timeline;
pub mod tolerances;
pub mod uncertainty;
pub mod picking;
pub mod tour;
pub mod view_menu;
pub mod what_if;
pub mod why;

use egui::{Align, Layout, RichText, Ui, UiBuilder};

use crate::theme;

/// A panel that has nothing to show: what it is for, and the sentence that says how to fill it.
pub fn missing(ui: &mut Ui, purpose: &str, sentence: &str) {
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
pub fn entry(ui: &mut Ui, is_chosen: bool, words: &str) -> egui::Response {
    let response = ui.selectable_label(is_chosen, words);
    if response.clicked() {
        ui.close();
    }
    response
}

/// What is smaller than this is the rounding of a computation in metres or pixels, not a measurement.
const ROUNDING: f64 = 1e-12;

/// A number with as many digits as make sense for its size.
pub fn digits(value: f64) -> String {
    let size = value.abs();
    match size {
        _ if size < ROUNDING => "0".to_owned(),
        _ if value == value.trunc() && size < 1e9 => format!("{value:.0}"),
        _ if (100.0..1e7).contains(&size) => format!("{value:.1}"),
        _ if (10.0..1e7).contains(&size) => format!("{value:.2}"),
        _ if (0.01..1e7).contains(&size) => format!("{value:.3}"),
        _ => format!("{value:.2e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::digits;

    #[test]
    fn numbers_have_digits_that_make_sense() {
        assert_eq!(digits(12.0), "12");
        assert_eq!(digits(123.456), "123.5");
        assert_eq!(digits(0.71234), "0.712");
        assert_eq!(digits(-2.71734), "-2.717");
        assert_eq!(digits(0.00012), "1.20e-4");
        assert_eq!(digits(-6.2e-18), "0", "the rounding of a difference is no bias");
        assert_eq!(digits(f64::NAN), "NaN");
    }
}
