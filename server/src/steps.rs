//! `…/runs/{run}/steps`: what one step saw and decided. Going back is a read of what was recorded.

use std::sync::Arc;

use axum::Json;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use sightline_core::image::{npy, npz};
use sightline_core::trace::{ArrayName, ArrayView, StepTrace};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::Path;
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult};
use crate::state::AppState;
use crate::traverses::FileBytes;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(routes!(show))
        .routes(routes!(stage))
        .routes(routes!(array))
        .routes(routes!(arrays))
}

/// A step
///
/// Arrays are left out; they are fetched one by one, or all in one file.
#[utoipa::path(get, operation_id = "show_step", path = "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}", tag = "steps", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path), ("step" = usize, Path)),
    responses((status = 200, body = StepTrace), ApiError))]
async fn show(
    State(state): State<AppState>,
    Path((session, target, run, step)): Path<(String, usize, usize, usize)>,
) -> ApiResult<Response> {
    let trace = find(&state, &session, target, run, step)?;
    blocking(move || Ok(Json(trace.as_ref()).into_response())).await
}

/// One stage of a step; null where it was not reached
#[utoipa::path(get, operation_id = "show_stage", path = "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/stages/{stage}",
    tag = "steps", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path), ("step" = usize, Path),
    ("stage" = String, Path, description = "predict, point_mast, capture, locate, judge or update")),
    responses((status = 200, body = serde_json::Value), ApiError))]
async fn stage(
    State(state): State<AppState>,
    Path((session, target, run, step, stage)): Path<(String, usize, usize, usize, String)>,
) -> ApiResult<Response> {
    let trace = find(&state, &session, target, run, step)?;
    match stage.as_str() {
        "predict" => json(&trace.predict),
        "point_mast" => json(&trace.point_mast),
        "capture" => json(&trace.capture),
        "locate" => json(&trace.locate),
        "judge" => json(&trace.judge),
        "update" => json(&trace.update),
        _ => {
            Err(ApiError::not_found("The stages are predict, point_mast, capture, locate, judge and update."))
        }
    }
}

/// An array of a step as a NumPy file; NaN where invalid
#[utoipa::path(get, operation_id = "show_array", path = "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/arrays/{file}",
    tag = "steps", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path), ("step" = usize, Path),
    ("file" = String, Path, description = "The array's name with the ending .npy")),
    responses((status = 200, content_type = "application/octet-stream", body = FileBytes), ApiError))]
async fn array(
    State(state): State<AppState>,
    Path((session, target, run, step, file)): Path<(String, usize, usize, usize, String)>,
) -> ApiResult<Response> {
    let trace = find(&state, &session, target, run, step)?;
    let name = file.strip_suffix(".npy").and_then(ArrayName::from_word).ok_or_else(|| {
        let words: Vec<_> = ArrayName::ALL.iter().map(|name| name.word()).collect();
        ApiError::not_found(format!("The arrays are {}, each with the ending .npy.", words.join(", ")))
    })?;
    blocking(move || {
        let missing =
            || ApiError::not_found(format!("Step {step} did not come to the array {}.", name.word()));
        let view = trace.array(name).ok_or_else(missing)?;
        let headers = [(header::CONTENT_TYPE, "application/octet-stream")];
        Ok((headers, npy::encode_array(view.values(), &shape_of(view))?).into_response())
    })
    .await
}

/// All arrays to which a step came, as one NumPy file (`numpy.load` gives them by name); NaN where invalid
#[utoipa::path(get, operation_id = "show_arrays", path = "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/arrays.npz",
    tag = "steps", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path), ("step" = usize, Path)),
    responses((status = 200, content_type = "application/octet-stream", body = FileBytes), ApiError))]
async fn arrays(
    State(state): State<AppState>,
    Path((session, target, run, step)): Path<(String, usize, usize, usize)>,
) -> ApiResult<Response> {
    let trace = find(&state, &session, target, run, step)?;
    blocking(move || {
        let there = ArrayName::ALL.into_iter().filter_map(|name| Some((name, trace.array(name)?)));
        let files: Vec<(&str, Vec<u8>)> = there
            .map(|(name, view)| Ok((name.word(), npy::encode_array(view.values(), &shape_of(view))?)))
            .collect::<ApiResult<_>>()?;
        let headers = [(header::CONTENT_TYPE, "application/octet-stream")];
        Ok((headers, npz::encode(files)?).into_response())
    })
    .await
}

/// Rows and columns, as NumPy counts them.
fn shape_of(view: ArrayView<'_>) -> [u32; 2] {
    let [width, height] = view.size();
    [height, width]
}

fn json(value: &impl Serialize) -> ApiResult<Response> {
    Ok(Json(value).into_response())
}

/// The recorded step that the path names.
fn find(
    state: &AppState,
    session: &str,
    target: usize,
    run: usize,
    step: usize,
) -> ApiResult<Arc<StepTrace>> {
    let live = state.session(session)?;
    live.with(|session| {
        let found = session.run(target, run).map_err(|error| ApiError::from(error).about_path())?;
        let missing = || {
            let is_coming = step < session.stop_count && step >= session.targets[target].designation.step;
            let detail = if is_coming { "was not computed yet" } else { "does not exist" };
            ApiError::not_found(format!("Step {step} of this run {detail}."))
        };
        found.step(step).cloned().ok_or_else(missing)
    })
}
