//! `…/steps/{step}/trackability`: predicted quality of a target at each position of a left image, before designation.
//!
//! The first request starts a map, which is computed in the background row by row, one map at a time; requests in the
//! meantime get the finished rows. A map is a function of the images, so caching it saves only time. The cache is limited to
//! the newest maps, and fewer of the underlying surfaces, which are larger.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{CancelTrackability, ShowTrackability, ShowTrackabilityAtPixel};
use sightline_api::location::AtStop;
use sightline_api::query::{MapLimits, MapPixel};
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_rover::trackability::{MapProgress, PixelVerdict, TrackabilityLimits, TrackabilityMap, pixel};
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::cancel::CancelFlag;
use crate::extract::{Params, Path};
use crate::jobs::{blocking, lock};
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::routes::route::route;
use crate::state::AppState;
use crate::trackability_maps::MapJob;

/// Minimum interval of progress events.
const REPORT_INTERVAL: Duration = Duration::from_millis(150);

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ShowTrackability>(routes!(show)))
        .routes(route::<ShowTrackabilityAtPixel>(routes!(at_pixel)))
        .routes(route::<CancelTrackability>(routes!(cancel)))
}

fn limits(text: Option<&str>) -> ApiResult<TrackabilityLimits> {
    Ok(TrackabilityLimits::parse(text.unwrap_or_default())?)
}

/// The trackability of a stop's left image, as far as computed
///
/// The first request starts the computation; the event `trackability_progress` announces further rows.
#[utoipa::path(get, operation_id = "show_trackability", path = ShowTrackability::PATH, tag = "trackability",
    params(MapLimits),
    responses((status = 200, body = MapProgress), ApiError))]
async fn show(
    State(state): State<AppState>,
    Path(AtStop { id, step }): Path<ShowTrackability>,
    Params(params): Params<ShowTrackability>,
) -> ApiResult<Json<MapProgress>> {
    let limits = limits(params.limits.as_deref())?;
    let open = stop(&state, &id, step)?;
    let (job, is_new) = state.maps().find_or_begin(&open.id, step, limits);
    if is_new {
        let (state, job) = (state.clone(), Arc::clone(&job));
        tokio::spawn(async move {
            let (own, mine) = (state.clone(), Arc::clone(&job));
            let done = state.maps().turn.run(move || Ok(make(&own, &open, &mine)?)).await;
            job.end(done.err().map(|problem| problem.problem().detail.clone()));
            state.send_event(job.event());
        });
    }
    blocking(move || Ok(Json(lock(&job.progress).clone()))).await
}

/// The verdict at one pixel: the image measures, and the result of the designation
#[utoipa::path(get, operation_id = "show_trackability_at_pixel", path = ShowTrackabilityAtPixel::PATH,
    tag = "trackability", params(MapPixel),
    responses((status = 200, body = PixelVerdict), ApiError))]
async fn at_pixel(
    State(state): State<AppState>,
    Path(AtStop { id, step }): Path<ShowTrackabilityAtPixel>,
    Params(params): Params<ShowTrackabilityAtPixel>,
) -> ApiResult<Json<PixelVerdict>> {
    let open = stop(&state, &id, step)?;
    let limits = limits(params.limits.as_deref())?;
    let [width, height] = open.traverse.left_camera(step).size;
    let pixel_at = Pixel::new(params.x, params.y);
    if !(pixel_at.x.is_finite() && pixel_at.y.is_finite() && pixel_at.is_inside(width, height)) {
        let detail = format!(
            "x, y: ({}, {}) lies outside the left image of {width} x {height} pixels",
            pixel_at.x, pixel_at.y
        );
        return Err(ApiError::invalid("query", detail));
    }
    let work_state = state.clone();
    state
        .designations()
        .run_until_dropped(move |cancel| {
            let settings = (&Settings::default(), &limits);
            let ground = work_state.maps().ground(&open, step, settings, cancel)?;
            Ok(Json(PixelVerdict::of(&open.traverse, &ground, pixel_at)))
        })
        .await
}

/// Cancels a map; the next request starts it again
#[utoipa::path(post, operation_id = "cancel_trackability", path = CancelTrackability::PATH,
    tag = "trackability", params(MapLimits),
    responses((status = 200, body = MapProgress), (status = 204, description = "Nothing was being made"), ApiError))]
async fn cancel(
    State(state): State<AppState>,
    Path(AtStop { id, step }): Path<CancelTrackability>,
    Params(params): Params<CancelTrackability>,
) -> ApiResult<Response> {
    let limits = limits(params.limits.as_deref())?;
    let open = stop(&state, &id, step)?;
    let Some(job) = state.maps().take_unfinished(&open.id, step, &limits) else {
        // The map may just have been completed.
        return Ok(StatusCode::NO_CONTENT.into_response());
    };
    job.cancel.store(true, Ordering::Relaxed);
    job.end(Some("cancelled".to_owned()));
    Ok(Json(lock(&job.progress).clone()).into_response())
}

/// The stop of a traverse named in the path.
fn stop(state: &AppState, id: &str, step: usize) -> ApiResult<Arc<OpenTraverse>> {
    let open = state.traverse(id)?;
    if step >= open.traverse.stop_count() {
        return Err(ApiError::not_found(format!("The traverse has no step {step}.")));
    }
    Ok(open)
}

/// Computes a map row by row.
fn make(state: &AppState, open: &OpenTraverse, job: &MapJob) -> Result<()> {
    let ground = state.maps().ground(open, job.step, (&Settings::default(), &job.limits), &job.cancel)?;
    let empty = TrackabilityMap::empty(&ground);
    let rows = empty.rows;
    {
        let mut progress = lock(&job.progress);
        (progress.n, progress.map) = (rows, Some(empty.clone()));
    }
    let mut last_report = Instant::now();
    for row in 0..rows {
        if job.cancel.load(Ordering::Relaxed) {
            return Err(Error::Cancelled);
        }
        let cells = empty.judge_row(&ground, row);
        let mut progress = lock(&job.progress);
        progress.k = row + 1;
        if let Some(map) = &mut progress.map {
            map.add(&cells);
        }
        drop(progress);
        if last_report.elapsed() >= REPORT_INTERVAL {
            last_report = Instant::now();
            state.send_event(job.event());
        }
    }
    Ok(())
}

/// The problem of a rejected designation, with the nearest good pixel if there is one.
pub(crate) fn refusal(
    state: &AppState,
    open: &OpenTraverse,
    designation: Designation,
    settings: &Settings,
    error: Error,
) -> ApiError {
    let Designation { step, pixel: pixel_at, camera } = designation;
    // Maps exist for the main pair only.
    let is_refused =
        matches!(error, Error::Target(_)) && camera.is_none() && step < open.traverse.stop_count();
    let problem = ApiError::from(error);
    let [width, height] = if is_refused { open.traverse.left_camera(step).size } else { [0, 0] };
    if !pixel_at.is_inside(width, height) {
        return problem;
    }
    let limits = TrackabilityLimits::default();
    let found = state
        .maps()
        .ground(open, step, (settings, &limits), &CancelFlag::default())
        .ok()
        .and_then(|ground| pixel::nearest_good(&open.traverse, &ground, pixel_at));
    match found {
        Some(good) => problem
            .hint(format!("The nearest good pixel is ({:.0}, {:.0}).", good.x, good.y))
            .nearest_pixel(good),
        None => problem,
    }
}
