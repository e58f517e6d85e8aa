//! A small image to draw on: grey images, lines with a dark halo, and text; opaque, so that it can be saved as a plain RGB
//! PNG.

use std::sync::OnceLock;

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};
use image::RgbImage;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use sightline_vision::image::GrayImage;
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, StrokeDash, Transform,
};

/// Red, green and blue.
pub(super) type Rgb = [u8; 3];

/// Line style.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum LineStyle {
    /// A continuous line.
    Solid,
    /// A dotted line.
    Dotted,
}

/// Width of a line and of the halo on either side of it, px.
const WIDTH: f32 = 2.0;
const HALO: f32 = 1.0;

/// An image to draw on; (0, 0) is the corner of its first pixel.
pub(super) struct Canvas {
    pixmap: Pixmap,
}

/// The visible part of an image: its corner and magnification. Image positions are relative to the centre of the first
/// pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// Upper left corner of the visible part in the image, px from the corner of its first pixel.
    pub(super) origin: [f64; 2],
    /// Canvas pixels per image pixel.
    pub(super) scale: f64,
    /// Position of that corner on the canvas, px.
    pub(super) at: [f64; 2],
    /// Width and height on the canvas, px.
    pub(super) size: [u32; 2],
}

impl Window {
    /// Maps a position in the image to the canvas.
    pub(super) fn to_canvas(self, x: f64, y: f64) -> [f32; 2] {
        let axis = |k: usize, v: f64| ((v + 0.5 - self.origin[k]) * self.scale + self.at[k]) as f32;
        [axis(0, x), axis(1, y)]
    }
}

impl Canvas {
    /// A canvas of one colour; `None` if it would have no pixels.
    pub(super) fn new(width: u32, height: u32, colour: Rgb) -> Option<Self> {
        let mut pixmap = Pixmap::new(width, height)?;
        pixmap.fill(opaque(colour));
        Some(Self { pixmap })
    }

    /// Draws a part of an image with its contrast stretched to black and white; pixels outside the image form a
    /// chequerboard.
    pub(super) fn image(&mut self, image: &GrayImage, window: &Window) {
        let [low, high] = ends(image, window);
        let width = self.pixmap.width() as usize;
        for y in 0..window.size[1] {
            for x in 0..window.size[0] {
                let [px, py] = [x, y].map(|v| (f64::from(v) + 0.5) / window.scale);
                let value = bilinear(image, px + window.origin[0] - 0.5, py + window.origin[1] - 0.5);
                let grey = match value {
                    Some(value) => (255.0 * ((value - low) / (high - low)).clamp(0.0, 1.0)).round() as u8,
                    None if (x / 8 + y / 8) % 2 == 0 => 0x60,
                    None => 0x74,
                };
                let at = (y as usize + window.at[1] as usize) * width + x as usize + window.at[0] as usize;
                if let Some(pixel) = self.pixmap.data_mut().get_mut(4 * at..4 * at + 4) {
                    pixel.copy_from_slice(&[grey, grey, grey, 0xff]);
                }
            }
        }
    }

    /// Draws a polyline with a halo, closed if `is_closed`.
    pub(super) fn line(&mut self, points: &[[f32; 2]], is_closed: bool, colour: Rgb, style: LineStyle) {
        let Some(path) = path(points, is_closed) else { return };
        let gaps = match style {
            LineStyle::Solid => None,
            LineStyle::Dotted => StrokeDash::new(vec![1.0, 5.5], 0.0),
        };
        for (width, colour) in [(WIDTH + 2.0 * HALO, [0; 3]), (WIDTH, colour)] {
            let stroke = Stroke {
                width,
                line_cap: LineCap::Round,
                line_join: LineJoin::Round,
                dash: gaps.clone(),
                ..Stroke::default()
            };
            self.pixmap.stroke_path(&path, &paint(colour), &stroke, Transform::identity(), None);
        }
    }

    /// Fills a rectangle.
    pub(super) fn fill(&mut self, [x, y]: [f32; 2], [width, height]: [f32; 2], colour: Rgb) {
        if let Some(rect) = Rect::from_xywh(x, y, width, height) {
            let path = PathBuilder::from_rect(rect);
            self.pixmap.fill_path(&path, &paint(colour), FillRule::Winding, Transform::identity(), None);
        }
    }

