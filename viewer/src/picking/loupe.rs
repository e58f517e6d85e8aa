//! The loupe: the magnified surroundings of a position, with the template window that a pick would take there.

use egui::{Pos2, Rect, Stroke, pos2, vec2};
use sightline_geometry::frames::Pixel;

use crate::drawing::overlay::{Mark, paint_mark};
use crate::drawing::raster::Raster;
use crate::drawing::view2d::Canvas;
use crate::theme;

/// Side of the loupe, points.
const SIDE: f32 = 148.0;

/// Image pixels across the loupe; more for a large template.
const PIXELS: f32 = 37.0;

/// Maximum fraction of the loupe's side that the template covers.
const TEMPLATE_SHARE: f32 = 0.6;

/// Distance from the border of the canvas, points.
const MARGIN: f32 = 8.0;

/// Paints the loupe.
pub(super) fn paint(canvas: &Canvas, raster: &Raster, pixel: Pixel, template_px: u32) {
    let [width, height] = raster.size().map(|side| side as f32);
    let image = canvas.transform.area(sightline_vision::image::PixelRect::whole(width as u32, height as u32));
    let frame = frame(canvas.transform.rect, image, canvas.transform.to_screen(pixel));
    let pixels = PIXELS.max(template_px as f32 / TEMPLATE_SHARE);
    let middle = pos2((pixel.x as f32 + 0.5) / width, (pixel.y as f32 + 0.5) / height);
    let part = Rect::from_center_size(middle, vec2(pixels / width, pixels / height));
    let painter = &canvas.painter;
    painter.rect_filled(frame, 0.0, theme::well());
    // Outside its border a texture repeats its edge pixels: the loupe shows only the image.
    let inside = part.intersect(Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0)));
    if inside.is_positive() {
        let to_frame = |at: Pos2| frame.min + (at - part.min) / part.size() * frame.size();
        let shown = Rect::from_min_max(to_frame(inside.min), to_frame(inside.max));
        painter.image(raster.texture.id(), shown, inside, theme::UNTINTED);
    }
    let template = Rect::from_center_size(
        frame.center(),
        vec2(1.0, 1.0) * (template_px as f32 / pixels * frame.width()),
    );
    for (width, colour) in [(3.0, theme::halo()), (1.0, theme::accent())] {
        painter.rect_stroke(template, 0.0, Stroke::new(width, colour), egui::StrokeKind::Middle);
    }
    painter.rect_stroke(frame, 0.0, Stroke::new(1.0, theme::accent()), egui::StrokeKind::Outside);
    paint_mark(painter, frame.center(), Mark::Plus, theme::accent(), 9.0);
}

/// The loupe's rectangle: beside the image where there is room, otherwise in a corner of the canvas away from the position.
fn frame(canvas: Rect, image: Rect, at: Pos2) -> Rect {
    let area = canvas.shrink(MARGIN);
    let side = SIDE.min(area.width() / 2.0).min(area.height() / 2.0).max(24.0);
    let (is_right, is_low) = (at.x > area.center().x, at.y > area.center().y);
    let left = if is_right { area.left() } else { area.right() - side };
    let beside_left = image.left() - canvas.left() >= side + MARGIN;
    let beside_right = canvas.right() - image.right() >= side + MARGIN;
    let x = match (beside_left, beside_right) {
        (false, true) => area.right() - side,
        (true, false) => area.left(),
        _ => left,
    };
    let y = if is_low { area.top() } else { area.bottom() - side };
    Rect::from_min_size(pos2(x, y), vec2(side, side))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn canvas() -> Rect {
        Rect::from_min_size(pos2(0.0, 0.0), vec2(700.0, 320.0))
    }

    #[test]
    fn the_loupe_is_beside_the_image_where_there_is_room() {
        let image = Rect::from_center_size(canvas().center(), vec2(320.0, 320.0));
        for at in [pos2(240.0, 40.0), pos2(500.0, 40.0), pos2(240.0, 300.0), pos2(500.0, 300.0)] {
            let frame = frame(canvas(), image, at);
            assert!(!frame.intersects(image) && canvas().contains_rect(frame), "{frame:?}");
        }
    }

    #[test]
    fn the_loupe_never_covers_the_place_and_never_vanishes() {
        for canvas in [canvas(), Rect::from_min_size(pos2(10.0, 20.0), vec2(180.0, 120.0))] {
            for (x, y) in [(0.1, 0.1), (0.9, 0.1), (0.1, 0.9), (0.9, 0.9), (0.49, 0.49), (0.51, 0.51)] {
                let at = canvas.min + vec2(canvas.width() * x, canvas.height() * y);
                let frame = frame(canvas, canvas, at);
                assert!(!frame.contains(at) && canvas.contains_rect(frame), "{at:?} {frame:?}");
                assert!(frame.width() >= 24.0);
            }
        }
    }
}
