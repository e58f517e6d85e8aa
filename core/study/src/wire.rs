//! Messages about studies between page and server.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::row::Row;
use sightline_world::Scenario;

/// A study in the server's list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StudyInfo {
    /// Name of the study.
    pub name: String,
    /// Question of the study, as one sentence.
    pub question: String,
    /// Name of the first variable.
    pub variable: String,
    /// Unit of the variable, empty for words and pure numbers.
    pub unit: String,
    /// Default values of its grid; empty without a grid.
    pub grid: Vec<String>,
    /// Default configurations.
    pub configurations: Vec<String>,
    /// Scenarios of the default grid.
    pub scenarios: Vec<String>,
    /// Points per value of the grid; more than 1 if the study has a second variable.
    pub points_per_value: usize,
}

/// Starts a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewStudy {
    /// The study's name.
    pub study: String,
    /// Seeds of the worlds, each with as many targets as it offers; at most 100.
    #[serde(default)]
    pub seeds: Vec<u64>,
    /// Without seeds: number of worlds that offer all their targets, 1 to 100 (10).
    #[serde(default)]
    pub worlds: Option<u64>,
    /// Without seeds: first seed to try (1).
    #[serde(default)]
    pub first_seed: Option<u64>,
    /// The configurations, as `preset+key=value`; by default the study's own.
    #[serde(default)]
    pub configurations: Vec<String>,
    /// Values of the study's variable; by default the study's own.
    #[serde(default)]
    pub grid: Vec<String>,
    /// A scenario in place of the study's own.
    #[serde(default)]
    pub scenario: Option<Scenario>,
}

/// State of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StudyState {
    /// Waits for other studies.
    Waiting,
    /// In progress.
    Running,
    /// Finished; the report is available.
    Done,
    /// Cancelled; the results so far are kept.
    Cancelled,
    /// Ended by an error.
    Failed,
}

/// A study that was started.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StudyJob {
    /// Identifier in paths.
    pub id: String,
    /// Name of the study.
    pub study: String,
    /// State of the job.
    pub state: StudyState,
    /// Finished units: a unit is one configuration at one point of the grid in one world.
    pub k: usize,
    /// Total number of units.
    pub n: usize,
    /// Finished fraction of the work, 0 to 1, including the rendering of the worlds.
    #[serde(default)]
    pub share: f64,
    /// Time since the study began or was resumed, s.
    #[serde(default)]
    pub seconds: f64,
    /// Number of changes of this job so far; of two answers, the larger is the newer.
    #[serde(default)]
    pub revision: u64,
    /// Current activity, or the reason of a failure.
    pub doing: String,
    /// Warnings, one sentence each.
    pub notices: Vec<String>,
    /// The equivalent command line.
    pub command: String,
}

/// The table of a study, as far as it is complete.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StudyRows {
    /// One row for each configuration, seed and point of the grid.
    pub rows: Vec<Row>,
}
