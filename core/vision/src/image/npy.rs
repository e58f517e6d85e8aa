//! Arrays as NumPy files (`.npy`, format version 1.0): dense data such as score maps, and the ground truth of rendered
//! images.
//!
//! Images are two-dimensional `f32`; rows are image rows (C order, `<f4`); NaN stays NaN. Arrays of `f64` and in column
//! order can be read too. [`encode_array`] writes arrays of other types and shapes.

use std::path::Path;

use npyz::{AutoSerialize, DType, NpyFile, Order, WriterBuilder};

use super::GrayImage;
use super::io::MAX_PIXELS;
use sightline_geometry::error::{Error, Result};

/// The bytes of a `.npy` file with the image as an array of shape (height, width).
///
/// # Errors
/// [`Error::Format`] if the writer fails, which only lack of memory can cause.
pub fn encode(image: &GrayImage) -> Result<Vec<u8>> {
    encode_array(image.as_raw(), &[image.height(), image.width()])
}

/// The bytes of a `.npy` file with an array of any shape; the last axis varies fastest.
///
/// # Errors
/// [`Error::Format`] if the number of values does not match the shape, or as [`encode`].
pub fn encode_array<T: AutoSerialize + Copy>(values: &[T], shape: &[u32]) -> Result<Vec<u8>> {
    let failed =
        |error: std::io::Error| Error::format("array", format!("cannot be written as .npy ({error})"));
    let mut bytes = Vec::with_capacity(128 + size_of_val(values));
    let shape: Vec<u64> = shape.iter().copied().map(u64::from).collect();
    let mut writer = npyz::WriteOptions::<T>::new()
        .default_dtype()
        .shape(&shape)
        .writer(&mut bytes)
        .begin_nd()
        .map_err(failed)?;
    writer.extend(values.iter().copied()).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

/// Decodes the image in the bytes of a `.npy` file; `name` is used in error messages.
///
/// # Errors
/// [`Error::Format`] if the bytes are no 2-D array of floats, are truncated, or contain too large an array.
pub fn decode(bytes: &[u8], name: impl AsRef<Path>) -> Result<GrayImage> {
    let problem = |text: String| Error::format(name.as_ref(), text);
    let damaged =
        |error: &dyn std::fmt::Display| problem(format!("not a .npy array that can be read ({error})"));
    let file = NpyFile::new(bytes).map_err(|e| damaged(&e))?;
    let [height, width] = *file.shape() else {
        return Err(problem(format!("the array has {} dimensions; an image has two", file.shape().len())));
    };
    if height.checked_mul(width).is_none_or(|pixels| pixels > MAX_PIXELS) {
        let limit = MAX_PIXELS / 1_000_000;
        return Err(problem(format!(
            "the array has {width} × {height} values; at most {limit} million can be read"
        )));
    }
    let order = file.order();
    let item_bytes = match file.dtype() {
        DType::Plain(ty) => ty.num_bytes(),
        _ => None,
    };
    let values: Vec<f32> = if item_bytes == Some(8) {
        file.into_vec::<f64>().map(|values| values.into_iter().map(|v| v as f32).collect())
    } else {
        file.into_vec::<f32>()
    }
    .map_err(|e| damaged(&e))?;
    from_values(width as u32, height as u32, values, order)
        .ok_or_else(|| damaged(&"its size and data disagree"))
}

fn from_values(width: u32, height: u32, values: Vec<f32>, order: Order) -> Option<GrayImage> {
    match order {
        Order::C => GrayImage::from_raw(width, height, values),
        Order::Fortran => {
            let columns = GrayImage::from_raw(height, width, values)?;
            Some(GrayImage::from_fn(width, height, |x, y| *columns.get_pixel(y, x)))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(header: &str, data: &[u8]) -> Vec<u8> {
        let mut text = header.as_bytes().to_vec();
        text.resize((10 + text.len() + 1).next_multiple_of(64) - 11, b' ');
        text.push(b'\n');
        [&b"\x93NUMPY\x01\x00"[..], &(text.len() as u16).to_le_bytes(), &text, data].concat()
    }

    #[test]
    fn an_array_survives_the_round_trip_with_its_invalid_values() {
        let image = GrayImage::from_fn(5, 3, |x, y| image::Luma([x as f32 - 10.0 * y as f32]));
        let bytes = encode(&image).unwrap();
        assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
        assert_eq!(decode(&bytes, "a").unwrap(), image);
        let holes = GrayImage::from_raw(2, 1, vec![f32::NAN, 1.0]).unwrap();
        let back = decode(&encode(&holes).unwrap(), "a").unwrap();
        assert!(back.as_raw()[0].is_nan() && back.as_raw()[1] == 1.0);
    }

    #[test]
    fn column_order_big_endian_and_double_precision_are_read() {
        let data: Vec<u8> = [1.0_f64, 4.0, 2.0, 5.0, 3.0, 6.0].iter().flat_map(|v| v.to_be_bytes()).collect();
        let bytes = file("{'descr': '>f8', 'fortran_order': True, 'shape': (2, 3), }", &data);
        assert_eq!(decode(&bytes, "a").unwrap().as_raw(), &vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    }

    #[test]
    fn what_is_no_image_is_refused_with_a_sentence() {
        let refuse = |bytes: &[u8]| decode(bytes, "x.npy").unwrap_err().to_string();
        let header = |shape: &str| format!("{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}, }}");
        assert!(refuse(b"hello").starts_with("x.npy: not a .npy array"));
        assert!(refuse(&file(&header("(2, 3)"), &[0; 20])).starts_with("x.npy: not a .npy array"));
        assert_eq!(
            refuse(&file(&header("(6,)"), &[0; 24])),
            "x.npy: the array has 1 dimensions; an image has two"
        );
        assert!(refuse(&file(&header("(1000000, 1000000)"), &[])).contains("at most 64 million"));
        assert!(
            refuse(&file("{'descr': '<i4', 'fortran_order': False, 'shape': (1, 1), }", &[0; 4]))
                .contains(".npy")
        );
    }
}
