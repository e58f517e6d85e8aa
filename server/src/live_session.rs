//! A session in use: the domain's [`Session`] behind a lock, with the state of its computations.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock};

use sightline_geometry::error::Result;
use sightline_session::Session;
use sightline_session::notes::Notes;

use crate::cancel::CancelFlag;
use crate::jobs::{Position, lock};
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::step_memory::StepMemory;
use crate::store::Store;

/// Maximum length of a target label, characters.
pub(crate) const LABEL_LIMIT: usize = 100;

/// A session with its traverse.
pub struct LiveSession {
    /// Its name in paths.
    pub id: String,
    /// The traverse; replaced by a longer one after each stop of a commanded drive.
    traverse: RwLock<Arc<OpenTraverse>>,
    session: Mutex<Session>,
    notes: Mutex<Notes>,
    /// The runs, by target and number, that are being computed or are queued.
    computing: Mutex<HashMap<(usize, usize), Computing>>,
    /// Whether it was removed, after which nothing is written; locked while it is written.
    removed: Mutex<bool>,
    is_awake: AtomicBool,
    is_restoring: AtomicBool,
    used: Mutex<Option<jiff::Timestamp>>,
    /// Memory of its steps.
    pub(crate) memory: StepMemory,
}

/// A run that is being computed or is queued.
struct Computing {
    flag: CancelFlag,
    position: Position,
}

impl LiveSession {
    /// A session; a restored one sleeps until its first request.
    pub fn new(mut session: Session, traverse: Arc<OpenTraverse>, is_awake: bool) -> Self {
        session.awaits = traverse.traverse.awaits();
        Self {
            id: session.id.clone(),
            traverse: RwLock::new(traverse),
            session: Mutex::new(session),
            notes: Mutex::default(),
            computing: Mutex::default(),
            removed: Mutex::default(),
            is_awake: AtomicBool::new(is_awake),
            is_restoring: AtomicBool::new(false),
            used: Mutex::default(),
            memory: StepMemory::default(),
        }
    }

