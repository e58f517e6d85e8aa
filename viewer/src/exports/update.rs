//! Carries out the user's commands about exports.

use sightline_api::endpoint::Call;
use sightline_api::endpoints::{
    CloseRecording, ListExports, ShowSessionPage, ShowSessionsPage, ShowStepPage, StreamRecording,
};
use sightline_api::location::{Anywhere, AtSession};
use sightline_api::query::SessionPart;

use crate::exports::{ExportScope, ExportsCommand};
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
    /// Carries out a command about exports.
    pub(crate) fn apply_exports_command(&mut self, command: ExportsCommand) {
        match command {
            ExportsCommand::Open => {
                self.exports.is_open = true;
                self.read_exports();
            }
            ExportsCommand::Close => self.exports.is_open = false,
            ExportsCommand::Scope(scope) => {
                self.exports.scope = scope;
                self.read_exports();
            }
            ExportsCommand::Download(path) => self.open_path(&path),
            ExportsCommand::Figure(request) => self.outbox.add(Effect::SaveFigure(request)),
            ExportsCommand::Format(format) => self.exports.format = format,
            ExportsCommand::Sheet(sheet) => self.exports.sheet = sheet,
            ExportsCommand::BurnIn(is_on) => self.exports.burns_in = is_on,
            ExportsCommand::PlainPage => self.open_path(&self.plain_page()),
        }
    }

    /// Path of the plain page of the current view, below `/api/v1/`.
    pub(crate) fn plain_page(&self) -> String {
        match (&self.session, self.step_key(self.cursor.step).filter(|_| self.row().is_some())) {
            (_, Some(key)) => Call::to::<ShowStepPage>(&key).path,
            (Some(session), None) => {
                Call::to::<ShowSessionPage>(&AtSession { session: session.id.clone() }).path
            }
            (None, None) => Call::to::<ShowSessionsPage>(&Anywhere {}).path,
        }
    }

    fn read_exports(&mut self) {
        (self.exports.entries, self.exports.refused) = (None, None);
        let (target, run) = match self.exports.scope {
            ExportScope::Session => (None, None),
            ExportScope::Target => (self.cursor.target, None),
            ExportScope::Run => (self.cursor.target, self.cursor.target.map(|_| self.cursor.run)),
        };
        let Some(session) = self.session_id() else { return };
        let call = Call::with_query::<ListExports>(&AtSession { session }, &SessionPart { target, run });
        self.call_with_problem::<ListExports>(call, |state, listed| match listed {
            Ok(entries) => state.exports.entries = Some(entries),
            Err(problem) => state.exports.refused = Some(problem.detail),
        });
    }
}
