//! The steps of a run as images: an animation (APNG) or a contact sheet (PNG).

use std::sync::atomic::{AtomicBool, Ordering};

use sightline_geometry::error::Error;

use super::canvas::Canvas;
use super::kind::SessionPart;
use super::source::{NamedRun, Source};
use super::step_image::{self, INK, PAPER};
use crate::problem::{ApiError, ApiResult};

/// Maximum number of animated steps; a longer run is sampled evenly, including the last step.
const MOST_FRAMES: usize = 600;
/// Maximum number of images on a sheet.
const MOST_PICTURES: usize = 96;
/// Images per row.
const COLUMNS: usize = 6;
/// Space between two images, px.
const GAP_PX: u32 = 8;
/// Height of the title of a sheet, px.
const TITLE_PX: u32 = 54;
/// Display time of a step, ms, and additional time of the last.
const STEP_MS: u16 = 700;
const LAST_MS: u16 = 2000;

/// The letter of a run, as in the viewer.
pub(crate) fn run_letter(number: usize) -> String {
    let letter = char::from(b'A' + (number % 26) as u8);
    if number < 26 { letter.to_string() } else { format!("{letter}{}", number / 26) }
}

/// The title of a run.
pub(crate) fn title(source: &Source, run: NamedRun<'_>) -> String {
    let name = &source.open.traverse.index().name;
    format!("{} · run {} · {name}", run.record.label, run_letter(run.number))
}

/// Indices of the shown steps in the run.
fn shown(steps: usize, most: usize) -> Vec<usize> {
    if steps <= most {
        return (0..steps).collect();
    }
    (0..most).map(|k| k * (steps - 1) / (most - 1)).collect()
}

/// An animated PNG.
///
/// # Errors
/// A problem if there is nothing to show; [`Error::Cancelled`].
pub(crate) fn animation(source: &Source, part: SessionPart, cancel: &AtomicBool) -> ApiResult<Vec<u8>> {
    let run = only_run(source, part)?;
    let indices = shown(run.run.steps.len(), MOST_FRAMES);
    let [width, height] = step_image::size(true);
    let wrong = |error: png::EncodingError| ApiError::internal(format!("an animation: {error}"));
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_animated(indices.len() as u32, 0).map_err(wrong)?;
    encoder.set_frame_delay(STEP_MS, 1000).map_err(wrong)?;
    let mut writer = encoder.write_header().map_err(wrong)?;
    let head = title(source, run);
    for (k, index) in indices.iter().enumerate() {
        if k + 1 == indices.len() {
            writer.set_frame_delay(LAST_MS, 1000).map_err(wrong)?;
        }
        let frame = draw_step(source, run, *index, Some(&head), cancel)?;
        writer.write_image_data(&frame.rgb()).map_err(wrong)?;
    }
    writer.finish().map_err(wrong)?;
    Ok(bytes)
}

/// All images in one PNG.
///
/// # Errors
/// A problem if there is nothing to show; [`Error::Cancelled`].
pub(crate) fn sheet(source: &Source, part: SessionPart, cancel: &AtomicBool) -> ApiResult<Vec<u8>> {
    let run = only_run(source, part)?;
    let indices = shown(run.run.steps.len(), MOST_PICTURES);
    let [width, height] = sheet_size(indices.len());
    let none = || ApiError::internal("a sheet without pixels");
    let mut whole = Canvas::new(width, height, PAPER).ok_or_else(none)?;
    let room = width as f32 - 2.0 * GAP_PX as f32;
    whole.text([GAP_PX as f32, 8.0], 18.0, room, INK, &title(source, run));
    let steps = run.run.steps.len();
    let of =
        if indices.len() < steps { format!("{} of {steps} steps. ", indices.len()) } else { String::new() };
    whole.text([GAP_PX as f32, 32.0], 12.0, room, INK, &format!("{of}{}", step_image::LEGEND));
    let [picture_width, picture_height] = step_image::size(false);
    for (k, index) in indices.iter().enumerate() {
        let step_image = draw_step(source, run, *index, None, cancel)?;
        let (column, row) = ((k % COLUMNS) as u32, (k / COLUMNS) as u32);
        let x = GAP_PX + column * (picture_width + GAP_PX);
        let y = TITLE_PX + row * (picture_height + GAP_PX);
        whole.put(&step_image, [x, y]);
    }
    whole.png().map_err(ApiError::internal)
}

/// The image of a step of a run, by its index.
pub(super) fn draw_step(
    source: &Source,
    run: NamedRun<'_>,
    index: usize,
    head: Option<&str>,
    cancel: &AtomicBool,
) -> ApiResult<Canvas> {
    if cancel.load(Ordering::Relaxed) {
        return Err(Error::Cancelled.into());
    }
    let trace = &run.run.steps[index];
    // A damaged file does not prevent the other steps from being shown.
    let left = match source.images(trace, cancel) {
        Err(Error::Cancelled) => return Err(Error::Cancelled.into()),
        images => images.ok().map(|[left, _]| left),
    };
    let drawn = step_image::draw(trace, left.as_deref(), &run.run.settings, head);
    drawn.ok_or_else(|| ApiError::internal("a picture without pixels"))
}

fn only_run(source: &Source, part: SessionPart) -> ApiResult<NamedRun<'_>> {
    let none = || ApiError::conflict("There is nothing to export: the run has no step yet.");
    source.runs(part).first().copied().ok_or_else(none)
}

fn sheet_size(pictures: usize) -> [u32; 2] {
    let [width, height] = step_image::size(false);
    let columns = pictures.clamp(1, COLUMNS) as u32;
    let rows = pictures.div_ceil(COLUMNS).max(1) as u32;
    [GAP_PX + columns * (width + GAP_PX), TITLE_PX + rows * (height + GAP_PX)]
}

/// Estimated size of the animation: rock fills the images, of which PNG leaves about half.
pub(crate) fn bytes_of_animation(source: &Source, part: SessionPart) -> u64 {
    let steps = source.runs(part).first().map_or(0, |run| run.run.steps.len().min(MOST_FRAMES));
    steps as u64 * bytes_of_picture()
}

/// Estimated size of the sheet.
pub(crate) fn bytes_of_sheet(source: &Source, part: SessionPart) -> u64 {
    let steps = source.runs(part).first().map_or(0, |run| run.run.steps.len().min(MOST_PICTURES));
    steps as u64 * bytes_of_picture()
}

fn bytes_of_picture() -> u64 {
    80_000
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_run_shows_its_first_and_last_step() {
        assert_eq!(shown(3, 96), [0, 1, 2]);
        let some = shown(1000, 96);
        assert_eq!((some.len(), some[0], some[95]), (96, 0, 999));
    }

    #[test]
    fn runs_are_called_as_in_the_viewer() {
        assert_eq!([0, 25, 26, 53].map(run_letter), ["A", "Z", "A1", "B2"]);
    }
}
