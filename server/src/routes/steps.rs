//! `…/runs/{run}/steps`: the record of a step, its arrays, and its view against the earlier templates of the run.

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

/// How many of the newest templates of a run a view is compared with, besides the designated one.
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
/// Arrays are left out; they are fetched together in one file.
#[utoipa::path(get, operation_id = "show_step", path = ShowStep::PATH, tag = "steps", responses((status = 200, body = RunStep), ApiError))]
async fn show(step: RecordedStep) -> ApiResult<Response> {
    blocking(move || Ok(Json(step.recorded.as_ref()).into_response())).await
}

/// What the stages of a step take
///
/// On Mars, by the model of the papers' processor of 20 MHz; on this machine, as measured when the step was computed.
#[utoipa::path(get, operation_id = "show_times", path = ShowTimes::PATH, tag = "steps", responses((status = 200, body = Vec<StageTime>), ApiError))]
async fn times(step: RecordedStep) -> ApiResult<Json<Vec<StageTime>>> {
    blocking(move || Ok(Json(step.times()))).await
}

/// All arrays to which a step came, as one NumPy file (`numpy.load` gives them by name); NaN where invalid
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

/// The view of a step against the earlier templates of its run, oldest first
///
/// Each template is prepared by the geometry from its own stop and searched near the position that the step found: the offsets are the
/// drift that the renewals between have added up. Of many templates the designated one and the newest are compared; the list is
/// empty where the step found no position.
#[utoipa::path(get, operation_id = "show_earlier_templates", path = ShowEarlierTemplates::PATH, tag = "steps",
    responses((status = 200, body = Vec<AgainstEarlier>), ApiError))]
async fn earlier_templates(
    State(state): State<AppState>,
    step: RecordedStep,
) -> ApiResult<Json<Vec<AgainstEarlier>>> {
    state.tries().run(move || Ok(Json(step.against_earlier(EARLIER_LIMIT)?))).await
}

/// Rows and columns, as NumPy counts them.
fn shape_of(view: ArrayView<'_>) -> [u32; 2] {
    let [width, height] = view.size();
    [height, width]
}
