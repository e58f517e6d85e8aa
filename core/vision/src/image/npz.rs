//! Several arrays in one file (`.npz`), as written by `numpy.savez`: an uncompressed ZIP with one `.npy` file per array.

use std::io::{Cursor, Read, Write};
use std::path::Path;

use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

use sightline_geometry::error::{Error, Result};

/// Suffix of every entry's name, which NumPy omits from the array's name.
const ENDING: &str = ".npy";

/// The bytes of a `.npz` file with these arrays, each given as the bytes of a `.npy` file; deterministic.
///
/// # Errors
/// [`Error::Format`] if two arrays have the same name.
pub fn encode<'a>(arrays: impl IntoIterator<Item = (&'a str, Vec<u8>)>) -> Result<Vec<u8>> {
    let failed = |error: ZipError| Error::format("arrays", format!("cannot be written as .npz ({error})"));
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::default());
    let mut file = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, array) in arrays {
        file.start_file(format!("{name}{ENDING}"), options).map_err(failed)?;
        file.write_all(&array).map_err(|error| failed(error.into()))?;
    }
    Ok(file.finish().map_err(failed)?.into_inner())
}

/// Decodes the arrays in the bytes of a `.npz` file: name and bytes of the `.npy` file of each; `name` is used in error
/// messages.
///
/// # Errors
/// [`Error::Format`] if the bytes are no ZIP, are truncated or damaged, or contain a compressed entry, which could
/// expand to any size.
pub fn decode(bytes: &[u8], name: impl AsRef<Path>) -> Result<Vec<(String, Vec<u8>)>> {
    let damaged = |error: &dyn std::fmt::Display| {
        Error::format(name.as_ref(), format!("not a .npz file that can be read ({error})"))
    };
    let mut file = ZipArchive::new(Cursor::new(bytes)).map_err(|e| damaged(&e))?;
    let mut arrays = Vec::with_capacity(file.len());
    for place in 0..file.len() {
        let mut entry = file.by_index(place).map_err(|e| damaged(&e))?;
        if entry.compression() != CompressionMethod::Stored {
            return Err(damaged(&format!("`{}` is compressed; write it with numpy.savez", entry.name())));
        }
        let array = entry.name().strip_suffix(ENDING).unwrap_or(entry.name()).to_owned();
        let mut content = Vec::new();
        entry.read_to_end(&mut content).map_err(|e| damaged(&e))?;
        arrays.push((array, content));
    }
    Ok(arrays)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> Vec<u8> {
        encode([("surface", vec![1, 2, 3]), ("matched", vec![7; 5000])]).unwrap()
    }

    #[test]
    fn arrays_come_back_by_their_names_and_the_same_ones_are_the_same_bytes() {
        let expected = vec![("surface".to_owned(), vec![1, 2, 3]), ("matched".to_owned(), vec![7; 5000])];
        assert_eq!(decode(&two(), "a").unwrap(), expected);
        assert_eq!(two(), two());
        assert!(decode(&encode([]).unwrap(), "a").unwrap().is_empty());
        assert!(encode([("a", vec![]), ("a", vec![])]).is_err());
    }

    #[test]
    fn what_is_damaged_is_refused_with_a_sentence() {
        let refuse = |bytes: &[u8]| decode(bytes, "x.npz").unwrap_err().to_string();
        assert!(refuse(b"hello").starts_with("x.npz: not a .npz file"));
        let whole = two();
        assert!(refuse(&whole[..whole.len() - 30]).starts_with("x.npz: not a .npz file"));
        let mut flipped = whole;
        let inside = flipped.windows(8).position(|w| w == [7; 8]).unwrap() + 100;
        flipped[inside] = 8;
        assert!(refuse(&flipped).contains("checksum"), "{}", refuse(&flipped));
    }
}
