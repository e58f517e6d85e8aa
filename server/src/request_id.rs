//! An identifier for every request, which links a user's report to the log. Every problem contains it with the time, and
//! also in the header `x-request-id`.

use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};

use axum::body::{Body, to_bytes};
use axum::http::header::{self, HeaderName};
use axum::http::{HeaderValue, Response};
use serde_json::{Map, Value};

use crate::clock;
use crate::problem::PROBLEM_JSON;

/// Upper bound on the size of a problem, bytes.
const PROBLEM_LIMIT: usize = 1 << 20;

/// A new identifier: the start time of the program and a counter.
pub(crate) fn next() -> String {
    static STARTED: LazyLock<i64> = LazyLock::new(|| jiff::Timestamp::now().as_second());
    static COUNT: AtomicU64 = AtomicU64::new(1);
    format!("{:x}-{}", *STARTED, COUNT.fetch_add(1, Ordering::Relaxed))
}

/// Adds the identifier to a problem; other answers are unchanged, so that the same request has the same answer.
pub(crate) async fn add_to_problem(response: Response<Body>, id: &str) -> Response<Body> {
    let is_problem = response.headers().get(header::CONTENT_TYPE).is_some_and(|kind| kind == PROBLEM_JSON);
    if !is_problem {
        return response;
    }
    let (mut parts, body) = response.into_parts();
    // Problems are created in memory, so the body is complete.
    let bytes = to_bytes(body, PROBLEM_LIMIT).await.unwrap_or_default();
    let bytes = match serde_json::from_slice::<Map<String, Value>>(&bytes) {
        Ok(mut problem) => {
            problem.insert("request_id".to_owned(), id.into());
            problem.insert("time".to_owned(), clock::now().into());
            Value::Object(problem).to_string().into_bytes()
        }
        Err(_) => bytes.to_vec(),
    };
    parts.headers.insert(header::CONTENT_LENGTH, bytes.len().into());
    if let Ok(value) = HeaderValue::from_str(id) {
        parts.headers.insert(HeaderName::from_static("x-request-id"), value);
    }
    Response::from_parts(parts, Body::from(bytes))
}
