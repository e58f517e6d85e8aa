//! The rows of a run as text: JSON Lines and CSV, the same for REST and the command line.
//!
//! Numbers are written with all their digits, so that reading them gives the same bits; what is not known is
//! null in JSON and empty in CSV.

use std::fmt::Write;

use sightline_core::trace::StepRow;

/// The header of the CSV table.
const HEADER: &str = "step,state,scale,roll_deg,ncc,stereo_score,err_px,err_m,sigma_m,nees,tracked,\
                      position_in_rover_x_m,position_in_rover_y_m,position_in_rover_z_m,\
                      left_pixel_x_px,left_pixel_y_px,range_m,\
                      distance_correction_m,distance_tolerance_m,position_correction_m,position_tolerance_m,\
                      budget_without_m,budget_with_m,inliers,confidence,reason";

/// One JSON object a line.
pub fn jsonl(rows: &[StepRow]) -> String {
    let line = |row| serde_json::to_string(row).map(|text| text + "\n").unwrap_or_default();
    rows.iter().map(line).collect()
}

/// A table with a header.
pub fn csv(rows: &[StepRow]) -> String {
    let mut table = csv_header();
    for row in rows {
        table.push_str(&csv_line(row));
    }
    table
}

/// The header with its line end.
pub fn csv_header() -> String {
    format!("{HEADER}\n")
}

/// One row with its line end.
pub fn csv_line(row: &StepRow) -> String {
    let mut line = format!("{},{}", row.step, text_cell(&row.state));
    let numbers =
        [row.scale, row.roll_deg, row.ncc, row.stereo_score, row.err_px, row.err_m, row.sigma_m, row.nees];
    numbers.into_iter().for_each(|number| push(&mut line, number));
    push(&mut line, row.tracked);
    row.position_in_rover.into_iter().for_each(|number| push(&mut line, Some(number)));
    push(&mut line, row.left_pixel.map(|pixel| pixel.x));
    push(&mut line, row.left_pixel.map(|pixel| pixel.y));
    let judged = [
        row.range_m,
        row.distance_correction_m,
        row.distance_tolerance_m,
        row.position_correction_m,
        row.position_tolerance_m,
        row.budget_without_m,
        row.budget_with_m,
    ];
    judged.into_iter().for_each(|number| push(&mut line, number));
    push(&mut line, row.inliers);
    push(&mut line, row.confidence);
    push(&mut line, row.reason.as_deref().map(text_cell));
    line + "\n"
}

fn push(line: &mut String, value: Option<impl std::fmt::Display>) {
    line.push(',');
    if let Some(value) = value {
        // Writing to a string does not fail.
        let _ = write!(line, "{value}");
    }
}

/// A cell of text: in quotes where it must be, and never a formula of a spreadsheet.
pub fn text_cell(text: &str) -> String {
    let text =
        if text.starts_with(['=', '+', '-', '@', '\t', '\r']) { format!("'{text}") } else { text.to_owned() };
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_has_as_many_cells_as_the_header_and_keeps_every_digit() {
        let number = 0.1 + 0.2;
        let row = StepRow { step: 3, state: "tracking".to_owned(), ncc: Some(number), ..empty() };
        let line = csv_line(&row);
        assert_eq!(line.trim_end().split(',').count(), HEADER.split(',').count());
        assert_eq!(line.split(',').nth(4).unwrap().parse(), Ok(number));
        assert_eq!(line.split(',').nth(2), Some(""));
    }

    #[test]
    fn text_is_neither_a_formula_nor_two_cells() {
        assert_eq!(text_cell("=1+1"), "'=1+1");
        assert_eq!(text_cell("a, \"b\""), "\"a, \"\"b\"\"\"");
        assert_eq!(text_cell("lost"), "lost");
    }

    fn empty() -> StepRow {
        serde_json::from_str(r#"{"step": 0, "state": "", "position_in_rover": [1, 2, 3], "covariance_in_rover": [1, 0, 0, 0, 1, 0, 0, 0, 1]}"#).unwrap()
    }
}
