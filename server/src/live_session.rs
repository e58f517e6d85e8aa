//! A session that people work on: the domain's [`Session`] under a lock, beside what is being computed for it.

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

/// How many characters the label of a target may have.
pub(crate) const LABEL_LIMIT: usize = 100;

/// A session with its traverse.
pub struct LiveSession {
    /// Its name in paths.
    pub id: String,
    /// The traverse; replaced by a longer one after each stop of a drive on commands.
    traverse: RwLock<Arc<OpenTraverse>>,
    session: Mutex<Session>,
    notes: Mutex<Notes>,
    /// The runs, by target and number, that are computed now or wait for it.
    computing: Mutex<HashMap<(usize, usize), Computing>>,
    /// Whether it was removed, so that nothing of it is written any more; locked while it is written.
    removed: Mutex<bool>,
    is_awake: AtomicBool,
    is_restoring: AtomicBool,
    used: Mutex<Option<jiff::Timestamp>>,
    /// What its steps take.
    pub(crate) memory: StepMemory,
}

/// A run that is computed or waits for it.
struct Computing {
    flag: CancelFlag,
    position: Position,
}

impl LiveSession {
    /// A session; one that was read back sleeps until somebody asks for it.
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

    /// The traverse with its present stops.
    pub fn traverse(&self) -> Arc<OpenTraverse> {
        Arc::clone(&self.traverse.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// Works from now on with the stops that a drive has come to.
    pub(crate) fn grow(&self, grown: Arc<OpenTraverse>) {
        let (count, awaits) = (grown.traverse.stop_count(), grown.traverse.awaits());
        // A step that the session has must be in the traverse.
        *self.traverse.write().unwrap_or_else(PoisonError::into_inner) = grown;
        self.with(|session| (session.stop_count, session.awaits) = (count, awaits));
    }

    /// Looks at or changes the session; keep it short.
    pub fn with<T>(&self, work: impl FnOnce(&mut Session) -> T) -> T {
        work(&mut lock(&self.session))
    }

    /// When something of it was changed or stepped through last.
    pub fn used(&self) -> Option<jiff::Timestamp> {
        *lock(&self.used)
    }

    /// Remembers when it was used last.
    pub(crate) fn set_used(&self, used: Option<jiff::Timestamp>) {
        *lock(&self.used) = used;
    }

    /// Changes the session, writes it, and does what follows before anybody uses it again: all or nothing.
    ///
    /// The session is locked until it is on disk: a step that is recorded meanwhile would be taken back with the change.
    ///
    /// # Errors
    /// That of `work`, or when the session was removed or the database cannot be written; it is then as it was.
    pub(crate) fn change_and<T>(
        &self,
        store: &Store,
        work: impl FnOnce(&mut Session) -> ApiResult<T>,
        then: impl FnOnce(&T),
    ) -> ApiResult<T> {
        let removed = lock(&self.removed);
        if *removed {
            return Err(is_gone());
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

    /// Takes the session out of the database for good; says whether it was there.
    ///
    /// # Errors
    /// When the database cannot be written; the session is then as it was.
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

    /// Looks at or changes the notes; keep it short. Where both are needed, the session comes first.
    pub(crate) fn with_notes<T>(&self, work: impl FnOnce(&mut Notes) -> T) -> T {
        work(&mut lock(&self.notes))
    }

    /// Changes the notes and writes them: both or nothing.
    ///
    /// # Errors
    /// That of `work`, or when the session was removed or the database cannot be written; they are then as they were.
    pub(crate) fn change_notes<T>(
        &self,
        store: &Store,
        work: impl FnOnce(&Session, &mut Notes) -> ApiResult<T>,
    ) -> ApiResult<T> {
        let removed = lock(&self.removed);
        if *removed {
            return Err(is_gone());
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

    /// Whether this is the first time that somebody asks for it.
    pub fn wake(&self) -> bool {
        !self.is_awake.swap(true, Ordering::Relaxed)
    }

    /// Says whether the runs of a session that was read back are being computed again.
    pub(crate) fn set_restoring(&self, is_restoring: bool) {
        self.is_restoring.store(is_restoring, Ordering::Release);
    }

    /// Whether they are.
    pub(crate) fn is_restoring(&self) -> bool {
        self.is_restoring.load(Ordering::Acquire)
    }

    /// Lets the next one who asks for it be the first again.
    pub fn sleep(&self) {
        self.is_awake.store(false, Ordering::Relaxed);
    }

    /// Marks a run as being computed, in place of what may still be ending.
    pub fn begin(&self, target: usize, run: usize) -> CancelFlag {
        let flag = CancelFlag::default();
        let one = Computing { flag: Arc::clone(&flag), position: Position::default() };
        if let Some(earlier) = lock(&self.computing).insert((target, run), one) {
            earlier.flag.store(true, Ordering::Relaxed);
        }
        flag
    }

    /// Where a run is in the queue; nowhere unless it is being computed.
    pub(crate) fn position(&self, target: usize, run: usize) -> Position {
        lock(&self.computing).get(&(target, run)).map_or_else(Position::default, |one| one.position.clone())
    }

    /// Marks a run as not being computed any more, unless it was begun anew.
    pub fn end(&self, target: usize, run: usize, flag: &CancelFlag) {
        let mut computing = lock(&self.computing);
        if computing.get(&(target, run)).is_some_and(|present| Arc::ptr_eq(&present.flag, flag)) {
            computing.remove(&(target, run));
        }
    }

    /// Whether a run is being computed or waits for it.
    pub(crate) fn is_computing(&self, target: usize, run: usize) -> bool {
        lock(&self.computing).contains_key(&(target, run))
    }

    /// Whether any run is being computed or waits for it.
    pub(crate) fn is_computing_any(&self) -> bool {
        !lock(&self.computing).is_empty()
    }

    /// Tells the computation of a run, or of all runs of a target, to end.
    pub(crate) fn tell_to_end(&self, target: usize, run: Option<usize>) {
        let computing = lock(&self.computing);
        let meant = computing.iter().filter(|((t, r), _)| *t == target && run.is_none_or(|run| run == *r));
        for (_, one) in meant {
            one.flag.store(true, Ordering::Relaxed);
        }
    }
}

fn is_gone() -> ApiError {
    ApiError::not_found("The session was removed meanwhile.")
}
