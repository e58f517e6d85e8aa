//! A picture of a panel: what is on the screen, cut to the panel, as a PNG file to keep.

use egui::{ColorImage, Context, Rect};

/// Takes a picture of the next frame, cut to `rect` (points), and offers it as a file of that name.
pub fn take(context: &Context, rect: Rect, name: String) {
    let scale = context.pixels_per_point();
    context.request_screenshot(move |whole| {
        if let Some(png) = cut(&whole, rect, scale).and_then(|image| encode(&image)) {
            keep(&name, &png);
        }
    });
    context.request_repaint();
}

/// The part of a picture; none where nothing of it is on the screen.
fn cut(whole: &ColorImage, rect: Rect, scale: f32) -> Option<ColorImage> {
    let [width, height] = whole.size;
    let at = |value: f32, end: usize| ((value * scale).round().max(0.0) as usize).min(end);
    let (left, right) = (at(rect.left(), width), at(rect.right(), width));
    let (top, bottom) = (at(rect.top(), height), at(rect.bottom(), height));
    if left >= right || top >= bottom {
        return None;
    }
    let rows = (top..bottom).flat_map(|y| whole.pixels[y * width + left..y * width + right].iter().copied());
    Some(ColorImage::new([right - left, bottom - top], rows.collect()))
}

fn encode(image: &ColorImage) -> Option<Vec<u8>> {
    let [width, height] = image.size;
    // What is behind the page is nobody's business: the picture is opaque.
    let pixels: Vec<u8> =
        image.pixels.iter().flat_map(|colour| [colour.r(), colour.g(), colour.b()]).collect();
    let picture = image::RgbImage::from_raw(width as u32, height as u32, pixels)?;
    let mut png = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut png, image::ImageFormat::Png).ok()?;
    Some(png.into_inner())
}

#[cfg(target_arch = "wasm32")]
fn keep(name: &str, png: &[u8]) {
    crate::web::download(name, "image/png", png);
}

/// Beside the program there is no browser that asks where to: the present folder, never over another file.
#[cfg(not(target_arch = "wasm32"))]
fn keep(name: &str, png: &[u8]) {
    use std::io::Write;
    let name_of = |number: u32| match number {
        0 => format!("{name}.png"),
        _ => format!("{name}-{number}.png"),
    };
    let free = (0..1000).find_map(|number| std::fs::File::create_new(name_of(number)).ok());
    if let Some(mut file) = free {
        // A full disk leaves a file that no viewer opens; there is nobody to tell from here.
        file.write_all(png).unwrap_or_default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::theme;
    use egui::pos2;

    #[test]
    fn a_panel_is_cut_out_at_the_scale_of_the_screen() {
        let mut whole = ColorImage::filled([40, 20], theme::grey(0.0));
        whole.pixels[9 * 40 + 21] = theme::UNTINTED;
        let rect = Rect::from_min_max(pos2(10.0, 4.0), pos2(15.0, 6.0));
        let part = cut(&whole, rect, 2.0).unwrap();
        assert_eq!((part.size, part.pixels[10 + 1]), ([10, 4], theme::UNTINTED));
        assert!(cut(&whole, rect.translate(egui::vec2(100.0, 0.0)), 2.0).is_none());
        let png = image::load_from_memory(&encode(&part).unwrap()).unwrap();
        assert_eq!((png.width(), png.height()), (10, 4));
    }
}
