//! `GET events`: a WebSocket on which the server notifies every open page of changes.
//!
//! The server never waits for a page: events go through a bounded channel, and a page that is too slow is asked to read
//! everything again. Messages from a page are ignored, except for the answers to our pings.

use std::time::Duration;

use axum::extract::State;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::http::StatusCode;
use axum::response::Response;
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::ListenToEvents;
use sightline_api::event::Event;
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::problem::{ApiError, ApiResult};
use crate::routes::route::route;
use crate::state::AppState;

/// Maximum size of a message from a page, bytes.
const MESSAGE_LIMIT: usize = 64 << 10;
/// Interval of pings.
const PING_PERIOD: Duration = Duration::from_secs(15);
/// Timeout for silence of a page, and for sending one message.
const SILENCE_TIMEOUT: Duration = Duration::from_secs(40);

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(route::<ListenToEvents>(routes!(listen)))
}

/// Opens a WebSocket on which events arrive as JSON texts.
#[utoipa::path(get, operation_id = "listen_to_events", path = ListenToEvents::PATH, tag = "events", responses(
    (status = 101, description = "From then on every message is one event", body = Event), ApiError))]
async fn listen(
    State(state): State<AppState>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> ApiResult<Response> {
    let upgrade = upgrade.map_err(|_| {
        ApiError::new(StatusCode::UPGRADE_REQUIRED, "websocket", "Events are sent over a WebSocket only.")
    })?;
    let limit = &state.limits().listeners;
    if state.events().receiver_count() >= limit.count() {
        return Err(ApiError::busy().hint(limit.hint("Close some pages.")));
    }
    let events = state.events().subscribe();
    let upgrade = upgrade.max_message_size(MESSAGE_LIMIT).max_frame_size(MESSAGE_LIMIT);
    Ok(upgrade.on_upgrade(move |socket| forward_events(socket, events, state)))
}

/// Sends events to one page until it disconnects.
async fn forward_events(mut socket: WebSocket, mut events: Receiver<Event>, state: AppState) {
    let mut ping = tokio::time::interval(PING_PERIOD);
    let mut last_message = tokio::time::Instant::now();
    let mut queue = state.everything_may_have_changed();
    loop {
        for event in queue.drain(..) {
            let Ok(text) = serde_json::to_string(&event) else { continue };
            if !send(&mut socket, Message::Text(text.into())).await {
                return;
            }
        }
        tokio::select! {
            event = events.recv() => match event {
                Ok(event) => queue.push(event),
                Err(RecvError::Lagged(_)) => queue = state.everything_may_have_changed(),
                Err(RecvError::Closed) => return,
            },
            message = socket.recv() => match message {
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => last_message = tokio::time::Instant::now(),
            },
            _ = ping.tick() => {
                let is_silent = last_message.elapsed() > SILENCE_TIMEOUT;
                if is_silent || !send(&mut socket, Message::Ping(Vec::new().into())).await {
                    return;
                }
            }
        }
    }
}

async fn send(socket: &mut WebSocket, message: Message) -> bool {
    matches!(tokio::time::timeout(SILENCE_TIMEOUT, socket.send(message)).await, Ok(Ok(())))
}
