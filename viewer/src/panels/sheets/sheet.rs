//! A table of values and its CSV (RFC 4180): all digits, units in the head, and empty cells for missing values.

use sightline_api::table;
use sightline_session::step::StepRow;

use crate::panels::digits;

/// A value of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// A number.
    Number(f64),
    /// A word.
    Word(String),
    /// No value.
    Nothing,
}

impl Cell {
    /// The text shown on the screen.
    pub fn shown(&self) -> String {
        match self {
            Self::Number(value) => digits(*value),
            Self::Word(word) => word.clone(),
            Self::Nothing => "–".to_owned(),
        }
    }

    fn csv(&self) -> String {
        match self {
            Self::Number(value) => value.to_string(),
            Self::Word(word) => table::cell(word),
            Self::Nothing => String::new(),
        }
    }
}

impl From<Option<f64>> for Cell {
    fn from(value: Option<f64>) -> Self {
        value.filter(|value| value.is_finite()).map_or(Self::Nothing, Self::Number)
    }
}

/// A column: its name and unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    /// The name, without unit.
    pub name: String,
    /// The unit; empty for a pure number.
    pub unit: &'static str,
}

impl Column {
    /// A column.
    pub fn new(name: impl Into<String>, unit: &'static str) -> Self {
        Self { name: name.into(), unit }
    }

    /// Its name with its unit.
    pub fn head(&self) -> String {
        if self.unit.is_empty() { self.name.clone() } else { format!("{}, {}", self.name, self.unit) }
    }
}

/// A row.
#[derive(Clone, Debug, PartialEq)]
pub struct SheetRow {
    /// The step that a click selects, if any.
    pub step: Option<usize>,
    /// Whether it is the row of the current step, or another highlighted row.
    pub is_present: bool,
    /// Its values, one per column.
    pub cells: Vec<Cell>,
}

/// A table.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// The title, with the step if the table is about one.
    pub title: String,
    /// The columns.
    pub columns: Vec<Column>,
    /// The rows shown.
    pub rows: Vec<SheetRow>,
    /// A longer table, with its own columns, that replaces this one in the copy; `None` if the copy has the shown rows.
    pub more: Option<Box<Sheet>>,
}

impl Sheet {
    /// A table whose first column is the step.
    pub(crate) fn over_steps(title: impl Into<String>, columns: Vec<Column>) -> Self {
        let columns = std::iter::once(Column::new("step", "")).chain(columns).collect();
        Self { title: title.into(), columns, rows: Vec::new(), more: None }
    }

    /// A table without a step column.
    pub fn of(title: impl Into<String>, columns: Vec<Column>) -> Self {
        Self { title: title.into(), columns, rows: Vec::new(), more: None }
    }

    /// Adds the row of a step.
    pub fn step(&mut self, step: usize, present: usize, cells: impl IntoIterator<Item = Cell>) {
        let cells = std::iter::once(Cell::Number(step as f64)).chain(cells).collect();
        self.rows.push(SheetRow { step: Some(step), is_present: step == present, cells });
    }

    /// Adds a row without a step.
    pub fn row(&mut self, is_present: bool, cells: Vec<Cell>) {
        self.rows.push(SheetRow { step: None, is_present, cells });
    }

    /// The table as CSV; uses `more` if present.
    pub fn csv(&self) -> String {
        if let Some(more) = &self.more {
            return more.csv();
        }
        let mut text = String::new();
        let head: Vec<String> = self.columns.iter().map(|column| table::cell(&column.head())).collect();
        text += &(head.join(",") + "\r\n");
        for row in &self.rows {
            let cells: Vec<String> = row.cells.iter().map(Cell::csv).collect();
            text += &(cells.join(",") + "\r\n");
        }
        text
    }
}

/// The state of a step; `fault` if its files are damaged.
pub(crate) fn state_of(row: &StepRow) -> Cell {
    let word = if row.fault { "fault" } else { &row.state };
    Cell::Word(word.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_has_units_all_digits_and_no_value_where_there_is_none() {
        let mut sheet = Sheet::over_steps("errors", vec![Column::new("err", "px"), Column::new("note", "")]);
        sheet.step(3, 3, [Cell::Number(0.123_456_789), Cell::Word("a, \"b\"".to_owned())]);
        sheet.step(4, 3, [Cell::from(Some(f64::NAN)), Cell::Word("=1+1".to_owned())]);
        let expected = "step,\"err, px\",note\r\n3,0.123456789,\"a, \"\"b\"\"\"\r\n4,,'=1+1\r\n";
        assert_eq!(sheet.csv(), expected);
        assert_eq!(sheet.rows.iter().map(|row| row.is_present).collect::<Vec<_>>(), [true, false]);
    }
}
