//! The rows of runs as tables: JSON Lines, CSV and Parquet, one row per step, each starting with target, label and run.
//!
//! CSV and JSON Lines write numbers with full precision; Parquet stores DOUBLE and INT64. Unknown values are null, or empty
//! in CSV. Units are part of the column names, and in Parquet also metadata of the file, `unit:<column>`.

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

use super::kind::SessionPart;
use super::source::Source;
use crate::columns as csv;
use crate::problem::{ApiError, ApiResult};
use crate::version::VERSION;

/// One step as a JSON object: the columns of [`StepRow`], then the quantities of every stage as `stage.quantity`.
#[derive(Serialize)]
pub(crate) struct ExportRow {
    #[serde(flatten)]
    row: StepRow,
    #[serde(flatten, serialize_with = "quantities")]
    records: Vec<StageRecord>,
}

impl From<&RunStep> for ExportRow {
    fn from(trace: &RunStep) -> Self {
        Self { row: trace.row(), records: records(trace) }
    }
}

/// A row with its target and run.
#[derive(Serialize)]
struct LabelledRow<'a> {
    target: usize,
    label: &'a str,
    run: usize,
    #[serde(flatten)]
    row: ExportRow,
}

/// A column in front of the record: its name and accessor.
type LeadingColumn = (&'static str, fn(&LabelledRow<'_>) -> Value);

const LEADING_COLUMNS: [LeadingColumn; 3] = [
    ("target", |labelled| Value::Count(labelled.target as i64)),
    ("label", |labelled| Value::Word(labelled.label.to_owned())),
    ("run", |labelled| Value::Count(labelled.run as i64)),
];

/// Serialises the quantities that are not part of the row as fields.
fn quantities<S: Serializer>(records: &[StageRecord], serializer: S) -> std::result::Result<S::Ok, S::Error> {
    let own = &columns()[row_columns().len()..];
    serializer.collect_map(own.iter().map(|column| (column.name.as_str(), column.cell(records))))
}

/// The rows of a part of a session.
///
/// # Errors
/// [`Error::Cancelled`](sightline_geometry::error::Error::Cancelled).
fn labelled_rows<'a>(
    source: &'a Source,
    part: SessionPart,
    cancel: Cancel<'_>,
) -> Result<Vec<LabelledRow<'a>>> {
    let mut labelled_rows = Vec::new();
    for run in source.runs(part) {
        for trace in &run.run.steps {
            cancel.check()?;
            let (label, row) = (&run.record.label, trace.as_ref().into());
            labelled_rows.push(LabelledRow { target: run.target, label, run: run.number, row });
        }
    }
    Ok(labelled_rows)
}

/// One JSON object per line.
///
/// # Errors
/// As [`labelled_rows`].
pub(crate) fn jsonl(source: &Source, part: SessionPart, cancel: Cancel<'_>) -> Result<String> {
    let mut text = String::new();
    for labelled in labelled_rows(source, part, cancel)? {
        cancel.check()?;
        text.push_str(&serde_json::to_string(&labelled).unwrap_or_default());
        text.push('\n');
    }
    Ok(text)
}

/// A CSV table with a header.
///
/// # Errors
/// As [`labelled_rows`].
pub(crate) fn csv(source: &Source, part: SessionPart, cancel: Cancel<'_>) -> Result<String> {
    let mut table = header().join(",") + "\n";
    for labelled in labelled_rows(source, part, cancel)? {
        cancel.check()?;
        let label = sightline_api::table::cell(labelled.label);
        let cells = csv::csv_cells(columns(), &labelled.row.records);
        table.push_str(&format!("{},{label},{},{cells}\n", labelled.target, labelled.run));
    }
    Ok(table)
}

/// The number of columns.
pub(crate) fn column_count() -> u64 {
    (LEADING_COLUMNS.len() + columns().len()) as u64
}

/// The names of all columns.
fn header() -> Vec<&'static str> {
    let own = columns().iter().map(|column| column.header.as_str());
    LEADING_COLUMNS.iter().map(|(name, _)| *name).chain(own).collect()
}

/// A Parquet file.
///
/// # Errors
/// A problem when it is cancelled, or with the message of the Parquet library.
pub(crate) fn parquet(source: &Source, part: SessionPart, cancel: Cancel<'_>) -> ApiResult<Vec<u8>> {
    let labelled_rows = labelled_rows(source, part, cancel)?;
    written(source, &labelled_rows, cancel).map_err(|error| {
        let internal = || ApiError::internal(format!("Parquet: {error}"));
        cancel.check().map_or_else(ApiError::from, |()| internal())
    })
}

fn written(
    source: &Source,
    labelled_rows: &[LabelledRow<'_>],
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
    let entry = |key: &str, value: String| KeyValue::new(key.to_owned(), value);
    let units = columns().iter().filter(|column| column.kind == Kind::Number);
    let mut about: Vec<KeyValue> = units
        .map(|column| entry(&format!("unit:{}", column.header), column.unit.word().to_owned()))
        .collect();
    about.push(entry("sightline", VERSION.to_owned()));
    about.push(entry("tracker", tracker_version()));
    about.push(entry("traverse", source.open.id.clone()));
    about.push(entry("session", source.session.id.clone()));
    about.push(entry("pixel_convention", "(0, 0) is the centre of the first pixel".to_owned()));
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
            let cell = |labelled: &LabelledRow<'_>| match LEADING_COLUMNS.get(index) {
                Some((_, value_of)) => value_of(labelled),
                None => columns()[index - LEADING_COLUMNS.len()].cell(&labelled.row.records),
            };
            write_column(column, kind, labelled_rows.iter().map(cell))?;
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

/// The known values, and for every row 1 if it has a value, else 0 (Parquet definition levels).
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
