//! A golden list in memory: names with typed values, and its text form.
//!
//! A line is `name -> kind tokens`. Kinds: `real` (one or more numbers, written so that they round trip exactly),
//! `int`, `word` (text, compared exactly), `digest` (SHA-256 in hexadecimal), and `absent`.

use std::collections::HashSet;
use std::fmt::{Display, Write};

use nalgebra::{OPoint, SMatrix};
use sha2::{Digest, Sha256};
use sightline_geometry::camera::MastAngles;
use sightline_geometry::frames::Pixel;

/// Separates a name from its value.
const ARROW: &str = " -> ";

/// Number of evenly spaced samples of an array.
const SAMPLES: usize = 16;

/// The value of a line, formatted.
pub(crate) struct Value(String);

impl Value {
    /// No value.
    pub(crate) fn absent() -> Self {
        Self("absent".into())
    }

    /// Numbers, compared within a tolerance on another CPU type.
    pub(crate) fn reals<N: Display>(numbers: impl IntoIterator<Item = N>) -> Self {
        Self::tokens("real", numbers)
    }

    /// Integers, compared exactly.
    pub(crate) fn integers<N: Display>(numbers: impl IntoIterator<Item = N>) -> Self {
        Self::tokens("int", numbers)
    }

    fn tokens<N: Display>(kind: &str, numbers: impl IntoIterator<Item = N>) -> Self {
        let mut text = kind.to_owned();
        for number in numbers {
            write!(text, " {number}").expect("a string can be written to");
        }
        Self(text)
    }

    fn digest(bytes: &[u8]) -> Self {
        let mut text = "digest ".to_owned();
        for byte in Sha256::digest(bytes) {
            write!(text, "{byte:02x}").expect("a string can be written to");
        }
        Self(text)
    }
}

macro_rules! value_from {
    ($kind:ident: $($number:ty),+) => {
        $(impl From<$number> for Value {
            fn from(number: $number) -> Self {
                Self::$kind([number])
            }
        })+
    };
}
value_from!(reals: f64, f32);
value_from!(integers: u8, u32, i32, u64, usize);

impl From<bool> for Value {
    fn from(flag: bool) -> Self {
        Self::from(if flag { "yes" } else { "no" })
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Self(format!("word {}", text.replace('\\', "\\\\").replace('\n', "\\n")))
    }
}

impl From<String> for Value {
    fn from(text: String) -> Self {
        Self::from(text.as_str())
    }
}

impl From<Pixel> for Value {
    fn from(pixel: Pixel) -> Self {
        Self::reals([pixel.x, pixel.y])
    }
}

impl From<MastAngles> for Value {
    fn from(angles: MastAngles) -> Self {
        Self::reals([angles.azimuth_rad, angles.elevation_rad])
    }
}

impl From<OPoint<f64, nalgebra::Const<3>>> for Value {
    fn from(point: OPoint<f64, nalgebra::Const<3>>) -> Self {
        Self::from(point.coords)
    }
}

impl<const N: usize> From<[f64; N]> for Value {
    fn from(numbers: [f64; N]) -> Self {
        Self::reals(numbers)
    }
}

/// Row by row.
impl<const R: usize, const C: usize> From<SMatrix<f64, R, C>> for Value {
    fn from(matrix: SMatrix<f64, R, C>) -> Self {
        Self::reals(matrix.transpose().iter())
    }
}

impl<T: Into<Self>> From<Option<T>> for Value {
    fn from(value: Option<T>) -> Self {
        value.map_or_else(Self::absent, Into::into)
    }
}

/// A number of an array.
pub(crate) trait Number: Copy + Display {
    /// The number as f64, for the mean.
    fn wide(self) -> f64;
    /// Its bytes, little endian.
    fn bytes(self) -> Vec<u8>;
}

macro_rules! number {
    ($($number:ty),+) => {
        $(impl Number for $number {
            fn wide(self) -> f64 {
                f64::from(self)
            }
            fn bytes(self) -> Vec<u8> {
                self.to_le_bytes().to_vec()
            }
        })+
    };
}
number!(f32, f64, u32);

/// A golden list under construction: lines in order, below a prefix.
#[derive(Default)]
pub(crate) struct Sheet {
    prefix: String,
    lines: Vec<(String, String)>,
}

impl Sheet {
    /// Adds a line.
    pub(crate) fn put(&mut self, name: &str, value: impl Into<Value>) {
        let Value(text) = value.into();
        self.lines.push((format!("{}{name}", self.prefix), text));
    }

