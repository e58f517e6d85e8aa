//! `traverses`: recorded and simulated traverses, and their images.

use std::sync::atomic::AtomicBool;

use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{AddTraverse, ListTraverses, Prefetch, ShowImage, ShowStop, ShowTraverse};
use sightline_api::location::{AtImage, AtStop, AtTraverse};
use sightline_api::query::{FirstStop, ImageWish};
use sightline_api::wire::{
    NewTraverse, Problem, StopCameraModels, StopCameraView, StopDetail, StopView, TraverseEntry, TraverseView,
};
use sightline_geometry::camera::CameraName;
use sightline_geometry::error::Error;
use sightline_rover::pair::FurtherCamera;
use sightline_rover::pipeline::Stops;
use sightline_vision::image::io;
use utoipa::ToSchema;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::cancel::{CancelFlag, CancelOnDrop};
use crate::drives;
use crate::extract::{Body, Params, Path};
use crate::import_session;
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::revision;
use crate::routes::route::{location, route};
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ListTraverses>(routes!(list)))
        .routes(route::<AddTraverse>(routes!(add)))
        .routes(route::<ShowTraverse>(routes!(show)))
        .routes(route::<ShowStop>(routes!(stop)))
        .routes(route::<ShowImage>(routes!(image)))
        .routes(route::<Prefetch>(routes!(prefetch)))
}

/// The hint for an image that cannot be read.
const MEND: &str =
    "Put the file back or mend it, then try again; the other steps can be looked at as they are.";

/// The bytes of a file, for the OpenAPI document.
#[derive(ToSchema)]
#[schema(value_type = String, format = Binary)]
pub(crate) struct FileBytes(#[allow(dead_code)] Vec<u8>);

/// The traverses that are open
#[utoipa::path(get, operation_id = "list_traverses", path = ListTraverses::PATH, tag = "traverses", responses(
    (status = 200, body = Vec<TraverseEntry>), ApiError))]
async fn list(State(state): State<AppState>) -> Json<Vec<TraverseEntry>> {
    Json(state.traverses().iter().map(|open| entry(&state, open)).collect())
}

fn entry(state: &AppState, open: &OpenTraverse) -> TraverseEntry {
    let index = open.traverse.index();
    TraverseEntry {
        id: open.id.clone(),
        name: index.name.clone(),
        description: index.description.clone(),
        simulated: index.scenario.is_some(),
        stop_count: index.stops.len(),
        removable: state.is_removable(open),
    }
}

/// Opens a simulated drive from a scenario
///
/// The same scenario is the same drive. It stays open across restarts; its images are rendered on demand.
#[utoipa::path(post, operation_id = "open_traverse", path = AddTraverse::PATH, tag = "traverses", request_body = NewTraverse, responses(
    (status = 200, description = "It was open already", body = TraverseEntry),
    (status = 201, body = TraverseEntry), ApiError))]
async fn add(State(state): State<AppState>, Body(new): Body<AddTraverse>) -> ApiResult<Response> {
    let work_state = state.clone();
    let work = move |cancel: &CancelFlag| {
        let (open, is_new) = import_session::open_scenario(&work_state, &new.scenario, cancel)?;
        let status = if is_new { StatusCode::CREATED } else { StatusCode::OK };
        let location = location::<ShowTraverse>(&AtTraverse { id: open.id.clone() });
        Ok((status, location, Json(entry(&work_state, &open))).into_response())
    };
    state.designations().run_until_dropped(work).await
}

/// A traverse with its stops
#[utoipa::path(get, operation_id = "show_traverse", path = ShowTraverse::PATH, tag = "traverses", responses(
    (status = 200, body = TraverseView), ApiError))]
async fn show(
    State(state): State<AppState>,
    Path(AtTraverse { id }): Path<ShowTraverse>,
) -> ApiResult<Json<TraverseView>> {
    let open = state.traverse(&id)?;
    blocking(move || Ok(Json(view(&open)))).await
}

/// A stop with its cameras, in the rover frame
#[utoipa::path(get, operation_id = "show_stop", path = ShowStop::PATH, tag = "traverses", responses(
    (status = 200, body = StopDetail), ApiError))]
async fn stop(
    State(state): State<AppState>,
    Path(AtStop { id, step }): Path<ShowStop>,
) -> ApiResult<Json<StopDetail>> {
    let open = state.traverse(&id)?;
    if step >= open.traverse.stop_count() {
        return Err(no_step(step));
    }
    let traverse = &open.traverse;
    let (left, right) = (traverse.left_camera(step).clone(), traverse.right_camera(step).clone());
    let mast = traverse.mast_angles(step);
    let models = |camera: FurtherCamera<'_>| StopCameraModels {
        name: camera.name,
        left: camera.left.clone(),
        right: camera.right.cloned(),
    };
    let cameras = traverse.further_cameras(step).map(models).collect();
    Ok(Json(StopDetail { stop: stop_view(&open, step), left, right, mast, cameras }))
}

fn no_step(step: usize) -> ApiError {
    ApiError::not_found(format!("The traverse has no step {step}."))
}

