//! The quantities and gates of runs as columns with units, each with its difference from the first run.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Compared, Moment};
use crate::records;
use crate::step::RunStep;
use sightline_geometry::error::{Error, Result};
use sightline_record::{Kind, StageRecord};
use sightline_track::stages::judge::Gate;

/// A numeric column: one value for each run and moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Column {
    /// Its name: a column of the record, or `gates.NAME.value`, `.limit` or `.margin`.
    pub name: String,
    /// Its unit; empty for pure numbers, counts, and flags (0 or 1).
    pub unit: String,
    /// The value of each run at each moment; null if missing.
    pub values: Vec<Vec<Option<f64>>>,
    /// Each run's value minus the first run's value, at each moment.
    pub deltas: Vec<Vec<Option<f64>>>,
}

/// A column of words: one word for each run and moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WordColumn {
    /// Its name.
    pub name: String,
    /// The word of each run at each moment; null if missing.
    pub values: Vec<Vec<Option<String>>>,
    /// At each moment, whether the words of the runs differ.
    pub differs: Vec<bool>,
}

/// A column of a gate: its name and how it is read.
type GateColumn = (&'static str, fn(&Gate) -> Option<f64>);

/// The columns of a gate.
const GATE: [GateColumn; 3] =
    [("value", |gate| gate.value), ("limit", |gate| Some(gate.limit)), ("margin", |gate| gate.margin)];

/// The columns of the runs over the moments; if `asked` is given, only the columns that it names.
///
/// # Errors
/// [`Error::Request`] for a column that does not exist.
pub(crate) fn columns(
    runs: &[Compared],
    moments: &[Moment],
    asked: Option<&[String]>,
) -> Result<(Vec<Column>, Vec<WordColumn>)> {
    if asked.is_some_and(<[String]>::is_empty) {
        return Ok((Vec::new(), Vec::new()));
    }
    let is_asked = |name: &str| asked.is_none_or(|names| names.iter().any(|asked| asked == name));
    let traces: Vec<Vec<Option<&RunStep>>> = runs
        .iter()
        .enumerate()
        .map(|(i, run)| moments.iter().map(|moment| run.step(moment.steps[i]?).map(AsRef::as_ref)).collect())
        .collect();
    let records: Vec<Vec<Option<Vec<StageRecord>>>> =
        traces.iter().map(|run| run.iter().map(|trace| trace.map(records::records)).collect()).collect();
    let (mut found, mut words) = (Vec::new(), Vec::new());
    for column in records::columns().iter().filter(|column| is_asked(&column.name)) {
        let cell = |record: &Option<Vec<StageRecord>>| record.as_ref().map(|record| column.cell(record));
        if column.kind == Kind::Word {
            let word = |record| cell(record).and_then(|cell| cell.word().map(str::to_owned));
            let values = records.iter().map(|run| run.iter().map(word).collect()).collect();
            words.push(WordColumn::new(&column.name, values));
        } else {
            let number = |record| cell(record).and_then(|cell| cell.number());
            let values = records.iter().map(|run| run.iter().map(number).collect()).collect();
            found.push(Column::new(column.name.clone(), column.unit.symbol().to_owned(), values));
        }
    }
    found.extend(gates(&traces, is_asked));
    let is_there = |name: &String| {
        found.iter().any(|column| column.name == *name) || words.iter().any(|column| column.name == *name)
    };
    match asked.unwrap_or_default().iter().find(|name| !is_there(name)) {
        None => Ok((found, words)),
        Some(name) => Err(Error::Request(format!(
            "columns: there is no column {name}; leave `columns` out to get all of them with their names"
        ))),
    }
}

/// The columns of all gates that occur in any step.
fn gates(traces: &[Vec<Option<&RunStep>>], is_asked: impl Fn(&str) -> bool) -> Vec<Column> {
    let all = || traces.iter().flatten().flatten().filter_map(|trace| trace.verdict());
    let mut names: Vec<(u8, &str, &str)> = all()
        .flat_map(|verdict| &verdict.gates)
        .map(|gate| (gate.criterion, gate.name.as_str(), gate.unit.as_str()))
        .collect();
    names.sort_unstable();
    names.dedup();
    let mut columns = Vec::new();
    for (_, gate_name, unit) in names {
        for (part, value) in GATE {
            let name = format!("gates.{gate_name}.{part}");
            if !is_asked(&name) {
                continue;
            }
            let of = |trace: &Option<&RunStep>| {
                value((*trace)?.verdict()?.gates.iter().find(|gate| gate.name == gate_name)?)
            };
            let values = traces.iter().map(|run| run.iter().map(of).collect()).collect();
            columns.push(Column::new(name, unit.to_owned(), values));
        }
    }
    columns
}

impl Column {
    fn new(name: String, unit: String, values: Vec<Vec<Option<f64>>>) -> Self {
        // A missing covariance is not finite, which JSON cannot represent.
        let values: Vec<Vec<Option<f64>>> = values
            .into_iter()
            .map(|run| run.into_iter().map(|v| v.filter(|v| v.is_finite())).collect())
            .collect();
        let first = values.first().cloned().unwrap_or_default();
        let delta = |run: &Vec<Option<f64>>| {
            run.iter().zip(&first).map(|(value, first)| Some((*value)? - (*first)?)).collect()
        };
        Self { deltas: values.iter().map(delta).collect(), name, unit, values }
    }
}

impl WordColumn {
    fn new(name: &str, values: Vec<Vec<Option<String>>>) -> Self {
        let count = values.first().map_or(0, Vec::len);
        let differs = |moment: usize| {
            let mut said = values.iter().map(|run| &run[moment]);
            said.next().is_some_and(|first| said.any(|other| other != first))
        };
        Self { name: name.to_owned(), differs: (0..count).map(differs).collect(), values }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::step::StepRow;

    #[test]
    fn every_field_of_a_line_is_a_column() {
        let text = r#"{"step": 0, "state": "", "position_in_rover": [1, 2, 3],
            "covariance_in_rover": [1, 0, 0, 0, 1, 0, 0, 0, 1]}"#;
        let row: StepRow = serde_json::from_str(text).unwrap();
        let fields = serde_json::to_value(&row).unwrap();
        for field in fields.as_object().unwrap().keys() {
            let mut names = records::row_columns().iter().map(|column| column.name.as_str());
            assert!(names.any(|name| name.split('.').next() == Some(field)), "{field} is no column");
        }
    }
}
