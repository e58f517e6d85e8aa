//! `…/runs/{run}/steps`: the record of a step, its arrays, and the comparison of its view with earlier templates of the run.

use axum::Json;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{ShowArrays, ShowEarlierTemplates, ShowStep, ShowTimes};
use sightline_session::step::RunStep;
use sightline_session::times::StageTime;
use sightline_track::locate::template::history::AgainstEarlier;
use sightline_track::trace::{ArrayName, ArrayView};
use sightline_vision::image::{npy, npz};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult};
use crate::recorded_step::RecordedStep;
use crate::routes::route::route;
use crate::routes::traverses::FileBytes;
use crate::state::AppState;

/// Maximum number of newest templates with which a view is compared, in addition to the designated one.
const EARLIER_LIMIT: usize = 40;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ShowStep>(routes!(show)))
        .routes(route::<ShowTimes>(routes!(times)))
        .routes(route::<ShowArrays>(routes!(arrays)))
        .routes(route::<ShowEarlierTemplates>(routes!(earlier_templates)))
}

/// A step
///
/// Without arrays, which are available together in one file.
#[utoipa::path(get, operation_id = "show_step", path = ShowStep::PATH, tag = "steps", responses((status = 200, body = RunStep), ApiError))]
async fn show(step: RecordedStep) -> ApiResult<Response> {
    blocking(move || Ok(Json(step.recorded.as_ref()).into_response())).await
}

/// The durations of a step's stages
///
/// On Mars, according to the model of the papers' 20 MHz processor; on this machine, as measured when the step was computed.
#[utoipa::path(get, operation_id = "show_times", path = ShowTimes::PATH, tag = "steps", responses((status = 200, body = Vec<StageTime>), ApiError))]
async fn times(step: RecordedStep) -> ApiResult<Json<Vec<StageTime>>> {
    blocking(move || Ok(Json(step.times()))).await
}

/// All arrays of a step as one NumPy file (`numpy.load` returns them by name); invalid values are NaN
#[utoipa::path(get, operation_id = "show_arrays", path = ShowArrays::PATH,
    tag = "steps", responses((status = 200, content_type = "application/octet-stream", body = FileBytes), ApiError))]
async fn arrays(step: RecordedStep) -> ApiResult<Response> {
    blocking(move || {
        let there = ArrayName::all().filter_map(|name| Some((name, step.recorded.array(name)?)));
        let files: Vec<(&str, Vec<u8>)> = there
            .map(|(name, view)| Ok((name.word(), npy::encode_array(view.values(), &shape_of(view))?)))
            .collect::<ApiResult<_>>()?;
        let headers = [(header::CONTENT_TYPE, "application/octet-stream")];
        Ok((headers, npz::encode(files)?).into_response())
    })
    .await
}

/// Compares the view of a step with the earlier templates of its run, oldest first
///
/// Each template is transformed from its own stop by the known geometry and searched near the located position: the offsets
/// are the drift accumulated by template renewals. If there are many templates, the designated one and the newest ones are
/// compared; the list is empty if the step located no position.
#[utoipa::path(get, operation_id = "show_earlier_templates", path = ShowEarlierTemplates::PATH, tag = "steps",
    responses((status = 200, body = Vec<AgainstEarlier>), ApiError))]
async fn earlier_templates(
    State(state): State<AppState>,
    step: RecordedStep,
) -> ApiResult<Json<Vec<AgainstEarlier>>> {
    state.tries().run(move || Ok(Json(step.against_earlier(EARLIER_LIMIT)?))).await
}

/// Rows and columns, the shape in NumPy.
fn shape_of(view: ArrayView<'_>) -> [u32; 2] {
    let [width, height] = view.size();
    [height, width]
}
