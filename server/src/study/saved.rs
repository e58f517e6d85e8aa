//! The list of studies on disk: what was ordered, how it stands, and what it found, so that it outlives the server.

use std::sync::{Arc, Weak};

use serde::{Deserialize, Serialize};
use serde_json::Value;
use sightline_geometry::error::Result;
use sightline_study::row::Row;
use sightline_study::wire::{NewStudy, StudyJob, StudyState};

use crate::store::Store;

/// A study as it is kept.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct KeptStudy {
    /// What was ordered.
    pub new: NewStudy,
    /// How it stands.
    pub job: StudyJob,
    /// What it found, once it is done: rows as JSON values, in which a name stands once. A row as it is written may name
    /// its scenario twice, as its own field and as a column.
    pub rows: Vec<Value>,
    /// Its report, once it is done.
    pub report: Option<String>,
}

impl KeptStudy {
    /// Rows as they are kept.
    pub(crate) fn kept_rows(rows: &[Row]) -> Vec<Value> {
        rows.iter().filter_map(|row| serde_json::to_value(row).ok()).collect()
    }

    /// The rows that were kept.
    pub(crate) fn read_rows(&self) -> Vec<Row> {
        self.rows.iter().filter_map(|row| serde_json::from_value(row.clone()).ok()).collect()
    }

    /// The study after a restart: what was under way was stopped by it, and goes on when it is resumed.
    #[must_use]
    pub(crate) fn after_a_restart(mut self) -> Self {
        if matches!(self.job.state, StudyState::Waiting | StudyState::Running) {
            self.job.state = StudyState::Cancelled;
            "stopped by the end of the server; resume it to go on".clone_into(&mut self.job.doing);
        }
        self
    }
}

/// Where studies are kept; it does not keep the database open.
#[derive(Clone)]
pub(crate) struct Keeper(Weak<Store>);

impl Keeper {
    /// Keeps studies in `store`.
    pub(crate) fn new(store: &Arc<Store>) -> Self {
        Self(Arc::downgrade(store))
    }

    /// The studies that were kept, by number.
    ///
    /// # Errors
    /// When the database cannot be read.
    pub(crate) fn all(&self) -> Result<Vec<(u64, KeptStudy)>> {
        self.0.upgrade().map_or_else(|| Ok(Vec::new()), |store| store.studies())
    }

    /// Keeps a study that is being carried out; where that fails, it is written later, because the study itself goes on.
    pub(crate) fn keep(&self, number: u64, study: &KeptStudy) {
        if let Some(store) = self.0.upgrade() {
            store.keep_study(number, study);
        }
    }

    /// Keeps a study that is started.
    ///
    /// # Errors
    /// When the database cannot be written.
    pub(crate) fn keep_new(&self, number: u64, study: &KeptStudy) -> Result<()> {
        self.0.upgrade().map_or(Ok(()), |store| store.save_study(number, study))
    }

    /// Forgets a study, for which the list has no room any more; what it found stays in its folder.
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
    fn a_row_that_names_its_scenario_twice_comes_back() {
        let row = serde_json::json!({
            "study": "approach", "configuration": "ncc", "scenario": "small", "seed": 3, "tracked": 3, "err_px": 0.1
        });
        let mut row: Row = serde_json::from_value(row).unwrap();
        row.columns.insert("scenario".to_owned(), "small".into());
        let job = serde_json::json!({ "id": "study-1", "study": "approach", "state": "running", "k": 0, "n": 1,
            "doing": "tracking", "notices": [], "command": "" });
        let new = serde_json::from_value(serde_json::json!({ "study": "approach" })).unwrap();
        let rows = KeptStudy::kept_rows(&[row.clone()]);
        let kept = KeptStudy { new, job: serde_json::from_value(job).unwrap(), rows, report: None };
        let text = serde_json::to_vec(&kept).unwrap();
        let back: KeptStudy = serde_json::from_slice(&text).unwrap();
        let json = |row: &Row| serde_json::to_value(row).unwrap();
        assert_eq!(back.read_rows().iter().map(json).collect::<Vec<_>>(), [json(&row)]);
        assert_eq!(back.after_a_restart().job.state, StudyState::Cancelled);
    }
}
