//! The lines of runs as columns with units, each with its difference from the first run; gates by their names.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Compared, Moment};
use crate::error::{Error, Result};
use crate::stages::judge::Gate;
use crate::trace::{StepRow, StepTrace};

/// Numbers of all runs over the moments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Column {
    /// Its name: a field of `StepRow`, or `gates.` with the gate's name and `value`, `limit` or `margin`.
    pub name: String,
    /// Its unit; empty for pure numbers, counts, and switches (0 or 1).
    pub unit: String,
    /// The value of each run at each moment.
    pub values: Vec<Vec<Option<f64>>>,
    /// Each run's value less the first run's, at each moment.
    pub deltas: Vec<Vec<Option<f64>>>,
}

/// Words of all runs over the moments.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WordColumn {
    /// Its name.
    pub name: String,
    /// The words of each run at each moment.
    pub values: Vec<Vec<Option<String>>>,
    /// At which moments not all runs that have one say the same.
    pub differs: Vec<bool>,
}

/// What of a line is a column: its name, unit and value.
type RowColumn = (&'static str, &'static str, fn(&StepRow) -> Option<f64>);

/// The numbers of a line, in its order.
const ROW: [RowColumn; 31] = [
    ("scale", "", |row| row.scale),
    ("roll_deg", "°", |row| row.roll_deg),
    ("ncc", "", |row| row.ncc),
    ("stereo_score", "", |row| row.stereo_score),
    ("inliers", "", |row| row.inliers.map(|count| count as f64)),
    ("confidence", "", |row| row.confidence),
    ("err_px", "px", |row| row.err_px),
    ("err_m", "m", |row| row.err_m),
    ("sigma_m", "m", |row| row.sigma_m),
    ("nees", "", |row| row.nees),
    ("tracked", "", |row| row.tracked.map(f64::from)),
    ("position_in_rover.x", "m", |row| Some(row.position_in_rover[0])),
    ("position_in_rover.y", "m", |row| Some(row.position_in_rover[1])),
    ("position_in_rover.z", "m", |row| Some(row.position_in_rover[2])),
    ("covariance_in_rover.xx", "m²", |row| Some(row.covariance_in_rover[(0, 0)])),
    ("covariance_in_rover.xy", "m²", |row| Some(row.covariance_in_rover[(0, 1)])),
    ("covariance_in_rover.xz", "m²", |row| Some(row.covariance_in_rover[(0, 2)])),
    ("covariance_in_rover.yy", "m²", |row| Some(row.covariance_in_rover[(1, 1)])),
    ("covariance_in_rover.yz", "m²", |row| Some(row.covariance_in_rover[(1, 2)])),
    ("covariance_in_rover.zz", "m²", |row| Some(row.covariance_in_rover[(2, 2)])),
    ("left_pixel.x", "px", |row| row.left_pixel.map(|pixel| pixel.x)),
    ("left_pixel.y", "px", |row| row.left_pixel.map(|pixel| pixel.y)),
    ("range_m", "m", |row| row.range_m),
    ("distance_correction_m", "m", |row| row.distance_correction_m),
    ("distance_tolerance_m", "m", |row| row.distance_tolerance_m),
    ("position_correction_m", "m", |row| row.position_correction_m),
    ("position_tolerance_m", "m", |row| row.position_tolerance_m),
    ("budget_without_m", "m", |row| row.budget_without_m),
    ("budget_with_m", "m", |row| row.budget_with_m),
    ("fault", "", |row| Some(f64::from(row.fault))),
    ("step", "", |row| Some(row.step as f64)),
];

/// What of a gate is a column.
type GateColumn = (&'static str, fn(&Gate) -> Option<f64>);

/// The numbers of a gate.
const GATE: [GateColumn; 3] =
    [("value", |gate| gate.value), ("limit", |gate| Some(gate.limit)), ("margin", |gate| gate.margin)];

/// What of a line is a column of words.
type RowWords = (&'static str, fn(&StepRow) -> Option<String>);

/// The words of a line.
const WORDS: [RowWords; 2] = [("state", |row| Some(row.state.clone())), ("reason", |row| row.reason.clone())];

/// The columns of runs over the moments; with `asked` only those, which must exist.
///
/// # Errors
/// [`Error::Request`] for a column that does not exist.
pub fn columns(
    runs: &[Compared],
    moments: &[Moment],
    asked: Option<&[String]>,
) -> Result<(Vec<Column>, Vec<WordColumn>)> {
    if asked.is_some_and(<[String]>::is_empty) {
        return Ok((Vec::new(), Vec::new()));
    }
    let is_asked = |name: &str| asked.is_none_or(|names| names.iter().any(|asked| asked == name));
    let traces: Vec<Vec<Option<&StepTrace>>> = runs
        .iter()
        .enumerate()
        .map(|(i, run)| moments.iter().map(|moment| run.step(moment.steps[i]?).map(AsRef::as_ref)).collect())
        .collect();
    let rows: Vec<Vec<Option<StepRow>>> =
        traces.iter().map(|run| run.iter().map(|trace| trace.map(StepTrace::row)).collect()).collect();
    let mut found: Vec<Column> = ROW
        .iter()
        .filter(|(name, ..)| is_asked(name))
        .map(|&(name, unit, value)| {
            let values =
                rows.iter().map(|run| run.iter().map(|row| value(row.as_ref()?)).collect()).collect();
            Column::new(name.to_owned(), unit.to_owned(), values)
        })
        .collect();
    found.extend(gates(&traces, is_asked));
    let words: Vec<WordColumn> = WORDS
        .iter()
        .filter(|(name, _)| is_asked(name))
        .map(|&(name, word)| {
            let values = rows.iter().map(|run| run.iter().map(|row| word(row.as_ref()?)).collect()).collect();
            WordColumn::new(name, values)
        })
        .collect();
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

/// The columns of all gates that any step has.
fn gates(traces: &[Vec<Option<&StepTrace>>], is_asked: impl Fn(&str) -> bool) -> Vec<Column> {
    let all = || traces.iter().flatten().flatten().filter_map(|trace| trace.judge.as_ref());
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
            let of = |trace: &Option<&StepTrace>| {
                value((*trace)?.judge.as_ref()?.gates.iter().find(|gate| gate.name == gate_name)?)
            };
            let values = traces.iter().map(|run| run.iter().map(of).collect()).collect();
            columns.push(Column::new(name, unit.to_owned(), values));
        }
    }
    columns
}

impl Column {
    fn new(name: String, unit: String, values: Vec<Vec<Option<f64>>>) -> Self {
        // A covariance that does not exist is not finite, which JSON cannot say.
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

    #[test]
    fn every_field_of_a_line_is_a_column() {
        let text = r#"{"step": 0, "state": "", "position_in_rover": [1, 2, 3],
            "covariance_in_rover": [1, 0, 0, 0, 1, 0, 0, 0, 1]}"#;
        let row: StepRow = serde_json::from_str(text).unwrap();
        let fields = serde_json::to_value(&row).unwrap();
        for field in fields.as_object().unwrap().keys() {
            let mut names = ROW.iter().map(|(name, ..)| *name).chain(WORDS.iter().map(|(name, _)| *name));
            assert!(names.any(|name| name.split('.').next() == Some(field)), "{field} is no column");
        }
    }
}
