//! Reading and writing PNG files.
//!
//! Detector numbers become fractions of full scale: value = DN / full scale. Full scale is 255 for 8 bits and 65535 for
//! 16 bits unless given by the caller (12-bit data in 16-bit files: 4095). Colour becomes luma = 0.2126 R + 0.7152 G +
//! 0.0722 B (ITU-R BT.709); transparency is ignored.
//!
//! The header alone determines the memory of the decoded pixels, so the size is checked first: images above
//! [`MAX_PIXELS`], or above the expected size, are not decoded, and the decoder may allocate at most 8 bytes per allowed
//! pixel plus 4 MiB.

use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, ErrorKind, Read, Seek};
use std::path::Path;

use image::codecs::png::PngDecoder;
use image::{DynamicImage, ImageBuffer, ImageDecoder, ImageError, ImageFormat, Limits, Luma};

use super::GrayImage;
use sightline_geometry::error::{Error, Result};

/// Largest number of pixels of an image that is read.
pub const MAX_PIXELS: u64 = 64_000_000;

/// Memory of a decoded pixel, bytes: four 16-bit channels.
const PIXEL_BYTES: u64 = 8;

/// Memory for the parts of a file that are not pixels, such as a colour profile, bytes.
const METADATA_BYTES: u64 = 4 << 20;

/// First bytes of every PNG file: signature, length and name of the header chunk.
const PNG_START: [u8; 16] = *b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR";

/// Reads an 8- or 16-bit PNG file; `full_scale_dn` is the detector number of value 1.
///
/// # Errors
/// [`Error::Read`] if the file cannot be opened; [`Error::Format`] if it is no PNG, is damaged or too large.
pub fn read_png(path: impl AsRef<Path>, full_scale_dn: Option<f64>) -> Result<GrayImage> {
    let path = path.as_ref();
    decode(open(path)?, path, full_scale_dn, MAX_PIXELS)
}

/// As [`read_png`], for a file that should have `size`, width and height in px: an image with more pixels is not
/// decoded. The caller compares the sizes, with [`png_size`] before and with the image after.
///
/// # Errors
/// As [`read_png`].
pub fn read_png_of_size(path: &Path, full_scale_dn: Option<f64>, size: [u32; 2]) -> Result<GrayImage> {
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    decode(open(path)?, path, full_scale_dn, pixels.min(MAX_PIXELS))
}

/// Width and height in the header of a PNG file, px; no pixel is decoded.
///
/// # Errors
/// As [`read_png`].
pub fn png_size(path: &Path) -> Result<[u32; 2]> {
    let mut start = [0; PNG_START.len() + 8];
    let read = open(path)?.read_exact(&mut start);
    let [a, b, c, d, e, f, g, h] = start[PNG_START.len()..] else { return Ok([0; 2]) };
    match read {
        Ok(()) if start.starts_with(&PNG_START) => {
            Ok([u32::from_be_bytes([a, b, c, d]), u32::from_be_bytes([e, f, g, h])])
        }
        Err(source) if source.kind() != ErrorKind::UnexpectedEof => {
            Err(Error::Read { path: path.into(), source })
        }
        _ => Err(Error::format(path, "not a PNG image that can be read (no header)")),
    }
}

/// Opens a file for reading if it is a regular file; others, such as a named pipe, may block for ever.
///
/// # Errors
/// For a missing file, a folder, a pipe, a device or a socket.
pub fn open_regular(path: &Path) -> std::io::Result<File> {
    // A pipe would block in the call to open it.
    if std::fs::metadata(path)?.is_file() {
        File::open(path)
    } else {
        Err(std::io::Error::new(ErrorKind::InvalidInput, "not a regular file"))
    }
}

fn open(path: &Path) -> Result<BufReader<File>> {
    open_regular(path).map(BufReader::new).map_err(|source| Error::Read { path: path.into(), source })
}

/// Decodes the bytes of a PNG file; `name` is used in error messages.
///
/// # Errors
/// [`Error::Format`] if the bytes are no PNG, are damaged or contain too large an image.
pub fn decode_png(bytes: &[u8], name: impl AsRef<Path>, full_scale_dn: Option<f64>) -> Result<GrayImage> {
    decode(Cursor::new(bytes), name.as_ref(), full_scale_dn, MAX_PIXELS)
}

/// Writes 8 bits: 1 becomes 255; values are clamped to 0…1, invalid pixels become 0.
///
/// # Errors
/// [`Error::Write`] if the file cannot be written; [`Error::Format`] for an image without pixels.
pub fn write_png_u8(path: impl AsRef<Path>, image: &GrayImage) -> Result<()> {
    write(path.as_ref(), &to_u8(image))
}

/// Writes 16 bits: 1 becomes `full_scale_dn` (default 65535); values are clamped to 0…1, invalid pixels become 0.
///
/// # Errors
/// [`Error::Write`] if the file cannot be written; [`Error::Format`] for an image without pixels.
pub fn write_png_u16(path: impl AsRef<Path>, image: &GrayImage, full_scale_dn: Option<f64>) -> Result<()> {
    write(path.as_ref(), &to_u16(image, full_scale_dn))
}

