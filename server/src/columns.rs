//! The rows of a run as CSV, the same for REST and the command line.
//!
//! Numbers are written with enough digits to restore the same bits; unknown values are empty.

use sightline_api::table::cell as text_cell;
use sightline_record::{Column, StageRecord, Value};
use sightline_session::records;
use sightline_session::step::StepRow;

/// A table with a header.
pub(crate) fn csv(rows: &[StepRow]) -> String {
    let mut table = csv_header();
    for row in rows {
        table.push_str(&csv_line(row));
    }
    table
}

/// The header with its line end.
pub(crate) fn csv_header() -> String {
    let names: Vec<&str> = records::row_columns().iter().map(|column| column.header.as_str()).collect();
    names.join(",") + "\n"
}

/// One row with its line end.
pub(crate) fn csv_line(row: &StepRow) -> String {
    csv_cells(records::row_columns(), &records::row_record(row)) + "\n"
}

/// The cells of columns, without a line end.
pub(crate) fn csv_cells(columns: &[Column], records: &[StageRecord]) -> String {
    let cells: Vec<String> = columns.iter().map(|column| cell(&column.cell(records))).collect();
    cells.join(",")
}

fn cell(value: &Value) -> String {
    match value {
        Value::Missing | Value::Components(_) => String::new(),
        Value::Flag(flag) => flag.to_string(),
        Value::Count(count) => count.to_string(),
        Value::Number(number) => number.to_string(),
        Value::Word(word) => text_cell(word),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_matches_the_header_and_has_full_precision() {
        let number = 0.1 + 0.2;
        let row = StepRow { step: 3, state: "tracking".to_owned(), ncc: Some(number), ..empty() };
        let line = csv_line(&row);
        assert_eq!(line.trim_end().split(',').count(), csv_header().split(',').count());
        assert_eq!(line.split(',').nth(4).unwrap().parse(), Ok(number));
        assert_eq!(line.split(',').nth(2), Some(""));
    }

    #[test]
    fn the_columns_of_earlier_tables_come_first_under_their_names() {
        let names = "step,state,scale,roll_deg,ncc,stereo_score,err_px,err_m,sigma_m,nees,tracked,\
                     position_in_rover_x_m,position_in_rover_y_m,position_in_rover_z_m,\
                     left_pixel_x_px,left_pixel_y_px,range_m,\
                     distance_correction_m,distance_tolerance_m,position_correction_m,position_tolerance_m,\
                     budget_without_m,budget_with_m,inliers,confidence,reason";
        assert!(csv_header().starts_with(names), "{}", csv_header());
    }

    fn empty() -> StepRow {
        serde_json::from_str(r#"{"step": 0, "state": "", "position_in_rover": [1, 2, 3], "covariance_in_rover": [1, 0, 0, 0, 1, 0, 0, 0, 1]}"#).unwrap()
    }
}
