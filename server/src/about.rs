//! `GET version` and `GET health`: what this program is, and whether it is well.

use axum::Json;
use axum::extract::State;
use serde::{Deserialize, Serialize};
use sightline_core::session::progress::SAVED_FORMAT;
use sightline_core::traverse::FORMAT_VERSION;
use utoipa::ToSchema;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::BODY_LIMIT;
use crate::live::{RUN_LIMIT, TARGET_LIMIT};
use crate::state::AppState;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(version)).routes(routes!(health))
}

/// What this program is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Version {
    /// The program's name.
    pub name: String,
    /// Its version.
    pub version: String,
    /// The version of the folders of traverses.
    pub traverse_format: u32,
    /// The version of saved sessions.
    pub session_format: u32,
    /// The limits in force.
    pub limits: Limits,
}

/// The limits in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Limits {
    /// The largest body of a request, bytes.
    pub body_bytes: usize,
    /// How many targets a session may have.
    pub targets: usize,
    /// How many runs a target may have.
    pub runs: usize,
}

/// Whether the server is well.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Health {
    /// `ok`.
    pub status: String,
    /// What a person should know about this start of the server, one sentence each.
    pub notices: Vec<String>,
}

/// What this program is
#[utoipa::path(get, operation_id = "show_version", path = "/version", tag = "about", responses((status = 200, body = Version)))]
async fn version() -> Json<Version> {
    Json(Version {
        name: "sightline".to_owned(),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        traverse_format: FORMAT_VERSION,
        session_format: SAVED_FORMAT,
        limits: Limits { body_bytes: BODY_LIMIT, targets: TARGET_LIMIT, runs: RUN_LIMIT },
    })
}

/// Whether the server is well
#[utoipa::path(get, operation_id = "show_health", path = "/health", tag = "about", responses((status = 200, body = Health)))]
async fn health(State(state): State<AppState>) -> Json<Health> {
    Json(Health { status: "ok".to_owned(), notices: state.notices().to_vec() })
}
