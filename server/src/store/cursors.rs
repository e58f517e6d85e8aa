//! Cursors, and when sessions were used, on their way to disk: gathered for a moment, because a cursor moves with every key,
//! then written together.

use std::collections::BTreeMap;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use sightline_geometry::error::{Error, Result};
use sightline_session::Cursor;

use super::{CURSORS, Disk, USED, put};
use crate::jobs::lock;

/// How long a cursor that moved may not be on disk.
pub(crate) const CURSOR_PERIOD: Duration = Duration::from_millis(500);

/// The cursors that are not on disk yet, with the thread that writes them.
pub(super) struct Cursors {
    waiting: Arc<Waiting>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Waiting {
    inside: Mutex<Inside>,
    changed: Condvar,
}

#[derive(Default)]
struct Inside {
    moved: BTreeMap<u64, Cursor>,
    used: BTreeMap<u64, String>,
    closed: bool,
}

impl Cursors {
    /// Starts the thread.
    pub(super) fn start(disk: Arc<Disk>) -> Result<Self> {
        let waiting = Arc::new(Waiting::default());
        let own = Arc::clone(&waiting);
        let thread = std::thread::Builder::new().name("cursors".to_owned()).spawn(move || own.work(&disk));
        let thread = thread.map_err(|error| Error::Request(format!("cannot start a thread: {error}")))?;
        Ok(Self { waiting, thread: Some(thread) })
    }

    /// Remembers a cursor.
    pub(super) fn set(&self, number: u64, cursor: Cursor) {
        lock(&self.waiting.inside).moved.insert(number, cursor);
        self.waiting.changed.notify_all();
    }

    /// Remembers when a session was used.
    pub(super) fn touch(&self, number: u64, now: String) {
        lock(&self.waiting.inside).used.insert(number, now);
        self.waiting.changed.notify_all();
    }

    /// Forgets a cursor that is written otherwise.
    pub(super) fn forget(&self, number: u64) {
        lock(&self.waiting.inside).moved.remove(&number);
    }

    /// Forgets everything about a session that is removed.
    pub(super) fn forget_session(&self, number: u64) {
        let mut inside = lock(&self.waiting.inside);
        inside.moved.remove(&number);
        inside.used.remove(&number);
    }

    /// Writes what is remembered.
    pub(super) fn flush(&self, disk: &Disk) -> Result<()> {
        self.waiting.write(disk)
    }
}

impl Drop for Cursors {
    fn drop(&mut self) {
        lock(&self.waiting.inside).closed = true;
        self.waiting.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has said so; there is nothing to add.
            let _ = thread.join();
        }
    }
}

impl Waiting {
    fn work(&self, disk: &Disk) {
        loop {
            let mut inside = lock(&self.inside);
            while inside.moved.is_empty() && inside.used.is_empty() && !inside.closed {
                inside = self.changed.wait(inside).unwrap_or_else(PoisonError::into_inner);
            }
            if !inside.closed {
                let until_closed = |inside: &mut Inside| !inside.closed;
                let waited = self.changed.wait_timeout_while(inside, CURSOR_PERIOD, until_closed);
                inside = waited.unwrap_or_else(PoisonError::into_inner).0;
            }
            let closed = inside.closed;
            drop(inside);
            if let Err(error) = self.write(disk) {
                tracing::error!("cursors are not saved: {}", crate::printable::printable(&error.to_string()));
            }
            if closed {
                return;
            }
        }
    }

    /// Writes what is remembered; what moves meanwhile stays for the next time.
    fn write(&self, disk: &Disk) -> Result<()> {
        let (moved, used) = {
            let mut inside = lock(&self.inside);
            (std::mem::take(&mut inside.moved), std::mem::take(&mut inside.used))
        };
        if moved.is_empty() && used.is_empty() {
            return Ok(());
        }
        let written = disk.write(|transaction| {
            let mut is_changed = false;
            for (number, cursor) in &moved {
                is_changed |= put(transaction, CURSORS, *number, cursor)?;
            }
            for (number, now) in &used {
                is_changed |= put(transaction, USED, *number, now)?;
            }
            Ok(is_changed)
        });
        if written.is_err() {
            let mut inside = lock(&self.inside);
            for (number, cursor) in moved {
                inside.moved.entry(number).or_insert(cursor);
            }
            for (number, now) in used {
                inside.used.entry(number).or_insert(now);
            }
        }
        written
    }
}
