//! Extractors for names in paths, query parameters and JSON bodies, whose problems name the offending field.

use std::any::TypeId;
use std::sync::Arc;
use std::time::Duration;

use axum::body::Bytes;
use axum::extract::rejection::PathRejection;
use axum::extract::{DefaultBodyLimit, FromRequest, FromRequestParts, Query, Request};
use axum::http::request::Parts;
use axum::http::{HeaderMap, Method, StatusCode, header};
use serde::de::{DeserializeOwned, IgnoredAny};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::BringSession;
use sightline_api::location::{AtRun, AtSession, AtTarget};
use sightline_session::{Run, Session};

use crate::limits::SharedLimits;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::recorded_step::RecordedStep;
use crate::state::AppState;

/// The names in the path of an endpoint; malformed names are reported as not found.
pub(crate) struct Path<E: Endpoint>(pub E::At);

impl<E: Endpoint, S: Send + Sync> FromRequestParts<S> for Path<E> {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> ApiResult<Self> {
        Ok(Self(names(parts, state).await?))
    }
}

/// The names in the path.
async fn names<T: DeserializeOwned + Send, S: Send + Sync>(parts: &mut Parts, state: &S) -> ApiResult<T> {
    match axum::extract::Path::<T>::from_request_parts(parts, state).await {
        Ok(axum::extract::Path(names)) => Ok(names),
        Err(PathRejection::FailedToDeserializePathParams(_)) => {
            Err(ApiError::not_found("The path names something that does not exist."))
        }
        Err(other) => Err(ApiError::internal(other.to_string())),
    }
}

/// The session named in the path.
pub(crate) struct SessionPath(pub Arc<LiveSession>);

impl FromRequestParts<AppState> for SessionPath {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> ApiResult<Self> {
        let AtSession { session } = names(parts, state).await?;
        Ok(Self(state.session(&session)?))
    }
}

/// The session named in the path, and the index of one of its targets.
pub(crate) struct TargetPath {
    /// The session.
    pub live: Arc<LiveSession>,
    /// The target's index; the handler checks that it exists.
    pub target: usize,
}

impl FromRequestParts<AppState> for TargetPath {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> ApiResult<Self> {
        let AtTarget { session, target } = names(parts, state).await?;
        Ok(Self { live: state.session(&session)?, target })
    }
}

/// The session named in the path, and the indices of one of its runs.
pub(crate) struct RunPath {
    /// The session.
    pub live: Arc<LiveSession>,
    /// The target's index.
    pub target: usize,
    /// The run's index; `with_run` or the handler checks that it exists.
    pub run: usize,
}

impl FromRequestParts<AppState> for RunPath {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> ApiResult<Self> {
        let AtRun { session, target, run } = names(parts, state).await?;
        Ok(Self { live: state.session(&session)?, target, run })
    }
}

impl RunPath {
    /// Reads the run while the session is locked; `read` must be quick.
    ///
    /// # Errors
    /// A problem if the run does not exist.
    pub(crate) fn with_run<T>(&self, read: impl FnOnce(&Session, &Run) -> T) -> ApiResult<T> {
        let found =
            self.live.with(|session| session.run(self.target, self.run).map(|run| read(session, run)));
        found.map_err(|error| ApiError::from(error).about_path())
    }
}

impl FromRequestParts<AppState> for RecordedStep {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &AppState) -> ApiResult<Self> {
        Self::find(state, &names(parts, state).await?)
    }
}

/// The query parameters of an endpoint; types that deny unknown fields reject unknown ones.
pub(crate) struct Params<E: Endpoint>(pub E::Query);

impl<E: Endpoint, S: Send + Sync> FromRequestParts<S> for Params<E> {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> ApiResult<Self> {
        match Query::<E::Query>::from_request_parts(parts, state).await {
            Ok(Query(params)) => Ok(Self(params)),
            Err(wrong) => Err(ApiError::invalid("query", wrong.body_text())),
        }
    }
}

/// The JSON body of an endpoint.
pub(crate) struct Body<E: Endpoint>(pub E::Body);

impl<E: Endpoint, S: Send + Sync> FromRequest<S> for Body<E> {
    type Rejection = ApiError;

    async fn from_request(request: Request, state: &S) -> ApiResult<Self> {
        if request.headers().get(header::CONTENT_TYPE).is_none() {
            return Err(not_json());
        }
        parse(&whole_body(request, state).await?).map(Self)
    }
}

