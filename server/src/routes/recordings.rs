//! `recordings` and `imports`: recordings on the server's machine, what they contain, and their import as drives.

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{CancelImport, ListRecordings, ShowImport, ShowRecording, StartImport};
use sightline_api::location::AtImport;
use sightline_api::recording::{ImportJob, RecordingList, RecordingPath, RecordingView};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::cancel::CancelFlag;
use crate::extract::{Body, Params, Path};
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult};
use crate::recordings;
use crate::routes::route::{location, route};
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ListRecordings>(routes!(list)))
        .routes(route::<ShowRecording>(routes!(contents)))
        .routes(route::<StartImport>(routes!(start)))
        .routes(route::<ShowImport>(routes!(show)))
        .routes(route::<CancelImport>(routes!(cancel)))
}

/// The recordings below the folders that were named when the server was started
#[utoipa::path(get, operation_id = "list_recordings", path = ListRecordings::PATH, tag = "recordings", responses(
    (status = 200, body = RecordingList), ApiError))]
async fn list(State(state): State<AppState>) -> ApiResult<Json<RecordingList>> {
    blocking(move || Ok(Json(recordings::list(state.folders(), state.limits())))).await
}

/// What a recording contains
///
/// Nothing is imported; what is refused here, an import refuses, too.
#[utoipa::path(get, operation_id = "show_recording", path = ShowRecording::PATH, tag = "recordings", params(RecordingPath),
    responses((status = 200, body = RecordingView), ApiError))]
async fn contents(
    State(state): State<AppState>,
    Params(RecordingPath { path }): Params<ShowRecording>,
) -> ApiResult<Json<RecordingView>> {
    let work_state = state.clone();
    let work = move |cancel: &CancelFlag| {
        let recording = recordings::confine(work_state.folders(), &path)?;
        Ok(Json(recordings::contents(&recording, work_state.limits(), cancel)?))
    };
    state.designations().run_until_dropped(work).await
}

/// Imports a recording as a drive
///
/// The drive stays open across restarts. A drive in the native format is opened where it is.
#[utoipa::path(post, operation_id = "start_import", path = StartImport::PATH, tag = "recordings",
    request_body = sightline_api::recording::NewImport, responses((status = 202, body = ImportJob), ApiError))]
async fn start(State(state): State<AppState>, Body(new): Body<StartImport>) -> ApiResult<Response> {
    let job = blocking(move || {
        let recording = recordings::confine(state.folders(), &new.path)?;
        state.imports().start(&state, recording)
    })
    .await?;
    let location = location::<ShowImport>(&AtImport { import: job.id.clone() });
    Ok((StatusCode::ACCEPTED, location, Json(job)).into_response())
}

/// How far an import is
#[utoipa::path(get, operation_id = "show_import", path = ShowImport::PATH, tag = "recordings",
    responses((status = 200, body = ImportJob), ApiError))]
async fn show(
    State(state): State<AppState>,
    Path(AtImport { import }): Path<ShowImport>,
) -> ApiResult<Json<ImportJob>> {
    Ok(Json(state.imports().view(&import)?))
}

/// Cancels an import; nothing of it is kept
#[utoipa::path(post, operation_id = "cancel_import", path = CancelImport::PATH, tag = "recordings",
    responses((status = 200, body = ImportJob), ApiError))]
async fn cancel(
    State(state): State<AppState>,
    Path(AtImport { import }): Path<CancelImport>,
) -> ApiResult<Json<ImportJob>> {
    Ok(Json(state.imports().cancel(&import)?))
}
