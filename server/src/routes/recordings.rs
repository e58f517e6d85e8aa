//! `recordings` and `imports`: recordings on the server's machine, their contents, and their import as drives.

use axum::Json;
use axum::extract::{Request, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{
    BeginUpload, CancelImport, ListRecordings, RemoveUpload, SendArchive, SendFile, ShowImport,
    ShowRecording, StartImport,
};
use sightline_api::location::{AtImport, AtUpload};
use sightline_api::recording::{
    ImportJob, NewImport, RecordingList, RecordingPath, RecordingView, UploadPath, UploadView,
};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::cancel::CancelFlag;
use crate::extract::{Body, Params, Path};
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult};
use crate::recordings;
use crate::routes::route::{location, route};
use crate::routes::traverses::FileBytes;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ListRecordings>(routes!(list)))
        .routes(route::<ShowRecording>(routes!(contents)))
        .routes(route::<BeginUpload>(routes!(begin_upload)))
        .routes(route::<SendFile>(routes!(send_file)))
        .routes(route::<SendArchive>(routes!(send_archive)))
        .routes(route::<RemoveUpload>(routes!(remove_upload)))
        .routes(route::<StartImport>(routes!(start)))
        .routes(route::<ShowImport>(routes!(show)))
        .routes(route::<CancelImport>(routes!(cancel)))
}

/// The recordings below the folders named at the server's start
#[utoipa::path(get, operation_id = "list_recordings", path = ListRecordings::PATH, tag = "recordings", responses(
    (status = 200, body = RecordingList), ApiError))]
async fn list(State(state): State<AppState>) -> ApiResult<Json<RecordingList>> {
    let own = state.clone();
    state.pictures().run(move || Ok(Json(recordings::list(own.folders(), own.limits())))).await
}

/// The contents of a recording
///
/// Imports nothing, but makes the same checks as an import.
#[utoipa::path(get, operation_id = "show_recording", path = ShowRecording::PATH, tag = "recordings", params(RecordingPath),
    responses((status = 200, body = RecordingView), ApiError))]
async fn contents(
    State(state): State<AppState>,
    Params(RecordingPath { path }): Params<ShowRecording>,
) -> ApiResult<Json<RecordingView>> {
    let work_state = state.clone();
    let work = move |cancel: &CancelFlag| {
        let recording = recordings::confine(&work_state, &path)?;
        Ok(Json(recordings::contents(&recording, work_state.limits(), cancel)?))
    };
    state.designations().run_until_dropped(work).await
}

/// Begins the upload of a recording
///
/// Its files are sent one by one, or as one zip archive; `GET recordings/contents` and `POST imports` accept the folder
/// named in the answer. Recordings that are not imported are deleted when the server ends.
#[utoipa::path(post, operation_id = "begin_upload", path = BeginUpload::PATH, tag = "recordings",
    responses((status = 201, body = UploadView), ApiError))]
async fn begin_upload(State(state): State<AppState>) -> ApiResult<(StatusCode, Json<UploadView>)> {
    blocking(move || Ok((StatusCode::CREATED, Json(state.uploads().begin(state.folders())?)))).await
}

/// Uploads a file of a recording
#[utoipa::path(put, operation_id = "send_file", path = SendFile::PATH, tag = "recordings", params(UploadPath),
    request_body(content = FileBytes, content_type = "application/octet-stream"),
    responses((status = 200, body = UploadView), ApiError))]
async fn send_file(
    State(state): State<AppState>,
    Path(AtUpload { upload }): Path<SendFile>,
    Params(UploadPath { path }): Params<SendFile>,
    request: Request,
) -> ApiResult<Json<UploadView>> {
    Ok(Json(state.uploads().upload(&upload)?.store_file(&path, request.into_body()).await?))
}

/// Uploads a recording as one zip archive
#[utoipa::path(put, operation_id = "send_archive", path = SendArchive::PATH, tag = "recordings",
    request_body(content = FileBytes, content_type = "application/octet-stream"),
    responses((status = 200, body = UploadView), ApiError))]
async fn send_archive(
    State(state): State<AppState>,
    Path(AtUpload { upload }): Path<SendArchive>,
    request: Request,
) -> ApiResult<Json<UploadView>> {
    Ok(Json(state.uploads().upload(&upload)?.unpack(request.into_body()).await?))
}

/// Removes an uploaded recording
#[utoipa::path(delete, operation_id = "remove_upload", path = RemoveUpload::PATH, tag = "recordings",
    responses((status = 204), ApiError))]
async fn remove_upload(
    State(state): State<AppState>,
    Path(AtUpload { upload }): Path<RemoveUpload>,
) -> ApiResult<StatusCode> {
    blocking(move || state.uploads().remove(&upload).map(|()| StatusCode::NO_CONTENT)).await
}

/// Imports a recording as a drive
///
/// The drive stays open across restarts. A drive in the native format is opened in place.
#[utoipa::path(post, operation_id = "start_import", path = StartImport::PATH, tag = "recordings",
    request_body = NewImport, responses((status = 202, body = ImportJob), ApiError))]
async fn start(State(state): State<AppState>, Body(new): Body<StartImport>) -> ApiResult<Response> {
    let job = blocking(move || {
        let recording = recordings::confine(&state, &new.path)?;
        state.imports().start(&state, recording)
    })
    .await?;
    let location = location::<ShowImport>(&AtImport { import: job.id.clone() });
    Ok((StatusCode::ACCEPTED, location, Json(job)).into_response())
}

/// The progress of an import
#[utoipa::path(get, operation_id = "show_import", path = ShowImport::PATH, tag = "recordings",
    responses((status = 200, body = ImportJob), ApiError))]
async fn show(
    State(state): State<AppState>,
    Path(AtImport { import }): Path<ShowImport>,
) -> ApiResult<Json<ImportJob>> {
    Ok(Json(state.imports().view(&import)?))
}

/// Cancels an import and removes its files
#[utoipa::path(post, operation_id = "cancel_import", path = CancelImport::PATH, tag = "recordings",
    responses((status = 200, body = ImportJob), ApiError))]
async fn cancel(
    State(state): State<AppState>,
    Path(AtImport { import }): Path<CancelImport>,
) -> ApiResult<Json<ImportJob>> {
    Ok(Json(state.imports().cancel(&import)?))
}
