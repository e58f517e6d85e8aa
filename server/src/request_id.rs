//! A name for every request, by which a person's report finds the log's lines: in every problem beside the time, and there
//! as the header `x-request-id`, too.

use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};

use axum::body::{Body, to_bytes};
use axum::http::header::{self, HeaderName};
use axum::http::{HeaderValue, Response};
use serde_json::{Map, Value};

use crate::clock;
use crate::problem::PROBLEM_JSON;

/// More than any problem has, bytes.
const PROBLEM_LIMIT: usize = 1 << 20;

/// The next name: when the program started, and a number.
pub(crate) fn next() -> String {
    static STARTED: LazyLock<i64> = LazyLock::new(|| jiff::Timestamp::now().as_second());
    static COUNT: AtomicU64 = AtomicU64::new(1);
    format!("{:x}-{}", *STARTED, COUNT.fetch_add(1, Ordering::Relaxed))
}

/// A problem with the name of its request; every other answer as it is, so that the same question has the same answer.
pub(crate) async fn told(response: Response<Body>, id: &str) -> Response<Body> {
    let is_problem = response.headers().get(header::CONTENT_TYPE).is_some_and(|kind| kind == PROBLEM_JSON);
    if !is_problem {
        return response;
    }
    let (mut parts, body) = response.into_parts();
    // Problems are made in memory, so that they arrive whole.
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
