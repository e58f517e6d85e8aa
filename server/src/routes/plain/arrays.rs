//! The arrays of a step as small images with captions, such as the template and the score map.

use image::{ImageFormat, Luma};
use sightline_track::trace::{ArrayName, StepTrace};

use crate::html::{escape, png_address};

/// Every image array of a step.
pub(super) fn figures(trace: &StepTrace) -> String {
    let figures: Vec<String> = ArrayName::all().filter_map(|name| figure(trace, name)).collect();
    if figures.is_empty() {
        return "<p>This step has no arrays.</p>\n".to_owned();
    }
    format!("<div class=\"row\">\n{}</div>\n", figures.concat())
}

fn figure(trace: &StepTrace, name: ArrayName) -> Option<String> {
    let declared = name.declaration().filter(|array| array.kind.is_raster())?;
    let words = &declared.description;
    let view = trace.array(name)?;
    let [width, height] = view.size();
    let values = view.values();
    let known = || values.iter().copied().filter(|value| value.is_finite());
    let (low, high) =
        known().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return None;
    }
    // For signed values, zero is mid grey.
    let is_signed = declared.kind.is_signed();
    let reach = high.max(-low);
    let (low, high) = if is_signed { (-reach, reach) } else { (low, high) };
    let span = (high - low).max(1e-9);
    let grey = |x: u32, y: u32| {
        let value = values.get((y * width + x) as usize).copied().unwrap_or(f32::NAN);
        Luma([if value.is_finite() { (255.0 * (value - low) / span).round() as u8 } else { 0 }])
    };
    let mut png = std::io::Cursor::new(Vec::new());
    image::GrayImage::from_fn(width, height, grey).write_to(&mut png, ImageFormat::Png).ok()?;
    let missing = values.len() - known().count();
    let holes = if missing > 0 { format!("; {missing} have no value and are black") } else { String::new() };
    let limits = format!("{width} × {height} values, black to white from {low:.3} to {high:.3}{holes}.");
    // Arrays larger than a template are displayed wider.
    let class = if width <= 64 { "patch" } else { "map" };
    Some(format!(
        "<figure class=\"{class}\"><img src=\"{}\" alt=\"{}\" width=\"{width}\" height=\"{height}\"><figcaption>{words}. {limits}</figcaption></figure>\n",
        png_address(png.get_ref()),
        escape(&format!("{words}, as grey values. {limits}"))
    ))
}
