//! The sessions of the server by number: loading them from the database when a drive is opened, and removing them.
//!
//! A removed session is deleted from the database at once. Its saved form, without steps, stays in memory, so that it can be
//! restored until the server ends or [`RESTORABLE`] further sessions are removed.

use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex};

use sightline_geometry::error::Result;
use sightline_session::Session;
use sightline_session::notes::Notes;
use sightline_session::view::SavedSession;

use crate::identity::Relation;
use crate::jobs::lock;
use crate::limits::Limit;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::store::{self, Store};

/// Maximum number of removed sessions that can be restored.
const RESTORABLE: usize = 16;

/// A removed session in its saved form, from which its runs can be recomputed.
pub(crate) struct Removed {
    number: u64,
    saved: SavedSession,
    notes: Notes,
    used: Option<jiff::Timestamp>,
    traverse: Arc<OpenTraverse>,
}

/// The sessions on open traverses.
#[derive(Default)]
pub(crate) struct Sessions {
    /// The sessions by number.
    pub(crate) by_number: BTreeMap<u64, Arc<LiveSession>>,
    /// The largest session number so far.
    pub(crate) last_number: u64,
    /// Number of sessions being created: they have a number, but are not on disk yet.
    beginning: usize,
    /// Removed sessions, most recent last.
    removed: VecDeque<Removed>,
}

impl Sessions {
    /// Loads the sessions on disk whose traverses are open. A notice lists those that are hidden although a drive with the
    /// same index is open: their results belong to other images.
    ///
    /// # Errors
    /// A database that cannot be read or written.
    pub(crate) fn load(store: &Store, traverses: &[Arc<OpenTraverse>]) -> Result<(Self, Vec<String>)> {
        let mut found = store.load()?;
        let mut sessions = Self { last_number: found.last_number, ..Self::default() };
        let mut notices = std::mem::take(&mut found.messages);
        let mut hidden = BTreeMap::<String, Vec<String>>::new();
        for saved in std::mem::take(&mut found.sessions) {
            let Some(number) = store::number_of(&saved.id) else { continue };
            let (traverse, saved) = match origin_of(traverses, saved) {
                SessionOrigin::On(traverse, saved) => (traverse, saved),
                SessionOrigin::Renamed(traverse, saved) => {
                    // On failure, the next start renames it.
                    if let Err(error) = store.save(&saved) {
                        notices.push(format!("session {}: {error}", saved.id));
                    }
                    (traverse, saved)
                }
                SessionOrigin::OtherImages(saved) => {
                    hidden.entry(saved.traverse).or_default().push(saved.id);
                    continue;
                }
                SessionOrigin::NotOpen => continue,
            };
            match Session::restored(&saved, traverse.traverse.stop_count()) {
                Ok(session) => {
                    let live = LiveSession::new(session, traverse, false);
                    live.with_notes(|notes| *notes = found.notes.remove(&number).unwrap_or_default());
                    live.set_used(found.used.remove(&number).and_then(|time| time.parse().ok()));
                    sessions.by_number.insert(number, Arc::new(live));
                }
                Err(error) => notices.push(store.set_aside(&saved.id, &error.to_string())),
            }
        }
        notices.extend(hidden.iter().map(|(drive, sessions)| images_changed(drive, sessions)));
        Ok((sessions, notices))
    }

    /// Checks the number of sessions before another one is created.
    ///
    /// # Errors
    /// A problem if there are too many.
    pub(crate) fn has_room(&self, limit: &Limit) -> ApiResult<()> {
        if self.by_number.len() + self.beginning < limit.count() {
            return Ok(());
        }
        let detail = format!("There are {} sessions already.", self.by_number.len());
        let way_out = "Remove one that is not needed: DELETE sessions/{session}.";
        Err(ApiError::conflict(detail).hint(limit.hint(way_out)))
    }

    /// Reserves the number of a new session.
    ///
    /// # Errors
    /// A problem if there are too many.
    pub(crate) fn reserve(&mut self, limit: &Limit) -> ApiResult<u64> {
        self.has_room(limit)?;
        self.beginning += 1;
        self.last_number += 1;
        Ok(self.last_number)
    }

