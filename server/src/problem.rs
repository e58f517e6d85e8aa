//! What can go wrong with a request, as `application/problem+json` (RFC 9457).
//!
//! What the person may see and what the log gets are different strings: a fault of the program says only
//! that it happened, and its cause goes to the log.

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
    // In a box, because every result of a handler has room for it.
    problem: Box<Problem>,
    place: Option<Box<ProblemPlace>>,
    log: Option<String>,
}

/// The result of a handler.
pub(crate) type ApiResult<T> = Result<T, ApiError>;

impl ApiError {
    /// A problem of that status; `code` is its stable name for programs.
    pub fn new(status: StatusCode, code: &str, detail: impl Into<String>) -> Self {
        let title = status.canonical_reason().unwrap_or("Problem");
        let problem = Box::new(Problem::new(status.as_u16(), code, title, detail));
        Self { problem, place: None, log: None }
    }

    /// Adds how to mend it.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.problem.hint = Some(hint.into());
        self
    }

    /// Adds the nearest pixel that would do.
    #[must_use]
    pub fn nearest_pixel(mut self, pixel: Pixel) -> Self {
        self.problem.nearest_pixel = Some(Box::new(pixel));
        self
    }

    /// Says which characters of which field are at fault.
    #[must_use]
    pub fn place(mut self, field: &str, from: usize, to: usize) -> Self {
        let position = TextRange { from, to };
        self.place = Some(Box::new(ProblemPlace { field: field.to_owned(), position }));
        self
    }

    /// There is nothing of that name.
    pub(crate) fn not_found(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::NOT_FOUND, "not_found", detail)
    }

    /// The request can be read but not be carried out.
    pub fn invalid(code: &str, detail: impl Into<String>) -> Self {
        Self::new(StatusCode::UNPROCESSABLE_ENTITY, code, detail)
    }

    /// The state of things does not allow it now.
    pub(crate) fn conflict(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::CONFLICT, "conflict", detail)
    }

    /// It is being made: the same request succeeds soon.
    pub(crate) fn awaited(detail: impl Into<String>) -> Self {
        Self::new(StatusCode::ACCEPTED, "awaited", detail)
    }

    /// The request may not come from there.
    pub(crate) fn forbidden(code: &str, detail: impl Into<String>) -> Self {
        Self::new(StatusCode::FORBIDDEN, code, detail)
    }

    /// Too much is waiting already.
    pub(crate) fn busy() -> Self {
        Self::new(StatusCode::SERVICE_UNAVAILABLE, "busy", "The server has too much to do already.")
            .hint("Wait until some of it is done, or cancel a run.")
    }

    /// As many things as the limit allows are busy already.
    pub(crate) fn full(limit: &Limit) -> Self {
        Self::busy().hint(limit.hint("Wait until some of it is done, or cancel some."))
    }

    /// A computation took longer than the limit allows.
    pub(crate) fn too_long(limit: &Limit) -> Self {
        let detail = format!("The step took longer than {} s.", limit.count());
        Self::invalid("too_long", detail).hint(limit.raise())
    }

    /// A fault of the program; `cause` goes to the log only.
    pub(crate) fn internal(cause: impl Into<String>) -> Self {
        let detail = "The server met a fault of its own; its log says more.";
        let problem = Self::new(StatusCode::INTERNAL_SERVER_ERROR, "internal", detail);
        Self { log: Some(cause.into()), ..problem }
    }

    /// The same problem about something that the path names.
    #[must_use]
    pub(crate) fn about_path(self) -> Self {
        if self.problem.status == StatusCode::UNPROCESSABLE_ENTITY.as_u16() {
            Self::not_found(self.problem.detail)
        } else {
            self
        }
    }

    /// What the person may see.
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

/// How to mend a write that failed.
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
            // The place is an extension member of the problem, as RFC 9457 has it.
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

/// The answer of every route when it cannot do what was asked, for the OpenAPI document.
impl IntoResponses for ApiError {
    fn responses() -> Responses {
        documented("default", "What is wrong and how to mend it", Ref::from_schema_name("Problem"))
    }
}

/// The answer to an expression that cannot be used, for the OpenAPI document: with its place where that is at fault.
pub(crate) struct ExpressionRefusal;

impl IntoResponses for ExpressionRefusal {
    fn responses() -> Responses {
        let forms = ["ExpressionProblem", "Problem"].map(Ref::from_schema_name);
        let schema = forms.into_iter().fold(AnyOfBuilder::new(), AnyOfBuilder::item).build();
        documented("422", "What is wrong with the expression, and where", Schema::AnyOf(schema))
    }
}

/// Answers of a status, as problems.
type Responses = std::collections::BTreeMap<String, RefOr<utoipa::openapi::Response>>;

fn documented(status: &str, description: &str, schema: impl Into<RefOr<Schema>>) -> Responses {
    let content = ContentBuilder::new().schema(Some(schema)).build();
    let response = ResponseBuilder::new().description(description).content(PROBLEM_JSON, content).build();
    [(status.to_owned(), RefOr::T(response))].into()
}