/// The bytes of an 8-bit PNG file, as [`write_png_u8`] writes them.
///
/// # Errors
/// [`Error::Format`] for an image without pixels.
pub fn encode_png_u8(image: &GrayImage) -> Result<Vec<u8>> {
    encode(&to_u8(image), Path::new("image"))
}

/// The bytes of a 16-bit PNG file, as [`write_png_u16`] writes them.
///
/// # Errors
/// [`Error::Format`] for an image without pixels.
pub fn encode_png_u16(image: &GrayImage, full_scale_dn: Option<f64>) -> Result<Vec<u8>> {
    encode(&to_u16(image, full_scale_dn), Path::new("image"))
}

fn decode(
    reader: impl BufRead + Seek,
    path: &Path,
    full_scale_dn: Option<f64>,
    most_pixels: u64,
) -> Result<GrayImage> {
    if let Some(dn) = full_scale_dn.filter(|dn| !(*dn > 0.0 && dn.is_finite())) {
        return Err(Error::format(path, format!("full scale must be a positive number, not {dn}")));
    }
    let mut limits = Limits::default();
    limits.max_alloc = Some(most_pixels * PIXEL_BYTES + METADATA_BYTES);
    let damaged =
        |error: ImageError| Error::format(path, format!("not a PNG image that can be read ({error})"));
    let decoder = PngDecoder::with_limits(reader, limits).map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    if u64::from(width) * u64::from(height) > most_pixels {
        let most = match most_pixels {
            MAX_PIXELS => format!("{} million", MAX_PIXELS / 1_000_000),
            fewer => fewer.to_string(),
        };
        let problem = format!("the image has {width} × {height} pixels; at most {most} can be read");
        return Err(Error::format(path, problem));
    }
    let decoded = DynamicImage::from_decoder(decoder).map_err(damaged)?;
    Ok(to_gray(decoded, full_scale_dn))
}

/// Converts any decoded image to fractions of full scale.
fn to_gray(decoded: DynamicImage, full_scale_dn: Option<f64>) -> GrayImage {
    let scale8 = 1.0 / full_scale_dn.unwrap_or(255.0);
    let scale16 = 1.0 / full_scale_dn.unwrap_or(65_535.0);
    match decoded {
        DynamicImage::ImageLuma8(grey) => from_samples(&grey, |p: &Luma<u8>| f64::from(p[0]) * scale8),
        DynamicImage::ImageLuma16(grey) => from_samples(&grey, |p: &Luma<u16>| f64::from(p[0]) * scale16),
        DynamicImage::ImageLumaA8(grey) => from_samples(&grey, |p| f64::from(p[0]) * scale8),
        DynamicImage::ImageLumaA16(grey) => from_samples(&grey, |p| f64::from(p[0]) * scale16),
        DynamicImage::ImageRgb8(colour) => from_samples(&colour, |p| luma(p.0.map(f64::from)) * scale8),
        DynamicImage::ImageRgba8(colour) => {
            from_samples(&colour, |p| luma([p[0], p[1], p[2]].map(f64::from)) * scale8)
        }
        other => from_samples(&other.into_rgb16(), |p| luma(p.0.map(f64::from)) * scale16),
    }
}

fn from_samples<P: image::Pixel>(
    image: &ImageBuffer<P, Vec<P::Subpixel>>,
    value: impl Fn(&P) -> f64,
) -> GrayImage {
    let values = image.pixels().map(|pixel| value(pixel) as f32).collect();
    GrayImage::from_raw(image.width(), image.height(), values).unwrap_or_default()
}

fn luma([red, green, blue]: [f64; 3]) -> f64 {
    0.2126 * red + 0.7152 * green + 0.0722 * blue
}

fn to_u8(image: &GrayImage) -> DynamicImage {
    // Rounding casts saturate, and NaN becomes 0.
    let pixel = |x, y| Luma([(image.get_pixel(x, y)[0].clamp(0.0, 1.0) * 255.0).round() as u8]);
    ImageBuffer::from_fn(image.width(), image.height(), pixel).into()
}

fn to_u16(image: &GrayImage, full_scale_dn: Option<f64>) -> DynamicImage {
    let full_scale = full_scale_dn.unwrap_or(65_535.0);
    let dn = |value: f32| (f64::from(value).clamp(0.0, 1.0) * full_scale).round() as u16;
    let pixel = |x, y| Luma([dn(image.get_pixel(x, y)[0])]);
    DynamicImage::ImageLuma16(ImageBuffer::from_fn(image.width(), image.height(), pixel))
}

fn encode(image: &DynamicImage, name: &Path) -> Result<Vec<u8>> {
    let mut bytes = Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, ImageFormat::Png)
        .map_err(|error| Error::format(name, format!("cannot be written as PNG ({error})")))?;
    Ok(bytes.into_inner())
}

fn write(path: &Path, image: &DynamicImage) -> Result<()> {
    let bytes = encode(image, path)?;
    std::fs::write(path, bytes).map_err(|source| Error::Write { path: path.into(), source })
}

#[cfg(test)]
#[path = "io_tests.rs"]
mod tests;