/// An image of a stop as PNG
///
/// An image of a simulated stop is rendered on the first request, which takes some seconds. 202 without an image: the drive
/// has not captured it yet; ask again.
#[utoipa::path(get, operation_id = "show_image", path = ShowImage::PATH, tag = "traverses", params(("file" = String, Path, description = "left.png or right.png"),
    ImageWish), responses(
    (status = 200, content_type = "image/png", body = FileBytes),
    (status = 202, description = "The drive has not taken it yet", body = Problem, content_type = "application/problem+json"),
    (status = 304, description = "It is the one that you have (If-None-Match)"), ApiError))]
async fn image(
    State(state): State<AppState>,
    Path(AtImage { id, step, file }): Path<ShowImage>,
    Params(params): Params<ShowImage>,
    headers: HeaderMap,
) -> ApiResult<Response> {
    let open = state.traverse(&id)?;
    let is_left = match file.as_str() {
        "left.png" => true,
        "right.png" => false,
        _ => return Err(ApiError::not_found("A stop has the images left.png and right.png.")),
    };
    let is_deep = match params.bits {
        None | Some(8) => false,
        Some(16) => true,
        Some(bits) => return Err(ApiError::invalid("query", format!("bits: must be 8 or 16, not {bits}"))),
    };
    if step >= open.traverse.stop_count() {
        return Err(no_step(step));
    }
    if let Some(name) = params.camera {
        let camera = open.traverse.further_cameras(step).find(|camera| camera.name == name);
        let camera =
            camera.ok_or_else(|| ApiError::not_found(format!("Step {step} has no camera `{name}`.")))?;
        if !is_left && camera.right.is_none() {
            let problem =
                format!("The camera `{name}` of step {step} is a single one: it has left.png only.");
            return Err(ApiError::not_found(problem));
        }
    }
    let cancel = CancelOnDrop::default();
    let flag = cancel.flag();
    let png = state
        .pictures()
        .run(move || {
            encode(&open, (step, params.camera, is_left), is_deep, &flag).map_err(|error| {
                // The drive will capture them when it continues; the page repeats the request.
                if open.traverse.is_awaited(step) {
                    return ApiError::awaited(error.to_string());
                }
                let is_of_file = matches!(error, Error::Read { .. } | Error::Format { .. });
                let problem = ApiError::from(error);
                if is_of_file { problem.hint(MEND) } else { problem }
            })
        })
        .await?;
    // The browser caches the image, but revalidates it: files may be replaced between two starts of the server.
    Ok(revision::unless_known(&headers, "image/png", png))
}

/// Renders the stops from this one onwards before all others
#[utoipa::path(post, operation_id = "prefetch", path = Prefetch::PATH, tag = "traverses", params(FirstStop), responses((status = 204), ApiError))]
async fn prefetch(
    State(state): State<AppState>,
    Path(AtTraverse { id }): Path<Prefetch>,
    Params(params): Params<Prefetch>,
) -> ApiResult<StatusCode> {
    let open = state.traverse(&id)?;
    state.prefetch_from(&open, params.from);
    Ok(StatusCode::NO_CONTENT)
}

fn stop_view(open: &OpenTraverse, step: usize) -> StopView {
    let (traverse, stop) = (&open.traverse, &open.traverse.index().stops[step]);
    StopView {
        time_s: stop.time_s,
        site_from_rover: stop.site_from_rover,
        true_site_from_rover: stop.truth.as_ref().map(|truth| truth.site_from_rover),
        left_size: traverse.left_camera(step).size,
        right_size: traverse.right_camera(step).size,
        ready: traverse.is_ready(step),
        odometry: stop.odometry.clone(),
        cameras: traverse.further_cameras(step).map(camera_view).collect(),
    }
}

fn camera_view(camera: FurtherCamera<'_>) -> StopCameraView {
    StopCameraView {
        name: camera.name,
        left_size: camera.left.size,
        right_size: camera.right.map(|right| right.size),
        mast: camera.mast_angles,
    }
}

fn view(open: &OpenTraverse) -> TraverseView {
    let (traverse, index) = (&open.traverse, open.traverse.index());
    TraverseView {
        id: open.id.clone(),
        name: index.name.clone(),
        description: index.description.clone(),
        simulated: index.scenario.is_some(),
        source: drives::argument(traverse),
        stereo: index.stereo,
        warnings: traverse.warnings().to_vec(),
        odometry_error: index.odometry_error,
        stops: (0..index.stops.len()).map(|step| stop_view(open, step)).collect(),
    }
}

/// Encodes the image as PNG, independent of the file format on disk; a value of 1 becomes full scale.
fn encode(
    open: &OpenTraverse,
    (step, camera, is_left): (usize, Option<CameraName>, bool),
    is_deep: bool,
    cancel: &AtomicBool,
) -> sightline_geometry::error::Result<Vec<u8>> {
    open.make_camera_ready(step, camera, cancel)?;
    let image = open.traverse.capture_one(step, camera, is_left)?;
    if is_deep { io::encode_png_u16(&image, None) } else { io::encode_png_u8(&image) }
}
