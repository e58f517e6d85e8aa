//! A zoomable canvas over pixels, and the transform between pixels and the screen.
//!
//! Convention: (0, 0) is the *centre* of the first pixel, so that an image of W × H spans [−0.5, W − 0.5] × [−0.5, H −
//! 0.5]. Screen positions are in egui points; on a page at 100 % they are CSS pixels. The wheel zooms about the pointer,
//! dragging pans, a double click fits the image to its panel.

use egui::{Painter, Pos2, Rect, Response, Sense, TextureHandle, Ui, Vec2, pos2, vec2};
use sightline_geometry::frames::Pixel;
use sightline_vision::image::PixelRect;

use crate::theme;

/// The largest magnification, points per pixel.
const SCALE_MAX: f64 = 64.0;

/// Magnification from which a pixel grid is drawn, points per pixel.
const GRID_SCALE: f64 = 14.0;

/// The part of an image that a panel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum View2d {
    /// The whole image, as large as it fits into the panel.
    Fit,
    /// A centre and a magnification.
    At {
        /// The pixel in the middle of the panel.
        centre: Pixel,
        /// Points per pixel.
        scale: f64,
    },
}

/// Transforms pixels to the screen and back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Transform {
    /// The panel's area on the screen.
    pub rect: Rect,
    centre: Pixel,
    /// Points per pixel.
    pub scale: f64,
}

impl Transform {
    /// The transform of `view` for the pixels of `region` in `rect`.
    pub(crate) fn new(view: View2d, region: PixelRect, rect: Rect) -> Self {
        match view {
            View2d::Fit => Self { rect, centre: region.centre(), scale: fit_scale(region, rect) },
            View2d::At { centre, scale } => Self { rect, centre, scale },
        }
    }

    /// The screen position of a pixel.
    pub(crate) fn to_screen(self, pixel: Pixel) -> Pos2 {
        let middle = self.rect.center();
        pos2(
            middle.x + ((pixel.x - self.centre.x) * self.scale) as f32,
            middle.y + ((pixel.y - self.centre.y) * self.scale) as f32,
        )
    }

    /// The pixel at a screen position.
    pub(crate) fn to_pixel(self, at: Pos2) -> Pixel {
        let offset = at - self.rect.center();
        self.centre.offset(f64::from(offset.x) / self.scale, f64::from(offset.y) / self.scale)
    }

    /// The screen area of a rectangle of pixels, the borders of its outermost pixels included.
    pub(crate) fn area(&self, region: PixelRect) -> Rect {
        let first = Pixel::new(f64::from(region.x) - 0.5, f64::from(region.y) - 0.5);
        let last = first.offset(f64::from(region.width), f64::from(region.height));
        Rect::from_min_max(self.to_screen(first), self.to_screen(last))
    }

    /// The view magnified by `factor`, with the pixel under `at` fixed.
    pub(crate) fn zoomed(&self, at: Pos2, factor: f64, region: PixelRect) -> View2d {
        let smallest = fit_scale(region, self.rect) / 2.0;
        let scale = (self.scale * factor).clamp(smallest.min(SCALE_MAX), SCALE_MAX);
        let (kept, offset) = (self.to_pixel(at), at - self.rect.center());
        let centre = kept.offset(-f64::from(offset.x) / scale, -f64::from(offset.y) / scale);
        View2d::At { centre: clamped_to(centre, region), scale }
    }

    /// The view moved by a drag of `delta` points.
    pub(crate) fn panned(&self, delta: Vec2, region: PixelRect) -> View2d {
        let centre = self.centre.offset(-f64::from(delta.x) / self.scale, -f64::from(delta.y) / self.scale);
        View2d::At { centre: clamped_to(centre, region), scale: self.scale }
    }
}

/// The largest magnification at which `region` fits into `rect`, points per pixel.
fn fit_scale(region: PixelRect, rect: Rect) -> f64 {
    let across = f64::from(rect.width()) / f64::from(region.width.max(1));
    let down = f64::from(rect.height()) / f64::from(region.height.max(1));
    across.min(down).max(1e-3)
}

/// The nearest position inside the image, so that a view never leaves it.
fn clamped_to(at: Pixel, region: PixelRect) -> Pixel {
    let hold = |v: f64, start: i32, length: u32| {
        v.clamp(f64::from(start) - 0.5, f64::from(start) + f64::from(length) - 0.5)
    };
    Pixel::new(hold(at.x, region.x, region.width), hold(at.y, region.y, region.height))
}

/// A canvas after layout, with its pointer input.
pub(crate) struct Canvas {
    /// Clicks and hover on it.
    pub response: Response,
    /// Paints inside the canvas only.
    pub painter: Painter,
    /// Its transform.
    pub transform: Transform,
    /// The view that the pointer input leads to; `None` if unchanged.
    pub moved: Option<View2d>,
    /// The position of the pointer, also while it is over a handle on the canvas.
    pointer: Option<Pos2>,
}

