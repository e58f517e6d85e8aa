//! The panels: read-only data in, commands out. Each file shows one thing.

pub mod bars;
pub mod gates;
pub mod help;
pub mod image_right;
pub mod images_left;
pub mod inspector;
pub mod legend;
pub mod map;
pub mod messages;
pub mod plots;
pub mod settings;
pub mod strip;
pub mod surface;
pub mod targets;
pub mod timeline;

use egui::{Align, Layout, Response, RichText, Sense, Ui, UiBuilder, vec2};

use crate::theme;

/// A panel's title on the left and what belongs beside it on the right. Returns the title's response for dragging.
pub fn title_row(ui: &mut Ui, title: &str, beside: impl FnOnce(&mut Ui)) -> Response {
    let height = 18.0;
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), height), Sense::hover());
    let mut row = ui.new_child(UiBuilder::new().max_rect(rect).layout(Layout::left_to_right(Align::Center)));
    let response = row.add(egui::Label::new(theme::title(title)).selectable(false).sense(Sense::drag()));
    row.add_space(8.0);
    row.with_layout(Layout::right_to_left(Align::Center), beside);
    response
}

/// The sentence of a panel that has nothing to show.
pub fn missing(ui: &mut Ui, sentence: &str) {
    let space = ui.available_rect_before_wrap();
    let mut middle =
        ui.new_child(UiBuilder::new().max_rect(space.shrink(6.0)).layout(Layout::top_down(Align::Center)));
    middle.add_space((space.height() / 2.0 - 20.0).clamp(2.0, 80.0));
    middle.add(egui::Label::new(RichText::new(sentence).color(theme::WEAK)).wrap());
    ui.advance_cursor_after_rect(space);
}

/// A row of a grid: a label, then a value and its unit.
pub fn value_row(ui: &mut Ui, label: &str, value: &str, unit: &str) {
    ui.label(theme::label(label));
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        ui.label(theme::number(value));
        if !unit.is_empty() {
            ui.label(theme::note(unit));
        }
    });
    ui.end_row();
}

/// A number with as many digits as make sense for its size.
pub fn digits(value: f64) -> String {
    let size = value.abs();
    match size {
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
        assert_eq!(digits(f64::NAN), "NaN");
    }
}
