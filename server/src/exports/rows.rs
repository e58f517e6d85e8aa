//! The rows of runs as tables: JSON Lines, CSV and Parquet, one row a step, each beginning with target, label and run.
//!
//! CSV and JSON Lines write numbers with all their digits; in Parquet they are DOUBLE and INT64. What is not known is null,
//! empty in CSV. Units stand in the columns' names, and in Parquet as metadata of the file, `unit:<column>`.

use std::sync::Arc;

use parquet::basic::Compression;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::parser::parse_message_type;
use serde::{Serialize, Serializer};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_record::{Kind, StageRecord, Value};
use sightline_rover::version::tracker_version;
use sightline_session::records::{columns, records, row_columns};
use sightline_session::step::{RunStep, StepRow};

use super::kind::Part;
use super::source::Source;
use crate::columns as csv;
use crate::problem::{ApiError, ApiResult};
use crate::version::VERSION;

/// One step as a JSON object: the columns of [`StepRow`], then the quantities of every stage as `stage.quantity`.
#[derive(Serialize)]
pub(crate) struct Row {
    #[serde(flatten)]
    row: StepRow,
    #[serde(flatten, serialize_with = "quantities")]
    records: Vec<StageRecord>,
}

impl From<&RunStep> for Row {
    fn from(trace: &RunStep) -> Self {
        Self { row: trace.row(), records: records(trace) }
    }
}

/// A row with where it belongs.
#[derive(Serialize)]
struct Line<'a> {
    target: usize,
    label: &'a str,
    run: usize,
    #[serde(flatten)]
    row: Row,
}

/// The columns before those of the record, and how they are read.
type Place = (&'static str, fn(&Line<'_>) -> Value);

const PLACES: [Place; 3] = [
    ("target", |line| Value::Count(line.target as i64)),
    ("label", |line| Value::Word(line.label.to_owned())),
    ("run", |line| Value::Count(line.run as i64)),
];

/// The quantities that the row does not have, as fields.
fn quantities<S: Serializer>(records: &[StageRecord], serializer: S) -> std::result::Result<S::Ok, S::Error> {
    let own = &columns()[row_columns().len()..];
    serializer.collect_map(own.iter().map(|column| (column.name.as_str(), column.cell(records))))
}

/// The rows of a part of a session.
///
/// # Errors
/// [`Error::Cancelled`](sightline_geometry::error::Error::Cancelled).
fn lines<'a>(source: &'a Source, part: Part, cancel: Cancel<'_>) -> Result<Vec<Line<'a>>> {
    let mut lines = Vec::new();
    for run in source.runs(part) {
        for trace in &run.run.steps {
            cancel.check()?;
            let (label, row) = (&run.record.label, trace.as_ref().into());
            lines.push(Line { target: run.target, label, run: run.number, row });
        }
    }
    Ok(lines)
}

/// One JSON object a line.
///
/// # Errors
/// As [`lines`].
pub(crate) fn jsonl(source: &Source, part: Part, cancel: Cancel<'_>) -> Result<String> {
    let mut text = String::new();
    for line in lines(source, part, cancel)? {
        cancel.check()?;
        text.push_str(&serde_json::to_string(&line).unwrap_or_default());
        text.push('\n');
    }
    Ok(text)
}

/// A table with a header.
///
/// # Errors
/// As [`lines`].
pub(crate) fn csv(source: &Source, part: Part, cancel: Cancel<'_>) -> Result<String> {
    let mut table = header().join(",") + "\n";
    for line in lines(source, part, cancel)? {
        cancel.check()?;
        let label = sightline_api::table::cell(line.label);
        let cells = csv::csv_cells(columns(), &line.row.records);
        table.push_str(&format!("{},{label},{},{cells}\n", line.target, line.run));
    }
    Ok(table)
}

/// The number of columns.
pub(crate) fn column_count() -> u64 {
    (PLACES.len() + columns().len()) as u64
}

/// The names of all columns.
fn header() -> Vec<&'static str> {
    let own = columns().iter().map(|column| column.header.as_str());
    PLACES.iter().map(|(name, _)| *name).chain(own).collect()
}

