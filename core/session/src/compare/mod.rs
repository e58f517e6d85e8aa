//! Comparison of two to four runs: aligned stops, all columns with their differences, the first difference of each run from
//! the first one, and the differing settings.
//!
//! ```text
//! align        alignment of stops: by step, by distance driven, or by time
//! columns      quantities and gates as columns
//! differ       differences of two records, with unit and tolerance
//! stages       the results of the stages of a step, in running order
//! divergence   the first step, stage and value at which two runs differ
//! ```
//! The runs may have different targets and trackers, but belong to one session and share its stops. Nothing is interpolated.

pub(crate) mod align;
pub(crate) mod columns;
pub mod differ;
pub(crate) mod divergence;
pub(crate) mod stages;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

pub use self::align::{Alignment, Moment};
pub use self::columns::{Column, WordColumn};
pub use self::differ::{Difference, Tolerance};
pub use self::divergence::{Divergence, FirstDivergence};
use super::{Run, Session};
use crate::step::RunStep;
use sightline_geometry::error::{Error, Result};
use sightline_track::settings::Settings;

/// Maximum number of compared runs: the plots have four marks.
pub const RUNS_MAX: usize = 4;

/// Identifies a run of a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RunName {
    /// The target's number.
    pub target: usize,
    /// The run's number within it.
    pub run: usize,
}

/// Requests a comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewComparison {
    /// Two to four runs; the others are compared with the first.
    #[schema(min_items = 2, max_items = 4)]
    pub runs: Vec<RunName>,
    /// How stops are aligned.
    #[serde(default)]
    pub align: Alignment,
    /// The largest difference at which values still count as equal, by unit (`px`, `px2`, `m`, `m2`, `rad`, `deg`, `s`, or
    /// `1` for none); values of a unit that is left out must be equal in every bit.
    #[serde(default)]
    pub tolerance: BTreeMap<String, f64>,
    /// The columns to return, by name; default: all.
    #[serde(default)]
    pub columns: Option<Vec<String>>,
}

/// The comparison of runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Comparison {
    /// The runs, in the order of the request.
    pub runs: Vec<RunName>,
    /// How stops are aligned.
    pub align: Alignment,
    /// The alignment as one sentence.
    pub aligned_by: String,
    /// The aligned stops.
    pub moments: Vec<Moment>,
    /// Numeric columns.
    pub columns: Vec<Column>,
    /// Columns of words.
    pub words: Vec<WordColumn>,
    /// The first difference of each other run from the first.
    pub first: Vec<FirstDivergence>,
    /// The settings that differ.
    pub settings: Vec<SettingDifference>,
}

/// A setting that is not equal in all runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SettingDifference {
    /// Its name.
    pub key: String,
    /// Its group.
    pub group: String,
    /// Its unit; empty for pure numbers and words.
    pub unit: String,
    /// Its value in each run.
    #[schema(value_type = Vec<Object>)]
    pub values: Vec<Value>,
}

/// A run to compare: its configuration and its steps so far.
#[derive(Clone, Debug)]
pub struct Compared {
    /// Target and run number.
    pub name: RunName,
    /// Its configuration.
    pub settings: Arc<Settings>,
    /// Its steps, the designation first.
    pub steps: Vec<Arc<RunStep>>,
}

impl Compared {
    /// A run to compare.
    pub fn new(name: RunName, run: &Run) -> Self {
        Self { name, settings: Arc::clone(&run.settings), steps: run.steps.clone() }
    }

    /// The record of a stop; `None` if it was not computed.
    pub fn step(&self, step: usize) -> Option<&Arc<RunStep>> {
        let first = self.steps.first()?.step;
        self.steps.get(step.checked_sub(first)?)
    }
}

impl Session {
    /// The runs that a comparison names.
    ///
    /// # Errors
    /// [`Error::Request`] for fewer than two or more than four runs, or a run that is named twice or does not exist.
    pub fn compared(&self, runs: &[RunName]) -> Result<Vec<Compared>> {
        if !(2..=RUNS_MAX).contains(&runs.len()) {
            let count = runs.len();
            return Err(Error::Request(format!("runs: name two to {RUNS_MAX} runs to compare, not {count}")));
        }
        for (i, name) in runs.iter().enumerate() {
            if runs[..i].contains(name) {
                let RunName { target, run } = name;
                return Err(Error::Request(format!("runs: run {run} of target {target} is named twice")));
            }
        }
        runs.iter().map(|&name| Ok(Compared::new(name, self.run(name.target, name.run)?))).collect()
    }
}

/// Compares each other run with the first.
///
/// # Errors
/// [`Error::Request`] for an unknown unit or column, or an invalid tolerance.
pub fn compare(runs: &[Compared], asked: &NewComparison) -> Result<Comparison> {
    let tolerance = Tolerance::new(&asked.tolerance)?;
    let moments = align::moments(runs, asked.align);
    let (columns, words) = columns::columns(runs, &moments, asked.columns.as_deref())?;
    let first = (1..runs.len()).map(|other| divergence::first(runs, other, &moments, &tolerance)).collect();
    Ok(Comparison {
        runs: runs.iter().map(|run| run.name).collect(),
        align: asked.align,
        aligned_by: asked.align.sentence().to_owned(),
        moments,
        columns,
        words,
        first,
        settings: settings(runs),
    })
}

/// The settings that are not equal in all runs.
fn settings(runs: &[Compared]) -> Vec<SettingDifference> {
    let documents: Vec<Value> =
        runs.iter().map(|run| serde_json::to_value(run.settings.as_ref()).unwrap_or_default()).collect();
    let value = |document: &Value, group: &str, key: &str| {
        let inside = document.get(group).and_then(|place| place.get(key));
        // The choice of the tracker is not inside a group.
        inside.or_else(|| document.get(key)).cloned().unwrap_or_default()
    };
    let differing = |info: sightline_track::limits::SettingInfo| {
        let values: Vec<Value> =
            documents.iter().map(|document| value(document, &info.group, &info.key)).collect();
        let is_alike = values.windows(2).all(|pair| pair[0] == pair[1]);
        (!is_alike).then_some(SettingDifference { key: info.key, group: info.group, unit: info.unit, values })
    };
    Settings::table().into_iter().filter_map(differing).collect()
}
