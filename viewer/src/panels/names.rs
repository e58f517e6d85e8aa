//! The row above a chart that names its lines, each with its shape: it covers nothing of the chart.

use egui::{Color32, Sense, Ui, vec2};

use crate::overlay::{Mark, paint_mark};
use crate::theme;

/// Height of the row, points.
pub const HEIGHT: f32 = 15.0;

/// Shows the title and the names.
pub fn show(ui: &mut Ui, title: &str, names: &[(Mark, Color32, String)]) {
    ui.horizontal(|ui| {
        ui.set_height(HEIGHT);
        ui.spacing_mut().item_spacing.x = 4.0;
        if !title.is_empty() {
            ui.label(theme::note(title).color(theme::TEXT));
            ui.add_space(6.0);
        }
        for (mark, colour, name) in names {
            let reach = if matches!(mark, Mark::Stroke(_)) { 8.0 } else { 4.0 };
            let (frame, _) = ui.allocate_exact_size(vec2(2.0 * reach + 2.0, 10.0), Sense::hover());
            paint_mark(ui.painter(), frame.center(), *mark, *colour, reach);
            ui.label(theme::note(name));
            ui.add_space(6.0);
        }
    });
}
