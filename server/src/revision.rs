//! `If-Match`: the revision that a client has read before changing a resource, to prevent lost updates.

use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};

use crate::naming::hash;
use crate::problem::{ApiError, ApiResult};

/// The revision that was read: `If-Match: "3"` is 3; `If-Match: *` is `None`, any revision; `If-None-Match: *` is 0, a
/// resource that does not exist yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Read(pub Option<u64>);

impl<S: Send + Sync> FromRequestParts<S> for Read {
    type Rejection = ApiError;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> ApiResult<Self> {
        read(&parts.headers)
    }
}

fn read(headers: &HeaderMap) -> ApiResult<Read> {
    let value_of = |name| headers.get(name).map(|value| value.to_str().unwrap_or_default().trim().to_owned());
    match (value_of(header::IF_MATCH), value_of(header::IF_NONE_MATCH)) {
        (_, Some(other)) if other != "*" => Err(ApiError::invalid(
            "if_none_match",
            "If-None-Match: must be *, for a thing that is not there yet",
        )),
        (Some(any), _) if any == "*" => Ok(Read(None)),
        (Some(tag), _) => {
            let number =
                tag.strip_prefix('"').and_then(|tag| tag.strip_suffix('"')).and_then(|n| n.parse().ok());
            let wrong = || {
                ApiError::invalid("if_match", "If-Match: must be a revision in quotes, such as \"3\", or *")
            };
            number.map(|number| Read(Some(number))).ok_or_else(wrong)
        }
        (None, Some(_)) => Ok(Read(Some(0))),
        (None, None) => Err(ApiError::new(
            StatusCode::PRECONDITION_REQUIRED,
            "if_match",
            "The header If-Match must name the revision that you have read.",
        )
        .hint("It is in the field `revision` and in the header ETag; `If-Match: *` takes whichever it is.")),
    }
}

/// The ETag header of a revision.
pub(crate) fn tag(revision: u64) -> [(header::HeaderName, String); 1] {
    [(header::ETAG, format!("\"{revision}\""))]
}

/// An answer with an ETag of its contents, or 304 if the client has the same version.
pub(crate) fn unless_known(headers: &HeaderMap, media_type: &'static str, body: Vec<u8>) -> Response {
    let tag = format!("\"{}\"", &hash(&body)[..32]);
    let known = headers.get(header::IF_NONE_MATCH).and_then(|value| value.to_str().ok());
    let caching = [(header::ETAG, tag.clone()), (header::CACHE_CONTROL, "private, no-cache".to_owned())];
    if known.is_some_and(|known| known.split(',').any(|one| one.trim().trim_start_matches("W/") == tag)) {
        return (StatusCode::NOT_MODIFIED, caching).into_response();
    }
    ([(header::CONTENT_TYPE, media_type)], caching, body).into_response()
}

/// The problem of a conflicting change by another client.
pub(crate) fn changed(what: &str, revision: u64) -> ApiError {
    let detail = format!("{what} was changed meanwhile; its revision is {revision} now.");
    ApiError::new(StatusCode::PRECONDITION_FAILED, "changed", detail)
        .hint("Read it again, then change it with that revision.")
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::http::HeaderValue;

    #[test]
    fn a_revision_is_read_from_its_quotes() {
        let with = |name, value: &'static str| {
            read(&HeaderMap::from_iter([(name, HeaderValue::from_static(value))]))
                .map_err(|e| e.problem().status)
        };
        assert_eq!(with(header::IF_MATCH, "\"12\""), Ok(Read(Some(12))));
        assert_eq!(with(header::IF_MATCH, "*"), Ok(Read(None)));
        assert_eq!(with(header::IF_NONE_MATCH, "*"), Ok(Read(Some(0))));
        assert_eq!(with(header::IF_MATCH, "12"), Err(422));
        assert_eq!(with(header::IF_NONE_MATCH, "\"12\""), Err(422));
        assert_eq!(read(&HeaderMap::new()).map_err(|e| e.problem().status), Err(428));
    }
}
