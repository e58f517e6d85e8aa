//! Deferred writes. Cursors and times of use are collected briefly, because a cursor moves with every key; computed results
//! are queued if they could not be saved. Failed writes are repeated.

use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use serde::Serialize;
use sightline_geometry::error::{Error, Result};

use super::disk::Disk;
use super::id_of;
use super::record::RecordKey;
use crate::jobs::lock;

/// Maximum time until a moved cursor is on disk.
pub(crate) const CURSOR_PERIOD: Duration = Duration::from_millis(500);
/// Interval between attempts while saving fails; short enough for a user who has just freed disk space.
pub(crate) const RETRY_PERIOD: Duration = Duration::from_secs(1);

/// The pending records, with the thread that writes them.
pub(super) struct DeferredWrites {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    pending: Mutex<Pending>,
    changed: Condvar,
}

#[derive(Default)]
struct Pending {
    /// JSON texts by place.
    records: BTreeMap<RecordKey, Vec<u8>>,
    closed: bool,
}

impl DeferredWrites {
    /// Starts the thread.
    pub(super) fn start(disk: Arc<Disk>) -> Result<Self> {
        let shared = Arc::new(Shared::default());
        let own = Arc::clone(&shared);
        let thread = std::thread::Builder::new().name("cursors".to_owned()).spawn(move || own.work(&disk));
        let thread = thread.map_err(|error| Error::Request(format!("cannot start a thread: {error}")))?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Queues a record.
    pub(super) fn set(&self, record_key: RecordKey, value: &impl Serialize) {
        // These numbers, strings and records can always be serialised as JSON.
        let Ok(json) = serde_json::to_vec(value) else { return };
        lock(&self.shared.pending).records.insert(record_key, json);
        self.shared.changed.notify_all();
    }

    /// Removes a pending record with this value, which was written by other means.
    pub(super) fn forget_if(&self, record_key: &RecordKey, value: &impl Serialize) {
        let json = serde_json::to_vec(value).unwrap_or_default();
        let mut pending = lock(&self.shared.pending);
        if pending.records.get(record_key) == Some(&json) {
            pending.records.remove(record_key);
        }
    }

    /// Removes a pending record.
    pub(super) fn forget(&self, record_key: &RecordKey) {
        lock(&self.shared.pending).records.remove(record_key);
    }

    /// Removes the pending records of a removed session.
    pub(super) fn forget_session(&self, number: u64) {
        let of_questions = format!("{}/", id_of(number));
        lock(&self.shared.pending).records.retain(|record_key, _| match record_key {
            RecordKey::Cursor(of) | RecordKey::Used(of) => *of != number,
            RecordKey::Question(name) => !name.starts_with(&of_questions),
            _ => true,
        });
    }

    /// Wakes the thread after a failed write, so that it tries again.
    pub(super) fn wake(&self) {
        // Locked, so that the thread either is already waiting or sees the failure.
        let _pending = lock(&self.shared.pending);
        self.shared.changed.notify_all();
    }

    /// Writes the pending records.
    pub(super) fn flush(&self, disk: &Disk) -> Result<()> {
        self.shared.write(disk)
    }
}

impl Drop for DeferredWrites {
    fn drop(&mut self) {
        lock(&self.shared.pending).closed = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // The panic has already been reported.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn work(&self, disk: &Disk) {
        loop {
            let mut pending = lock(&self.pending);
            while pending.records.is_empty() && !pending.closed && disk.trouble().is_none() {
                pending = self.changed.wait(pending).unwrap_or_else(PoisonError::into_inner);
            }
            if !pending.closed {
                let period = if disk.trouble().is_some() { RETRY_PERIOD } else { CURSOR_PERIOD };
                let until_closed = |pending: &mut Pending| !pending.closed;
                let waited = self.changed.wait_timeout_while(pending, period, until_closed);
                pending = waited.unwrap_or_else(PoisonError::into_inner).0;
            }
            let (closed, nothing) = (pending.closed, pending.records.is_empty());
            drop(pending);
            // The disk reports failures, and the loop tries again.
            let _ = if nothing && !closed { disk.probe_in_trouble() } else { self.write(disk) };
            if closed {
                return;
            }
        }
    }

    /// Writes the pending records. A record that changes meanwhile is written the next time.
    fn write(&self, disk: &Disk) -> Result<()> {
        let mut records = BTreeMap::new();
        let written = disk.write(|write| {
            // Taken while no other transaction is active, so that no older value overwrites a newer one.
            records = std::mem::take(&mut lock(&self.pending).records);
            records
                .iter()
                .try_for_each(|(record_key, json)| write.put_json(record_key.clone(), json).map(|_| ()))
        });
        if written.is_err() {
            let mut pending = lock(&self.pending);
            for (record_key, json) in records {
                pending.records.entry(record_key).or_insert(json);
            }
        }
        written
    }
}
