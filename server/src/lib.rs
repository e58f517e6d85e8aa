//! The server of Sightline: sessions over HTTP and WebSocket, the page, Rerun recordings, and the command line.
//!
//! ```text
//! page or script ──► guard ──► routes (one file each) ──► live sessions ──► core/session
//!                                         │                        ▲
//!                                         └──► jobs ──► runner ────┘ one step at a time
//! ```
//!
//! The order in which to read: [`state`] (what the handlers share), `live_session`, `runner` and `rendering` (how
//! runs and images come about), `jobs` and `store` (threads and files), `guard`, `extract` and
//! `problem` (what comes before and after every handler), then `routes` (one file a resource), and [`cli`].
//!
//! Invariants: the reactor computes nothing; GET changes nothing but what can be computed again; names in paths
//! never become names of files; every number comes from `core::session::track`, for REST and command line alike.

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
mod driven;
mod drives;
mod brought;
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
mod requests_first;
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

/// The whole server as a function from requests to answers.
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
        .layer(middleware::from_fn_with_state(requests, requests_first::count))
        .layer(middleware::from_fn_with_state(access, guard::guard));
    match public {
        // Layers come after the routing of their router, so that another one around it changes the path.
        Some(public) => Router::new()
            .fallback_service(whole)
            .layer(middleware::from_fn_with_state(public, public_url::mount)),
        None => whole,
    }
}

async fn no_route() -> ApiError {
    ApiError::not_found("There is no such route.").hint("api/v1/openapi.json lists all of them.")
}

// The signature is that of tower-http.
#[allow(clippy::needless_pass_by_value)]
fn panicked(panic: Box<dyn std::any::Any + Send + 'static>) -> Response {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    ApiError::internal(format!("a handler panicked: {}", text.unwrap_or("no message"))).into_response()
}
