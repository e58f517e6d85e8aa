//! `…/rerun`: a session as a live Rerun recording, with the same token and on the same port as everything else.
//!
//! Rerun's own stream (gRPC) has no token and does not check its Host, accepts messages from any sender, and its address
//! cannot contain a path. Its viewer also reads recordings over HTTP while they grow, which these routes serve.

use std::convert::Infallible;
use std::sync::{Arc, Mutex};

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use sightline_api::endpoint::{self, Endpoint, NoQuery};
use sightline_api::endpoints::{CloseRecording, ReadRecording, ShowRerunViewer, StreamRecording};
use sightline_api::event::Event;
use sightline_api::location::{AtSession, AtViewerFile};
use sightline_api::wire::RerunStream;
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::commanded_drive;
use crate::extract::{Path, SessionPath};
use crate::jobs::{blocking, lock};
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::rerun_log::{LiveRecording, page};
use crate::routes::route::route;
use crate::routes::traverses::FileBytes;
use crate::state::AppState;
use crate::streams::Viewing;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<StreamRecording>(routes!(open)))
        .routes(route::<CloseRecording>(routes!(close)))
        .routes(route::<ReadRecording>(routes!(read)))
        .routes(route::<ShowRerunViewer>(routes!(viewer_file)))
}

/// Opens the live Rerun stream of a session
///
/// It stays open until it is closed, the session is removed, or the server ends.
#[utoipa::path(post, operation_id = "stream_recording", path = StreamRecording::PATH, tag = "exports", responses((status = 200, body = RerunStream), ApiError))]
async fn open(State(state): State<AppState>, SessionPath(live): SessionPath) -> ApiResult<Json<RerunStream>> {
    let session = live.id.clone();
    state.streams().open(&session)?;
    let viewer = AtViewerFile { file: page::PAGE.to_owned() };
    let viewer = endpoint::path::<ShowRerunViewer>(&viewer, &NoQuery {});
    let viewer_path = format!("{viewer}?session={session}&hide_welcome_screen&persist=false");
    let stream_path = endpoint::path::<ReadRecording>(&AtSession { session }, &NoQuery {});
    Ok(Json(RerunStream { viewer_path, stream_path }))
}

/// Closes the live Rerun stream of a session
///
/// Viewers keep the data received so far.
#[utoipa::path(delete, operation_id = "close_recording", path = CloseRecording::PATH, tag = "exports", responses((status = 204), ApiError))]
async fn close(State(state): State<AppState>, SessionPath(live): SessionPath) -> ApiResult<StatusCode> {
    let not_open = || ApiError::not_found("This session is not streamed to Rerun.");
    state.streams().close(&live.id).then_some(StatusCode::NO_CONTENT).ok_or_else(not_open)
}

/// The live Rerun stream of a session
///
/// An endless `.rrd` file: all steps so far, and each further step when it is computed.
#[utoipa::path(get, operation_id = "read_recording", path = ReadRecording::PATH, tag = "exports",
    responses((status = 200, content_type = "application/octet-stream", body = FileBytes), ApiError))]
async fn read(State(state): State<AppState>, SessionPath(live): SessionPath) -> ApiResult<Response> {
    let viewing = state.streams().view(&live.id)?;
    let events = state.events().subscribe();
    let recording = blocking(|| Ok(LiveRecording::start()?)).await?;
    let recording = Arc::new(Mutex::new(recording));
    let reader = Reader { live, recording, events, viewing };
    let bytes = stream::unfold(reader, |mut reader| async move {
        let bytes = reader.next().await?;
        Some((Ok::<_, Infallible>(bytes), reader))
    });
    let headers = [
        (header::CONTENT_TYPE, "application/octet-stream"),
        // A buffering proxy would delay the newest step.
        (header::HeaderName::from_static("x-accel-buffering"), "no"),
    ];
    Ok((headers, Body::from_stream(bytes)).into_response())
}

/// A file of Rerun's web viewer
#[utoipa::path(get, operation_id = "show_rerun_viewer", path = ShowRerunViewer::PATH, tag = "exports",
    responses((status = 200, content_type = "application/octet-stream", body = FileBytes), ApiError))]
async fn viewer_file(Path(AtViewerFile { file }): Path<ShowRerunViewer>) -> ApiResult<Response> {
    let found = page::file(&file).map_err(|error| ApiError::internal(error.to_string()))?;
    found.ok_or_else(|| ApiError::not_found("The viewer has no such file."))
}

/// One viewer of a session. The next bytes are computed when the connection can accept them.
struct Reader {
    live: Arc<LiveSession>,
    recording: Arc<Mutex<LiveRecording>>,
    events: Receiver<Event>,
    viewing: Viewing,
}

impl Reader {
    /// The next bytes, as soon as the session has changed; `None` when the stream is closed.
    async fn next(&mut self) -> Option<Vec<u8>> {
        let closed = self.viewing.closed.clone();
        while !closed.is_cancelled() {
            match self.advance().await {
                Ok(bytes) if bytes.is_empty() => {}
                Ok(bytes) => return Some(bytes),
                Err(error) => {
                    let detail = &error.problem().detail;
                    tracing::warn!("the Rerun stream ended: {}", crate::printable::printable(detail));
                    return None;
                }
            }
            tokio::select! {
                () = closed.cancelled() => return None,
                goes_on = self.changed() => if !goes_on { return None },
            }
        }
        None
    }

    /// Logs the next steps; the result is empty if the recording is up to date.
    async fn advance(&self) -> ApiResult<Vec<u8>> {
        let (live, recording) = (Arc::clone(&self.live), Arc::clone(&self.recording));
        blocking(move || {
            let (session, open) = (live.with(|session| session.clone()), live.traverse());
            let traverse = &open.traverse;
            let drive = commanded_drive::log(&live);
            Ok(lock(&recording).advance(&traverse.index().name, traverse, &session, drive.as_ref())?)
        })
        .await
    }

    /// Waits until the session may have changed; false if the session was removed.
    async fn changed(&mut self) -> bool {
        loop {
            match self.events.recv().await {
                Ok(Event::SessionRemoved { session }) if session == self.live.id => return false,
                Ok(Event::SessionChanged { session } | Event::RunProgress { session, .. }) => {
                    if session == self.live.id {
                        return true;
                    }
                }
                Ok(_) => {}
                Err(RecvError::Lagged(_)) => return true,
                Err(RecvError::Closed) => return false,
            }
        }
    }
}
