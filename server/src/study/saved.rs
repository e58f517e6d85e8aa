//! The stored list of studies: request, state and results.

use std::sync::{Arc, Weak};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sightline_geometry::error::Result;
use sightline_study::row::Row;
use sightline_study::wire::{NewStudy, StudyJob, StudyState};

use crate::store::Store;

/// A study in its stored form.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct StoredStudy {
    /// The request.
    pub new: NewStudy,
    /// The state.
    pub job: StudyJob,
    /// The rows, once it is done, as JSON values without duplicate names: a serialised row may contain its scenario twice,
    /// as its own field and as a column.
    pub rows: Vec<Value>,
    /// The report, once it is done.
    pub report: Option<String>,
}

impl StoredStudy {
    /// Converts rows to their stored form.
    pub(crate) fn rows_to_json(rows: &[Row]) -> Vec<Value> {
        rows.iter().filter_map(|row| serde_json::to_value(row).ok()).collect()
    }

    /// The stored rows.
    pub(crate) fn rows_from_json(&self) -> Vec<Row> {
        self.rows.iter().filter_map(|row| serde_json::from_value(row.clone()).ok()).collect()
    }

    /// The study after a restart: if it was waiting or running, it is cancelled and can be resumed.
    #[must_use]
    pub(crate) fn after_a_restart(mut self) -> Self {
        if matches!(self.job.state, StudyState::Waiting | StudyState::Running) {
            self.job.state = StudyState::Cancelled;
            "stopped by the end of the server; resume it to go on".clone_into(&mut self.job.doing);
        }
        self
    }
}

/// Access to the stored studies, without keeping the database open.
#[derive(Clone)]
pub(crate) struct StudyStore(Weak<Store>);

impl StudyStore {
    /// Stores studies in `store`.
    pub(crate) fn new(store: &Arc<Store>) -> Self {
        Self(Arc::downgrade(store))
    }

    /// The stored studies, by number.
    ///
    /// # Errors
    /// If the database cannot be read.
    pub(crate) fn all(&self) -> Result<Vec<(u64, StoredStudy)>> {
        self.0.upgrade().map_or_else(|| Ok(Vec::new()), |store| store.studies())
    }

    /// Stores the state of a running study; if this fails, the write is deferred, because the study itself continues.
    pub(crate) fn save_or_defer(&self, number: u64, study: &StoredStudy) {
        if let Some(store) = self.0.upgrade() {
            store.save_or_defer_study(number, study);
        }
    }

    /// Stores a study that is about to start.
    ///
    /// # Errors
    /// If the database cannot be written.
    pub(crate) fn save_new(&self, number: u64, study: &StoredStudy) -> Result<()> {
        self.0.upgrade().map_or(Ok(()), |store| store.save_study(number, study))
    }

    /// Removes a study from a full list; its results stay in its folder.
    pub(crate) fn forget(&self, number: u64) {
        let Some(store) = self.0.upgrade() else { return };
        if let Err(error) = store.remove_study(number) {
            tracing::error!(
                "study {number} stays in the list: {}",
                crate::printable::printable(&error.to_string())
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_with_a_duplicate_scenario_round_trips() {
        let row = serde_json::json!({
            "study": "approach", "configuration": "ncc", "scenario": "small", "seed": 3, "tracked": 3, "err_px": 0.1
        });
        let mut row: Row = serde_json::from_value(row).unwrap();
        row.columns.insert("scenario".to_owned(), "small".into());
        let job = serde_json::json!({ "id": "study-1", "study": "approach", "state": "running", "k": 0, "n": 1,
            "doing": "tracking", "notices": [], "command": "" });
        let new = serde_json::from_value(serde_json::json!({ "study": "approach" })).unwrap();
        let rows = StoredStudy::rows_to_json(&[row.clone()]);
        let stored = StoredStudy { new, job: serde_json::from_value(job).unwrap(), rows, report: None };
        let text = serde_json::to_vec(&stored).unwrap();
        let back: StoredStudy = serde_json::from_slice(&text).unwrap();
        let json = |row: &Row| serde_json::to_value(row).unwrap();
        assert_eq!(back.rows_from_json().iter().map(json).collect::<Vec<_>>(), [json(&row)]);
        assert_eq!(back.after_a_restart().job.state, StudyState::Cancelled);
    }
}
