//! The tables of a study: its rows as CSV and Parquet, its runs as CSV.
//!
//! Columns: study, configuration, scenario and seed, then the study's variables, then all others by name. Missing values are
//! empty. In Parquet, integers are INT64, other numbers DOUBLE, texts UTF8; all are nullable.

use std::fmt::Write;
use std::path::Path;
use std::sync::Arc;

use parquet::basic::Compression;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::parser::parse_message_type;
use serde_json::Value;
use sightline_api::table;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::files::write_atomically;
use sightline_study::plan::Unit;
use sightline_study::row::Row;

/// Writes `rows.csv`, `rows.parquet` and `runs.csv`.
///
/// # Errors
/// A folder that cannot be written.
pub(crate) fn write(folder: &Path, rows: &[Row], units: &[Unit]) -> Result<()> {
    let table = Table::of(rows);
    write_atomically(&folder.join("rows.csv"), table.csv().as_bytes())?;
    let path = folder.join("rows.parquet");
    let bytes = table.parquet().map_err(|error| Error::format(&path, error.to_string()))?;
    write_atomically(&path, &bytes)?;
    write_atomically(&folder.join("runs.csv"), runs_csv(units).as_bytes())
}

/// The rows as CSV, for the standard output.
pub(crate) fn rows_csv(rows: &[Row]) -> String {
    Table::of(rows).csv()
}

/// Named columns with one value per row.
struct Table {
    columns: Vec<(String, Vec<Value>)>,
    rows: usize,
}

/// Column types.
#[derive(Clone, Copy, PartialEq)]
enum ColumnType {
    Whole,
    Number,
    Word,
}

impl Table {
    fn of(rows: &[Row]) -> Self {
        let mut names: Vec<&String> = rows.iter().flat_map(|row| row.columns.keys()).collect();
        names.sort();
        names.dedup();
        let word = |of: fn(&Row) -> &String| rows.iter().map(|row| of(row).clone().into()).collect();
        let mut columns: Vec<(String, Vec<Value>)> = vec![
            ("study".to_owned(), word(|row| &row.study)),
            ("configuration".to_owned(), word(|row| &row.configuration)),
            ("scenario".to_owned(), word(|row| &row.scenario)),
            ("seed".to_owned(), rows.iter().map(|row| row.seed.into()).collect()),
        ];
        let value = |row: &Row, name: &str| row.columns.get(name).cloned().unwrap_or(Value::Null);
        // A study without a variable has the scenario only once.
        let own = names.into_iter().filter(|name| *name != "scenario");
        columns.extend(own.map(|name| (name.clone(), rows.iter().map(|row| value(row, name)).collect())));
        Self { columns, rows: rows.len() }
    }

    fn csv(&self) -> String {
        let mut text = self.columns.iter().map(|(name, _)| table::cell(name)).collect::<Vec<_>>().join(",");
        text.push('\n');
        for row in 0..self.rows {
            let line: Vec<String> = self.columns.iter().map(|(_, values)| cell(&values[row])).collect();
            text.push_str(&line.join(","));
            text.push('\n');
        }
        text
    }

    fn parquet(&self) -> Result<Vec<u8>, ParquetError> {
        let mut schema = "message rows {".to_owned();
        for (name, values) in &self.columns {
            let column_type = match column_type(values) {
                ColumnType::Whole => format!("optional int64 {name};"),
                ColumnType::Number => format!("optional double {name};"),
                ColumnType::Word => format!("optional byte_array {name} (utf8);"),
            };
            schema.push_str(&column_type);
        }
        schema.push('}');
        let properties = WriterProperties::builder().set_compression(Compression::UNCOMPRESSED).build();
        let schema = Arc::new(parse_message_type(&schema)?);
        let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties))?;
        let mut group = writer.next_row_group()?;
        for (_, values) in &self.columns {
            if let Some(column) = group.next_column()? {
                write_column(column, values)?;
            }
        }
        group.close()?;
        writer.into_inner()
    }
}

fn column_type(values: &[Value]) -> ColumnType {
    let known = || values.iter().filter(|value| !value.is_null());
    if known().all(Value::is_i64) && known().next().is_some() {
        ColumnType::Whole
    } else if known().all(Value::is_number) {
        ColumnType::Number
    } else {
        ColumnType::Word
    }
}

