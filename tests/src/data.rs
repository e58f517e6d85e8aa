//! Reads the reference tables of the recorded data sets.

use std::path::Path;

pub use sightline_testdata::recorded as set;

/// One row of a table: the leading text columns, and the numbers of the others.
pub struct TableRow {
    /// The leading columns.
    pub names: Vec<String>,
    /// The columns after them.
    pub numbers: Vec<f64>,
}

/// Reads a table of comma-separated values whose first line is a header and whose first `names` columns are text; lines
/// that begin with `#` are comments.
///
/// # Panics
/// If the file cannot be read or a number is malformed: the data sets are complete.
pub fn table(path: &Path, names: usize) -> Vec<TableRow> {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let read = |line: &str| {
        let columns: Vec<_> = line.split(',').map(str::trim).collect();
        let number = |column: &&str| column.parse().unwrap_or_else(|_| panic!("{}: {line}", path.display()));
        TableRow {
            names: columns[..names].iter().map(|&name| name.to_owned()).collect(),
            numbers: columns[names..].iter().map(number).collect(),
        }
    };
    let lines = text.lines().filter(|line| !line.trim().is_empty() && !line.starts_with('#'));
    lines.skip(1).map(read).collect()
}
