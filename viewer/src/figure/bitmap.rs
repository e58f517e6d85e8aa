//! A figure as an opaque PNG, rendered at the requested scale, so that lines and letters are sharp at every scale.
//!
//! It is rendered by the CPU, so that the limits of the graphics card's textures do not apply; the limit is memory.

use egui::{Color32, ColorImage, FontDefinitions, FontFamily, Rect};
use tiny_skia::{
    Color, FillRule, FilterQuality, Mask, Paint, Path, PathBuilder, Pattern, Pixmap, PremultipliedColorU8,
    Shader, SpreadMode, Transform,
};

use crate::figure::faces::Faces;
use crate::figure::{Figure, Form, Ink, Words};

/// Maximum number of pixels, each of which takes four bytes while it is rendered.
pub(crate) const PIXELS_MAX: f64 = 48e6;

/// The end of the chunk `IHDR` of a PNG file: 8 bytes of signature and 25 of the chunk.
const HEADER_END: usize = 33;

/// Length of the handles of a quarter circle drawn as one cubic Bézier curve, in radii.
const QUARTER: f32 = 0.552_284_8;

/// Thickening of the stems of the proportional font, in font sizes. The page has a light font, which it paints heavier
/// than its outlines; SVG files request the regular weight.
const EMBOLDENING: f32 = 0.018;

/// Slant of italics: the tangent of the angle.
const LEAN: f32 = 0.2;

/// Width and height at a scale, px.
///
/// # Errors
/// A sentence if there would be too many pixels.
pub(crate) fn size_px(figure: &Figure, scale: u8) -> Result<[u32; 2], String> {
    let side = |points: f32| (f64::from(points) * f64::from(scale)).round().max(1.0);
    let [width, height] = [side(figure.size.x), side(figure.size.y)];
    if width * height > PIXELS_MAX {
        let fits = (1..scale).rev().find(|&less| size_px(figure, less).is_ok());
        let way = fits.map_or_else(
            || "make the panel smaller, or save it as SVG".to_owned(),
            |less| format!("save it at {less}×, or as SVG"),
        );
        return Err(format!(
            "The picture would have {width:.0} × {height:.0} px, more than {:.0} million in all: {way}.",
            PIXELS_MAX / 1e6
        ));
    }
    Ok([width as u32, height as u32])
}

/// Renders the figure at a scale as a PNG file.
///
/// # Errors
/// A sentence if it would be too large.
pub(crate) fn png(figure: &Figure, scale: u8, fonts: &FontDefinitions) -> Result<Vec<u8>, String> {
    let pixmap = drawn(figure, scale, fonts)?;
    let pixels: Vec<u8> =
        pixmap.pixels().iter().flat_map(|pixel| [pixel.red(), pixel.green(), pixel.blue()]).collect();
    let picture = image::RgbImage::from_raw(pixmap.width(), pixmap.height(), pixels);
    let mut png = encoded(picture.map(image::DynamicImage::ImageRgb8))?;
    let physical = physical_size(scale);
    png.splice(HEADER_END..HEADER_END, physical);
    Ok(png)
}

/// The chunk `pHYs` of a PNG file, which stores its resolution: a point is 1/72 inch.
fn physical_size(scale: u8) -> Vec<u8> {
    let per_metre = (f64::from(scale) * 72.0 / 0.0254).round() as u32;
    let metre = 1;
    let data = [&b"pHYs"[..], &per_metre.to_be_bytes(), &per_metre.to_be_bytes(), &[metre]].concat();
    let length = (data.len() - 4) as u32;
    [&length.to_be_bytes()[..], &data, &crc32(&data).to_be_bytes()].concat()
}

/// The CRC-32 of a PNG chunk (ISO 3309).
fn crc32(bytes: &[u8]) -> u32 {
    let bits = |crc: u32| if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 };
    !bytes.iter().fold(u32::MAX, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), |crc, _| bits(crc)))
}

/// Encodes pixels with their opacity as a PNG file.
///
/// # Errors
/// A sentence if they cannot be encoded.
pub(crate) fn png_of(pixels: &ColorImage) -> Result<Vec<u8>, String> {
    let [width, height] = pixels.size.map(|side| side as u32);
    let is_opaque = pixels.pixels.iter().all(|colour| colour.a() == u8::MAX);
    let colours = pixels.pixels.iter().map(Color32::to_srgba_unmultiplied);
    let picture = if is_opaque {
        let bytes: Vec<u8> = colours.flat_map(|[r, g, b, _]| [r, g, b]).collect();
        image::RgbImage::from_raw(width, height, bytes).map(image::DynamicImage::ImageRgb8)
    } else {
        let bytes: Vec<u8> = colours.flatten().collect();
        image::RgbaImage::from_raw(width, height, bytes).map(image::DynamicImage::ImageRgba8)
    };
    encoded(picture)
}

