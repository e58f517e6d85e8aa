//! Serialised forms of a session: the view that clients read, and the saved form that survives a restart.

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

/// The version of the saved format that this code reads and writes.
pub const SAVED_FORMAT: u32 = 1;

/// A session as clients receive it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SessionView {
    /// The session's name in paths.
    pub id: String,
    /// The traverse's name in paths.
    pub traverse: String,
    /// Number of stops of the traverse.
    pub stop_count: usize,
    /// The current selection.
    pub cursor: Cursor,
    /// The targets that were not removed.
    pub targets: Vec<TargetView>,
    /// The breakpoints; `…/breakpoints` returns their hits.
    #[serde(default)]
    pub breakpoints: Vec<Breakpoint>,
    /// The driving run and its command; null before the first drive command.
    #[serde(default)]
    pub steering: Option<Steering>,
}

/// A target as clients receive it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TargetView {
    /// Its number in paths.
    pub number: usize,
    /// Its label.
    pub label: String,
    /// Its designation.
    pub designation: Designation,
    /// Its runs that were not removed, by number.
    pub runs: Vec<RunView>,
}

/// A run as clients receive it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RunView {
    /// Its number in paths.
    pub number: usize,
    /// Its fork from a parent run; null for the first run.
    pub fork: Option<Fork>,
    /// The settings that differ from the defaults.
    #[schema(value_type = Object)]
    pub changes: Changes,
    /// The configuration.
    pub settings: Settings,
    /// The changed settings that have no effect with the other settings, each with the condition for an effect.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub without_effect: BTreeMap<String, String>,
    /// One row for each step so far.
    pub rows: Vec<StepRow>,
    /// Whether the last stop was reached.
    pub complete: bool,
    /// Why it stopped before the last stop; null if it did not.
    pub stopped: Option<String>,
    /// Number of runs before it in the queue of the server, including those being computed; null unless it waits.
    #[serde(default)]
    pub waits_for: Option<usize>,
    /// The verdict so far.
    pub summary: Summary,
}

/// The text for a run that waits for `before` others.
pub fn waiting_for(before: usize) -> String {
    format!("waiting for {before} {} before it", if before == 1 { "run" } else { "runs" })
}

/// The saved form of a session: the person's actions, from which it is recomputed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedSession {
    /// The version of this format.
    pub format: u32,
    /// The session's name.
    pub id: String,
    /// The traverse's name.
    pub traverse: String,
    /// The selection.
    pub cursor: Cursor,
    /// The targets, by number.
    pub targets: Vec<SavedTarget>,
    /// The breakpoints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub breakpoints: Vec<Breakpoint>,
    /// The driving run and its command.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steering: Option<Steering>,
    /// The completed visits of a drive to several targets.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub visits: Vec<Visit>,
}

/// A saved target with its runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedTarget {
    /// Its label.
    pub label: String,
    /// Its designation.
    pub designation: Designation,
    /// Whether it was removed.
    pub removed: bool,
    /// Its runs, by number; empty if it can no longer be restored.
    pub runs: Vec<SavedRun>,
}

/// A saved run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedRun {
    /// Its fork from a parent run; null for the first run.
    pub fork: Option<Fork>,
    /// The complete configuration, because defaults may change between versions.
    pub settings: Settings,
    /// The step after which it was stopped by a person.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stop_after: Option<usize>,
    /// Whether it was removed.
    #[serde(default, skip_serializing_if = "is_false")]
    pub removed: bool,
}

// serde requires this signature.
#[allow(clippy::trivially_copy_pass_by_ref)]
fn is_false(value: &bool) -> bool {
    !value
}

impl Session {
    /// The session as clients receive it.
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

    /// A run as clients receive it.
    pub fn run_view(&self, number: usize, run: &Run) -> RunView {
        self.run_view_from(number, run, 0)
    }

    /// The run with its rows from `from_row` on, counted from 0: the new rows for a client that already has `from_row` rows.
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

    /// The saved form.
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
