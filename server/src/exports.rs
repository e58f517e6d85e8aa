//! `…/export.rrd` and `…/rerun`: a session as a Rerun recording, to keep or to watch.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use sightline_core::session::Session;
use sightline_core::session::wire::{Event, RerunStream};
use tempfile::TempDir;
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;
use tokio_util::io::ReaderStream;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::Path;
use crate::jobs::{blocking, lock};
use crate::live::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::rerun_log::{self, LiveStream, RunLog};
use crate::state::AppState;
use crate::traverses::{CancelOnDrop, FileBytes};

/// How many sessions may be streamed at a time; each keeps its history in memory.
const STREAM_LIMIT: usize = 4;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(export)).routes(routes!(stream))
}

/// A session as a Rerun recording
#[utoipa::path(get, operation_id = "export_recording", path = "/sessions/{session}/export.rrd", tag = "exports", params(("session" = String, Path)),
    responses((status = 200, content_type = "application/octet-stream", body = FileBytes), ApiError))]
async fn export(State(state): State<AppState>, Path(session): Path<String>) -> ApiResult<Response> {
    let live = state.session(&session)?;
    let name = format!("sightline-{}.rrd", live.id);
    let cancel = CancelOnDrop::default();
    let flag = cancel.flag();
    let (file, folder) = state.exports().run(move || write(&live, &flag)).await?;
    let headers = [
        (header::CONTENT_TYPE, "application/octet-stream".to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
    ];
    // The folder is removed when the last byte was sent or the request went away.
    let file = KeptFile { file: tokio::fs::File::from_std(file), _folder: folder };
    Ok((headers, Body::from_stream(ReaderStream::with_capacity(file, 1 << 16))).into_response())
}

/// Streams a session to Rerun while it goes on
///
/// Data and page come from two further ports of this machine, which ask for no token: every program of this
/// machine can read them until the server ends.
#[utoipa::path(post, operation_id = "stream_recording", path = "/sessions/{session}/rerun", tag = "exports", params(("session" = String, Path)),
    responses((status = 200, body = RerunStream), ApiError))]
async fn stream(State(state): State<AppState>, Path(session): Path<String>) -> ApiResult<Json<RerunStream>> {
    let live = state.session(&session)?;
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

/// Writes the recording into a temporary folder.
fn write(live: &LiveSession, cancel: &AtomicBool) -> ApiResult<(std::fs::File, TempDir)> {
    let internal = |error: std::io::Error| ApiError::internal(format!("cannot write a recording: {error}"));
    let folder = tempfile::tempdir().map_err(internal)?;
    let path = folder.path().join("session.rrd");
    let session = live.with(|session| session.clone());
    let mut progress = |_, _| {
        if cancel.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let traverse = &live.traverse.traverse;
    rerun_log::export(&path, &traverse.index().name, traverse, &runs(&session), &mut progress)?;
    Ok((std::fs::File::open(&path).map_err(internal)?, folder))
}

/// The runs of a session as the recording takes them.
fn runs(session: &Session) -> Vec<RunLog<'_>> {
    let live = session.targets.iter().enumerate().filter(|(_, record)| !record.removed);
    let of_target = live.flat_map(|(target, record)| {
        let runs = record.runs.iter().enumerate().filter(|(_, run)| !run.removed && !run.steps.is_empty());
        runs.map(move |(number, run)| RunLog { target, run: number, label: &record.label, steps: &run.steps })
    });
    of_target.collect()
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
            tracing::warn!("the Rerun stream: {}", crate::plain(&error.problem().detail));
        }
        loop {
            match events.recv().await {
                Ok(Event::SessionChanged { session } | Event::RunProgress { session, .. })
                    if session != live.id => {}
                Ok(
                    Event::RenderProgress { .. }
                    | Event::StudyProgress { .. }
                    | Event::TrackabilityProgress { .. },
                ) => {}
                Ok(_) | Err(RecvError::Lagged(_)) => break,
                Err(RecvError::Closed) => return,
            }
        }
    }
}

/// An open file with the temporary folder in which it lies.
struct KeptFile {
    file: tokio::fs::File,
    _folder: TempDir,
}

impl tokio::io::AsyncRead for KeptFile {
    fn poll_read(
        mut self: std::pin::Pin<&mut Self>,
        context: &mut std::task::Context<'_>,
        buffer: &mut tokio::io::ReadBuf<'_>,
    ) -> std::task::Poll<std::io::Result<()>> {
        std::pin::Pin::new(&mut self.file).poll_read(context, buffer)
    }
}
