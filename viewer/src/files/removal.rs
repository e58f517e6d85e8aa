//! Removes sessions and drives from the lists, and follows removals by other pages.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{RemoveSession, RemoveTraverse, RestoreSession};
use sightline_api::location::{AtSession, AtTraverse};
use sightline_api::wire::SessionEntry;

use crate::state::State;

impl State {
    /// Removes a session; it remains listed as removed and can be restored.
    pub(super) fn remove_session(&mut self, entry: SessionEntry) {
        let call = Call::to::<RemoveSession>(&AtSession { session: entry.id.clone() });
        self.call::<RemoveSession>(call, move |state, _| {
            state.files.removed.retain(|removed| removed.id != entry.id);
            state
                .messages
                .note(format!("Removed session {}. The window Open (Ctrl+O) restores it.", entry.id));
            state.files.removed.push(entry);
            state.read_recent();
        });
    }

    /// Restores a removed session.
    pub(super) fn restore_session(&mut self, id: String) {
        let call = Call::to::<RestoreSession>(&AtSession { session: id.clone() });
        self.call::<RestoreSession>(call, move |state, _| {
            state.files.removed.retain(|removed| removed.id != id);
            state.messages.note(format!("Restored session {id}; its runs are computed again."));
            state.read_recent();
        });
    }

    /// Removes a drive with its images.
    pub(super) fn remove_drive(&mut self, id: String) {
        self.files.confirming = None;
        let call = Call::to::<RemoveTraverse>(&AtTraverse { id: id.clone() });
        self.call::<RemoveTraverse>(call, move |state, _| {
            state.messages.note(format!("Removed the drive {id}. Its scenario opens it again."));
            state.drive_removed(&id);
        });
    }

    /// Handles the removal of a session by any page; it may be the open session.
    pub(crate) fn session_removed(&mut self, id: &str) {
        if let Some(recent) = &mut self.files.recent {
            recent.retain(|entry| entry.id != id);
        }
        if self.session.as_ref().is_some_and(|open| open.id == id) {
            let hint = "Open another one, or restore it on the page that removed it.".to_owned();
            self.messages.problem(format!("Session {id} was removed by another page."), Some(hint));
            self.files.is_open = true;
            self.read_recent();
        }
    }

    /// Handles the removal of a drive by any page.
    pub(crate) fn drive_removed(&mut self, id: &str) {
        self.files.removed.retain(|removed| removed.traverse != id);
        if let Some(list) = &mut self.traverses {
            list.retain(|entry| entry.id != id);
        }
    }
}
