//! The row above a chart that names its lines, each with its shape: it covers nothing of the chart.

use egui::{Color32, Sense, Ui, vec2};

use crate::drawing::overlay::{Mark, paint_mark};
use crate::theme;

/// Height of the row, points.
pub(crate) const HEIGHT: f32 = 15.0;

/// Shows the title and the names in one row.
pub(crate) fn show(ui: &mut Ui, title: &str, names: &[(Mark, Color32, String)]) {
    ui.horizontal(|ui| {
        ui.set_height(HEIGHT);
        contents(ui, title, names);
    });
}

/// Shows the title and the names in as many rows as they need.
pub(crate) fn wrapped(ui: &mut Ui, title: &str, names: &[(Mark, Color32, String)]) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.y = 1.0;
        ui.spacing_mut().interact_size.y = HEIGHT;
        contents(ui, title, names);
    });
}

fn contents(ui: &mut Ui, title: &str, names: &[(Mark, Color32, String)]) {
    ui.spacing_mut().item_spacing.x = 10.0;
    if !title.is_empty() {
        ui.label(theme::note(title).color(theme::text()));
    }
    for (mark, colour, name) in names {
        entry(ui, *mark, *colour, name);
    }
}

/// A mark with its word, which stay together where the row is broken.
fn entry(ui: &mut Ui, mark: Mark, colour: Color32, name: &str) {
    let reach = if matches!(mark, Mark::Stroke(_)) { 8.0 } else { 4.0 };
    let word = ui.painter().layout_no_wrap(name.to_owned(), theme::image_font(), theme::weak());
    let beside = 2.0 * reach + 6.0;
    let size = vec2(beside + word.size().x, word.size().y.max(HEIGHT - 2.0));
    let (frame, response) = ui.allocate_exact_size(size, Sense::hover());
    paint_mark(ui.painter(), frame.left_center() + vec2(reach + 1.0, 0.0), mark, colour, reach);
    let at = frame.left_center() + vec2(beside, -word.size().y / 2.0);
    ui.painter().galley(at, word, theme::weak());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, name));
}