fn encoded(picture: Option<image::DynamicImage>) -> Result<Vec<u8>, String> {
    let mut png = std::io::Cursor::new(Vec::new());
    picture
        .and_then(|picture| picture.write_to(&mut png, image::ImageFormat::Png).ok())
        .ok_or_else(|| "The picture cannot be encoded as PNG.".to_owned())?;
    Ok(png.into_inner())
}

fn drawn(figure: &Figure, scale: u8, fonts: &FontDefinitions) -> Result<Pixmap, String> {
    let [width, height] = size_px(figure, scale)?;
    let mut pixmap =
        Pixmap::new(width, height).ok_or_else(|| "The panel has no size on the screen.".to_owned())?;
    // The PNG is opaque, independent of what is behind the page.
    pixmap.fill(colour(figure.ground.to_opaque()));
    let mut sheet = Sheet { pixmap, scale: f32::from(scale), mask: None, faces: Faces::new(fonts) };
    for piece in &figure.pieces {
        sheet.draw(piece.clip, &piece.ink);
    }
    Ok(sheet.pixmap)
}

struct Sheet<'a> {
    pixmap: Pixmap,
    scale: f32,
    /// The mask of the last clip rectangle that was needed.
    mask: Option<(Rect, Mask)>,
    faces: Faces<'a>,
}

impl Sheet<'_> {
    fn draw(&mut self, clip: Rect, ink: &Ink) {
        let is_cut = !clip.contains_rect(ink.bounds());
        if is_cut && self.mask.as_ref().is_none_or(|(known, _)| *known != clip) {
            self.mask =
                mask(clip, self.scale, [self.pixmap.width(), self.pixmap.height()]).map(|mask| (clip, mask));
        }
        let mask = self.mask.as_ref().filter(|_| is_cut).map(|(_, mask)| mask);
        let whole = Transform::from_scale(self.scale, self.scale);
        match ink {
            Ink::Area { form, fill, stroke } => {
                let Some((path, turn)) = path(form) else { return };
                let transform = whole.pre_concat(turn);
                if fill.a() > 0 {
                    self.pixmap.fill_path(&path, &paint(*fill), FillRule::Winding, transform, mask);
                }
                if !stroke.is_empty() {
                    let line = tiny_skia::Stroke { width: stroke.width, ..tiny_skia::Stroke::default() };
                    self.pixmap.stroke_path(&path, &paint(stroke.color), &line, transform, mask);
                }
            }
            Ink::Words(words) => {
                letters(&mut self.pixmap, &mut self.faces, words, whole, mask);
            }
            Ink::Picture { pixels, place } => picture(&mut self.pixmap, pixels, *place, self.scale, mask),
        }
    }
}

fn letters(pixmap: &mut Pixmap, faces: &mut Faces<'_>, words: &Words, whole: Transform, mask: Option<&Mask>) {
    let ink = paint(words.colour);
    let line = whole.pre_translate(words.at.x, words.at.y).pre_rotate(words.angle.to_degrees());
    let mut end = 0.0;
    for (letter, place) in words.text.chars().zip(&words.places) {
        let start = place.unwrap_or(end);
        end = start + faces.advance(&words.family, letter) * words.size;
        let Some(outline) = faces.outline(&words.family, letter) else { continue };
        let mut transform = line.pre_translate(start, 0.0).pre_scale(words.size, words.size);
        if words.is_italic {
            transform = transform.pre_concat(Transform::from_skew(-LEAN, 0.0));
        }
        pixmap.fill_path(outline, &ink, FillRule::Winding, transform, mask);
        if words.family == FontFamily::Proportional {
            let edge = tiny_skia::Stroke { width: EMBOLDENING, ..tiny_skia::Stroke::default() };
            pixmap.stroke_path(outline, &ink, &edge, transform, mask);
        }
    }
}

/// Draws an image into a rectangle: whole pixels when magnified, averaged when reduced.
fn picture(pixmap: &mut Pixmap, pixels: &ColorImage, place: Rect, scale: f32, mask: Option<&Mask>) {
    let wanted = [place.width(), place.height()].map(|side| (side * scale).round().max(1.0) as usize);
    let averaged;
    let is_smaller = wanted[0] < pixels.size[0] && wanted[1] < pixels.size[1];
    let pixels = if is_smaller {
        averaged = average(pixels, wanted);
        &averaged
    } else {
        pixels
    };
    let Some(texture) = texture(pixels) else { return };
    let [width, height] = pixels.size.map(|side| side as f32);
    let (sx, sy) = (place.width() * scale / width, place.height() * scale / height);
    let (x, y) = (place.left() * scale, place.top() * scale);
    let placed = Transform::from_row(sx, 0.0, 0.0, sy, x, y);
    let shader = Pattern::new(texture.as_ref(), SpreadMode::Pad, FilterQuality::Nearest, 1.0, placed);
    let paint = Paint { shader, anti_alias: false, ..Paint::default() };
    if let Some(area) = tiny_skia::Rect::from_xywh(x, y, sx * width, sy * height) {
        pixmap.fill_rect(area, &paint, Transform::identity(), mask);
    }
}

