//! What the page asks about single steps, and about taking removals back.

use ehttp::Method;
use serde_json::json;
use sightline_core::session::counterfactual::wire::Question;
use sightline_core::session::view::SessionView;
use sightline_core::session::what_if::{Ghost, WhatIf};
use sightline_core::session::why::Explanation;
use sightline_core::session::wire::Problem;

use super::http::{json as body, parse};
use crate::cache::StepKey;

/// What is asked.
#[derive(Clone, Debug, PartialEq)]
pub enum WhyRequest {
    /// Where a value came from.
    Explain {
        /// The step.
        of: StepKey,
        /// The value's name.
        value: String,
    },
    /// To try a change.
    WhatIf {
        /// The step.
        of: StepKey,
        /// The change.
        what_if: WhatIf,
    },
    /// What would have saved a step, as far as it is known.
    Question(StepKey),
    /// To look for what would have saved it.
    AskQuestion(StepKey),
    /// To stop looking.
    CancelQuestion(StepKey),
    /// To remove a run.
    RemoveRun {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// To take the removal of a run back.
    RestoreRun {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
        /// The run's number.
        run: usize,
    },
    /// To take the removal of a target back.
    RestoreTarget {
        /// The session.
        session: String,
        /// The target's number.
        target: usize,
    },
}

/// What the server answered.
pub enum WhyReply {
    /// Where a value came from.
    Explanation(Box<Explanation>),
    /// What came of a change.
    Ghost(Box<Ghost>),
    /// What would have saved a step.
    Question(Box<Question>),
    /// The session after a removal or its undoing.
    Session(Box<SessionView>),
}

/// Method, path and body of a request.
pub(super) fn describe(request: &WhyRequest) -> (Method, String, Option<Vec<u8>>) {
    let step = |key: &StepKey| {
        let StepKey { session, target, run, step } = key;
        format!("sessions/{session}/targets/{target}/runs/{run}/steps/{step}")
    };
    let post = |path: String| (Method::POST, path, body(&json!({})));
    match request {
        WhyRequest::Explain { of, value } => {
            (Method::GET, format!("{}/why?value={}", step(of), escaped(value)), None)
        }
        WhyRequest::WhatIf { of, what_if } => (Method::POST, format!("{}/what_if", step(of)), body(what_if)),
        WhyRequest::Question(of) => (Method::GET, format!("{}/counterfactual", step(of)), None),
        WhyRequest::AskQuestion(of) => post(format!("{}/counterfactual", step(of))),
        WhyRequest::CancelQuestion(of) => post(format!("{}/counterfactual/cancel", step(of))),
        WhyRequest::RemoveRun { session, target, run } => {
            (Method::DELETE, format!("sessions/{session}/targets/{target}/runs/{run}"), None)
        }
        WhyRequest::RestoreRun { session, target, run } => {
            post(format!("sessions/{session}/targets/{target}/runs/{run}/restore"))
        }
        WhyRequest::RestoreTarget { session, target } => {
            post(format!("sessions/{session}/targets/{target}/restore"))
        }
    }
}

/// A name in a query: all but letters, digits, points and underscores as percent signs and digits.
pub(super) fn escaped(text: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || matches!(byte, b'.' | b'_' | b'-');
    let escape = |byte: u8| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") };
    text.bytes().map(escape).collect()
}

/// Reads the body of an answer.
pub(super) fn read(request: &WhyRequest, bytes: &[u8]) -> Result<WhyReply, Problem> {
    Ok(match request {
        WhyRequest::Explain { .. } => WhyReply::Explanation(Box::new(parse(bytes)?)),
        WhyRequest::WhatIf { .. } => WhyReply::Ghost(Box::new(parse(bytes)?)),
        WhyRequest::Question(_) | WhyRequest::AskQuestion(_) | WhyRequest::CancelQuestion(_) => {
            WhyReply::Question(Box::new(parse(bytes)?))
        }
        WhyRequest::RemoveRun { .. } | WhyRequest::RestoreRun { .. } | WhyRequest::RestoreTarget { .. } => {
            WhyReply::Session(Box::new(parse(bytes)?))
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn questions_have_their_paths() {
        let of = StepKey { session: "s1".to_owned(), target: 2, run: 3, step: 4 };
        let path = |request: WhyRequest| describe(&request).1;
        let value = "gate.ncc & more".to_owned();
        assert_eq!(
            path(WhyRequest::Explain { of: of.clone(), value }),
            "sessions/s1/targets/2/runs/3/steps/4/why?value=gate.ncc%20%26%20more"
        );
        assert_eq!(
            path(WhyRequest::CancelQuestion(of)),
            "sessions/s1/targets/2/runs/3/steps/4/counterfactual/cancel"
        );
    }
}
