//! The declared quantities of the stages as names of expressions: their units, and values that are not fields of the record.

use std::collections::BTreeMap;

use crate::records::{self, StageQuantity};
use crate::step::RunStep;
use sightline_record::{Kind, Quantity, StageSchema, Value as Recorded};

use super::extract::Value;
use super::schema::{Declared, Entry, Shape};
use super::tree::Segment;
use super::unit::Unit;

/// The declaration of the field at a path of the record.
pub(super) fn of_field(path: &str) -> Declared {
    let meaning = records::quantity_at(path).map(|quantity| quantity.description.to_string());
    Declared { unit: records::unit_at(path).map(Unit::from), meaning }
}

/// The declaration of a column of the row.
pub(super) fn of_column(path: &str) -> Declared {
    let quantity = records::row_quantity(path);
    Declared {
        unit: quantity.map(|quantity| quantity.unit.into()),
        meaning: quantity.map(|quantity| quantity.description.to_string()),
    }
}

/// The stages with their declared quantities, as records.
pub(super) fn stages() -> BTreeMap<String, Entry> {
    schemas().map(|stage| (stage.stage.to_string(), entry_of(stage))).collect()
}

/// The stage whose quantities are the columns of a row.
pub(super) const ROW: &str = "step";

/// The row with its declared columns, below the name `ROW`.
pub(super) fn row() -> BTreeMap<String, Entry> {
    records::stage(ROW).map(|row| (ROW.to_owned(), entry_of(row.schema()))).into_iter().collect()
}

/// The schemas of the stages with their own evidence.
fn schemas() -> impl Iterator<Item = &'static StageSchema> {
    records::stages().iter().map(sightline_record::Stage::schema).filter(|schema| !schema.path.is_empty())
}

fn entry_of(stage: &StageSchema) -> Entry {
    let mut fields = BTreeMap::new();
    for quantity in &stage.quantities {
        let mut names: Vec<&str> = quantity.name.split('.').collect();
        let last = names.pop().unwrap_or_default();
        let mut within = &mut fields;
        for name in names {
            let record = Entry { meaning: String::new(), shape: Shape::Record(BTreeMap::new()) };
            match &mut within.entry(name.to_owned()).or_insert(record).shape {
                Shape::Record(inner) => within = inner,
                // A quantity has no parts other than its components.
                _ => return Entry { meaning: stage.question.to_string(), shape: Shape::Record(fields) },
            }
        }
        within.insert(last.to_owned(), of_quantity(quantity));
    }
    Entry { meaning: stage.question.to_string(), shape: Shape::Record(fields) }
}

fn of_quantity(quantity: &Quantity) -> Entry {
    let meaning = quantity.description.to_string();
    let number = || Shape::Number(Unit::from(quantity.unit));
    let part = || Entry { meaning: quantity.description.to_string(), shape: number() };
    let shape = match quantity.kind {
        Kind::Number | Kind::Count => number(),
        Kind::Flag => Shape::Truth,
        Kind::Word => Shape::Word(Vec::new()),
        kind => Shape::Record(kind.components().iter().map(|name| ((*name).to_owned(), part())).collect()),
    };
    Entry { meaning, shape }
}

/// The value of a declared quantity; the path is the stage, the quantity's name, and optionally a component.
pub(super) fn read(trace: &RunStep, path: &[Segment]) -> Value {
    let names: Option<Vec<&str>> = path.iter().map(field).collect();
    let found = names.and_then(|names| {
        let name = names.join(".");
        if let Some(quantity) = StageQuantity::named(&name) {
            return Some(plain(quantity.value(trace)));
        }
        let (whole, component) = name.rsplit_once('.')?;
        let quantity = StageQuantity::named(whole)?;
        let index = quantity.declared().kind.components().iter().position(|c| *c == component)?;
        quantity.value(trace).component(index).map(Value::of_number)
    });
    found.unwrap_or(Value::Missing)
}

fn field(segment: &Segment) -> Option<&str> {
    match segment {
        Segment::Field(name) => Some(name),
        Segment::Index(_) => None,
    }
}

fn plain(value: Recorded) -> Value {
    match value {
        Recorded::Missing => Value::Missing,
        Recorded::Flag(flag) => Value::Truth(flag),
        Recorded::Count(count) => Value::Number(count as f64),
        Recorded::Number(number) => Value::of_number(number),
        Recorded::Word(word) => Value::Word(word),
        Recorded::Components(_) => Value::Record,
    }
}
