//! Removes sessions and drives from the state, and restores sessions.

use std::sync::{Arc, MutexGuard};

use sightline_api::event::Event;

use super::AppState;
use crate::jobs::lock;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::{sessions, store};

impl AppState {
    /// Removes a session; [`Self::restore_session`] restores it.
    ///
    /// # Errors
    /// A problem if it does not exist, or the database cannot be written.
    pub(crate) fn remove_session(&self, id: &str) -> ApiResult<()> {
        let missing = || ApiError::not_found("There is no such session.");
        let number = store::number_of(id).ok_or_else(missing)?;
        let live = lock(&self.0.sessions).by_number.get(&number).cloned().ok_or_else(missing)?;
        if !live.remove(&self.0.store)? {
            return Err(missing());
        }
        lock(&self.0.sessions).take(number);
        self.0.questions.forget_session(id);
        self.0.streams.close(id);
        self.send_event(Event::SessionRemoved { session: id.to_owned() });
        Ok(())
    }

    /// Restores a removed session; its runs are recomputed.
    ///
    /// # Errors
    /// A problem if it was not removed, or too long ago.
    pub(crate) fn restore_session(&self, id: &str) -> ApiResult<Arc<LiveSession>> {
        let number = store::number_of(id);
        let number = number.ok_or_else(|| ApiError::not_found("There is no such removed session."))?;
        sessions::restore(&self.0.sessions, &self.0.store, &self.limits().sessions, number)?;
        let restored = lock(&self.0.sessions).by_number.get(&number).cloned();
        restored.iter().for_each(|live| self.add_new_stops(live));
        self.send_event(Event::SessionChanged { session: id.to_owned() });
        self.session(id)
    }

    /// Whether a traverse was opened from a page and can be removed.
    pub(crate) fn is_removable(&self, open: &OpenTraverse) -> bool {
        !self.0.given.contains(&open.id)
    }

    /// Locks the creation and removal of drives.
    pub(crate) fn drive_folder_lock(&self) -> MutexGuard<'_, ()> {
        lock(&self.0.drive_folder_lock)
    }

    /// Closes a traverse without sessions; new sessions on it are then impossible.
    ///
    /// # Errors
    /// A problem if it has sessions.
    pub(crate) fn close_traverse(&self, open: &OpenTraverse) -> ApiResult<()> {
        let mut traverses = lock(&self.0.traverses);
        let mut sessions = lock(&self.0.sessions);
        let (count, id) = (sessions.count_on(&open.id), &open.id);
        if count > 0 {
            let noun = if count == 1 { "session" } else { "sessions" };
            let detail = format!("The drive {id} has {count} {noun}.");
            return Err(ApiError::conflict(detail).hint("Remove its sessions first."));
        }
        open.close();
        sessions.forget_removed_on(id);
        traverses.retain(|other| other.id != *id);
        self.0.maps.forget(id);
        self.0.odometry.forget(id);
        Ok(())
    }
}
