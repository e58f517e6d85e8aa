//! Errors of requests as `application/problem+json` (RFC 9457).
//!
//! The user and the log get different strings: for an internal error, the answer reports only that it happened; the cause
//! goes to the log.

use crate::limits::Limit;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use sightline_api::wire::{ExpressionProblem, Problem, ProblemPlace, TextRange};
use sightline_geometry::error::Error;
use sightline_geometry::frames::Pixel;
use utoipa::IntoResponses;
use utoipa::openapi::schema::AnyOfBuilder;
use utoipa::openapi::{ContentBuilder, Ref, RefOr, ResponseBuilder, Schema};

/// The media type of problems.
pub(crate) const PROBLEM_JSON: &str = "application/problem+json";

/// A request that cannot be answered.
#[derive(Clone, Debug, PartialEq)]
pub struct ApiError {
    // Boxed, because every result of a handler reserves space for it.
    problem: Box<Problem>,
    place: Option<Box<ProblemPlace>>,
    log: Option<String>,
}

/// The result of a handler.
pub(crate) type ApiResult<T> = Result<T, ApiError>;

impl ApiError {
    /// A problem with that status; `code` is its stable name for programs.
    pub fn new(status: StatusCode, code: &str, detail: impl Into<String>) -> Self {
        let title = status.canonical_reason().unwrap_or("Problem");
        let problem = Box::new(Problem::new(status.as_u16(), code, title, detail));
        Self { problem, place: None, log: None }
    }

    /// Adds advice on how to resolve it.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.problem.hint = Some(hint.into());
        self
    }

    /// Adds the nearest valid pixel.
    #[must_use]
    pub fn nearest_pixel(mut self, pixel: Pixel) -> Self {
        self.problem.nearest_pixel = Some(Box::new(pixel));
        self
    }

    /// Adds the invalid range of characters in a field.
    #[must_use]
    pub(crate) fn with_range(mut self, field: &str, from: usize, to: usize) -> Self {
        let position = TextRange { from, to };
        self.place = Some(Box::new(ProblemPlace { field: field.to_owned(), position }));
        self
    }

    /// The named resource does not exist.
    pub(crate) fn not_found(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, "not_found", detail)
    }

    /// The request is well-formed but cannot be processed.
    pub fn invalid(code: &str, detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, code, detail)
    }

    /// The current state does not allow the request.
    pub(crate) fn conflict(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::CONFLICT, "conflict", detail)
    }

    /// The result is being prepared: the same request succeeds soon.
    pub(crate) fn awaited(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::ACCEPTED, "awaited", detail)
    }

    /// Requests from this origin are not allowed.
    pub(crate) fn forbidden(code: &str, detail: impl Into<String>) -> Self {
        Self::new(StatusCode::FORBIDDEN, code, detail)
    }

    /// The queue is full.
    pub(crate) fn busy() -> Self {
        Self::new(StatusCode::SERVICE_UNAVAILABLE, "busy", "The server has too much to do already.")
            .hint("Wait until some of it is done, or cancel a run.")
    }

    /// The number of jobs has reached the limit.
    pub(crate) fn full(limit: &Limit) -> Self {
        Self::busy().hint(limit.hint("Wait until some of it is done, or cancel some."))
    }

    /// A computation exceeded its time limit.
    pub(crate) fn too_long(limit: &Limit) -> Self {
        let detail = format!("The step took longer than {} s.", limit.count());
        Self::invalid("too_long", detail).hint(limit.raise())
    }

    /// An internal error; `cause` goes to the log only.
    pub(crate) fn internal(cause: impl Into<String>) -> Self {
        let detail = "The server met a fault of its own; its log says more.";
        let problem = Self::new(StatusCode::INTERNAL_SERVER_ERROR, "internal", detail);
        Self { log: Some(cause.into()), ..problem }
    }

    /// Converts an invalid request (422) to 404, for a problem with a name in the path.
    #[must_use]
    pub(crate) fn about_path(self) -> Self {
        if self.problem.status == StatusCode::UNPROCESSABLE_ENTITY.as_u16() {
            Self::not_found(self.problem.detail)
        } else {
            self
        }
    }

    /// The part that is sent to the user.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }
}

impl From<Error> for ApiError {
    fn from(error: Error) -> Self {
        let detail = error.to_string();
        match error {
            Error::Setting { .. } => Self::invalid("setting", detail),
            Error::Target(_) => Self::invalid("target", detail),
            Error::Request(_) => Self::invalid("request", detail),
            Error::Read { .. } | Error::Format { .. } => Self::invalid("file", detail),
            Error::Cancelled => Self::conflict(detail),
            Error::Write { source, .. } => {
                let status = StatusCode::INSUFFICIENT_STORAGE;
                let problem = Self::new(status, "write", detail.clone()).hint(hint_for(&source));
                Self { log: Some(detail), ..problem }
            }
        }
    }
}

/// Advice on how to resolve a failed write.
fn hint_for(source: &std::io::Error) -> &'static str {
    use std::io::ErrorKind;
    match source.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge => {
            "Make room on the disk and try again; nothing of this change was kept."
        }
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            "Make the server's folder writable and try again; nothing of this change was kept."
        }
        _ => "Check the disk of the server's folder and try again; nothing of this change was kept.",
    }
}

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        if let Some(cause) = &self.log {
            tracing::error!(code = self.problem.code, "{}", crate::printable::printable(cause));
        }
        let status = StatusCode::from_u16(self.problem.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let mut response = match self.place {
            // The place is an extension member of the problem, as RFC 9457 permits.
            Some(place) => {
                let whole = ExpressionProblem { problem: *self.problem, place: *place };
                (status, axum::Json(whole)).into_response()
            }
            None => (status, axum::Json(self.problem.as_ref())).into_response(),
        };
        response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(PROBLEM_JSON));
        if status == StatusCode::UNAUTHORIZED {
            response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        if status == StatusCode::SERVICE_UNAVAILABLE {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from_static("2"));
        }
        response
    }
}

/// The default error response of every route, for the OpenAPI document.
impl IntoResponses for ApiError {
    fn responses() -> Responses {
        documented("default", "What is wrong and how to mend it", Ref::from_schema_name("Problem"))
    }
}

/// The response to an invalid expression, for the OpenAPI document: with the position of the error if the expression is at
/// fault.
pub(crate) struct ExpressionRefusal;

impl IntoResponses for ExpressionRefusal {
    fn responses() -> Responses {
        let forms = ["ExpressionProblem", "Problem"].map(Ref::from_schema_name);
        let schema = forms.into_iter().fold(AnyOfBuilder::new(), AnyOfBuilder::item).build();
        documented("422", "What is wrong with the expression, and where", Schema::AnyOf(schema))
    }
}

/// Responses by status.
type Responses = std::collections::BTreeMap<String, RefOr<utoipa::openapi::Response>>;

fn documented(status: &str, description: &str, schema: impl Into<RefOr<Schema>>) -> Responses {
    let content = ContentBuilder::new().schema(Some(schema)).build();
    let response = ResponseBuilder::new().description(description).content(PROBLEM_JSON, content).build();
    [(status.to_owned(), RefOr::T(response))].into()
}
