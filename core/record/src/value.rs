//! Plain values of quantities, and the evidence types that convert to them.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::frames::{Pixel, Point3};

/// The kind of a quantity's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A real number.
    Number,
    /// A whole number.
    Count,
    /// True or false.
    Flag,
    /// A word or a sentence.
    Word,
    /// Column (x) and row (y) in an image.
    Pixel,
    /// x, y and z.
    Vector,
    /// The upper triangle of a symmetric 3 × 3 matrix.
    Symmetric3,
    /// A 2 × 2 matrix, row by row.
    Matrix2,
    /// A 3 × 2 matrix, row by row.
    Matrix3x2,
}

impl Kind {
    /// The names of the components; empty for scalars and words.
    pub const fn components(self) -> &'static [&'static str] {
        match self {
            Self::Number | Self::Count | Self::Flag | Self::Word => &[],
            Self::Pixel => &["x", "y"],
            Self::Vector => &["x", "y", "z"],
            Self::Symmetric3 => &["xx", "xy", "xz", "yy", "yz", "zz"],
            Self::Matrix2 => &["xx", "xy", "yx", "yy"],
            Self::Matrix3x2 => &["xx", "xy", "yx", "yy", "zx", "zy"],
        }
    }
}

/// The value of a quantity at one step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(untagged)]
pub enum Value {
    /// The quantity has no value at this step.
    #[default]
    Missing,
    /// True or false.
    Flag(bool),
    /// A whole number.
    Count(i64),
    /// A real number.
    Number(f64),
    /// A word or a sentence.
    Word(String),
    /// The components of a pixel, point or matrix.
    Components(Vec<f64>),
}

impl Value {
    /// The value as a number; counts and flags convert (true is 1). `None` for other kinds.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Count(count) => Some(*count as f64),
            Self::Flag(flag) => Some(f64::from(*flag)),
            Self::Missing | Self::Word(_) | Self::Components(_) => None,
        }
    }

    /// One component, by its position in [`Kind::components`].
    pub fn component(&self, index: usize) -> Option<f64> {
        match self {
            Self::Components(values) => values.get(index).copied(),
            _ => None,
        }
    }

    /// The word; `None` for other kinds.
    pub fn word(&self) -> Option<&str> {
        match self {
            Self::Word(word) => Some(word),
            _ => None,
        }
    }
}

/// A type of evidence field that can be declared as a quantity.
pub trait Measured {
    /// The kind of its values.
    const KIND: Kind;
    /// The plain value.
    fn value(self) -> Value;
}

impl<T: Measured> Measured for Option<T> {
    const KIND: Kind = T::KIND;

    fn value(self) -> Value {
        self.map_or(Value::Missing, T::value)
    }
}

impl<T: Measured + Copy> Measured for &T {
    const KIND: Kind = T::KIND;

    fn value(self) -> Value {
        (*self).value()
    }
}

macro_rules! measured {
    ($($type:ty, $kind:ident, $value:expr;)*) => {$(
        impl Measured for $type {
            const KIND: Kind = Kind::$kind;

            fn value(self) -> Value {
                let make: fn(Self) -> Value = $value;
                make(self)
            }
        }
    )*};
}

measured! {
    f64, Number, Value::Number;
    f32, Number, |v| Value::Number(v.into());
    usize, Count, |v| Value::Count(v as i64);
    u64, Count, |v| Value::Count(v as i64);
    u32, Count, |v| Value::Count(v.into());
    u8, Count, |v| Value::Count(v.into());
    bool, Flag, Value::Flag;
    String, Word, Value::Word;
    &str, Word, |v| Value::Word(v.to_owned());
    Pixel, Pixel, |v| Value::Components(vec![v.x, v.y]);
    [f64; 2], Pixel, |v| Value::Components(v.to_vec());
    [u32; 2], Pixel, |v| Value::Components(v.map(f64::from).to_vec());
    Vector2<f64>, Pixel, |v| Value::Components(vec![v.x, v.y]);
    Point3, Vector, |v| Value::Components(vec![v.x, v.y, v.z]);
    [f64; 3], Vector, |v| Value::Components(v.to_vec());
    Matrix3<f64>, Symmetric3, |m| {
        Value::Components([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| m[at]).to_vec())
    };
    Matrix2<f64>, Matrix2, |m| Value::Components([(0, 0), (0, 1), (1, 0), (1, 1)].map(|at| m[at]).to_vec());
    Matrix3x2<f64>, Matrix3x2, |m| {
        Value::Components([(0, 0), (0, 1), (1, 0), (1, 1), (2, 0), (2, 1)].map(|at| m[at]).to_vec())
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn components_match_their_kind() {
        let matrix = Matrix3::new(1.0, 2.0, 3.0, 2.0, 4.0, 5.0, 3.0, 5.0, 6.0);
        let value = matrix.value();
        assert_eq!(value, Value::Components(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        let names = <Matrix3<f64> as Measured>::KIND.components();
        let yz = names.iter().position(|name| *name == "yz").unwrap();
        assert_eq!(value.component(yz), Some(matrix[(1, 2)]));
        let by_pixel = Matrix3x2::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0);
        assert_eq!(by_pixel.value().component(4), Some(5.0), "row by row");
    }

    #[test]
    fn a_missing_value_is_null_and_a_count_stays_whole() {
        let values = vec![None::<f64>.value(), 3_usize.value(), true.value(), "lost".value()];
        assert_eq!(serde_json::to_string(&values).unwrap(), r#"[null,3,true,"lost"]"#);
        assert_eq!(serde_json::from_str::<Vec<Value>>(r#"[null,3,true,"lost"]"#).unwrap(), values);
    }
}
