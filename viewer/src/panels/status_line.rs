//! The line below an image: the pixel under the pointer, and the magnification.

use egui::{Align, Layout, Ui};
use sightline_vision::image::PixelRect;

use crate::drawing::raster::Raster;
use crate::drawing::view2d::Canvas;
use crate::{figure, theme};

/// Height of the status line below an image, points.
pub(crate) const STATUS: f32 = 22.0;

/// Shows pixel and grey value under the pointer, else `hovered` or the image size; and the magnification.
pub(crate) fn status_line(
    ui: &mut Ui,
    canvas: &Canvas,
    raster: &Raster,
    region: PixelRect,
    hovered: Option<String>,
) {
    // A figure has no pointer, and its magnification differs from that of the screen.
    if figure::is_on_paper() {
        return;
    }
    ui.horizontal(|ui| {
        ui.set_height(STATUS - 4.0);
        match canvas.hovered(region) {
            Some(pixel) => {
                let value = raster.at(pixel.x.round() as i64, pixel.y.round() as i64);
                let grey = value.map_or_else(|| "no data".to_owned(), |v| format!("{v:.4}"));
                ui.label(theme::number(format!("x {:7.1}  y {:7.1}", pixel.x, pixel.y)).size(11.0));
                ui.label(theme::note("grey"));
                ui.label(theme::number(grey).size(11.0));
            }
            None => {
                let size = || format!("{} × {} px", region.width, region.height);
                ui.label(theme::note(hovered.unwrap_or_else(size)));
            }
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.label(theme::note(format!("×{:.2}", canvas.transform.scale)))
                .on_hover_text("Points on the screen per pixel. (0, 0) is the centre of the first pixel.");
        });
    });
}
