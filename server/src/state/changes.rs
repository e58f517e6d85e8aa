//! Creates and changes sessions: a change is on disk before pages are notified, or it is undone.

use std::sync::Arc;

use sightline_api::event::Event;
use sightline_session::notes::Notes;
use sightline_session::{Cursor, Session};

use super::AppState;
use crate::clock;
use crate::jobs::lock;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::store;

impl AppState {
    /// Creates a session on a traverse.
    ///
    /// # Errors
    /// A problem if there are too many.
    pub fn begin_session(&self, traverse: Arc<OpenTraverse>) -> ApiResult<Arc<LiveSession>> {
        let count = traverse.traverse.stop_count();
        let name = traverse.id.clone();
        self.enter_session(traverse, true, |id| Ok((Session::new(id, &name, count), Notes::default())))
    }

    /// Adds the session that `make` creates for its name, once it is on disk, and notifies every page. The runs of a session
    /// that is not awake are computed on its first request.
    ///
    /// # Errors
    /// A problem if there are too many, that of `make`, or if it cannot be written: no session is created then.
    pub(crate) fn enter_session(
        &self,
        traverse: Arc<OpenTraverse>,
        is_awake: bool,
        make: impl FnOnce(String) -> ApiResult<(Session, Notes)>,
    ) -> ApiResult<Arc<LiveSession>> {
        let number = lock(&self.0.sessions).reserve(&self.limits().sessions)?;
        let made = make(store::id_of(number)).and_then(|(session, notes)| {
            self.0.store.save_with(&session.saved(), Some(&notes))?;
            let live = LiveSession::new(session, traverse, is_awake);
            live.with_notes(|own| *own = notes);
            Ok(Arc::new(live))
        });
        let is_closed = {
            let mut sessions = lock(&self.0.sessions);
            let is_closed = made.as_ref().is_ok_and(|live| live.traverse().is_closed());
            sessions.enter(number, made.as_ref().ok().filter(|_| !is_closed));
            is_closed
        };
        let live = made?;
        if is_closed {
            self.0.store.remove(&live.id)?;
            return Err(ApiError::not_found("The drive was removed meanwhile."));
        }
        self.add_new_stops(&live);
        self.announce(&live);
        Ok(live)
    }

    /// Updates a session with new stops of its drive.
    pub(super) fn add_new_stops(&self, live: &LiveSession) {
        let now = live.traverse();
        if let Ok(current) = self.traverse(&now.id)
            && current.traverse.stop_count() > now.traverse.stop_count()
        {
            live.grow(current);
        }
    }

    /// Changes a session, saves it, and notifies every page: all or nothing.
    ///
    /// # Errors
    /// That of `work`, or if the session was removed or cannot be written.
    pub(crate) fn change<T>(
        &self,
        live: &LiveSession,
        work: impl FnOnce(&mut Session) -> ApiResult<T>,
    ) -> ApiResult<T> {
        self.change_and(live, work, |_| ())
    }

    /// As [`Self::change`]; calls `then` after saving, before the session is unlocked.
    ///
    /// # Errors
    /// As [`Self::change`].
    pub(crate) fn change_and<T>(
        &self,
        live: &LiveSession,
        work: impl FnOnce(&mut Session) -> ApiResult<T>,
        then: impl FnOnce(&T),
    ) -> ApiResult<T> {
        let value = live.change_and(&self.0.store, work, then)?;
        self.announce(live);
        Ok(value)
    }

    /// Notifies every page that a session was changed.
    fn announce(&self, live: &LiveSession) {
        live.measure();
        self.send_event(Event::SessionChanged { session: live.id.clone() });
        self.mark_used(live);
    }

    /// Records that a session is in use.
    fn mark_used(&self, live: &LiveSession) {
        live.set_used(Some(jiff::Timestamp::now()));
        self.0.store.touch(&live.id, clock::now());
    }

    /// Stores a moved cursor, which is written to disk with a short delay, and notifies every page.
    pub(crate) fn move_cursor(&self, live: &LiveSession, cursor: Cursor) {
        if live.is_removed() {
            return;
        }
        self.0.store.move_cursor(&live.id, cursor);
        self.mark_used(live);
        self.send_event(Event::CursorMoved { session: live.id.clone(), cursor });
    }
}
