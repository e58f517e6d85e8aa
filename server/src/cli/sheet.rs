//! The contact sheet of a traverse: its left images, reduced, row by row, for an overview of the drive.
//!
//! Contains at most eight evenly spaced stops, including the first and the last. Levels are drawn as their square root,
//! close to the display gamma for linear light, with one scale for the whole sheet.

use std::io::Cursor;
use std::path::Path;

use image::imageops::{self, FilterType};
use image::{GrayImage, ImageFormat, Luma};
use sightline_geometry::error::{Error, Result};
use sightline_recordings::Traverse;
use sightline_recordings::files::{remove_left_overs_of, write_atomically};

/// Images per row.
const COLUMNS: u32 = 4;
/// Maximum number of images on a sheet.
const MOST: usize = 8;
/// Width of an image on the sheet, px.
const WIDTH_PX: u32 = 160;
/// Space between images, px.
const GAP_PX: u32 = 4;

/// Writes the contact sheet of a traverse whose images exist.
///
/// # Errors
/// An image that cannot be read, or a file that cannot be written.
pub(super) fn write(traverse: &Traverse, path: &Path) -> Result<()> {
    let stops = evenly_spaced(traverse.stop_count());
    let mut images = Vec::with_capacity(stops.len());
    for stop in stops {
        let left = traverse.capture(stop)?.left;
        let height = (WIDTH_PX * left.height()).div_ceil(left.width());
        images.push(imageops::resize(left.as_ref(), WIDTH_PX, height, FilterType::Triangle));
    }
    let brightest =
        images.iter().flat_map(|image| image.pixels()).map(|p| p.0[0]).fold(f32::MIN_POSITIVE, f32::max);
    let height = images.iter().map(image::ImageBuffer::height).max().unwrap_or(1);
    let rows = (images.len() as u32).div_ceil(COLUMNS);
    let across = COLUMNS.min(images.len() as u32);
    let mut sheet = GrayImage::from_pixel(
        across * (WIDTH_PX + GAP_PX) + GAP_PX,
        rows * (height + GAP_PX) + GAP_PX,
        Luma([255]),
    );
    for (index, image) in images.iter().enumerate() {
        let (column, row) = (index as u32 % COLUMNS, index as u32 / COLUMNS);
        let drawn = GrayImage::from_fn(image.width(), image.height(), |x, y| {
            Luma([(255.0 * (image.get_pixel(x, y).0[0].max(0.0) / brightest).sqrt()).round() as u8])
        });
        let at = |k: u32, size: u32| i64::from(GAP_PX + k * (size + GAP_PX));
        imageops::replace(&mut sheet, &drawn, at(column, WIDTH_PX), at(row, height));
    }
    let wrong = |problem| Error::format(path, format!("cannot be written: {problem}"));
    let format = ImageFormat::from_path(path).map_err(wrong)?;
    let mut bytes = Cursor::new(Vec::new());
    sheet.write_to(&mut bytes, format).map_err(wrong)?;
    remove_left_overs_of(path);
    write_atomically(path, bytes.get_ref())
}

/// The stops shown on the sheet.
fn evenly_spaced(stops: usize) -> Vec<usize> {
    let count = stops.min(MOST);
    (0..count).map(|k| if count > 1 { k * (stops - 1) / (count - 1) } else { 0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sheet_begins_with_the_first_stop_and_ends_with_the_last() {
        assert_eq!(evenly_spaced(30), [0, 4, 8, 12, 16, 20, 24, 29]);
        assert_eq!(evenly_spaced(3), [0, 1, 2]);
        assert_eq!(evenly_spaced(1), [0]);
    }
}