    /// The traverse with the stops so far.
    pub fn traverse(&self) -> Arc<OpenTraverse> {
        Arc::clone(&self.traverse.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// Replaces the traverse by one with more stops.
    pub(crate) fn grow(&self, grown: Arc<OpenTraverse>) {
        let (count, awaits) = (grown.traverse.stop_count(), grown.traverse.awaits());
        // The traverse is replaced first, because every step of the session must be in it.
        *self.traverse.write().unwrap_or_else(PoisonError::into_inner) = grown;
        self.with(|session| (session.stop_count, session.awaits) = (count, awaits));
    }

    /// Reads or changes the session under its lock; `work` must be quick.
    pub fn with<T>(&self, work: impl FnOnce(&mut Session) -> T) -> T {
        work(&mut lock(&self.session))
    }

    /// Time of the last change or cursor movement.
    pub fn used(&self) -> Option<jiff::Timestamp> {
        *lock(&self.used)
    }

    /// Sets the time of last use.
    pub(crate) fn set_used(&self, used: Option<jiff::Timestamp>) {
        *lock(&self.used) = used;
    }

    /// Changes the session, writes it, and calls `then` before the lock is released: all or nothing.
    ///
    /// The session is locked until it is on disk, because undoing the change would also remove steps recorded in between.
    ///
    /// # Errors
    /// That of `work`, or when the session was removed or the database cannot be written; the session is then unchanged.
    pub(crate) fn change_and<T>(
        &self,
        store: &Store,
        work: impl FnOnce(&mut Session) -> ApiResult<T>,
        then: impl FnOnce(&T),
    ) -> ApiResult<T> {
        let removed = lock(&self.removed);
        if *removed {
            return Err(removed_error());
        }
        self.with(|session| {
            let before = session.clone();
            let changed = work(session).and_then(|value| {
                store.save(&session.saved())?;
                Ok(value)
            });
            match &changed {
                Ok(value) => then(value),
                Err(_) => *session = before,
            }
            changed
        })
    }

    /// Removes the session from the database permanently; returns whether it was there.
    ///
    /// # Errors
    /// When the database cannot be written; the session is then unchanged.
    pub(crate) fn remove(&self, store: &Store) -> Result<bool> {
        let mut removed = lock(&self.removed);
        if *removed {
            return Ok(false);
        }
        store.remove(&self.id)?;
        *removed = true;
        for one in lock(&self.computing).values() {
            one.flag.store(true, Ordering::Relaxed);
        }
        Ok(true)
    }

    /// Whether it was removed.
    pub(crate) fn is_removed(&self) -> bool {
        *lock(&self.removed)
    }

    /// Reads or changes the notes under their lock; `work` must be quick. Lock the session before the notes.
    pub(crate) fn with_notes<T>(&self, work: impl FnOnce(&mut Notes) -> T) -> T {
        work(&mut lock(&self.notes))
    }

    /// Changes the notes and writes them, or neither.
    ///
    /// # Errors
    /// That of `work`, or when the session was removed or the database cannot be written; the notes are then unchanged.
    pub(crate) fn change_notes<T>(
        &self,
        store: &Store,
        work: impl FnOnce(&Session, &mut Notes) -> ApiResult<T>,
    ) -> ApiResult<T> {
        let removed = lock(&self.removed);
        if *removed {
            return Err(removed_error());
        }
        self.with(|session| {
            self.with_notes(|notes| {
                let before = notes.clone();
                let changed = work(session, notes).and_then(|value| {
                    store.save_notes(&self.id, notes)?;
                    Ok(value)
                });
                if changed.is_err() {
                    *notes = before;
                }
                changed
            })
        })
    }

    /// Marks the session as awake; returns whether it was asleep.
    pub fn wake(&self) -> bool {
        !self.is_awake.swap(true, Ordering::Relaxed)
    }

    /// Sets whether the runs of a restored session are being recomputed.
    pub(crate) fn set_restoring(&self, is_restoring: bool) {
        self.is_restoring.store(is_restoring, Ordering::Release);
    }

    /// Whether the runs of a restored session are being recomputed.
    pub(crate) fn is_restoring(&self) -> bool {
        self.is_restoring.load(Ordering::Acquire)
    }

    /// Marks the session as asleep, so that the next request wakes it.
    pub fn sleep(&self) {
        self.is_awake.store(false, Ordering::Relaxed);
    }

    /// Marks a run as being computed, and cancels an earlier computation of it.
    pub fn begin(&self, target: usize, run: usize) -> CancelFlag {
        let flag = CancelFlag::default();
        let one = Computing { flag: Arc::clone(&flag), position: Position::default() };
        if let Some(earlier) = lock(&self.computing).insert((target, run), one) {
            earlier.flag.store(true, Ordering::Relaxed);
        }
        flag
    }

    /// The queue position of a run; empty if it is not being computed.
    pub(crate) fn position(&self, target: usize, run: usize) -> Position {
        lock(&self.computing).get(&(target, run)).map_or_else(Position::default, |one| one.position.clone())
    }

    /// Marks a run as not being computed any more, unless it was restarted.
    pub fn end(&self, target: usize, run: usize, flag: &CancelFlag) {
        let mut computing = lock(&self.computing);
        if computing.get(&(target, run)).is_some_and(|present| Arc::ptr_eq(&present.flag, flag)) {
            computing.remove(&(target, run));
        }
    }

    /// Whether a run is being computed or is queued.
    pub(crate) fn is_computing(&self, target: usize, run: usize) -> bool {
        lock(&self.computing).contains_key(&(target, run))
    }

    /// Whether any run is being computed or is queued.
    pub(crate) fn is_computing_any(&self) -> bool {
        !lock(&self.computing).is_empty()
    }

    /// Cancels the computation of a run, or of all runs of a target.
    pub(crate) fn cancel_runs(&self, target: usize, run: Option<usize>) {
        let computing = lock(&self.computing);
        let meant = computing.iter().filter(|((t, r), _)| *t == target && run.is_none_or(|run| run == *r));
        for (_, one) in meant {
            one.flag.store(true, Ordering::Relaxed);
        }
    }
}

fn removed_error() -> ApiError {
    ApiError::not_found("The session was removed meanwhile.")
}
