//! The pixels of a PDS3 product.
//!
//! Source: domain.md 6.1. The pointer `^IMAGE` is a record number (from 1, of `RECORD_BYTES`), a byte number
//! `<BYTES>` (from 1), or either beside the name of another file in the same folder. A line takes
//! `LINE_PREFIX_BYTES`, its samples and `LINE_SUFFIX_BYTES`. Samples are integers of 8, 16 or 32 bits or reals
//! of 32 bits, in either byte order; one band.
//!
//! Full scale is the largest number that `SAMPLE_BIT_MASK` allows (4095 for twelve bits). Some writers omit the
//! mask's radix, so a mask with as many binary digits as a sample has bits is read as binary.

use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use super::product::{FILE_LIMIT, Product};
use crate::import::odl::{Group, Value};
use sightline_geometry::error::{Error, Result};
use sightline_vision::image::io::open_regular;

/// The samples of an image, as the detector's numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// Width, px.
    pub width: u32,
    /// Height, px.
    pub height: u32,
    /// The samples line by line, DN.
    pub samples: Vec<f32>,
    /// The largest number of the detector, DN; `None` if the label lacks it (reals).
    pub full_scale_dn: Option<f64>,
}

impl Raster {
    /// Mean, smallest and largest sample, DN.
    pub fn statistics(&self) -> (f64, f32, f32) {
        let sum: f64 = self.samples.iter().map(|&v| f64::from(v)).sum();
        let smallest = self.samples.iter().copied().fold(f32::INFINITY, f32::min);
        let largest = self.samples.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        (sum / self.samples.len().max(1) as f64, smallest, largest)
    }
}

/// The storage format of a sample.
#[derive(Clone, Copy)]
struct SampleFormat {
    bytes: usize,
    kind: Kind,
    big_endian: bool,
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Signed,
    Unsigned,
    Real,
}

impl SampleFormat {
    fn read(image: &Group) -> Result<Self, String> {
        let name = image.text("SAMPLE_TYPE").ok_or("IMAGE has no SAMPLE_TYPE")?;
        let bits = image.number("SAMPLE_BITS").ok_or("IMAGE has no SAMPLE_BITS")?;
        let (kind, big_endian) = match name {
            "UNSIGNED_INTEGER" | "MSB_UNSIGNED_INTEGER" | "MAC_UNSIGNED_INTEGER" => (Kind::Unsigned, true),
            "INTEGER" | "MSB_INTEGER" | "MAC_INTEGER" => (Kind::Signed, true),
            "LSB_UNSIGNED_INTEGER" | "PC_UNSIGNED_INTEGER" => (Kind::Unsigned, false),
            "LSB_INTEGER" | "PC_INTEGER" => (Kind::Signed, false),
            "IEEE_REAL" | "REAL" => (Kind::Real, true),
            "PC_REAL" => (Kind::Real, false),
            other => return Err(format!("SAMPLE_TYPE {other} is not understood")),
        };
        let bytes = match (kind, bits) {
            (Kind::Signed | Kind::Unsigned, 8.0) => 1,
            (Kind::Signed | Kind::Unsigned, 16.0) => 2,
            (_, 32.0) => 4,
            _ => return Err(format!("{name} with SAMPLE_BITS = {bits} is not understood")),
        };
        Ok(Self { bytes, kind, big_endian })
    }

    fn decode(self, sample: &[u8]) -> f32 {
        let mut word = [0_u8; 4];
        for (place, byte) in word.iter_mut().zip(sample) {
            *place = *byte;
        }
        if self.big_endian {
            word[..self.bytes].reverse();
        }
        let unsigned = u32::from_le_bytes(word);
        let unused_bits = 32 - 8 * self.bytes as u32;
        match self.kind {
            Kind::Unsigned => unsigned as f32,
            Kind::Signed => ((unsigned << unused_bits) as i32 >> unused_bits) as f32,
            Kind::Real => f32::from_bits(unsigned),
        }
    }

    fn full_scale_dn(self, image: &Group) -> Option<f64> {
        if self.kind == Kind::Real {
            return None;
        }
        let bits = 8 * self.bytes as u32;
        let highest = f64::from(u32::MAX >> (32 - bits + u32::from(self.kind == Kind::Signed)));
        let mask = image.value("SAMPLE_BIT_MASK").and_then(|value| bit_mask(value, bits));
        Some(mask.filter(|&mask| mask >= 1.0 && mask <= highest).unwrap_or(highest))
    }
}

fn bit_mask(value: &Value, bits: u32) -> Option<f64> {
    let text = value.text()?;
    let binary = text.len() == bits as usize && text.bytes().all(|b| matches!(b, b'0' | b'1'));
    let mask = if binary { u32::from_str_radix(text, 2).ok().map(f64::from) } else { value.number() };
    mask.filter(|mask| mask.fract() == 0.0)
}

