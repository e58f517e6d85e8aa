//! `…/rerun`: a session as a live Rerun stream.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::StreamRecording;
use sightline_api::wire::{Event, RerunStream};
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::SessionPath;
use crate::jobs::{blocking, lock};
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::rerun_log::LiveStream;
use crate::routes::route::route;
use crate::state::AppState;

/// How many sessions may be streamed at a time; each keeps its history in memory.
const STREAM_LIMIT: usize = 4;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(route::<StreamRecording>(routes!(stream)))
}

/// Streams a session to Rerun while it goes on
///
/// Data and page come from two further ports of this machine, which ask for no token: every program of this
/// machine can read them until the server ends.
#[utoipa::path(post, operation_id = "stream_recording", path = StreamRecording::PATH, tag = "exports", responses((status = 200, body = RerunStream), ApiError))]
async fn stream(
    State(state): State<AppState>,
    SessionPath(live): SessionPath,
) -> ApiResult<Json<RerunStream>> {
    let events = state.events().subscribe();
    let (stream, is_new) = {
        let (state, id) = (state.clone(), live.id.clone());
        blocking(move || open(&state, &id)).await?
    };
    let answer = RerunStream { viewer_url: stream.viewer_url(), stream_url: stream.stream_url() };
    if is_new {
        tokio::spawn(follow(live, stream, events));
    }
    Ok(Json(answer))
}

/// The stream of a session, opened where it is not yet.
fn open(state: &AppState, session: &str) -> ApiResult<(Arc<LiveStream>, bool)> {
    let mut streams = lock(state.streams());
    if let Some(stream) = streams.get(session) {
        return Ok((Arc::clone(stream), false));
    }
    if streams.len() >= STREAM_LIMIT {
        return Err(ApiError::conflict(format!("{STREAM_LIMIT} sessions are streamed already.")));
    }
    let stream = Arc::new(LiveStream::start()?);
    streams.insert(session.to_owned(), Arc::clone(&stream));
    Ok((stream, true))
}

/// Brings the stream up to the session whenever that went on.
async fn follow(live: Arc<LiveSession>, stream: Arc<LiveStream>, mut events: Receiver<Event>) {
    loop {
        let (live_now, stream_now) = (Arc::clone(&live), Arc::clone(&stream));
        let logged = blocking(move || {
            let (session, traverse) = (live_now.with(|session| session.clone()), &live_now.traverse.traverse);
            Ok(stream_now.log_session(&traverse.index().name, traverse, &session)?)
        });
        if let Err(error) = logged.await {
            tracing::warn!("the Rerun stream: {}", crate::printable::printable(&error.problem().detail));
        }
        loop {
            match events.recv().await {
                Ok(Event::SessionRemoved { session }) if session == live.id => return,
                Ok(Event::SessionChanged { session } | Event::RunProgress { session, .. })
                    if session != live.id => {}
                Ok(
                    Event::SessionRemoved { .. }
                    | Event::TraverseRemoved { .. }
                    | Event::CursorMoved { .. }
                    | Event::RenderProgress { .. }
                    | Event::StudyProgress { .. }
                    | Event::TrackabilityProgress { .. }
                    | Event::NotesChanged { .. },
                ) => {}
                Ok(_) | Err(RecvError::Lagged(_)) => break,
                Err(RecvError::Closed) => return,
            }
        }
    }
}
