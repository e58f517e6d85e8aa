//! The arrays of a step as small pictures with words: what a template looked like, and where it fitted.

use image::{ImageFormat, Luma};
use sightline_core::trace::{ArrayName, StepTrace};

use crate::html::{escape, png_address};

/// What an array shows, as words below it; none for those that are tables of numbers.
const fn words(name: ArrayName) -> Option<&'static str> {
    Some(match name {
        ArrayName::Reference => "The template as it was taken",
        ArrayName::Scaled => "The template, scaled to the present distance",
        ArrayName::Rolled => "The template, scaled and rolled: what was matched",
        ArrayName::Matched => "The left image at the match",
        ArrayName::Difference => "Match less template, both normalised; grey is no difference",
        ArrayName::Surface => "The score of every position of the search window; bright is a better match",
        ArrayName::RightWindow => "The right image at the stereo match, as the left eye would see it",
        ArrayName::Disparities => "Disparities of the aligned left image; bright is near",
        ArrayName::Ranges => "Distances in the aligned left image; bright is far",
        ArrayName::Sensor => "The earlier surface in the virtual range sensor; bright is far",
        ArrayName::ErrorBefore => "Present less earlier depth before the registration; grey is no difference",
        ArrayName::ErrorCoarse => "Present less earlier depth after the coarse search; grey is no difference",
        ArrayName::ErrorFine => "Present less earlier depth at the end; grey is no difference",
        ArrayName::CoarseSearch => "Mean distance of the surfaces for every shift; dark is a better fit",
        ArrayName::Draped => "The earlier image as the present camera would see it",
        ArrayName::DrapedMatch => "The present image where that was found",
        ArrayName::Features
        | ArrayName::Cloud
        | ArrayName::RefinePath
        | ArrayName::MeshFixed
        | ArrayName::MeshMoving => {
            return None;
        }
    })
}

/// Every array of a step that is a picture.
pub(super) fn figures(trace: &StepTrace) -> String {
    let figures: Vec<String> = ArrayName::ALL.into_iter().filter_map(|name| figure(trace, name)).collect();
    if figures.is_empty() {
        return "<p>This step came to no arrays.</p>\n".to_owned();
    }
    format!("<div class=\"row\">\n{}</div>\n", figures.concat())
}

fn figure(trace: &StepTrace, name: ArrayName) -> Option<String> {
    let words = words(name)?;
    let view = trace.array(name)?;
    let [width, height] = view.size();
    let values = view.values();
    let known = || values.iter().copied().filter(|value| value.is_finite());
    let (low, high) =
        known().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return None;
    }
    // Signed values have their zero in the middle grey.
    let is_signed = matches!(
        name,
        ArrayName::Difference | ArrayName::ErrorBefore | ArrayName::ErrorCoarse | ArrayName::ErrorFine
    );
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
    // What is larger than a template stands wider.
    let class = if width <= 64 { "patch" } else { "map" };
    Some(format!(
        "<figure class=\"{class}\"><img src=\"{}\" alt=\"{}\" width=\"{width}\" height=\"{height}\"><figcaption>{words}. {limits}</figcaption></figure>\n",
        png_address(png.get_ref()),
        escape(&format!("{words}, as grey values. {limits}"))
    ))
}
