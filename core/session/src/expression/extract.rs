//! Extracts one value of a record by its path: a `serde` serialiser that skips all other fields and builds no tree.
//!
//! Non-finite numbers and absent fields are missing.

use std::fmt::Display;

use serde::ser::{self, Serialize};

use super::tree::Segment;

/// A value of a step.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// No value.
    Missing,
    /// A number: in base units during evaluation, in the expression's unit as its result.
    Number(f64),
    /// Yes or no.
    Truth(bool),
    /// A word or a text.
    Word(String),
    /// A list, with its number of entries.
    List(usize),
    /// A record with fields.
    Record,
}

impl Value {
    /// A number; missing if it is not finite.
    pub(super) fn of_number(value: f64) -> Self {
        if value.is_finite() { Self::Number(value) } else { Self::Missing }
    }
}

/// The value at `path` of `record`.
pub(super) fn extract<T: Serialize + ?Sized>(record: &T, path: &[Segment]) -> Value {
    record.serialize(Extract { path }).unwrap_or(Value::Missing)
}

/// The error of the serialiser; the value is then missing.
#[derive(Debug)]
struct Unreadable;

impl Display for Unreadable {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "unreadable")
    }
}
impl std::error::Error for Unreadable {}
impl ser::Error for Unreadable {
    fn custom<T: Display>(_: T) -> Self {
        Self
    }
}

#[derive(Clone, Copy)]
struct Extract<'a> {
    path: &'a [Segment],
}

impl<'a> Extract<'a> {
    /// A value without parts.
    fn leaf(self, value: Value) -> Result<Value, Unreadable> {
        Ok(if self.path.is_empty() { value } else { Value::Missing })
    }

    fn inside(self, empty: Value) -> Inside<'a> {
        let found = if self.path.is_empty() { empty } else { Value::Missing };
        Inside { path: self.path, found, count: 0, is_next: false }
    }

    /// An enum variant with data, as a record of one field.
    fn variant<T: Serialize + ?Sized>(self, name: &str, value: &T) -> Result<Value, Unreadable> {
        match self.path.split_first() {
            None => Ok(Value::Record),
            Some((Segment::Field(field), rest)) if field == name => value.serialize(Extract { path: rest }),
            Some(_) => Ok(Value::Missing),
        }
    }
}

/// Serialises the entries of a list or the fields of a record, one after the other.
struct Inside<'a> {
    path: &'a [Segment],
    found: Value,
    count: usize,
    is_next: bool,
}

impl Inside<'_> {
    fn field<T: Serialize + ?Sized>(&mut self, name: &str, value: &T) -> Result<(), Unreadable> {
        if let Some((Segment::Field(field), rest)) = self.path.split_first()
            && field == name
        {
            self.found = value.serialize(Extract { path: rest })?;
        }
        Ok(())
    }

    fn entry<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Unreadable> {
        match self.path.split_first() {
            None => self.found = Value::List(self.count + 1),
            Some((Segment::Index(index), rest)) if *index == self.count => {
                self.found = value.serialize(Extract { path: rest })?;
            }
            Some((Segment::Field(name), rest)) if self.found == Value::Missing => {
                let own = [Segment::Field("name".to_owned())];
                if extract(value, &own) == Value::Word(name.clone()) {
                    self.found = value.serialize(Extract { path: rest })?;
                }
            }
            Some(_) => {}
        }
        self.count += 1;
        Ok(())
    }
}

macro_rules! numbers {
    ($($name:ident: $type:ty),*) => {
        $(fn $name(self, value: $type) -> Result<Value, Unreadable> {
            // Counts beyond 2⁵³ do not occur.
            self.leaf(Value::of_number(value as f64))
        })*
    };
}

impl<'a> ser::Serializer for Extract<'a> {
    type Ok = Value;
    type Error = Unreadable;
    type SerializeSeq = Inside<'a>;
    type SerializeTuple = Inside<'a>;
    type SerializeTupleStruct = Inside<'a>;
    type SerializeTupleVariant = Inside<'a>;
    type SerializeMap = Inside<'a>;
    type SerializeStruct = Inside<'a>;
    type SerializeStructVariant = Inside<'a>;

    numbers!(serialize_i8: i8, serialize_i16: i16, serialize_i32: i32, serialize_i64: i64, serialize_u8: u8,
        serialize_u16: u16, serialize_u32: u32, serialize_u64: u64, serialize_f32: f32, serialize_f64: f64);

