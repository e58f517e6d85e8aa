//! What is on its way to disk: cursors and times of use, gathered for a moment, because a cursor moves with every key; and
//! what was computed when it could not be saved. While saving fails it is tried again.

use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use serde::Serialize;
use sightline_geometry::error::{Error, Result};

use super::disk::Disk;
use super::id_of;
use super::record::Place;
use crate::jobs::lock;

/// How long a cursor that moved may not be on disk.
pub(crate) const CURSOR_PERIOD: Duration = Duration::from_millis(500);
/// How often saving is tried again while it fails: soon enough for a person who makes room on the disk and looks.
pub(crate) const RETRY_PERIOD: Duration = Duration::from_secs(1);

/// The records that are not on disk yet, with the thread that writes them.
pub(super) struct Waiting {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    inside: Mutex<Inside>,
    changed: Condvar,
}

#[derive(Default)]
struct Inside {
    /// JSON texts by their places.
    records: BTreeMap<Place, Vec<u8>>,
    closed: bool,
}

impl Waiting {
    /// Starts the thread.
    pub(super) fn start(disk: Arc<Disk>) -> Result<Self> {
        let shared = Arc::new(Shared::default());
        let own = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("cursors".to_owned()).spawn(move || own.work(&disk));
        let thread = thread.map_err(|error| Error::Request(format!("cannot start a thread: {error}")))?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Remembers a record.
    pub(super) fn set(&self, place: Place, value: &impl Serialize) {
        // Numbers, texts and records of these do not fail to be written as JSON.
        let Ok(json) = serde_json::to_vec(value) else { return };
        lock(&self.shared.inside).records.insert(place, json);
        self.shared.changed.notify_all();
    }

    /// Forgets a record of this value, which was written otherwise.
    pub(super) fn forget_if(&self, place: &Place, value: &impl Serialize) {
        let json = serde_json::to_vec(value).unwrap_or_default();
        let mut inside = lock(&self.shared.inside);
        if inside.records.get(place) == Some(&json) {
            inside.records.remove(place);
        }
    }

    /// Forgets a record.
    pub(super) fn forget(&self, place: &Place) {
        lock(&self.shared.inside).records.remove(place);
    }

    /// Forgets everything about a session that is removed.
    pub(super) fn forget_session(&self, number: u64) {
        let of_questions = format!("{}/", id_of(number));
        lock(&self.shared.inside).records.retain(|place, _| match place {
            Place::Cursor(of) | Place::Used(of) => *of != number,
            Place::Question(name) => !name.starts_with(&of_questions),
            _ => true,
        });
    }

    /// Saving failed: it is tried again.
    pub(super) fn wake(&self) {
        // Under the lock, so that the thread either waits already or sees the trouble.
        let _inside = lock(&self.shared.inside);
        self.shared.changed.notify_all();
    }

    /// Writes what is remembered.
    pub(super) fn flush(&self, disk: &Disk) -> Result<()> {
        self.shared.write(disk)
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        lock(&self.shared.inside).closed = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has said so; there is nothing to add.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn work(&self, disk: &Disk) {
        loop {
            let mut inside = lock(&self.inside);
            while inside.records.is_empty() && !inside.closed && disk.trouble().is_none() {
                inside = self.changed.wait(inside).unwrap_or_else(PoisonError::into_inner);
            }
            if !inside.closed {
                let period = if disk.trouble().is_some() { RETRY_PERIOD } else { CURSOR_PERIOD };
                let until_closed = |inside: &mut Inside| !inside.closed;
                let waited = self.changed.wait_timeout_while(inside, period, until_closed);
                inside = waited.unwrap_or_else(PoisonError::into_inner).0;
            }
            let (closed, nothing) = (inside.closed, inside.records.is_empty());
            drop(inside);
            // What fails is reported by the disk and tried again.
            let _ = if nothing && !closed { disk.probe_in_trouble() } else { self.write(disk) };
            if closed {
                return;
            }
        }
    }

    /// Writes what is remembered. A record that changes meanwhile stays for the next time.
    fn write(&self, disk: &Disk) -> Result<()> {
        let mut records = BTreeMap::new();
        let written = disk.write(|write| {
            // Taken when no other transaction is under way, so that no older value follows a newer one.
            records = std::mem::take(&mut lock(&self.inside).records);
            records.iter().try_for_each(|(place, json)| write.put_json(place.clone(), json).map(|_| ()))
        });
        if written.is_err() {
            let mut inside = lock(&self.inside);
            for (place, json) in records {
                inside.records.entry(place).or_insert(json);
            }
        }
        written
    }
}
