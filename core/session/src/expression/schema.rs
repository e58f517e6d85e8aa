//! The record of a step as a tree of names, built from the OpenAPI schema, so that no field is missing or described twice.
//!
//! The unit of a field is the one that its stage declares, else it follows from the name (`_m`) or the type (`Pixel`), else
//! it is that of the enclosing field.

use std::collections::{BTreeMap, HashMap};

use sightline_record::Unit as Recorded;
use utoipa::ToSchema;
use utoipa::openapi::schema::{ArrayItems, SchemaType, Type};
use utoipa::openapi::{RefOr, Schema};

use super::unit::Unit;

/// Maximum depth of nested records.
const DEPTH_LIMIT: usize = 16;

/// A name with the names under it.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    /// Its meaning, as one sentence.
    pub meaning: String,
    /// The kind of its value.
    pub shape: Shape,
}

/// The kind of value that a name denotes.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// A number.
    Number(Unit),
    /// Yes or no.
    Truth,
    /// A word or a text, with the possible words; empty if unknown.
    Word(Vec<String>),
    /// A list of entries of the same shape.
    List(Box<Entry>),
    /// Fields by name.
    Record(BTreeMap<String, Entry>),
}

/// The declaration of a field by the record.
pub(super) struct Declared {
    /// The unit.
    pub unit: Option<Unit>,
    /// The meaning; `None` if the field is not a quantity.
    pub meaning: Option<String>,
}

/// Returns the declaration of the field at a path.
pub(super) type DeclaredAt = fn(&str) -> Declared;

/// The fields of a type, with the units and meanings that the record declares.
pub(super) fn fields_of<T: ToSchema>(declared_at: DeclaredAt) -> BTreeMap<String, Entry> {
    let mut parts = Vec::new();
    T::schemas(&mut parts);
    let parts: HashMap<String, RefOr<Schema>> = parts.into_iter().collect();
    match (Walk { parts: &parts, declared_at }).entry(&T::schema(), "", &Context::default()).shape {
        Shape::Record(fields) => fields,
        _ => BTreeMap::new(),
    }
}

/// The properties that a field inherits from the enclosing one.
#[derive(Clone, Default)]
struct Context {
    meaning: String,
    unit: Option<Unit>,
    path: String,
    depth: usize,
}

struct Walk<'a> {
    declared_at: DeclaredAt,
    parts: &'a HashMap<String, RefOr<Schema>>,
}

impl Walk<'_> {
    fn entry(&self, schema: &RefOr<Schema>, name: &str, context: &Context) -> Entry {
        let path = match (context.path.as_str(), name) {
            (around, "") => around.to_owned(),
            ("", name) => name.to_owned(),
            (around, name) => format!("{around}.{name}"),
        };
        let declared = (self.declared_at)(&path);
        let unit = declared.unit.or_else(|| type_of(schema).and_then(unit_of_type));
        let described = || description(schema).map(first_sentence);
        let meaning = declared.meaning.or_else(described).unwrap_or_else(|| context.meaning.clone());
        let context =
            Context { meaning, unit: unit.or_else(|| context.unit.clone()), path, depth: context.depth + 1 };
        let shape = if context.depth > DEPTH_LIMIT {
            Shape::Record(BTreeMap::new())
        } else {
            self.shape(schema, &context)
        };
        Entry { meaning: context.meaning, shape }
    }

    fn shape(&self, schema: &RefOr<Schema>, context: &Context) -> Shape {
        let empty = Shape::Record(BTreeMap::new());
        let schema = match schema {
            RefOr::T(schema) => schema,
            RefOr::Ref(to) => {
                let name = to.ref_location.rsplit('/').next().unwrap_or_default();
                return self.parts.get(name).map_or(empty, |part| self.shape(part, context));
            }
        };
        match schema {
            Schema::Object(object) if !object.properties.is_empty() => {
                // Fields inherit the unit of the whole unless they declare their own.
                let fields = object.properties.iter();
                let entry = |(name, field): (&String, &RefOr<Schema>)| {
                    (name.clone(), self.entry(field, name, context))
                };
                Shape::Record(fields.map(entry).collect())
            }
            Schema::Object(object) => match only_type(&object.schema_type) {
                Some(Type::Number | Type::Integer) => {
                    Shape::Number(context.unit.clone().unwrap_or(Unit::NONE))
                }
                Some(Type::Boolean) => Shape::Truth,
                Some(Type::String) => {
                    let words = object.enum_values.iter().flatten();
                    Shape::Word(words.filter_map(|word| word.as_str().map(str::to_owned)).collect())
                }
                _ => empty,
            },
            Schema::Array(array) => match &array.items {
                ArrayItems::RefOrSchema(items) => Shape::List(Box::new(self.entry(items, "", context))),
                ArrayItems::False => empty,
            },
            Schema::OneOf(one) => self.together(&one.items, context),
            Schema::AnyOf(any) => self.together(&any.items, context),
            Schema::AllOf(all) => self.together(&all.items, context),
            _ => empty,
        }
    }

    /// Merges alternatives, so that the fields of each can be named.
    fn together(&self, items: &[RefOr<Schema>], context: &Context) -> Shape {
        let shapes = items.iter().filter(|item| !is_null(item)).map(|item| self.shape(item, context));
        shapes.reduce(merged).unwrap_or_else(|| Shape::Record(BTreeMap::new()))
    }
}

