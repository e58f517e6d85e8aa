//! Beginning and changing sessions: a change is on disk before anybody hears of it, or it is taken back.

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
    /// Begins a session on a traverse.
    ///
    /// # Errors
    /// A problem when there are too many already.
    pub fn begin_session(&self, traverse: Arc<OpenTraverse>) -> ApiResult<Arc<LiveSession>> {
        let count = traverse.traverse.stop_count();
        let name = traverse.id.clone();
        self.enter_session(traverse, true, |id| Ok((Session::new(id, &name, count), Notes::default())))
    }

    /// Enters the session that `make` makes of its name, once it is on disk, and tells every page; one that is not awake has
    /// its runs computed when it is asked for.
    ///
    /// # Errors
    /// A problem when there are too many already, that of `make`, or when it cannot be written: nothing is begun then.
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
        self.keep_up(&live);
        self.announce(&live);
        Ok(live)
    }

    /// Gives a session the stops that its drive has come to meanwhile.
    pub(super) fn keep_up(&self, live: &LiveSession) {
        let now = live.traverse();
        if let Ok(current) = self.traverse(&now.id)
            && current.traverse.stop_count() > now.traverse.stop_count()
        {
            live.grow(current);
        }
    }

    /// Changes a session, saves it, and tells every page: all or nothing.
    ///
    /// # Errors
    /// That of `work`, or when the session was removed or cannot be written.
    pub(crate) fn change<T>(
        &self,
        live: &LiveSession,
        work: impl FnOnce(&mut Session) -> ApiResult<T>,
    ) -> ApiResult<T> {
        self.change_and(live, work, |_| ())
    }

    /// As [`Self::change`], with something to be done before the session is used again, once it is on disk.
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

    /// Tells every page that a session was changed.
    fn announce(&self, live: &LiveSession) {
        live.measure();
        self.tell(Event::SessionChanged { session: live.id.clone() });
        self.touched(live);
    }

    /// Remembers that a session is used now.
    fn touched(&self, live: &LiveSession) {
        live.set_used(Some(jiff::Timestamp::now()));
        self.0.store.touch(&live.id, clock::now());
    }

    /// Remembers a cursor that moved, which is on disk a moment later, and tells every page.
    pub(crate) fn cursor_moved(&self, live: &LiveSession, cursor: Cursor) {
        if live.is_removed() {
            return;
        }
        self.0.store.move_cursor(&live.id, cursor);
        self.touched(live);
        self.tell(Event::CursorMoved { session: live.id.clone(), cursor });
    }
}
