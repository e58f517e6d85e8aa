//! The sessions of the server by number: how they come back from the database when a drive is opened, and how they are
//! removed.
//!
//! A removed session leaves the database at once. What the person did is kept in memory, without steps, so that the removal
//! can be taken back until the server ends or [`RESTORABLE`] later ones were removed.

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

/// How many removed sessions can be restored.
const RESTORABLE: usize = 16;

/// A removed session: what the person did, from which its runs are computed again.
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
    /// The largest number that a session ever had.
    pub(crate) last_number: u64,
    /// Sessions that are being begun: they have a number, and are not on disk yet.
    beginning: usize,
    /// Those that were removed, the last one at the end.
    removed: VecDeque<Removed>,
}

impl Sessions {
    /// The sessions on disk whose traverses are open; the others stay where they are. A notice says which of them are not
    /// shown although a drive of their index is open: their numbers belong to other images.
    ///
    /// # Errors
    /// A database that cannot be read or written.
    pub(crate) fn read_back(store: &Store, traverses: &[Arc<OpenTraverse>]) -> Result<(Self, Vec<String>)> {
        let mut found = store.load()?;
        let mut sessions = Self { last_number: found.last_number, ..Self::default() };
        let mut notices = std::mem::take(&mut found.messages);
        let mut hidden = BTreeMap::<String, Vec<String>>::new();
        for saved in std::mem::take(&mut found.sessions) {
            let Some(number) = store::number_of(&saved.id) else { continue };
            let (traverse, saved) = match place(traverses, saved) {
                Place::On(traverse, saved) => (traverse, saved),
                Place::Renamed(traverse, saved) => {
                    // Otherwise it is renamed at the next start again.
                    if let Err(error) = store.save(&saved) {
                        notices.push(format!("session {}: {error}", saved.id));
                    }
                    (traverse, saved)
                }
                Place::OtherImages(saved) => {
                    hidden.entry(saved.traverse).or_default().push(saved.id);
                    continue;
                }
                Place::Nowhere => continue,
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

    /// Whether another session may be begun.
    ///
    /// # Errors
    /// A problem when there are too many.
    pub(crate) fn has_room(&self, limit: &Limit) -> ApiResult<()> {
        if self.by_number.len() + self.beginning < limit.count() {
            return Ok(());
        }
        let detail = format!("There are {} sessions already.", self.by_number.len());
        let way_out = "Remove one that is not needed: DELETE sessions/{session}.";
        Err(ApiError::conflict(detail).hint(limit.hint(way_out)))
    }

    /// A number for a session that is begun.
    ///
    /// # Errors
    /// A problem when there are too many.
    pub(crate) fn reserve(&mut self, limit: &Limit) -> ApiResult<u64> {
        self.has_room(limit)?;
        self.beginning += 1;
        self.last_number += 1;
        Ok(self.last_number)
    }

    /// Enters the session for which a number was reserved, or gives the number back.
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

    /// Takes a session out that was removed from the database, and keeps what the person did.
    pub(crate) fn take(&mut self, number: u64) {
        let Some(live) = self.by_number.remove(&number) else { return };
        let (saved, notes) = live.with(|session| (session.saved(), live.with_notes(|notes| notes.clone())));
        let (used, traverse) = (live.used(), live.traverse());
        self.removed.push_back(Removed { number, saved, notes, used, traverse });
        let surplus = self.removed.len().saturating_sub(RESTORABLE);
        self.removed.drain(..surplus);
    }

    /// Forgets the removed sessions of a traverse.
    pub(crate) fn forget_removed_on(&mut self, traverse: &str) {
        self.removed.retain(|removed| removed.traverse.id != traverse);
    }
}

/// Brings a removed session back.
///
/// # Errors
/// A problem when it was not removed, too long ago, there are too many sessions, or it cannot be written: it is then
/// restorable still.
pub(crate) fn restore(
    sessions: &Mutex<Sessions>,
    store: &Store,
    limit: &Limit,
    number: u64,
) -> ApiResult<()> {
    let mut sessions = lock(sessions);
    let place = sessions.removed.iter().position(|removed| removed.number == number).ok_or_else(|| {
        ApiError::not_found("There is no such removed session.")
            .hint(format!("The last {RESTORABLE} removed sessions can be restored until the server ends."))
    })?;
    sessions.has_room(limit)?;
    let removed = &sessions.removed[place];
    let session = Session::restored(&removed.saved, removed.traverse.traverse.stop_count())?;
    let live = LiveSession::new(session, Arc::clone(&removed.traverse), false);
    live.with_notes(|notes| *notes = removed.notes.clone());
    live.set_used(removed.used);
    store.save_with(&removed.saved, Some(&removed.notes))?;
    sessions.removed.remove(place);
    sessions.by_number.insert(number, Arc::new(live));
    Ok(())
}

/// Where a saved session belongs.
enum Place {
    /// On an open drive.
    On(Arc<OpenTraverse>, SavedSession),
    /// On an open drive, which has another name since the session was saved.
    Renamed(Arc<OpenTraverse>, SavedSession),
    /// On a drive of the same index as an open one, but with other images.
    OtherImages(SavedSession),
    /// On a drive that is not open.
    Nowhere,
}

fn place(traverses: &[Arc<OpenTraverse>], saved: SavedSession) -> Place {
    let find = |wanted: Relation| {
        traverses.iter().find(|open| open.identity.relation(&saved.traverse) == wanted).cloned()
    };
    if let Some(open) = find(Relation::Same) {
        return Place::On(open, saved);
    }
    if let Some(open) = find(Relation::SameIndex) {
        let saved = SavedSession { traverse: open.id.clone(), ..saved };
        return Place::Renamed(open, saved);
    }
    if find(Relation::OtherFiles).is_some() { Place::OtherImages(saved) } else { Place::Nowhere }
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
