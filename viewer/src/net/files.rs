//! Requests about what is opened: recent sessions, drives by their scenario, sessions from elsewhere.

use ehttp::Method;
use sightline_core::session::reproduce::Reproduction;
use sightline_core::session::view::SessionView;
use sightline_core::session::wire::{NewTraverse, Problem, SessionEntry, TraverseEntry};

use super::http::{json, parse};

/// What is asked.
#[derive(Clone, Debug, PartialEq)]
pub enum FileRequest {
    /// The sessions, for the list of recent ones.
    Recent,
    /// To open a simulated drive.
    Drive {
        /// The file that has it.
        file: String,
        /// The drive.
        new: NewTraverse,
    },
    /// To begin a session as it was elsewhere.
    Session {
        /// The file that has it.
        file: String,
        /// The session.
        new: Box<Reproduction>,
    },
}

/// What the server answered.
pub enum FileReply {
    /// The sessions.
    Recent(Vec<SessionEntry>),
    /// The drive.
    Drive(TraverseEntry),
    /// The session.
    Session(Box<SessionView>),
}

/// Method, path and body of a request.
pub(super) fn describe(request: &FileRequest) -> (Method, String, Option<Vec<u8>>) {
    match request {
        FileRequest::Recent => (Method::GET, "sessions".to_owned(), None),
        FileRequest::Drive { new, .. } => (Method::POST, "traverses".to_owned(), json(new)),
        FileRequest::Session { new, .. } => (Method::POST, "sessions/reproduced".to_owned(), json(new)),
    }
}

/// Reads the body of an answer.
pub(super) fn read(request: &FileRequest, bytes: &[u8]) -> Result<FileReply, Problem> {
    Ok(match request {
        FileRequest::Recent => FileReply::Recent(parse(bytes)?),
        FileRequest::Drive { .. } => FileReply::Drive(parse(bytes)?),
        FileRequest::Session { .. } => FileReply::Session(Box::new(parse(bytes)?)),
    })
}