/// A Parquet file.
///
/// # Errors
/// A problem when it is cancelled, or with what the library says.
pub(crate) fn parquet(source: &Source, part: Part, cancel: Cancel<'_>) -> ApiResult<Vec<u8>> {
    let lines = lines(source, part, cancel)?;
    written(source, &lines, cancel).map_err(|error| {
        let said = || ApiError::internal(format!("Parquet: {error}"));
        cancel.check().map_or_else(ApiError::from, |()| said())
    })
}

fn written(
    source: &Source,
    lines: &[Line<'_>],
    cancel: Cancel<'_>,
) -> std::result::Result<Vec<u8>, ParquetError> {
    let kinds = [Kind::Count, Kind::Word, Kind::Count].into_iter();
    let kinds: Vec<Kind> = kinds.chain(columns().iter().map(|column| column.kind)).collect();
    let mut schema = "message rows {".to_owned();
    for (name, kind) in header().into_iter().zip(&kinds) {
        schema.push_str(&match kind {
            Kind::Count => format!("optional int64 {name};"),
            Kind::Flag => format!("optional boolean {name};"),
            Kind::Word => format!("optional byte_array {name} (utf8);"),
            _ => format!("optional double {name};"),
        });
    }
    schema.push('}');
    let said = |key: &str, value: String| KeyValue::new(key.to_owned(), value);
    let units = columns().iter().filter(|column| column.kind == Kind::Number);
    let mut about: Vec<KeyValue> =
        units.map(|column| said(&format!("unit:{}", column.header), column.unit.word().to_owned())).collect();
    about.push(said("sightline", VERSION.to_owned()));
    about.push(said("tracker", tracker_version()));
    about.push(said("traverse", source.open.id.clone()));
    about.push(said("session", source.session.id.clone()));
    about.push(said("pixel_convention", "(0, 0) is the centre of the first pixel".to_owned()));
    let properties = WriterProperties::builder()
        .set_compression(Compression::UNCOMPRESSED)
        .set_key_value_metadata(Some(about))
        .build();
    let schema = Arc::new(parse_message_type(&schema)?);
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for (index, kind) in kinds.into_iter().enumerate() {
        cancel.check().map_err(|error| ParquetError::External(Box::new(error)))?;
        if let Some(column) = group.next_column()? {
            let cell = |line: &Line<'_>| match PLACES.get(index) {
                Some((_, place)) => place(line),
                None => columns()[index - PLACES.len()].cell(&line.row.records),
            };
            write_column(column, kind, lines.iter().map(cell))?;
        }
    }
    group.close()?;
    writer.into_inner()
}

fn write_column(
    mut column: SerializedColumnWriter<'_>,
    kind: Kind,
    cells: impl Iterator<Item = Value>,
) -> std::result::Result<(), ParquetError> {
    match kind {
        Kind::Count => {
            let (known, levels) = split(cells.map(|cell| match cell {
                Value::Count(count) => Some(count),
                _ => None,
            }));
            column.typed::<Int64Type>().write_batch(&known, Some(&levels), None)?;
        }
        Kind::Flag => {
            let (known, levels) = split(cells.map(|cell| match cell {
                Value::Flag(flag) => Some(flag),
                _ => None,
            }));
            column.typed::<BoolType>().write_batch(&known, Some(&levels), None)?;
        }
        Kind::Word => {
            let (known, levels) = split(cells.map(|cell| cell.word().map(ByteArray::from)));
            column.typed::<ByteArrayType>().write_batch(&known, Some(&levels), None)?;
        }
        _ => {
            let (known, levels) = split(cells.map(|cell| cell.number()));
            column.typed::<DoubleType>().write_batch(&known, Some(&levels), None)?;
        }
    }
    column.close()
}

/// The known values, and for every row whether it has one.
fn split<T>(values: impl Iterator<Item = Option<T>>) -> (Vec<T>, Vec<i16>) {
    let (mut known, mut levels) = (Vec::new(), Vec::new());
    for value in values {
        levels.push(i16::from(value.is_some()));
        known.extend(value);
    }
    (known, levels)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use sightline_record::Unit;

    #[test]
    fn names_are_unique_and_end_with_their_unit() {
        let names: BTreeSet<&str> = header().into_iter().collect();
        assert_eq!(names.len(), header().len());
        for column in columns() {
            for unit in [Unit::Pixel, Unit::Metre, Unit::Degree] {
                let ends = column.header.ends_with(&format!("_{}", unit.word()));
                assert_eq!(ends, column.unit == unit, "{}", column.header);
            }
        }
    }
}
