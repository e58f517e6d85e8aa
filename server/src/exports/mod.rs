//! `…/exports`: a session as files, for papers, scripts and other programs; and `…/rerun`, the live stream.
//!
//! Every file is made by [`make`], for REST and the command line alike; `kind` lists them. What is made takes its time in a
//! lane of its own, and ends when the request goes away.

pub mod kind;
pub mod source;
pub mod rows;
pub mod picture;
pub mod sheet;
pub mod metrics;
pub mod report;
pub mod bundle;
mod canvas;
pub mod rerun;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use axum::Json;
use axum::body::Body;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use sightline_core::session::exports::ExportEntry;
use tempfile::TempDir;
use tokio_util::io::ReaderStream;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{Params, Path};
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult};
use crate::rerun_log::{self, RunLog};
use crate::state::AppState;
use crate::traverses::{CancelOnDrop, FileBytes};

pub use kind::{Kind, Part};
pub use report::note_html;
pub use sheet::run_letter;
pub use source::Source;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(list)).routes(routes!(file)).merge(rerun::router())
}

/// What was made.
pub enum Made {
    /// In memory.
    Bytes(Vec<u8>),
    /// A file in a folder of its own, which is removed with this value.
    File(std::fs::File, TempDir),
}

/// What a session can be exported as, with sizes and commands
#[utoipa::path(get, operation_id = "list_exports", path = "/sessions/{session}/exports", tag = "exports", params(
    ("session" = String, Path), Part), responses((status = 200, body = Vec<ExportEntry>), ApiError))]
async fn list(
    State(state): State<AppState>,
    Path(session): Path<String>,
    Params(part): Params<Part>,
) -> ApiResult<Json<Vec<ExportEntry>>> {
    let live = state.session(&session)?;
    blocking(move || {
        let source = Source::of(&live);
        source.check(Kind::Csv, part)?;
        Ok(Json(kind::catalogue(&source, part)))
    })
    .await
}

/// A session, or a part of it, as a file
///
/// The work ends when the request goes away.
#[utoipa::path(get, operation_id = "export_file", path = "/sessions/{session}/exports/{file}", tag = "exports", params(
    ("session" = String, Path), ("file" = String, Path, description = "One of the names that the list of exports gives"), Part),
    responses((status = 200, content_type = "application/octet-stream", body = FileBytes), ApiError))]
async fn file(
    State(state): State<AppState>,
    Path((session, file)): Path<(String, String)>,
    Params(part): Params<Part>,
) -> ApiResult<Response> {
    let kind = Kind::from_name(&file).ok_or_else(|| {
        ApiError::not_found(format!("The files are {}.", Kind::ALL.map(Kind::name).join(", ")))
    })?;
    let live = state.session(&session)?;
    let cancel = CancelOnDrop::default();
    let flag = cancel.flag();
    let work = move || {
        let source = Source::of(&live);
        source.check(kind, part)?;
        let part = source.narrowed(kind, part);
        let name = source.file_name(kind, part);
        let mut go_on = |_, _| ControlFlow::Continue(());
        Ok((name, make(&source, kind, part, &flag, &mut go_on)?))
    };
    let (name, made) = state.exports().run(work).await?;
    answer(kind, &name, made).await
}

/// Makes a file; `progress` is told what is done of how much, where that is known.
///
/// # Errors
/// A problem when there is nothing to export, an image cannot be read, or `cancel` was set.
pub fn make(
    source: &Source,
    kind: Kind,
    part: Part,
    cancel: &AtomicBool,
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> ApiResult<Made> {
    let part = source.narrowed(kind, part);
    Ok(match kind {
        Kind::Jsonl => Made::Bytes(rows::jsonl(source, part).into_bytes()),
        Kind::Csv => Made::Bytes(rows::csv(source, part).into_bytes()),
        Kind::Parquet => Made::Bytes(
            rows::parquet(source, part).map_err(|error| ApiError::internal(format!("Parquet: {error}")))?,
        ),
        Kind::Animation => Made::Bytes(sheet::animation(source, part, cancel)?),
        Kind::Sheet => Made::Bytes(sheet::sheet(source, part, cancel)?),
        Kind::Report => Made::Bytes(report::html(source, part, cancel)?.into_bytes()),
        Kind::Bundle => Made::Bytes(bundle::json(source, part).into_bytes()),
        Kind::Recording => recording(source, part, cancel, progress)?,
    })
}

/// A Rerun recording in a temporary folder.
fn recording(
    source: &Source,
    part: Part,
    cancel: &AtomicBool,
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> ApiResult<Made> {
    let internal = |error: std::io::Error| ApiError::internal(format!("cannot write a recording: {error}"));
    let folder = tempfile::tempdir().map_err(internal)?;
    let path = folder.path().join("session.rrd");
    let runs = source.runs(part);
    let runs: Vec<RunLog<'_>> = runs
        .iter()
        .map(|run| RunLog {
            target: run.target,
            run: run.number,
            label: &run.record.label,
            steps: &run.run.steps,
        })
        .collect();
    let mut tell = |k, n| {
        let is_cancelled = cancel.load(Ordering::Relaxed);
        if is_cancelled { ControlFlow::Break(()) } else { progress(k, n) }
    };
    let traverse = &source.open.traverse;
    rerun_log::export(&path, &traverse.index().name, traverse, &runs, &mut tell)?;
    Ok(Made::File(std::fs::File::open(&path).map_err(internal)?, folder))
}

/// The answer that browsers save under `name`, which is made of our own names; its length is known.
async fn answer(kind: Kind, name: &str, made: Made) -> ApiResult<Response> {
    let mut headers = vec![
        (header::CONTENT_TYPE, kind.media_type().to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
    ];
    if kind == Kind::Report {
        headers.push((header::CONTENT_SECURITY_POLICY, crate::html::ALONE.to_owned()));
    }
    let headers = axum::response::AppendHeaders(headers);
    match made {
        Made::Bytes(bytes) => Ok((headers, bytes).into_response()),
        Made::File(file, folder) => {
            let file = tokio::fs::File::from_std(file);
            let length = file.metadata().await.map(|about| about.len());
            let length = length.map_err(|error| ApiError::internal(error.to_string()))?;
            // The folder is removed when the last byte was sent or the request went away.
            let file = KeptFile { file, _folder: folder };
            let body = Body::from_stream(ReaderStream::with_capacity(file, 1 << 16));
            Ok(([(header::CONTENT_LENGTH, length.to_string())], headers, body).into_response())
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