fn write_column(mut column: SerializedColumnWriter<'_>, values: &[Value]) -> Result<(), ParquetError> {
    let levels: Vec<i16> = values.iter().map(|value| i16::from(!value.is_null())).collect();
    let known = || values.iter().filter(|value| !value.is_null());
    match column_type(values) {
        ColumnType::Whole => {
            let values: Vec<i64> = known().filter_map(Value::as_i64).collect();
            column.typed::<Int64Type>().write_batch(&values, Some(&levels), None)?;
        }
        ColumnType::Number => {
            let values: Vec<f64> = known().filter_map(Value::as_f64).collect();
            column.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
        }
        ColumnType::Word => {
            let values: Vec<ByteArray> =
                known().map(|value| ByteArray::from(word(value).into_bytes())).collect();
            column.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)?;
        }
    }
    column.close()
}

/// A value as plain text.
fn word(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn cell(value: &Value) -> String {
    if value.is_null() { String::new() } else { table::cell(&word(value)) }
}

/// One line per target.
fn runs_csv(units: &[Unit]) -> String {
    let mut text = "configuration,scenario,seed,point,target,group,x_px,y_px,refused,start_distance_m,end_distance_m,\
                    steps,steps_tracked,steps_lost,run_tracked,state,false_tracked_steps,false_lost_steps,err_px,err_m,\
                    drift_m,err_range_m,sigma_m,nees,fault_step,at_fault,end\n"
        .to_owned();
    for unit in units {
        let point: Vec<String> =
            unit.point.variables.iter().map(|(name, value)| format!("{name}={}", word(value))).collect();
        for run in &unit.runs {
            let [start_m, end_m] = run.distance_m.map_or([None; 2], |ends| ends.map(Some));
            let summary = &run.summary;
            let known = serde_json::json!([
                unit.configuration,
                unit.scenario,
                unit.seed,
                point.join(" "),
                run.target,
                run.group,
                run.pixel.x,
                run.pixel.y,
                run.refused,
                start_m,
                end_m,
                summary.steps,
                summary.steps_tracked,
                summary.steps_lost,
                summary.run_tracked,
                run.state,
                summary.false_tracked,
                summary.false_lost,
                summary.final_err_px,
                summary.final_err_m,
                run.drift_m,
                run.err_range_m,
                run.sigma_m,
                run.nees,
                run.fault_step,
                run.at_fault,
                run.end
            ]);
            let cells: Vec<String> = known.as_array().into_iter().flatten().map(cell).collect();
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{}", cells.join(","));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    fn rows() -> Vec<Row> {
        let row = |configuration: &str, share: Option<f64>| {
            serde_json::from_value(serde_json::json!({
                "study": "straight", "configuration": configuration, "scenario": "approach-5", "seed": 3,
                "n_skip": 4, "tracked_share": share, "state": "a, \"b\""
            }))
            .unwrap()
        };
        vec![row("ncc", Some(0.15)), row("ncc-scale", None)]
    }

    #[test]
    fn the_parquet_file_contains_the_rows() {
        let bytes = Table::of(&rows()).parquet().unwrap();
        let reader = SerializedFileReader::new(parquet_bytes(bytes)).unwrap();
        let names: Vec<String> = reader
            .metadata()
            .file_metadata()
            .schema()
            .get_fields()
            .iter()
            .map(|f| f.name().to_owned())
            .collect();
        assert_eq!(names, ["study", "configuration", "scenario", "seed", "n_skip", "state", "tracked_share"]);
        let read: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
        assert_eq!((read[0].get_string(1).unwrap().as_str(), read[0].get_long(4).unwrap()), ("ncc", 4));
        assert_eq!(read[0].get_double(6).unwrap(), 0.15);
        assert!(read[1].get_double(6).is_err(), "a null is no number");
    }

    fn parquet_bytes(bytes: Vec<u8>) -> std::fs::File {
        use std::io::Write;
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(&bytes).unwrap();
        file
    }

    #[test]
    fn a_field_with_a_comma_is_quoted() {
        let csv = rows_csv(&rows());
        assert_eq!(csv.lines().nth(1).unwrap(), "straight,ncc,approach-5,3,4,\"a, \"\"b\"\"\",0.15",);
        assert!(csv.lines().nth(2).unwrap().ends_with(','));
    }
}
