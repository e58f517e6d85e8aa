//! `…/exports`: a session as files; the export is cancelled when the request is dropped.

use std::ops::ControlFlow;

use axum::Json;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{ExportFile, ListExports};
use sightline_api::location::AtExport;
use sightline_session::exports::ExportEntry;
use tempfile::TempDir;
use tokio_util::io::ReaderStream;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::cancel::{CancelFlag, CancelOnDrop};
use crate::exports::{ExportFormat, ExportedFile, SessionPart, Source, catalogue, make};
use crate::extract::{Params, Path, SessionPath};
use crate::problem::{ApiError, ApiResult};
use crate::routes::route::route;
use crate::routes::traverses::FileBytes;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ListExports>(routes!(list)))
        .routes(route::<ExportFile>(routes!(file)))
}

/// The available exports of a session, with sizes and commands
#[utoipa::path(get, operation_id = "list_exports", path = ListExports::PATH, tag = "exports", params(SessionPart), responses((status = 200, body = Vec<ExportEntry>), ApiError))]
async fn list(
    State(state): State<AppState>,
    SessionPath(live): SessionPath,
    Params(part): Params<ListExports>,
) -> ApiResult<Json<Vec<ExportEntry>>> {
    let work = move |cancel: &CancelFlag| {
        let source = Source::of(&live);
        source.check(ExportFormat::Csv, part)?;
        Ok(Json(catalogue::catalogue(&source, part, cancel.as_ref().into())?))
    };
    state.queries().run_until_dropped(work).await
}

/// A session, or a part of it, as a file
///
/// The export is cancelled when the request is dropped.
#[utoipa::path(get, operation_id = "export_file", path = ExportFile::PATH, tag = "exports", params(("file" = String, Path, description = "One of the names that the list of exports gives"), SessionPart),
    responses((status = 200, content_type = "application/octet-stream", body = FileBytes), ApiError))]
async fn file(
    State(state): State<AppState>,
    Path(AtExport { session, file }): Path<ExportFile>,
    Params(part): Params<ExportFile>,
) -> ApiResult<Response> {
    let kind = ExportFormat::from_name(&file).ok_or_else(|| {
        ApiError::not_found(format!(
            "The files are {}.",
            ExportFormat::ALL.map(ExportFormat::name).join(", ")
        ))
    })?;
    let live = state.session(&session)?;
    let cancel = CancelOnDrop::default();
    let flag = cancel.flag();
    let work = move || {
        let source = Source::of(&live);
        source.check(kind, part)?;
        let part = source.resolve_part(kind, part);
        let name = source.file_name(kind, part);
        let mut proceed = |_, _| ControlFlow::Continue(());
        Ok((name, make(&source, kind, part, &flag, &mut proceed)?))
    };
    let (name, made) = state.exports().run(work).await?;
    answer(kind, &name, made).await
}

/// A download with the file name `name`, which the server composes; its length is known.
pub(crate) async fn answer(kind: ExportFormat, name: &str, made: ExportedFile) -> ApiResult<Response> {
    let mut headers = vec![
        (header::CONTENT_TYPE, kind.media_type().to_owned()),
        (header::CONTENT_DISPOSITION, format!("attachment; filename=\"{name}\"")),
    ];
    if kind == ExportFormat::Report {
        headers.push((header::CONTENT_SECURITY_POLICY, crate::html::ALONE.to_owned()));
    }
    let headers = axum::response::AppendHeaders(headers);
    match made {
        ExportedFile::Bytes(bytes) => Ok((headers, bytes).into_response()),
        ExportedFile::File(file, folder) => {
            let file = tokio::fs::File::from_std(file);
            let length = file.metadata().await.map(|about| about.len());
            let length = length.map_err(|error| ApiError::internal(error.to_string()))?;
            // The folder is removed after the last byte or when the request is dropped.
            let file = KeptFile { file, _folder: folder };
            let body = axum::body::Body::from_stream(ReaderStream::with_capacity(file, 1 << 16));
            Ok(([(header::CONTENT_LENGTH, length.to_string())], headers, body).into_response())
        }
    }
}

/// An open file with its temporary folder.
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