/// The bytes of a body.
///
/// # Errors
/// A problem if the body is too large or does not arrive in time.
pub(crate) async fn whole_body<S: Send + Sync>(mut request: Request, state: &S) -> ApiResult<Bytes> {
    let limits = request.extensions().get::<SharedLimits>().cloned().unwrap_or_default();
    let is_file = request.uri().path().ends_with(BringSession::PATH);
    let limit = if is_file { &limits.file_bytes } else { &limits.body_bytes };
    let too_large = || {
        let detail = format!("The body of this request may have at most {} bytes.", limit.count());
        ApiError::new(StatusCode::PAYLOAD_TOO_LARGE, "too_large", detail).hint(limit.raise())
    };
    // Rejects an announced body that is too large without waiting for it.
    let announced = request.headers().get(header::CONTENT_LENGTH).and_then(|length| length.to_str().ok());
    if announced.and_then(|length| length.parse::<u64>().ok()).is_some_and(|n| n > limit.count() as u64) {
        return Err(too_large());
    }
    DefaultBodyLimit::max(limit.count()).apply(&mut request);
    let patience = limits.body_s.time().unwrap_or(Duration::MAX);
    let reading = tokio::time::timeout(patience, Bytes::from_request(request, state)).await;
    let slow = |_| {
        let detail = "The body of the request did not arrive in time.";
        ApiError::new(StatusCode::REQUEST_TIMEOUT, "slow", detail).hint(limits.body_s.raise())
    };
    reading.map_err(slow)?.map_err(|wrong| match wrong.status() {
        StatusCode::PAYLOAD_TOO_LARGE => too_large(),
        status => ApiError::new(status, "body", "The body of the request did not arrive whole."),
    })
}

/// Parses JSON: a syntax error is a bad request; other errors name the field.
fn parse<T: DeserializeOwned + 'static>(bytes: &[u8]) -> ApiResult<T> {
    // serde also accepts an array for a struct, but the fields of a request have names.
    let is_any = TypeId::of::<T>() == TypeId::of::<serde_json::Value>();
    if !is_any
        && bytes.trim_ascii_start().starts_with(b"[")
        && serde_json::from_slice::<IgnoredAny>(bytes).is_ok()
    {
        return Err(ApiError::invalid("field", "the body must be an object with names, not an array"));
    }
    let mut json = serde_json::Deserializer::from_slice(bytes);
    let malformed = |wrong: &serde_json::Error| {
        ApiError::new(StatusCode::BAD_REQUEST, "malformed_json", format!("The body is no JSON: {wrong}."))
    };
    let value = serde_path_to_error::deserialize(&mut json).map_err(|wrong| {
        let is_json = wrong.inner().is_data() || serde_json::from_slice::<IgnoredAny>(bytes).is_ok();
        if !is_json {
            return malformed(wrong.inner());
        }
        // For valid JSON, serde_json reports a syntax error only if an array is too long.
        let message = if wrong.inner().is_data() {
            wrong.inner().to_string()
        } else {
            "has too many elements".to_owned()
        };
        let field = wrong.path().to_string();
        // Removes the line and column that serde_json appends, because the field is more helpful.
        let message = message.split(" at line ").next().unwrap_or_default();
        let prefix = if matches!(field.as_str(), "." | "?") { String::new() } else { format!("{field}: ") };
        ApiError::invalid("field", format!("{prefix}{message}"))
    })?;
    json.end().map_err(|wrong| malformed(&wrong))?;
    Ok(value)
}

/// The path prefix of endpoints whose bodies are files.
const UPLOADS: &str = "/api/v1/uploads/";

/// Requires bodies to be JSON, or bytes for uploads, so that a form on another site's page cannot reach a route.
pub(crate) fn check_content_type(method: &Method, path: &str, headers: &HeaderMap) -> ApiResult<()> {
    if method.is_safe() {
        return Ok(());
    }
    let is_file = method == Method::PUT && path.starts_with(UPLOADS);
    let is_allowed = |value: &axum::http::HeaderValue| {
        let media_type = value.to_str().unwrap_or_default().split(';').next().unwrap_or_default().trim();
        media_type.eq_ignore_ascii_case("application/json")
            || is_file && media_type.eq_ignore_ascii_case("application/octet-stream")
    };
    let length = headers.get(header::CONTENT_LENGTH);
    let has_body =
        length.is_some_and(|length| length != "0") || headers.contains_key(header::TRANSFER_ENCODING);
    let mut types = headers.get_all(header::CONTENT_TYPE).iter().peekable();
    let is_unsaid = types.peek().is_none();
    if (is_unsaid && has_body) || !types.all(is_allowed) {
        return Err(if is_file { not_bytes() } else { not_json() });
    }
    Ok(())
}

fn not_bytes() -> ApiError {
    let detail =
        "The body of this request is a file, said by the header `Content-Type: application/octet-stream`.";
    ApiError::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "not_bytes", detail)
}

fn not_json() -> ApiError {
    let detail = "The body of a request must be JSON, said by the header `Content-Type: application/json`.";
    ApiError::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "not_json", detail)
}
