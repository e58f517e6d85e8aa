//! The server of Sightline: sessions over HTTP and WebSocket, the page, Rerun recordings, and the command line.
//!
//! ```text
//! page or script ──► guard ──► resources (one file each) ──► live sessions ──► core::session
//!                                         │                        ▲
//!                                         └──► jobs ──► runner ────┘ one step at a time
//! ```
//!
//! The order in which to read: [`state`] (what the handlers share), [`live`], [`runner`] and [`rendering`] (how
//! runs and images come about), [`jobs`] and [`store`] (threads and files), [`guard`], [`extract`] and
//! [`problem`] (what comes before and after every handler), then the resources, and [`cli`].
//!
//! Invariants: the reactor computes nothing; GET changes nothing but what can be computed again; names in paths
//! never become names of files; every number comes from `core::session::track`, for REST and command line alike.

pub mod state;
pub mod live;
pub mod runner;
pub mod rendering;
pub mod drives;
pub mod jobs;
pub mod store;
pub mod guard;
mod request_id;
pub mod extract;
pub mod problem;
pub mod about;
pub mod settings;
pub mod traverses;
pub mod sessions;
pub mod targets;
pub mod runs;
pub mod steps;
pub mod columns;
pub mod photometry;
pub mod compare;
pub mod exports;
pub mod studies;
pub mod notes;
pub mod documents;
pub mod revision;
pub mod html;
pub mod plain;
pub mod breakpoints;
pub mod expressions;
pub mod events;
pub mod trackability;
pub mod first;
pub mod asked;
pub mod questions;
pub mod removal;
pub mod what_if;
pub mod why;
pub mod openapi;
pub mod page;
pub mod rerun_log;
pub mod study;
pub mod cli;

use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::http::StatusCode;
use axum::middleware;
use axum::response::{IntoResponse, Response};
use tower_http::catch_panic::CatchPanicLayer;

use crate::problem::ApiError;
use crate::state::AppState;

/// The whole server as a function from requests to answers.
pub fn app(state: AppState) -> Router {
    let (api, _) = openapi::router().split_for_parts();
    let api = api.fallback(no_route).method_not_allowed_fallback(wrong_method);
    let hosts = state.hosts().clone();
    Router::new()
        .nest("/api/v1", api)
        .fallback(page::serve)
        .with_state(state)
        .layer(DefaultBodyLimit::max(extract::BODY_LIMIT))
        .layer(CatchPanicLayer::custom(panicked))
        .layer(middleware::from_fn_with_state(hosts, guard::guard))
}

/// `text` without control characters, so that what comes from outside cannot write lines of its own into the log.
pub fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

async fn no_route() -> ApiError {
    ApiError::not_found("There is no such route.").hint("api/v1/openapi.json lists all of them.")
}

pub(crate) async fn wrong_method() -> ApiError {
    ApiError::new(StatusCode::METHOD_NOT_ALLOWED, "method", "This route does not know that method.")
}

// The signature is that of tower-http.
#[allow(clippy::needless_pass_by_value)]
fn panicked(panic: Box<dyn std::any::Any + Send + 'static>) -> Response {
    let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    ApiError::internal(format!("a handler panicked: {}", text.unwrap_or("no message"))).into_response()
}