/// The name of the type to which a field, possibly nullable, refers.
fn type_of(schema: &RefOr<Schema>) -> Option<&str> {
    match schema {
        RefOr::Ref(to) => to.ref_location.rsplit('/').next(),
        RefOr::T(Schema::OneOf(one)) => {
            one.items.iter().filter(|item| !is_null(item)).find_map(|item| type_of(item))
        }
        RefOr::T(_) => None,
    }
}

/// The unit of a type; `None` for types without one.
fn unit_of_type(name: &str) -> Option<Unit> {
    matches!(name, "Pixel" | "PixelRect").then(|| Recorded::Pixel.into())
}

fn merged(a: Shape, b: Shape) -> Shape {
    match (a, b) {
        (Shape::Record(mut fields), Shape::Record(more)) => {
            for (name, entry) in more {
                let both = match fields.remove(&name) {
                    Some(known) => Entry { shape: merged(known.shape, entry.shape), ..known },
                    None => entry,
                };
                fields.insert(name, both);
            }
            Shape::Record(fields)
        }
        (Shape::Word(mut words), Shape::Word(more)) => {
            words.extend(more);
            Shape::Word(words)
        }
        (fields @ Shape::Record(_), _) | (_, fields @ Shape::Record(_)) => fields,
        (a, _) => a,
    }
}

fn is_null(schema: &RefOr<Schema>) -> bool {
    let RefOr::T(Schema::Object(object)) = schema else { return false };
    object.schema_type == SchemaType::Type(Type::Null)
}

fn only_type(schema_type: &SchemaType) -> Option<Type> {
    match schema_type {
        SchemaType::Type(only) => Some(only.clone()),
        SchemaType::Array(several) => several.iter().find(|one| **one != Type::Null).cloned(),
        SchemaType::AnyValue => None,
    }
}

/// The description of a field; a nullable field may have it at its only non-null alternative.
fn description(schema: &RefOr<Schema>) -> Option<&str> {
    own_description(schema).or_else(|| match schema {
        RefOr::T(Schema::OneOf(one)) => {
            match one.items.iter().filter(|item| !is_null(item)).collect::<Vec<_>>()[..] {
                [only] => own_description(only),
                _ => None,
            }
        }
        _ => None,
    })
}

fn own_description(schema: &RefOr<Schema>) -> Option<&str> {
    let text = match schema {
        RefOr::Ref(to) => Some(to.description.as_str()),
        RefOr::T(Schema::Object(object)) => object.description.as_deref(),
        RefOr::T(Schema::Array(array)) => array.description.as_deref(),
        RefOr::T(Schema::OneOf(one)) => one.description.as_deref(),
        RefOr::T(Schema::AnyOf(any)) => any.description.as_deref(),
        RefOr::T(Schema::AllOf(all)) => all.description.as_deref(),
        RefOr::T(_) => None,
    };
    text.filter(|text| !text.is_empty())
}

/// The first sentence of a description, on one line.
fn first_sentence(text: &str) -> String {
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let end = line.find(". ").map_or(line.len(), |end| end + 1);
    line[..end].to_owned()
}
