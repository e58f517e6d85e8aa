//! `documents`: small documents that the page stores next to the sessions, such as arrangements of panels.

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{ListDocuments, PutDocument, RemoveDocument, ShowDocument};
use sightline_api::location::AtDocument;
use sightline_session::documents::{DOCUMENT_BYTES, DOCUMENT_LIMIT, Document, is_name};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{Body, Path};
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult};
use crate::revision::{self, Read};
use crate::routes::route::route;
use crate::state::AppState;
use crate::store::Clash;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ListDocuments>(routes!(list)))
        .routes(route::<ShowDocument>(routes!(show)))
        .routes(route::<PutDocument>(routes!(put)))
        .routes(route::<RemoveDocument>(routes!(remove)))
}

/// All documents, by name
#[utoipa::path(get, operation_id = "list_documents", path = ListDocuments::PATH, tag = "documents", responses(
    (status = 200, body = Vec<Document>), ApiError))]
async fn list(State(state): State<AppState>) -> ApiResult<Json<Vec<Document>>> {
    blocking(move || Ok(Json(state.store().documents()?))).await
}

/// A document
#[utoipa::path(get, operation_id = "show_document", path = ShowDocument::PATH, tag = "documents", responses((status = 200, body = Document), ApiError))]
async fn show(
    State(state): State<AppState>,
    Path(AtDocument { name }): Path<ShowDocument>,
) -> ApiResult<Response> {
    blocking(move || {
        let found = state.store().documents()?.into_iter().find(|document| document.name == name);
        Ok(tagged(found.ok_or_else(missing)?))
    })
    .await
}

/// Replaces a document, or adds one
///
/// The header `If-Match` names the revision that was read; `If-None-Match: *` creates a new document.
#[utoipa::path(put, operation_id = "put_document", path = PutDocument::PATH, tag = "documents", params(("If-Match" = Option<String>, Header, pattern = r#"^("[0-9]{1,18}"|\*)$"#, description = "The revision in quotes, or *"),
    ("If-None-Match" = Option<String>, Header, pattern = r"^\*$", description = "* for a new one")),
    request_body = serde_json::Value, responses((status = 200, body = Document), ApiError))]
async fn put(
    State(state): State<AppState>,
    Path(AtDocument { name }): Path<PutDocument>,
    Read(read): Read,
    Body(value): Body<PutDocument>,
) -> ApiResult<Response> {
    if !is_name(&name) {
        let rule =
            "name: must begin with a small letter, then small letters, digits, `-`, `_` and `.`, at most 64";
        return Err(ApiError::invalid("field", rule));
    }
    let size = value.to_string().len();
    if size > DOCUMENT_BYTES {
        let detail = format!("A document may have at most {DOCUMENT_BYTES} bytes, not {size}.");
        return Err(ApiError::new(StatusCode::PAYLOAD_TOO_LARGE, "too_large", detail));
    }
    blocking(move || match state.store().put_document(&name, value, read)? {
        Ok(document) => Ok(tagged(document)),
        Err(clash) => Err(problem(clash)),
    })
    .await
}

/// Removes a document
///
/// The header `If-Match` names the revision that was read.
#[utoipa::path(delete, operation_id = "remove_document", path = RemoveDocument::PATH, tag = "documents", params(("If-Match" = String, Header, pattern = r#"^("[0-9]{1,18}"|\*)$"#, description = "The revision in quotes, or *")), responses((status = 204), ApiError))]
async fn remove(
    State(state): State<AppState>,
    Path(AtDocument { name }): Path<RemoveDocument>,
    Read(read): Read,
) -> ApiResult<StatusCode> {
    blocking(move || match state.store().remove_document(&name, read)? {
        Ok(true) => Ok(StatusCode::NO_CONTENT),
        Ok(false) => Err(missing()),
        Err(clash) => Err(problem(clash)),
    })
    .await
}

fn tagged(document: Document) -> Response {
    (revision::tag(document.revision), Json(document)).into_response()
}

fn missing() -> ApiError {
    ApiError::not_found("There is no such document.")
}

fn problem(clash: Clash) -> ApiError {
    match clash {
        Clash::Full => ApiError::conflict(format!("There are {DOCUMENT_LIMIT} documents already."))
            .hint("Remove one that is not needed any more."),
        Clash::Changed(now) => revision::changed("The document", now.unwrap_or(0)),
    }
}
