//! The server of Sightline: sessions over HTTP and WebSocket, the page, Rerun recordings, and the command line.
//!
//! ```text
//! page or script ──► guard ──► routes (one file each) ──► live sessions ──► core/session
//!                                         │                        ▲
//!                                         └──► jobs ──► runner ────┘ one step at a time
//! ```
//!
//! Suggested reading order: [`state`] (shared by the handlers), `live_session`, `runner` and `rendering` (computation of
//! runs and images), `jobs` and `store` (threads and files), `guard`, `extract` and `problem` (before and after every
//! handler), then `routes` (one file per resource), and [`cli`].
//!
//! Invariants: the reactor computes nothing; GET changes nothing but caches; names in paths never become file names; every
//! number comes from `core::session::track`, for REST and the command line.

pub mod state;
mod live_session;
mod sessions;
mod shared_world;
pub mod first_session;
mod recorded_step;
mod runner;
mod rendering;
pub mod naming;
mod identity;
mod folders;
mod commanded_drive;
mod drives;
mod import_session;
mod imports;
mod recordings;
mod uploads;
mod questions;
mod trackability_maps;
mod odometry_tables;
mod clock;
mod cancel;
pub mod limits;
mod step_memory;
mod memory;
mod jobs;
mod stopwatch;
mod store;
mod streams;
pub mod hosts;
pub mod access;
mod guard;
pub mod public_url;
mod connections;
mod request_id;
mod idempotency;
mod extract;
mod printable;
mod priority;
mod request_priority;
mod problem;
mod version;
mod revision;
mod routes;
mod columns;
mod exports;
mod html;
pub mod rerun_log;
pub mod study;
pub mod cli;

use std::sync::Arc;

use axum::Router;
use axum::middleware;
use axum::response::{IntoResponse, Response};
use tower_http::catch_panic::CatchPanicLayer;

use crate::problem::ApiError;
use crate::routes::{openapi, page};
use crate::state::AppState;

/// The whole server as a `Router` from requests to answers.
pub fn app(state: AppState) -> Router {
    let (api, _) = openapi::router().split_for_parts();
    let api = api.fallback(no_route).method_not_allowed_fallback(page::wrong_method);
    let api = api.layer(middleware::from_fn_with_state(Arc::clone(state.repeated()), idempotency::once));
    let (access, limits) = (state.access().clone(), Arc::clone(state.limits()));
    let requests = Arc::clone(state.requests());
    let public = access.public().cloned();
    let whole = Router::new()
        .nest("/api/v1", api)
        .fallback(page::serve)
        .with_state(state)
        .layer(axum::Extension(limits))
        .layer(CatchPanicLayer::custom(panicked))
        .layer(middleware::from_fn_with_state(requests, request_priority::count))
        .layer(middleware::from_fn_with_state(access, guard::guard));
    match public {
        // Layers run after the routing of their router, so an outer router is needed to change the path.
        Some(public) => Router::new()
            .fallback_service(whole)
            .layer(middleware::from_fn_with_state(public, public_url::mount)),
        None => whole,
    }
}

async fn no_route() -> ApiError {
    ApiError::not_found("There is no such route.").hint("api/v1/openapi.json lists all of them.")
}

// tower-http requires this signature.
#[allow(clippy::needless_pass_by_value)]
fn panicked(panic: Box<dyn std::any::Any + Send + 'static>) -> Response {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    ApiError::internal(format!("a handler panicked: {}", text.unwrap_or("no message"))).into_response()
}