impl Product {
    /// Reads the pixels.
    ///
    /// # Errors
    /// A sentence that names the missing or unsupported entry of the label, or a file that is too short for its image.
    pub fn read_raster(&self) -> Result<Raster> {
        let image = self.image()?;
        let [width, height] = self.size()?;
        if let Some(bands) = image.number("BANDS").filter(|&bands| bands != 1.0) {
            return Err(self.problem(format!("the picture has {bands} bands, but only grey ones are read")));
        }
        let format = SampleFormat::read(image).map_err(|problem| self.problem(problem))?;
        let (prefix, suffix) = (self.blank_bytes(image, "PREFIX")?, self.blank_bytes(image, "SUFFIX")?);
        let line_bytes = width as usize * format.bytes;
        let stride = prefix + line_bytes + suffix;
        let bytes = self.read_block(stride * height as usize)?;
        let mut samples = Vec::with_capacity(width as usize * height as usize);
        for line in bytes.chunks_exact(stride) {
            let line = &line[prefix..prefix + line_bytes];
            samples.extend(line.chunks_exact(format.bytes).map(|sample| format.decode(sample)));
        }
        Ok(Raster { width, height, samples, full_scale_dn: format.full_scale_dn(image) })
    }

    /// The bytes before or after the samples of each line.
    fn blank_bytes(&self, image: &Group, place: &str) -> Result<usize> {
        let key = format!("LINE_{place}_BYTES");
        let bytes = image.number(&key).unwrap_or(0.0);
        let plausible = (0.0..=65_536.0).contains(&bytes) && bytes.fract() == 0.0;
        plausible.then_some(bytes as usize).ok_or_else(|| self.problem(format!("{key} is {bytes}")))
    }

    /// Reads `length` bytes from the position given by `^IMAGE`.
    fn read_block(&self, length: usize) -> Result<Vec<u8>> {
        let (path, offset) = self.locate_pixels()?;
        let unreadable = |source| Error::Read { path: path.clone(), source };
        let mut file = open_regular(&path).map_err(unreadable)?;
        let present = file.metadata().map_err(unreadable)?.len();
        let needed = offset.saturating_add(length as u64);
        if needed > present || present > FILE_LIMIT {
            let problem = format!(
                "the label puts the picture in bytes {offset} to {needed}, but the file has {present} \
                 (and at most {FILE_LIMIT} are read); fetch the file again"
            );
            return Err(Error::format(path, problem));
        }
        file.seek(SeekFrom::Start(offset)).map_err(unreadable)?;
        let mut bytes = vec![0; length];
        file.read_exact(&mut bytes).map_err(unreadable)?;
        Ok(bytes)
    }

    /// The file with the pixels, and the byte at which they begin.
    fn locate_pixels(&self) -> Result<(PathBuf, u64)> {
        let missing = || self.problem("the label has no ^IMAGE, so where its pixels begin is unknown");
        let pointer = self.label.value("^IMAGE").ok_or_else(missing)?;
        let (name, place) = match pointer.items() {
            [name, place] => (name.text(), Some(place)),
            [only] if only.number().is_some() => (None, Some(only)),
            [only] => (only.text(), None),
            _ => return Err(self.problem("^IMAGE must be (file, record)")),
        };
        let path = name.map_or_else(|| Ok(self.path.clone()), |name| self.beside(name))?;
        let Some(place) = place else { return Ok((path, 0)) };
        let number = place.number().filter(|&n| n >= 1.0 && n <= FILE_LIMIT as f64);
        let number = number.ok_or_else(|| self.problem("^IMAGE does not point into a file"))? as u64;
        if place.has_unit("BYTES") {
            return Ok((path, number - 1));
        }
        let record_bytes = self.record_bytes(&path)?;
        Ok((path, (number - 1).saturating_mul(record_bytes)))
    }

    /// Length of a record of the file at `path`, bytes; checked against the number of records, if the label has one.
    fn record_bytes(&self, path: &Path) -> Result<u64> {
        let missing = || self.problem("^IMAGE counts records, but RECORD_BYTES is missing");
        let stated = self.label.number("RECORD_BYTES").ok_or_else(missing)?;
        if !(stated >= 1.0 && stated <= FILE_LIMIT as f64 && stated.fract() == 0.0) {
            let problem =
                format!("RECORD_BYTES is {stated}, but it must be a whole number from 1 to {FILE_LIMIT}");
            return Err(self.problem(problem));
        }
        let bytes = stated as u64;
        if let Some(records) =
            self.label.number("FILE_RECORDS").filter(|&n| n >= 1.0 && n <= FILE_LIMIT as f64)
        {
            let unreadable = |source| Error::Read { path: path.to_owned(), source };
            let present = open_regular(path).and_then(|file| file.metadata()).map_err(unreadable)?.len();
            let expected = (records as u64).saturating_mul(bytes);
            // Some archives pad a file, by less than a record.
            if !(expected..expected.saturating_add(bytes)).contains(&present) {
                return Err(self.problem(format!(
                    "{records} FILE_RECORDS of {bytes} RECORD_BYTES are {expected} bytes, but the file has {present}; \
                     mend the label or fetch the file again"
                )));
            }
        }
        Ok(bytes)
    }

    /// The file of that name in the label's folder, ignoring case.
    fn beside(&self, name: &str) -> Result<PathBuf> {
        let folder = self.path.parent().unwrap_or(&self.path);
        let same_name = |path: &PathBuf| path.file_name().is_some_and(|own| own.eq_ignore_ascii_case(name));
        let entries =
            std::fs::read_dir(folder).map_err(|source| Error::Read { path: folder.into(), source })?;
        let found = entries.filter_map(|entry| Some(entry.ok()?.path())).find(same_name);
        found.ok_or_else(|| self.problem(format!("^IMAGE names {name}, which is not in the same folder")))
    }
}
