//! Requests about breakpoints and expressions, and how their answers are read.

use ehttp::Method;
use sightline_core::session::wire::Problem;

use super::http::{json, parse};
use crate::state::ask::{AskReply, AskRequest};

/// Method, path and body of a request.
pub(super) fn describe(request: &AskRequest) -> (Method, String, Option<Vec<u8>>) {
    let list = |session: &str| format!("sessions/{session}/breakpoints");
    match request {
        AskRequest::Breakpoints(session) => (Method::GET, list(session), None),
        AskRequest::Add { session, new } => (Method::POST, list(session), json(new)),
        AskRequest::Change { session, number, change } => {
            (Method::PATCH, format!("{}/{number}", list(session)), json(change))
        }
        AskRequest::Remove { session, number } => {
            (Method::DELETE, format!("{}/{number}", list(session)), None)
        }
        AskRequest::Query { session, query } => {
            (Method::POST, format!("sessions/{session}/query"), json(query))
        }
    }
}

/// Reads the body of an answer.
pub(super) fn read(request: &AskRequest, bytes: &[u8]) -> Result<AskReply, Problem> {
    Ok(match request {
        AskRequest::Breakpoints(_) => AskReply::Breakpoints(parse(bytes)?),
        AskRequest::Add { .. } | AskRequest::Change { .. } => AskReply::Breakpoint(parse(bytes)?),
        AskRequest::Remove { .. } => AskReply::Done,
        AskRequest::Query { .. } => AskReply::Answer(parse(bytes)?),
    })
}
