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
use serde::Serialize;
use sightline_core::study::plan::tracker_version;
use sightline_core::trace::StepRow;

use super::kind::Part;
use super::source::Source;
use crate::columns;

/// A row with where it belongs.
#[derive(Serialize)]
struct Line<'a> {
    target: usize,
    label: &'a str,
    run: usize,
    #[serde(flatten)]
    row: StepRow,
}

/// How a column is read from a row.
enum Get {
    Whole(fn(&Line<'_>) -> Option<i64>),
    Number(fn(&Line<'_>) -> Option<f64>),
    Flag(fn(&Line<'_>) -> Option<bool>),
    Word(for<'a> fn(&'a Line<'_>) -> Option<&'a str>),
}

/// The columns in the order of the CSV table: name, unit, how to read it.
const COLUMNS: [(&str, &str, Get); 29] = [
    ("target", "", Get::Whole(|line| Some(line.target as i64))),
    ("label", "", Get::Word(|line| Some(line.label))),
    ("run", "", Get::Whole(|line| Some(line.run as i64))),
    ("step", "", Get::Whole(|line| Some(line.row.step as i64))),
    ("state", "", Get::Word(|line| Some(&line.row.state))),
    ("scale", "1", Get::Number(|line| line.row.scale)),
    ("roll_deg", "deg", Get::Number(|line| line.row.roll_deg)),
    ("ncc", "1", Get::Number(|line| line.row.ncc)),
    ("stereo_score", "1", Get::Number(|line| line.row.stereo_score)),
    ("err_px", "px", Get::Number(|line| line.row.err_px)),
    ("err_m", "m", Get::Number(|line| line.row.err_m)),
    ("sigma_m", "m", Get::Number(|line| line.row.sigma_m)),
    ("nees", "1", Get::Number(|line| line.row.nees)),
    ("tracked", "", Get::Flag(|line| line.row.tracked)),
    ("position_in_rover_x_m", "m", Get::Number(|line| Some(line.row.position_in_rover[0]))),
    ("position_in_rover_y_m", "m", Get::Number(|line| Some(line.row.position_in_rover[1]))),
    ("position_in_rover_z_m", "m", Get::Number(|line| Some(line.row.position_in_rover[2]))),
    ("left_pixel_x_px", "px", Get::Number(|line| line.row.left_pixel.map(|pixel| pixel.x))),
    ("left_pixel_y_px", "px", Get::Number(|line| line.row.left_pixel.map(|pixel| pixel.y))),
    ("range_m", "m", Get::Number(|line| line.row.range_m)),
    ("distance_correction_m", "m", Get::Number(|line| line.row.distance_correction_m)),
    ("distance_tolerance_m", "m", Get::Number(|line| line.row.distance_tolerance_m)),
    ("position_correction_m", "m", Get::Number(|line| line.row.position_correction_m)),
    ("position_tolerance_m", "m", Get::Number(|line| line.row.position_tolerance_m)),
    ("budget_without_m", "m", Get::Number(|line| line.row.budget_without_m)),
    ("budget_with_m", "m", Get::Number(|line| line.row.budget_with_m)),
    ("inliers", "", Get::Whole(|line| line.row.inliers.map(|count| count as i64))),
    ("confidence", "1", Get::Number(|line| line.row.confidence)),
    ("reason", "", Get::Word(|line| line.row.reason.as_deref())),
];

fn lines(source: &Source, part: Part) -> Vec<Line<'_>> {
    let of_run =
        |run: super::source::NamedRun<'_>| run.run.steps.iter().map(|trace| trace.row()).collect::<Vec<_>>();
    let mut lines = Vec::new();
    for run in source.runs(part) {
        let line = |row| Line { target: run.target, label: &run.record.label, run: run.number, row };
        lines.extend(of_run(run).into_iter().map(line));
    }
    lines
}

/// One JSON object a line.
pub fn jsonl(source: &Source, part: Part) -> String {
    let line = |line| serde_json::to_string(&line).map(|text| text + "\n").unwrap_or_default();
    lines(source, part).into_iter().map(line).collect()
}

/// A table with a header.
pub fn csv(source: &Source, part: Part) -> String {
    let mut table = format!("target,label,run,{}", columns::csv_header());
    for line in lines(source, part) {
        let label = columns::text_cell(line.label);
        table.push_str(&format!("{},{label},{},{}", line.target, line.run, columns::csv_line(&line.row)));
    }
    table
}

/// A Parquet file.
///
/// # Errors
/// What the library says.
pub fn parquet(source: &Source, part: Part) -> Result<Vec<u8>, ParquetError> {
    let lines = lines(source, part);
    let mut schema = "message rows {".to_owned();
    for (name, _, get) in &COLUMNS {
        schema.push_str(&match get {
            Get::Whole(_) => format!("optional int64 {name};"),
            Get::Number(_) => format!("optional double {name};"),
            Get::Flag(_) => format!("optional boolean {name};"),
            Get::Word(_) => format!("optional byte_array {name} (utf8);"),
        });
    }
    schema.push('}');
    let said = |key: &str, value: String| KeyValue::new(key.to_owned(), value);
    let units = COLUMNS.iter().filter(|(_, unit, _)| !unit.is_empty());
    let mut about: Vec<KeyValue> =
        units.map(|(name, unit, _)| said(&format!("unit:{name}"), (*unit).to_owned())).collect();
    about.push(said("sightline", env!("CARGO_PKG_VERSION").to_owned()));
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
    for (_, _, get) in &COLUMNS {
        if let Some(column) = group.next_column()? {
            write_column(column, get, &lines)?;
        }
    }
    group.close()?;
    writer.into_inner()
}

fn write_column(
    mut column: SerializedColumnWriter<'_>,
    get: &Get,
    lines: &[Line<'_>],
) -> Result<(), ParquetError> {
    match get {
        Get::Whole(get) => {
            let (known, levels) = split(lines.iter().map(get));
            column.typed::<Int64Type>().write_batch(&known, Some(&levels), None)?;
        }
        Get::Number(get) => {
            let (known, levels) = split(lines.iter().map(get));
            column.typed::<DoubleType>().write_batch(&known, Some(&levels), None)?;
        }
        Get::Flag(get) => {
            let (known, levels) = split(lines.iter().map(get));
            column.typed::<BoolType>().write_batch(&known, Some(&levels), None)?;
        }
        Get::Word(get) => {
            let (known, levels) = split(lines.iter().map(|line| get(line).map(ByteArray::from)));
            column.typed::<ByteArrayType>().write_batch(&known, Some(&levels), None)?;
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
    use super::*;

    #[test]
    fn both_tables_have_the_same_columns_in_the_same_order() {
        let names: Vec<&str> = COLUMNS.iter().map(|(name, ..)| *name).collect();
        assert_eq!(format!("target,label,run,{}", columns::csv_header()).trim_end(), names.join(","));
    }

    #[test]
    fn a_unit_is_what_the_name_ends_with() {
        for (name, unit, _) in &COLUMNS {
            for ending in ["px", "m", "deg"] {
                assert_eq!(name.ends_with(&format!("_{ending}")), *unit == ending, "{name}");
            }
        }
    }
}