    /// Draws a line of text from its upper left corner, cut off at `width`.
    pub(super) fn text(&mut self, [x, y]: [f32; 2], size: f32, width: f32, colour: Rgb, words: &str) {
        let Some(font) = font() else { return };
        let scaled = font.as_scaled(PxScale::from(size));
        let mut at = x;
        let count = words.chars().count();
        for (k, c) in words.chars().enumerate() {
            // If more letters would follow, the last one that fits becomes an ellipsis.
            let advance = scaled.h_advance(font.glyph_id('m'));
            let is_cut = at + 2.0 * advance > x + width && k + 1 < count;
            let c = match c {
                _ if is_cut => '…',
                c if c.is_control() => ' ',
                c => c,
            };
            let glyph =
                font.glyph_id(c).with_scale_and_position(PxScale::from(size), point(at, y + scaled.ascent()));
            at += scaled.h_advance(glyph.id);
            if let Some(outline) = font.outline_glyph(glyph) {
                let bounds = outline.px_bounds();
                outline.draw(|gx, gy, cover| {
                    self.blend(
                        bounds.min.x as i64 + i64::from(gx),
                        bounds.min.y as i64 + i64::from(gy),
                        colour,
                        cover,
                    );
                });
            }
            if is_cut {
                break;
            }
        }
    }

    /// Copies another canvas into this one.
    pub(super) fn put(&mut self, other: &Canvas, [x, y]: [u32; 2]) {
        let (from, to) = (other.pixmap.width() as usize * 4, self.pixmap.width() as usize * 4);
        for row in 0..other.pixmap.height() as usize {
            let start = (y as usize + row) * to + x as usize * 4;
            let source = &other.pixmap.data()[row * from..(row + 1) * from];
            if let Some(target) = self.pixmap.data_mut().get_mut(start..start + from) {
                target.copy_from_slice(source);
            }
        }
    }

    /// Width and height, px.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.pixmap.width(), self.pixmap.height()]
    }

    /// The pixels, three bytes each.
    pub(super) fn rgb(&self) -> Vec<u8> {
        self.pixmap.data().chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
    }

    /// Encodes the canvas as PNG.
    ///
    /// # Errors
    /// The message of the encoder.
    pub(super) fn png(&self) -> Result<Vec<u8>, String> {
        let [width, height] = self.size();
        let image = RgbImage::from_raw(width, height, self.rgb()).ok_or("size and pixels disagree")?;
        let mut bytes = std::io::Cursor::new(Vec::new());
        // Images are stored and sent, so a smaller size is worth the time.
        let encoder =
            PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive);
        image.write_with_encoder(encoder).map_err(|error| error.to_string())?;
        Ok(bytes.into_inner())
    }

    fn blend(&mut self, x: i64, y: i64, colour: Rgb, cover: f32) {
        let (width, height) = (i64::from(self.pixmap.width()), i64::from(self.pixmap.height()));
        if !(0..width).contains(&x) || !(0..height).contains(&y) {
            return;
        }
        let at = 4 * (y * width + x) as usize;
        let cover = cover.clamp(0.0, 1.0);
        for (value, ink) in self.pixmap.data_mut()[at..at + 3].iter_mut().zip(colour) {
            *value = (f32::from(*value) * (1.0 - cover) + f32::from(ink) * cover).round() as u8;
        }
    }
}

fn opaque([red, green, blue]: Rgb) -> Color {
    Color::from_rgba8(red, green, blue, 0xff)
}

fn paint(colour: Rgb) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color(opaque(colour));
    paint
}

fn path(points: &[[f32; 2]], is_closed: bool) -> Option<Path> {
    let mut builder = PathBuilder::new();
    for (k, [x, y]) in points.iter().enumerate() {
        // Points far outside are invisible and could exceed the limits of the rasteriser.
        let [x, y] = [x.clamp(-4096.0, 8192.0), y.clamp(-4096.0, 8192.0)];
        if k == 0 { builder.move_to(x, y) } else { builder.line_to(x, y) }
    }
    if is_closed {
        builder.close();
    }
    builder.finish()
}

