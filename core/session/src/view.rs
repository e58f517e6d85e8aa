//! What of a session travels: the view that pages and scripts read, and the saved form that survives a restart.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::breakpoints::Breakpoint;
use super::{Cursor, Fork, Run, Session, TargetRecord};
use crate::driving::Steering;
use crate::step::StepRow;
use crate::summary::{Summary, summarise};
use crate::visits::Visit;
use sightline_track::settings::{Changes, Settings};
use sightline_track::target::Designation;

/// The version of the saved form that this code reads and writes.
pub const SAVED_FORMAT: u32 = 1;

/// A session as pages and scripts see it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SessionView {
    /// The session's name in paths.
    pub id: String,
    /// The traverse's name in paths.
    pub traverse: String,
    /// How many stops the traverse has.
    pub stop_count: usize,
    /// What is looked at.
    pub cursor: Cursor,
    /// The targets that were not removed.
    pub targets: Vec<TargetView>,
    /// The conditions that are looked for; `…/breakpoints` says what they hit.
    #[serde(default)]
    pub breakpoints: Vec<Breakpoint>,
    /// Who drives, and how; null where nobody was told to.
    #[serde(default)]
    pub steering: Option<Steering>,
}

/// A target as pages and scripts see it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TargetView {
    /// Its number in paths.
    pub number: usize,
    /// What the person calls it.
    pub label: String,
    /// How it was designated.
    pub designation: Designation,
    /// Its runs that were not removed, by number.
    pub runs: Vec<RunView>,
}

/// A run as pages and scripts see it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RunView {
    /// Its number in paths.
    pub number: usize,
    /// Where it left another run.
    pub fork: Option<Fork>,
    /// The settings that differ from the defaults.
    #[schema(value_type = Object)]
    pub changes: Changes,
    /// The configuration.
    pub settings: Settings,
    /// The changed settings that have no effect beside the others, each with the condition under which it has one.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub without_effect: BTreeMap<String, String>,
    /// One line a step, so far.
    pub rows: Vec<StepRow>,
    /// Whether the last stop was reached.
    pub complete: bool,
    /// Why it stopped before.
    pub stopped: Option<String>,
    /// How many runs are before it in the queue of the server, those that are being computed included; null unless it waits.
    #[serde(default)]
    pub waits_for: Option<usize>,
    /// The verdict so far.
    pub summary: Summary,
}

/// What a waiting run waits for, in words.
pub fn waiting_for(before: usize) -> String {
    format!("waiting for {before} {} before it", if before == 1 { "run" } else { "runs" })
}

/// What a person did, from which the session comes again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedSession {
    /// Version of this form.
    pub format: u32,
    /// The session's name.
    pub id: String,
    /// The traverse's name.
    pub traverse: String,
    /// What was looked at.
    pub cursor: Cursor,
    /// The targets, by number.
    pub targets: Vec<SavedTarget>,
    /// The conditions that were looked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub breakpoints: Vec<Breakpoint>,
    /// Who drove, and how.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steering: Option<Steering>,
    /// The visits that had ended, of a drive to several targets.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub visits: Vec<Visit>,
}

/// A target as it was designated, and the configurations tried on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedTarget {
    /// What the person calls it.
    pub label: String,
    /// How it was designated.
    pub designation: Designation,
    /// Whether the person removed it.
    pub removed: bool,
    /// Its runs, by number.
    pub runs: Vec<SavedRun>,
}

/// A configuration tried on a target.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedRun {
    /// Where it left another run.
    pub fork: Option<Fork>,
    /// The whole configuration: defaults may change between versions.
    pub settings: Settings,
    /// The step after which the person stopped it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop_after: Option<usize>,
    /// Whether the person removed it.
    #[serde(default, skip_serializing_if = "is_false")]
    pub removed: bool,
}

// The signature is that of serde.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_false(value: &bool) -> bool {
    !value
}

impl Session {
    /// The session as pages and scripts see it.
    pub fn view(&self) -> SessionView {
        let live = self.targets.iter().enumerate().filter(|(_, record)| !record.removed);
        SessionView {
            id: self.id.clone(),
            traverse: self.traverse.clone(),
            stop_count: self.stop_count,
            cursor: self.cursor,
            targets: live.map(|(number, record)| self.target_view(number, record)).collect(),
            breakpoints: self.breakpoints.list(),
            steering: self.steering.clone(),
        }
    }

    /// A run as pages and scripts see it.
    pub fn run_view(&self, number: usize, run: &Run) -> RunView {
        self.run_view_from(number, run, 0)
    }

    /// A run with its rows from the one at `from_row` on, counted from 0: what is new for somebody who has that many.
    pub fn run_view_from(&self, number: usize, run: &Run, from_row: usize) -> RunView {
        let changes = run.settings.changes();
        RunView {
            number,
            fork: run.fork,
            without_effect: run.settings.without_effect(&changes).into_iter().collect(),
            changes,
            settings: run.settings.as_ref().clone(),
            rows: run.steps.iter().skip(from_row).map(|trace| trace.row()).collect(),
            complete: run.whole_steps().last().is_some_and(|last| last.step + 1 == self.stop_count),
            stopped: run.why_stopped(),
            waits_for: None,
            summary: summarise(run.whole_steps().iter().map(AsRef::as_ref)),
        }
    }

    /// What the person did.
    pub fn saved(&self) -> SavedSession {
        let saved_run = |run: &Run| SavedRun {
            fork: run.fork,
            settings: run.settings.as_ref().clone(),
            stop_after: run.stop_after,
            removed: run.removed,
        };
        SavedSession {
            format: SAVED_FORMAT,
            id: self.id.clone(),
            traverse: self.traverse.clone(),
            cursor: self.cursor,
            targets: self
                .targets
                .iter()
                .map(|record| SavedTarget {
                    label: record.label.clone(),
                    designation: record.designation,
                    removed: record.removed,
                    runs: record.runs.iter().map(saved_run).collect(),
                })
                .collect(),
            breakpoints: self.breakpoints.list(),
            steering: self.steering.clone(),
            visits: self.visits.clone(),
        }
    }

    fn target_view(&self, number: usize, record: &TargetRecord) -> TargetView {
        let live = record.runs.iter().enumerate().filter(|(_, run)| !run.removed);
        let runs = live.map(|(number, run)| self.run_view(number, run));
        TargetView {
            number,
            label: record.label.clone(),
            designation: record.designation,
            runs: runs.collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use serde_json::json;

    use super::*;

    #[test]
    fn a_run_names_the_changed_settings_without_effect() {
        let changes = Changes::from([
            ("ncc_min".to_owned(), json!(0.6)),
            ("sdog_ratio".to_owned(), json!(2.0)),
            ("bootstrap_sets".to_owned(), json!(50)),
        ]);
        let settings = Settings::default().with(&changes).unwrap();
        let view = |settings: Settings| {
            Session::new("s1", "drive", 5).run_view(0, &Run::new(Arc::new(settings), None, Vec::new()))
        };
        let found = serde_json::to_value(view(settings)).unwrap();
        let expected =
            json!({ "bootstrap_sets": "tracker = features or combined", "sdog_ratio": "measure = sdog" });
        assert_eq!(found["without_effect"], expected);
        let default = serde_json::to_value(view(Settings::default())).unwrap();
        assert_eq!(default.get("without_effect"), None);
    }
}