    fn serialize_bool(self, value: bool) -> Result<Value, Unreadable> {
        self.leaf(Value::Truth(value))
    }
    fn serialize_char(self, value: char) -> Result<Value, Unreadable> {
        self.leaf(Value::Word(value.to_string()))
    }
    fn serialize_str(self, value: &str) -> Result<Value, Unreadable> {
        self.leaf(Value::Word(value.to_owned()))
    }
    fn serialize_bytes(self, value: &[u8]) -> Result<Value, Unreadable> {
        self.leaf(Value::List(value.len()))
    }
    fn serialize_none(self) -> Result<Value, Unreadable> {
        Ok(Value::Missing)
    }
    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<Value, Unreadable> {
        value.serialize(self)
    }
    fn serialize_unit(self) -> Result<Value, Unreadable> {
        Ok(Value::Missing)
    }
    fn serialize_unit_struct(self, _: &'static str) -> Result<Value, Unreadable> {
        Ok(Value::Missing)
    }
    fn serialize_unit_variant(
        self,
        _: &'static str,
        _: u32,
        name: &'static str,
    ) -> Result<Value, Unreadable> {
        self.leaf(Value::Word(name.to_owned()))
    }
    fn serialize_newtype_struct<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        value: &T,
    ) -> Result<Value, Unreadable> {
        value.serialize(self)
    }
    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        name: &'static str,
        value: &T,
    ) -> Result<Value, Unreadable> {
        self.variant(name, value)
    }
    fn serialize_seq(self, _: Option<usize>) -> Result<Inside<'a>, Unreadable> {
        Ok(self.inside(Value::List(0)))
    }
    fn serialize_tuple(self, _: usize) -> Result<Inside<'a>, Unreadable> {
        Ok(self.inside(Value::List(0)))
    }
    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Inside<'a>, Unreadable> {
        Ok(self.inside(Value::List(0)))
    }
    fn serialize_tuple_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Inside<'a>, Unreadable> {
        Err(Unreadable)
    }
    fn serialize_map(self, _: Option<usize>) -> Result<Inside<'a>, Unreadable> {
        Ok(self.inside(Value::Record))
    }
    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Inside<'a>, Unreadable> {
        Ok(self.inside(Value::Record))
    }
    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        name: &'static str,
        _: usize,
    ) -> Result<Inside<'a>, Unreadable> {
        let rest = match self.path.split_first() {
            Some((Segment::Field(field), rest)) if field == name => rest,
            Some(_) => return Err(Unreadable),
            None => self.path,
        };
        Ok(Extract { path: rest }.inside(Value::Record))
    }
}

macro_rules! lists {
    ($($trait:ident::$method:ident),*) => {
        $(impl ser::$trait for Inside<'_> {
            type Ok = Value;
            type Error = Unreadable;
            fn $method<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Unreadable> {
                self.entry(value)
            }
            fn end(self) -> Result<Value, Unreadable> {
                Ok(self.found)
            }
        })*
    };
}
lists!(
    SerializeSeq::serialize_element,
    SerializeTuple::serialize_element,
    SerializeTupleStruct::serialize_field,
    SerializeTupleVariant::serialize_field
);

macro_rules! records {
    ($($trait:ident),*) => {
        $(impl ser::$trait for Inside<'_> {
            type Ok = Value;
            type Error = Unreadable;
            fn serialize_field<T: Serialize + ?Sized>(&mut self, name: &'static str, value: &T) -> Result<(), Unreadable> {
                self.field(name, value)
            }
            fn end(self) -> Result<Value, Unreadable> {
                Ok(self.found)
            }
        })*
    };
}
records!(SerializeStruct, SerializeStructVariant);

impl ser::SerializeMap for Inside<'_> {
    type Ok = Value;
    type Error = Unreadable;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), Unreadable> {
        let wanted = matches!(self.path.first(), Some(Segment::Field(field)) if extract(key, &[]) == Value::Word(field.clone()));
        self.is_next = wanted;
        Ok(())
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Unreadable> {
        if self.is_next
            && let Some((_, rest)) = self.path.split_first()
        {
            self.found = value.serialize(Extract { path: rest })?;
        }
        Ok(())
    }

    fn end(self) -> Result<Value, Unreadable> {
        Ok(self.found)
    }
}
