//! Carries out what a person asks of exports.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    CloseRecording, ListExports, ShowSessionPage, ShowSessionsPage, ShowStepPage, StreamRecording,
};
use sightline_api::location::{Anywhere, AtSession};
use sightline_api::query::SessionPart;

use crate::exports::{Ask, Part};
use crate::state::State;
use crate::state::effect::Effect;

/// Closes the live Rerun stream of a session.
pub(crate) fn close_rerun(session: String) -> Call {
    Call::to::<CloseRecording>(&AtSession { session })
}

/// Opens a live Rerun stream of a session.
pub(crate) fn stream_to_rerun(session: String) -> Call {
    Call::to::<StreamRecording>(&AtSession { session })
}

impl State {
    /// Carries out what was asked of exports.
    pub(crate) fn ask_of_exports(&mut self, ask: Ask) {
        match ask {
            Ask::Open => {
                self.exports.is_open = true;
                self.want_exports();
            }
            Ask::Close => self.exports.is_open = false,
            Ask::Of(part) => {
                self.exports.part = part;
                self.want_exports();
            }
            Ask::Download(path) => self.open_path(&path),
            Ask::Figure(wish) => self.outbox.add(Effect::SaveFigure(wish)),
            Ask::Kind(kind) => self.exports.kind = kind,
            Ask::Sheet(sheet) => self.exports.sheet = sheet,
            Ask::BurnIn(is_on) => self.exports.burns_in = is_on,
            Ask::PlainPage => self.open_path(&self.plain_page()),
        }
    }

    /// Where the plain page of what is looked at is, below `/api/v1/`.
    pub(crate) fn plain_page(&self) -> String {
        match (&self.session, self.step_key(self.cursor.step).filter(|_| self.row().is_some())) {
            (_, Some(key)) => Call::to::<ShowStepPage>(&key).path,
            (Some(session), None) => {
                Call::to::<ShowSessionPage>(&AtSession { session: session.id.clone() }).path
            }
            (None, None) => Call::to::<ShowSessionsPage>(&Anywhere {}).path,
        }
    }

    fn want_exports(&mut self) {
        (self.exports.entries, self.exports.refused) = (None, None);
        let (target, run) = match self.exports.part {
            Part::Session => (None, None),
            Part::Target => (self.cursor.target, None),
            Part::Run => (self.cursor.target, self.cursor.target.map(|_| self.cursor.run)),
        };
        let Some(session) = self.session_id() else { return };
        let call = Call::with_query::<ListExports>(&AtSession { session }, &SessionPart { target, run });
        self.call_with_problem::<ListExports>(call, |state, listed| match listed {
            Ok(entries) => state.exports.entries = Some(entries),
            Err(problem) => state.exports.refused = Some(problem.detail),
        });
    }
}
