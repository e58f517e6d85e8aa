//! How requests are read: names in paths, query parameters and JSON bodies, with problems that say what is wrong.

use std::time::Duration;

use axum::body::Bytes;
use axum::extract::rejection::PathRejection;
use axum::extract::{FromRequest, FromRequestParts, Query, Request};
use axum::http::request::Parts;
use axum::http::{HeaderMap, Method, StatusCode, header};
use serde::de::DeserializeOwned;

use crate::problem::{ApiError, ApiResult};

/// The largest body of a request, bytes.
pub const BODY_LIMIT: usize = 1 << 20;

/// How long a body may take to arrive.
const BODY_PATIENCE: Duration = Duration::from_secs(30);

/// The names in the path; what is not even of their form is not there.
pub struct Path<T>(pub T);

impl<T: DeserializeOwned + Send, S: Send + Sync> FromRequestParts<S> for Path<T> {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> ApiResult<Self> {
        match axum::extract::Path::<T>::from_request_parts(parts, state).await {
            Ok(axum::extract::Path(names)) => Ok(Self(names)),
            Err(PathRejection::FailedToDeserializePathParams(_)) => {
                Err(ApiError::not_found("The path names something that does not exist."))
            }
            Err(other) => Err(ApiError::internal(other.to_string())),
        }
    }
}

/// The query parameters; unknown ones are refused by types that deny unknown fields.
pub struct Params<T>(pub T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequestParts<S> for Params<T> {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> ApiResult<Self> {
        match Query::<T>::from_request_parts(parts, state).await {
            Ok(Query(params)) => Ok(Self(params)),
            Err(wrong) => Err(ApiError::invalid("query", wrong.body_text())),
        }
    }
}

/// A JSON body.
pub struct Body<T>(pub T);

impl<T: DeserializeOwned, S: Send + Sync> FromRequest<S> for Body<T> {
    type Rejection = ApiError;

    async fn from_request(request: Request, state: &S) -> ApiResult<Self> {
        if request.headers().get(header::CONTENT_TYPE).is_none() {
            return Err(not_json());
        }
        let reading = tokio::time::timeout(BODY_PATIENCE, Bytes::from_request(request, state)).await;
        let slow = |_| {
            ApiError::new(
                StatusCode::REQUEST_TIMEOUT,
                "slow",
                "The body of the request did not arrive in time.",
            )
        };
        let bytes = reading.map_err(slow)?.map_err(|wrong| match wrong.status() {
            StatusCode::PAYLOAD_TOO_LARGE => {
                let limit = BODY_LIMIT >> 20;
                let detail = format!("The body of a request may have at most {limit} MiB.");
                ApiError::new(StatusCode::PAYLOAD_TOO_LARGE, "too_large", detail)
            }
            status => ApiError::new(status, "body", "The body of the request did not arrive whole."),
        })?;
        parse(&bytes).map(Self)
    }
}

/// Reads JSON: what is no JSON is a bad request; what does not fit is refused by the name of the field.
fn parse<T: DeserializeOwned>(bytes: &[u8]) -> ApiResult<T> {
    let mut json = serde_json::Deserializer::from_slice(bytes);
    let malformed = |wrong: &serde_json::Error| {
        ApiError::new(StatusCode::BAD_REQUEST, "malformed_json", format!("The body is no JSON: {wrong}."))
    };
    let value = serde_path_to_error::deserialize(&mut json).map_err(|wrong| {
        if !wrong.inner().is_data() {
            return malformed(wrong.inner());
        }
        let (field, message) = (wrong.path().to_string(), wrong.inner().to_string());
        // serde_json puts the place behind the message, which says less than the field.
        let message = message.split(" at line ").next().unwrap_or_default();
        let place = if matches!(field.as_str(), "." | "?") { String::new() } else { format!("{field}: ") };
        ApiError::invalid("field", format!("{place}{message}"))
    })?;
    json.end().map_err(|wrong| malformed(&wrong))?;
    Ok(value)
}

/// Refuses bodies that are not JSON, so that a form on a foreign page cannot reach a route.
pub fn check_content_type(method: &Method, headers: &HeaderMap) -> ApiResult<()> {
    if method.is_safe() {
        return Ok(());
    }
    let is_json = |value: &axum::http::HeaderValue| {
        let media_type = value.to_str().unwrap_or_default().split(';').next().unwrap_or_default().trim();
        media_type.eq_ignore_ascii_case("application/json")
    };
    let length = headers.get(header::CONTENT_LENGTH);
    let has_body =
        length.is_some_and(|length| length != "0") || headers.contains_key(header::TRANSFER_ENCODING);
    let mut types = headers.get_all(header::CONTENT_TYPE).iter().peekable();
    let is_unsaid = types.peek().is_none();
    if (is_unsaid && has_body) || !types.all(is_json) { Err(not_json()) } else { Ok(()) }
}

fn not_json() -> ApiError {
    let detail = "The body of a request must be JSON, said by the header `Content-Type: application/json`.";
    ApiError::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "not_json", detail)
}
