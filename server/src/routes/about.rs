//! `GET version` and `GET health`: version and status of the program.

use axum::Json;
use axum::extract::State;
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{ShowHealth, ShowVersion};
use sightline_api::program::{Health, Limits, Version};
use sightline_session::progress::SAVED_FORMAT;
use sightline_world::traverse::FORMAT_VERSION;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::routes::route::route;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ShowVersion>(routes!(version)))
        .routes(route::<ShowHealth>(routes!(health)))
}

/// The name and version of the program
#[utoipa::path(get, operation_id = "show_version", path = ShowVersion::PATH, tag = "about", responses((status = 200, body = Version)))]
async fn version(State(state): State<AppState>) -> Json<Version> {
    let limits = state.limits();
    Json(Version {
        name: "sightline".to_owned(),
        version: crate::version::VERSION.to_owned(),
        traverse_format: FORMAT_VERSION,
        session_format: SAVED_FORMAT,
        limits: Limits {
            body_bytes: limits.body_bytes.count(),
            targets: limits.targets.count(),
            runs: limits.runs.count(),
        },
    })
}

/// The health of the server
#[utoipa::path(get, operation_id = "show_health", path = ShowHealth::PATH, tag = "about", responses((status = 200, body = Health)))]
async fn health(State(state): State<AppState>) -> Json<Health> {
    Json(Health { status: "ok".to_owned(), notices: state.notices(), usage: state.usage() })
}