/// The font of the exports, the same as in the viewer; `None` if it cannot be parsed.
fn font() -> Option<&'static FontRef<'static>> {
    static FONT: OnceLock<Option<FontRef<'static>>> = OnceLock::new();
    FONT.get_or_init(|| FontRef::try_from_slice(epaint_default_fonts::HACK_REGULAR).ok()).as_ref()
}

/// Grey values in the window that map to black and white: the 1 % and 99 % quantiles.
fn ends(image: &GrayImage, window: &Window) -> [f32; 2] {
    let from = |k: usize| window.origin[k].floor().max(0.0) as u32;
    let to = |k: usize, size: u32| {
        let end = window.origin[k] + f64::from(window.size[k]) / window.scale;
        (end.ceil().max(0.0) as u32).min(size)
    };
    let rows = from(1)..to(1, image.height());
    let columns = from(0)..to(0, image.width());
    let pixels = rows.flat_map(|y| columns.clone().map(move |x| image.get_pixel(x, y).0[0]));
    let mut values: Vec<f32> = pixels.filter(|value| value.is_finite()).collect();
    if values.is_empty() {
        return [0.0, 1.0];
    }
    values.sort_by(f32::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
    let (low, high) = (at(0.01), at(0.99));
    [low, high.max(low + 1e-3)]
}

/// Interpolates the grey value at a position relative to the centre of the first pixel; `None` outside the image and at
/// invalid pixels.
fn bilinear(image: &GrayImage, x: f64, y: f64) -> Option<f32> {
    let (width, height) = (f64::from(image.width()), f64::from(image.height()));
    if !(-0.5..width - 0.5).contains(&x) || !(-0.5..height - 0.5).contains(&y) {
        return None;
    }
    let (x, y) = (x.clamp(0.0, width - 1.0), y.clamp(0.0, height - 1.0));
    let (x0, y0) = (x.floor() as u32, y.floor() as u32);
    let (x1, y1) = ((x0 + 1).min(image.width() - 1), (y0 + 1).min(image.height() - 1));
    let (fx, fy) = ((x - x.floor()) as f32, (y - y.floor()) as f32);
    let at = |x: u32, y: u32| image.get_pixel(x, y).0[0];
    let top = at(x0, y0) * (1.0 - fx) + at(x1, y0) * fx;
    let bottom = at(x0, y1) * (1.0 - fx) + at(x1, y1) * fx;
    Some(top * (1.0 - fy) + bottom * fy).filter(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn a_pixel_is_drawn_at_its_position() {
        let mut image = GrayImage::from_pixel(9, 9, Luma([0.0]));
        image.put_pixel(5, 3, Luma([1.0]));
        let mut canvas = Canvas::new(40, 40, [9, 9, 9]).unwrap();
        let window = Window { origin: [2.0, 1.0], scale: 4.0, at: [4.0, 8.0], size: [20, 20] };
        canvas.image(&image, &window);
        let rgb = canvas.rgb();
        let brightest = (0..1600).max_by_key(|at| rgb[3 * at]).unwrap();
        let [x, y] = window.to_canvas(5.0, 3.0);
        let (found_x, found_y) = ((brightest % 40) as f32 + 0.5, (brightest / 40) as f32 + 0.5);
        assert!((found_x - x).abs() <= 1.0 && (found_y - y).abs() <= 1.0, "{found_x} {found_y} {x} {y}");
    }

    #[test]
    fn text_is_drawn_within_its_width() {
        let mut canvas = Canvas::new(100, 20, [0; 3]).unwrap();
        canvas.text([2.0, 2.0], 13.0, 50.0, [255; 3], "tracking, and much more than fits");
        let inked: Vec<usize> =
            (0..2000).filter(|at| canvas.rgb()[3 * at] > 100).map(|at| at % 100).collect();
        assert!(inked.len() > 40 && *inked.iter().max().unwrap() < 54, "{inked:?}");
    }
}