/// A reduced image, each pixel of which is the mean of those that it covers.
fn average(pixels: &ColorImage, [width, height]: [usize; 2]) -> ColorImage {
    let range = |k: usize, count: usize, side: usize| {
        let first = k * side / count;
        first..((k + 1) * side / count).max(first + 1)
    };
    let mut small = Vec::with_capacity(width * height);
    for y in 0..height {
        for x in 0..width {
            let (mut sum, mut count) = ([0_u32; 4], 0);
            for row in range(y, height, pixels.size[1]) {
                for column in range(x, width, pixels.size[0]) {
                    let pixel = pixels.pixels[row * pixels.size[0] + column].to_array();
                    sum.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += u32::from(value));
                    count += 1;
                }
            }
            small.push(crate::theme::premultiplied(sum.map(|sum| (sum / count) as u8)));
        }
    }
    ColorImage::new([width, height], small)
}

fn texture(pixels: &ColorImage) -> Option<Pixmap> {
    let mut texture = Pixmap::new(pixels.size[0] as u32, pixels.size[1] as u32)?;
    for (place, colour) in texture.pixels_mut().iter_mut().zip(&pixels.pixels) {
        let [r, g, b, a] = colour.to_array();
        // Additive colours, with components above alpha, cannot be represented; clamp them.
        *place = PremultipliedColorU8::from_rgba(r.min(a), g.min(a), b.min(a), a)?;
    }
    Some(texture)
}

fn mask(clip: Rect, scale: f32, [width, height]: [u32; 2]) -> Option<Mask> {
    let mut mask = Mask::new(width, height)?;
    let whole = |v: f32| (v * scale).round();
    let area = tiny_skia::Rect::from_ltrb(
        whole(clip.left()),
        whole(clip.top()),
        whole(clip.right()),
        whole(clip.bottom()),
    )?;
    mask.fill_path(&PathBuilder::from_rect(area), FillRule::Winding, false, Transform::identity());
    Some(mask)
}

/// The path of a form, and its rotation.
fn path(form: &Form) -> Option<(Path, Transform)> {
    let mut path = PathBuilder::new();
    let mut turn = Transform::identity();
    match form {
        Form::Rect(rect, radii) => corners(&mut path, *rect, *radii),
        Form::Ellipse(middle, half, angle) => {
            let box_of = Rect::from_center_size(*middle, 2.0 * *half);
            path.push_oval(tiny_skia::Rect::from_ltrb(
                box_of.left(),
                box_of.top(),
                box_of.right(),
                box_of.bottom(),
            )?);
            turn = Transform::from_rotate_at(angle.to_degrees(), middle.x, middle.y);
        }
        Form::Lines(points, closed) => {
            let (first, rest) = points.split_first()?;
            path.move_to(first.x, first.y);
            rest.iter().for_each(|point| path.line_to(point.x, point.y));
            if *closed {
                path.close();
            }
        }
        Form::Curve([first, one, two, last], closed) => {
            path.move_to(first.x, first.y);
            path.cubic_to(one.x, one.y, two.x, two.y, last.x, last.y);
            if *closed {
                path.close();
            }
        }
    }
    Some((path.finish()?, turn))
}

/// A rectangle with rounded corners, clockwise.
fn corners(path: &mut PathBuilder, Rect { min, max }: Rect, [nw, ne, se, sw]: [f32; 4]) {
    let away = 1.0 - QUARTER;
    path.move_to(min.x + nw, min.y);
    path.line_to(max.x - ne, min.y);
    path.cubic_to(max.x - ne * away, min.y, max.x, min.y + ne * away, max.x, min.y + ne);
    path.line_to(max.x, max.y - se);
    path.cubic_to(max.x, max.y - se * away, max.x - se * away, max.y, max.x - se, max.y);
    path.line_to(min.x + sw, max.y);
    path.cubic_to(min.x + sw * away, max.y, min.x, max.y - sw * away, min.x, max.y - sw);
    path.line_to(min.x, min.y + nw);
    path.cubic_to(min.x, min.y + nw * away, min.x + nw * away, min.y, min.x + nw, min.y);
    path.close();
}

fn colour(colour: Color32) -> Color {
    let [r, g, b, a] = colour.to_srgba_unmultiplied();
    Color::from_rgba8(r, g, b, a)
}

fn paint(ink: Color32) -> Paint<'static> {
    Paint { shader: Shader::SolidColor(colour(ink)), ..Paint::default() }
}
