//! What page and server say to each other about studies.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::row::Row;
use sightline_world::Scenario;

/// A study in the server's list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StudyInfo {
    /// Its name.
    pub name: String,
    /// What it asks.
    pub question: String,
    /// Its first variable.
    pub variable: String,
    /// The variable's unit, empty for words and pure numbers.
    pub unit: String,
    /// The values of its grid by default; empty where it has none.
    pub grid: Vec<String>,
    /// Its configurations by default.
    pub configurations: Vec<String>,
    /// The scenarios of its grid by default.
    pub scenarios: Vec<String>,
    /// Points per value of the grid; some studies cross their variable with a second one.
    pub points_per_value: usize,
}

/// Starts a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct NewStudy {
    /// The study's name.
    pub study: String,
    /// The seeds of the worlds, each with however many targets it offers; at most 100.
    #[serde(default)]
    pub seeds: Vec<u64>,
    /// Without seeds: how many worlds that offer all their targets, 1 to 100 (10).
    #[serde(default)]
    pub worlds: Option<u64>,
    /// Without seeds: the first seed that is tried (1).
    #[serde(default)]
    pub first_seed: Option<u64>,
    /// The configurations, as `preset+key=value`; by default the study's own.
    #[serde(default)]
    pub configurations: Vec<String>,
    /// Values of the study's variable; by default its own.
    #[serde(default)]
    pub grid: Vec<String>,
    /// A scenario in place of the study's own.
    #[serde(default)]
    pub scenario: Option<Scenario>,
}

/// How a study stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StudyState {
    /// Others come first.
    Waiting,
    /// It is being carried out.
    Running,
    /// It is done: its report is there.
    Done,
    /// It was cancelled; what it found is kept.
    Cancelled,
    /// It could not go on.
    Failed,
}

/// A study that was started.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StudyJob {
    /// Its name in paths.
    pub id: String,
    /// The study's name.
    pub study: String,
    /// How it stands.
    pub state: StudyState,
    /// Units done: a unit is one configuration at one point of the grid in one world.
    pub k: usize,
    /// Units in all.
    pub n: usize,
    /// Share of the work that is done, from 0 to 1, with the rendering of the worlds.
    #[serde(default)]
    pub share: f64,
    /// Time since the study began or was resumed, s.
    #[serde(default)]
    pub seconds: f64,
    /// Number of changes of this job so far: the larger one is the newer of two answers.
    #[serde(default)]
    pub revision: u64,
    /// What is being done, in words; why it stopped, where it failed.
    pub doing: String,
    /// What was odd on the way, one sentence each.
    pub notices: Vec<String>,
    /// The command line that does the same.
    pub command: String,
}

/// The table of a study, as far as it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct StudyRows {
    /// One row for each configuration, seed and point of the grid.
    pub rows: Vec<Row>,
}