    /// Adds the lines that `write` adds, with `name` and a full stop before their names.
    pub(crate) fn within(&mut self, name: &str, write: impl FnOnce(&mut Self)) {
        let length = self.prefix.len();
        self.prefix.push_str(name);
        self.prefix.push('.');
        write(self);
        self.prefix.truncate(length);
    }

    /// Like [`Self::within`], for a value that may be absent; an absent one is one line.
    pub(crate) fn optional<T>(&mut self, name: &str, value: Option<T>, write: impl FnOnce(&mut Self, T)) {
        match value {
            Some(value) => self.within(name, |sheet| write(sheet, value)),
            None => self.put(name, Value::absent()),
        }
    }

    /// Like [`Self::within`], for every element of a list, numbered from 0; the first line is their number.
    pub(crate) fn each<T>(&mut self, name: &str, items: &[T], write: impl Fn(&mut Self, &T)) {
        self.within(name, |sheet| {
            sheet.put("count", items.len());
            for (index, item) in items.iter().enumerate() {
                sheet.within(&index.to_string(), |sheet| write(sheet, item));
            }
        });
    }

    /// Adds the summary of an array: shape, extremes and mean of its finite values, number of the others, samples, digest of
    /// its bytes.
    pub(crate) fn array<N: Number>(&mut self, name: &str, shape: &[usize], values: &[N]) {
        let finite = || values.iter().copied().filter(|value| value.wide().is_finite());
        let by_size = |a: &N, b: &N| a.wide().total_cmp(&b.wide());
        let count = finite().count();
        let mean = finite().map(Number::wide).sum::<f64>() / count.max(1) as f64;
        let last = values.len().saturating_sub(1);
        let places = (0..SAMPLES.min(values.len())).map(|k| k * last / (SAMPLES - 1));
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.bytes()).collect();
        self.within(name, |sheet| {
            sheet.put("shape", Value::integers(shape));
            sheet.put("min", finite().min_by(by_size).map(|value| Value::reals([value])));
            sheet.put("max", finite().max_by(by_size).map(|value| Value::reals([value])));
            sheet.put("mean", (count > 0).then_some(mean));
            sheet.put("not_finite", values.len() - count);
            sheet.put("samples", Value::reals(places.map(|place| values[place])));
            sheet.put("digest", Value::digest(&bytes));
        });
    }

    /// Returns the finished list.
    ///
    /// # Panics
    /// If two lines have the same name.
    pub(crate) fn finish(self, cpu: &str) -> List {
        let mut names = HashSet::new();
        for (name, _) in &self.lines {
            assert!(names.insert(name), "two lines of a golden list are named {name}");
        }
        List { cpu: cpu.to_owned(), lines: self.lines }
    }
}

/// A golden list: the CPU type that computed it, and its lines in order.
pub(crate) struct List {
    /// The CPU type.
    pub(crate) cpu: String,
    /// Names and values.
    pub(crate) lines: Vec<(String, String)>,
}

impl List {
    /// Reads a list from its text.
    ///
    /// # Errors
    /// The first line that is neither a comment nor `name -> value`.
    pub(crate) fn from_text(text: &str) -> Result<Self, MalformedList> {
        let mut list = Self { cpu: String::new(), lines: Vec::new() };
        for (index, line) in text.lines().enumerate() {
            if let Some(comment) = line.strip_prefix('#') {
                if let Some(cpu) = comment.trim().strip_prefix("cpu: ") {
                    list.cpu = cpu.to_owned();
                }
            } else if let Some((name, value)) = line.split_once(ARROW) {
                list.lines.push((name.to_owned(), value.to_owned()));
            } else if !line.is_empty() {
                return Err(MalformedList { line: index + 1 });
            }
        }
        Ok(list)
    }

    /// Formats the list as a file; `title` is one line that names drive and configuration.
    pub(crate) fn to_text(&self, title: &str) -> String {
        let mut text = format!(
            "# Golden list: {title}\n# Written by `cargo xtask golden --update`; not edited by hand.\n# cpu: {}\n\n",
            self.cpu
        );
        for (name, value) in &self.lines {
            text.push_str(&format!("{name}{ARROW}{value}\n"));
        }
        text
    }
}

/// A golden list with a line that is neither a comment nor `name -> value`.
#[derive(Debug, thiserror::Error)]
#[error("line {line} is neither a comment nor `name -> value`")]
pub(crate) struct MalformedList {
    line: usize,
}