    /// Adds the session with a reserved number, or cancels the reservation.
    pub(crate) fn enter(&mut self, number: u64, live: Option<&Arc<LiveSession>>) {
        self.beginning -= 1;
        match live {
            Some(live) => {
                self.by_number.insert(number, Arc::clone(live));
            }
            None if self.last_number == number => self.last_number -= 1,
            None => {}
        }
    }

    /// The number of sessions on a traverse.
    pub(crate) fn count_on(&self, traverse: &str) -> usize {
        self.by_number.values().filter(|live| live.traverse().id == traverse).count()
    }

    /// Moves a session that was removed from the database to the removed ones, in its saved form.
    pub(crate) fn take(&mut self, number: u64) {
        let Some(live) = self.by_number.remove(&number) else { return };
        let (saved, notes) = live.with(|session| (session.saved(), live.with_notes(|notes| notes.clone())));
        let (used, traverse) = (live.used(), live.traverse());
        self.removed.push_back(Removed { number, saved, notes, used, traverse });
        let surplus = self.removed.len().saturating_sub(RESTORABLE);
        self.removed.drain(..surplus);
    }

    /// Discards the removed sessions of a traverse.
    pub(crate) fn forget_removed_on(&mut self, traverse: &str) {
        self.removed.retain(|removed| removed.traverse.id != traverse);
    }
}

/// Restores a removed session.
///
/// # Errors
/// A problem if it was not removed or too long ago, there are too many sessions, or it cannot be written; in the last two
/// cases it can still be restored.
pub(crate) fn restore(
    sessions: &Mutex<Sessions>,
    store: &Store,
    limit: &Limit,
    number: u64,
) -> ApiResult<()> {
    let mut sessions = lock(sessions);
    let index = sessions.removed.iter().position(|removed| removed.number == number).ok_or_else(|| {
        ApiError::not_found("There is no such removed session.")
            .hint(format!("The last {RESTORABLE} removed sessions can be restored until the server ends."))
    })?;
    sessions.has_room(limit)?;
    let removed = &sessions.removed[index];
    let session = Session::restored(&removed.saved, removed.traverse.traverse.stop_count())?;
    let live = LiveSession::new(session, Arc::clone(&removed.traverse), false);
    live.with_notes(|notes| *notes = removed.notes.clone());
    live.set_used(removed.used);
    store.save_with(&removed.saved, Some(&removed.notes))?;
    sessions.removed.remove(index);
    sessions.by_number.insert(number, Arc::new(live));
    Ok(())
}

/// The relation of a saved session to the open drives.
enum SessionOrigin {
    /// On an open drive.
    On(Arc<OpenTraverse>, SavedSession),
    /// On an open drive whose name has changed since the session was saved.
    Renamed(Arc<OpenTraverse>, SavedSession),
    /// On a drive of the same index as an open one, but with other images.
    OtherImages(SavedSession),
    /// On a drive that is not open.
    NotOpen,
}

fn origin_of(traverses: &[Arc<OpenTraverse>], saved: SavedSession) -> SessionOrigin {
    let find = |wanted: Relation| {
        traverses.iter().find(|open| open.identity.relation(&saved.traverse) == wanted).cloned()
    };
    if let Some(open) = find(Relation::Same) {
        return SessionOrigin::On(open, saved);
    }
    if let Some(open) = find(Relation::SameIndex) {
        let saved = SavedSession { traverse: open.id.clone(), ..saved };
        return SessionOrigin::Renamed(open, saved);
    }
    if find(Relation::OtherFiles).is_some() {
        SessionOrigin::OtherImages(saved)
    } else {
        SessionOrigin::NotOpen
    }
}

fn images_changed(drive: &str, sessions: &[String]) -> String {
    let (which, was) = match sessions {
        [one] => (format!("session {one}"), "was"),
        more => (format!("sessions {}", more.join(", ")), "were"),
    };
    format!(
        "{which} {was} made on the drive {drive}, whose images have changed since; the numbers would differ, so that it is \
         not shown. Put the former images back and start again, or begin a new session"
    )
}
