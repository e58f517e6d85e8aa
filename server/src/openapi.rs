//! All routes with their description: the OpenAPI document is made from the very router that answers.

use std::sync::LazyLock;

use axum::http::header;
use axum::response::IntoResponse;
use sightline_core::session::wire::{Event, Problem};
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::state::AppState;
use crate::{
    about, breakpoints, compare, documents, events, exports, expressions, notes, photometry, plain,
    questions, removal, runs, sessions, settings, steps, studies, targets, trackability, traverses, what_if,
    why,
};

#[derive(OpenApi)]
#[openapi(
    info(title = "Sightline", description = "Sessions of the visual debugger for rover target tracking. \
        Units are in the names of fields (`_px`, `_m`, `_deg`, `_s`); `a_from_b` takes points of frame b into \
        frame a; pixel (0, 0) is the centre of the first pixel; what is not known is null."),
    servers((url = "/api/v1")),
    components(schemas(Problem, Event))
)]
struct Document;

static JSON: LazyLock<String> =
    LazyLock::new(|| router().into_openapi().to_json().unwrap_or_else(|error| error.to_string()));

/// The routes below `/api/v1`.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::with_openapi(Document::openapi())
        .merge(about::router())
        .routes(routes!(document))
        .merge(settings::router())
        .merge(traverses::router())
        .merge(sessions::router())
        .merge(targets::router())
        .merge(runs::router())
        .merge(photometry::router())
        .merge(compare::router())
        .merge(steps::router())
        .merge(exports::router())
        .merge(studies::router())
        .merge(notes::router())
        .merge(documents::router())
        .merge(plain::router())
        .merge(events::router())
        .merge(trackability::router())
        .merge(what_if::router())
        .merge(why::router())
        .merge(questions::router())
        .merge(removal::router())
        .merge(breakpoints::router())
        .merge(expressions::router())
}

/// This document
#[utoipa::path(get, operation_id = "show_openapi", path = "/openapi.json", tag = "about", responses(
    (status = 200, description = "The OpenAPI document", body = serde_json::Value)))]
async fn document() -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "application/json")], JSON.as_str())
}