impl Canvas {
    /// Allocates the rest of `ui`, less `below` points at its bottom, as a canvas for the pixels of `region`.
    pub(crate) fn new(ui: &mut Ui, view: View2d, region: PixelRect, below: f32) -> Self {
        let size = vec2(ui.available_width().max(24.0), (ui.available_height() - below).max(24.0));
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 0.0, theme::well());
        let transform = Transform::new(view, region, rect);
        let moved = view_from_input(ui, &response, &transform, region);
        let pointer = ui.input(|input| input.pointer.hover_pos()).filter(|_| ui.rect_contains_pointer(rect));
        Self { response, painter, transform, moved, pointer }
    }

    /// Paints a texture over the pixels of `region`.
    pub(crate) fn texture(&self, texture: &TextureHandle, region: PixelRect) {
        let whole = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        self.painter.image(texture.id(), self.transform.area(region), whole, theme::UNTINTED);
    }

    /// The pixel under the pointer; `None` outside `region`.
    pub(crate) fn hovered(&self, region: PixelRect) -> Option<Pixel> {
        let pixel = self.transform.to_pixel(self.pointer?);
        region.contains(pixel).then_some(pixel)
    }

    /// Lines between the pixels, from a magnification of `GRID_SCALE`.
    pub(crate) fn pixel_grid(&self, region: PixelRect) {
        if self.transform.scale < GRID_SCALE {
            return;
        }
        let stroke = egui::Stroke::new(1.0, theme::grid());
        let area = self.transform.area(region).intersect(self.transform.rect);
        let (first, last) = (self.transform.to_pixel(area.min), self.transform.to_pixel(area.max));
        for x in first.x.round() as i32..=last.x.round() as i32 {
            let at = self.transform.to_screen(Pixel::new(f64::from(x) - 0.5, 0.0)).x;
            self.painter.vline(at, area.y_range(), stroke);
        }
        for y in first.y.round() as i32..=last.y.round() as i32 {
            let at = self.transform.to_screen(Pixel::new(0.0, f64::from(y) - 0.5)).y;
            self.painter.hline(area.x_range(), at, stroke);
        }
    }

    /// The pattern for missing data.
    pub(crate) fn checker(&self, region: PixelRect) {
        checker(&self.painter, self.transform.area(region).intersect(self.transform.rect));
    }
}

/// Paints the pattern for missing data.
pub(crate) fn checker(painter: &Painter, area: Rect) {
    const SIDE: f32 = 8.0;
    if !area.is_positive() {
        return;
    }
    painter.rect_filled(area, 0.0, theme::checker(false));
    let (columns, rows) = ((area.width() / SIDE).ceil() as i32, (area.height() / SIDE).ceil() as i32);
    for row in 0..rows {
        for column in (row % 2..columns).step_by(2) {
            let corner = area.min + vec2(column as f32, row as f32) * SIDE;
            let cell = Rect::from_min_size(corner, Vec2::splat(SIDE)).intersect(area);
            painter.rect_filled(cell, 0.0, theme::checker(true));
        }
    }
}

/// The view that wheel, drag or double click lead to; `None` if unchanged.
fn view_from_input(ui: &Ui, response: &Response, transform: &Transform, region: PixelRect) -> Option<View2d> {
    if response.double_clicked() {
        return Some(View2d::Fit);
    }
    if response.dragged() && response.drag_delta() != Vec2::ZERO {
        return Some(transform.panned(response.drag_delta(), region));
    }
    let at = response.hover_pos()?;
    let (scroll, zoom) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
    let factor = f64::from(zoom) * (f64::from(scroll) / 200.0).exp();
    (factor != 1.0).then(|| transform.zoomed(at, factor, region))
}

#[cfg(test)]
mod tests {
    use super::*;

    const REGION: PixelRect = PixelRect::new(0, 0, 1024, 768);

    fn rect() -> Rect {
        Rect::from_min_size(pos2(100.0, 50.0), vec2(512.0, 384.0))
    }

    #[test]
    fn a_fitted_image_spans_its_panel_from_minus_half_a_pixel() {
        let transform = Transform::new(View2d::Fit, REGION, rect());
        assert_eq!(transform.scale, 0.5);
        assert_eq!(transform.to_screen(Pixel::new(-0.5, -0.5)), pos2(100.0, 50.0));
        assert_eq!(transform.to_screen(Pixel::new(1023.5, 767.5)), pos2(612.0, 434.0));
        assert_eq!(transform.area(REGION), rect());
    }

    #[test]
    fn the_centre_of_the_first_pixel_is_zero_zero() {
        let view = View2d::At { centre: Pixel::new(0.0, 0.0), scale: 10.0 };
        let transform = Transform::new(view, REGION, rect());
        assert_eq!(transform.to_screen(Pixel::new(0.0, 0.0)), rect().center());
        let first = transform.area(PixelRect::new(0, 0, 1, 1));
        assert_eq!(first, Rect::from_center_size(rect().center(), Vec2::splat(10.0)));
    }

    #[test]
    fn screen_and_pixel_are_inverse() {
        let view = View2d::At { centre: Pixel::new(311.25, 98.5), scale: 3.7 };
        let transform = Transform::new(view, REGION, rect());
        for pixel in [Pixel::new(0.0, 0.0), Pixel::new(300.4, 120.9), Pixel::new(1023.0, 767.0)] {
            assert!(transform.to_pixel(transform.to_screen(pixel)).distance(pixel) < 1e-3);
        }
    }

    #[test]
    fn zooming_keeps_the_pixel_under_the_pointer() {
        let transform = Transform::new(View2d::Fit, REGION, rect());
        let at = pos2(180.0, 300.0);
        let before = transform.to_pixel(at);
        let zoomed = Transform::new(transform.zoomed(at, 4.0, REGION), REGION, rect());
        assert!((zoomed.scale - 2.0).abs() < 1e-12);
        assert!(zoomed.to_pixel(at).distance(before) < 1e-9);
    }

    #[test]
    fn dragging_moves_the_image_with_the_pointer_and_never_loses_it() {
        let transform = Transform::new(View2d::Fit, REGION, rect());
        let moved = Transform::new(transform.panned(vec2(30.0, -12.0), REGION), REGION, rect());
        let from = transform.to_screen(Pixel::new(400.0, 300.0));
        assert_eq!(moved.to_screen(Pixel::new(400.0, 300.0)), from + vec2(30.0, -12.0));
        let far = Transform::new(transform.panned(vec2(1e6, 0.0), REGION), REGION, rect());
        assert_eq!(far.to_pixel(rect().center()).x, -0.5);
    }
}
