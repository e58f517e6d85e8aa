//! `…/steps/{step}/trackability`: how well a target would do at each place of a left image, before one is picked.
//!
//! A map is made in the background when it is first asked for, row by row, one at a time; whoever asks meanwhile gets the rows
//! that are there. It is a function of the images, so that keeping it changes nothing but the time. What is kept is limited:
//! the newest maps, and fewer of the surfaces behind them, which are larger.

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
use crate::trackability_maps::Making;

/// How often pages are told of new rows.
const TOLD_EVERY: Duration = Duration::from_millis(150);

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

/// The trackability of a stop's left image, as far as it was made
///
/// Asking for it begins it; rows follow in the background, told by the event `trackability_progress`.
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
    let (making, is_new) = state.maps().find_or_begin(&open.id, step, limits);
    if is_new {
        let (state, making) = (state.clone(), Arc::clone(&making));
        tokio::spawn(async move {
            let (own, mine) = (state.clone(), Arc::clone(&making));
            let done = state.maps().turn.run(move || Ok(make(&own, &open, &mine)?)).await;
            making.end(done.err().map(|problem| problem.problem().detail.clone()));
            state.tell(making.event());
        });
    }
    blocking(move || Ok(Json(lock(&making.progress).clone()))).await
}

/// The verdict at one pixel: what the images say, and the designation itself
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
    let place = Pixel::new(params.x, params.y);
    if !(place.x.is_finite() && place.y.is_finite() && place.is_inside(width, height)) {
        let detail = format!(
            "x, y: ({}, {}) lies outside the left image of {width} x {height} pixels",
            place.x, place.y
        );
        return Err(ApiError::invalid("query", detail));
    }
    let work_state = state.clone();
    state
        .designations()
        .run_until_dropped(move |cancel| {
            let wanted = (&Settings::default(), &limits);
            let ground = work_state.maps().ground(&open, step, wanted, cancel)?;
            Ok(Json(PixelVerdict::of(&open.traverse, &ground, place)))
        })
        .await
}

/// Stops making a map; asking for it again begins it anew
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
    let Some(making) = state.maps().take_unfinished(&open.id, step, &limits) else {
        // A map that was complete a moment ago is what was wanted, too.
        return Ok(StatusCode::NO_CONTENT.into_response());
    };
    making.cancel.store(true, Ordering::Relaxed);
    making.end(Some("cancelled".to_owned()));
    Ok(Json(lock(&making.progress).clone()).into_response())
}

/// The stop of a traverse that the path names.
fn stop(state: &AppState, id: &str, step: usize) -> ApiResult<Arc<OpenTraverse>> {
    let open = state.traverse(id)?;
    if step >= open.traverse.stop_count() {
        return Err(ApiError::not_found(format!("The traverse has no step {step}.")));
    }
    Ok(open)
}

/// Makes a map row by row.
fn make(state: &AppState, open: &OpenTraverse, making: &Making) -> Result<()> {
    let ground =
        state.maps().ground(open, making.step, (&Settings::default(), &making.limits), &making.cancel)?;
    let empty = TrackabilityMap::empty(&ground);
    let rows = empty.rows;
    {
        let mut progress = lock(&making.progress);
        (progress.n, progress.map) = (rows, Some(empty.clone()));
    }
    let mut told = Instant::now();
    for row in 0..rows {
        if making.cancel.load(Ordering::Relaxed) {
            return Err(Error::Cancelled);
        }
        let cells = empty.judge_row(&ground, row);
        let mut progress = lock(&making.progress);
        progress.k = row + 1;
        if let Some(map) = &mut progress.map {
            map.add(&cells);
        }
        drop(progress);
        if told.elapsed() >= TOLD_EVERY {
            told = Instant::now();
            state.tell(making.event());
        }
    }
    Ok(())
}

/// The problem of a refused designation, with the nearest good pixel where there is one.
pub(crate) fn refusal(
    state: &AppState,
    open: &OpenTraverse,
    designation: Designation,
    settings: &Settings,
    error: Error,
) -> ApiError {
    let Designation { step, pixel: place, camera } = designation;
    // The map of a stop is that of its main pair.
    let is_refused =
        matches!(error, Error::Target(_)) && camera.is_none() && step < open.traverse.stop_count();
    let problem = ApiError::from(error);
    let [width, height] = if is_refused { open.traverse.left_camera(step).size } else { [0, 0] };
    if !place.is_inside(width, height) {
        return problem;
    }
    let limits = TrackabilityLimits::default();
    let found = state
        .maps()
        .ground(open, step, (settings, &limits), &CancelFlag::default())
        .ok()
        .and_then(|ground| pixel::nearest_good(&open.traverse, &ground, place));
    match found {
        Some(good) => problem
            .hint(format!("The nearest good pixel is ({:.0}, {:.0}).", good.x, good.y))
            .nearest_pixel(good),
        None => problem,
    }
}
