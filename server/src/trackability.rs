//! `…/steps/{step}/trackability`: how well a target would do at each place of a left image, before one is picked.
//!
//! A map is made in the background when it is first asked for, row by row, one at a time; whoever asks meanwhile gets the rows
//! that are there. It is a function of the images, so that keeping it changes nothing but the time. What is kept is limited:
//! the newest maps, and fewer of the surfaces behind them, which are larger.

use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use sightline_core::error::{Error, Result};
use sightline_core::frames::Pixel;
use sightline_core::session::wire::Event;
use sightline_core::settings::Settings;
use sightline_core::target::Designation;
use sightline_core::trackability::{
    Ground, MapProgress, PixelVerdict, TrackabilityLimits, TrackabilityMap, pixel,
};
use utoipa::IntoParams;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{Params, Path};
use crate::jobs::{Lane, blocking, lock};
use crate::live::CancelFlag;
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::state::AppState;

/// Maps that are kept: about half a megabyte each.
const MAPS: usize = 64;
/// Surfaces that are kept for judging single pixels: about twenty megabytes each.
const GROUNDS: usize = 2;
/// Maps that may wait for their turn.
const WAITING: usize = 8;
/// How often pages are told of new rows.
const TOLD_EVERY: Duration = Duration::from_millis(150);

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(show)).routes(routes!(at_pixel)).routes(routes!(cancel))
}

/// The limits by which a map is made.
#[derive(Clone, Debug, Default, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct LimitParams {
    /// Limits that are not the defaults: `name=value`, commas between, for example `edge_bad_px=4,slant_risky_deg=70`.
    limits: Option<String>,
}

impl LimitParams {
    fn limits(&self) -> ApiResult<TrackabilityLimits> {
        Ok(TrackabilityLimits::parse(self.limits.as_deref().unwrap_or_default())?)
    }
}

/// A pixel of the left image.
#[derive(Clone, Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct PixelParams {
    /// Its column, px.
    x: f64,
    /// Its row, px.
    y: f64,
    /// Limits that are not the defaults: `name=value`, commas between.
    limits: Option<String>,
}

/// The maps that were made or are being made, and the surfaces behind the newest.
pub struct Maps {
    making: Mutex<VecDeque<Arc<Making>>>,
    grounds: Mutex<VecDeque<(String, Arc<Ground>)>>,
    turn: Lane,
}

/// A map that is made, or was.
struct Making {
    traverse: String,
    step: usize,
    limits: TrackabilityLimits,
    progress: Mutex<MapProgress>,
    cancel: CancelFlag,
}

impl Default for Maps {
    fn default() -> Self {
        Self { making: Mutex::default(), grounds: Mutex::default(), turn: Lane::new(1, WAITING) }
    }
}

/// The trackability of a stop's left image, as far as it was made
///
/// Asking for it begins it; rows follow in the background, told by the event `trackability_progress`.
#[utoipa::path(get, operation_id = "show_trackability", path = "/traverses/{id}/steps/{step}/trackability", tag = "trackability",
    params(("id" = String, Path), ("step" = usize, Path), LimitParams),
    responses((status = 200, body = MapProgress), ApiError))]
async fn show(
    State(state): State<AppState>,
    Path((id, step)): Path<(String, usize)>,
    Params(params): Params<LimitParams>,
) -> ApiResult<Json<MapProgress>> {
    let limits = params.limits()?;
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
#[utoipa::path(get, operation_id = "show_trackability_at_pixel", path = "/traverses/{id}/steps/{step}/trackability/pixel",
    tag = "trackability", params(("id" = String, Path), ("step" = usize, Path), PixelParams),
    responses((status = 200, body = PixelVerdict), ApiError))]
async fn at_pixel(
    State(state): State<AppState>,
    Path((id, step)): Path<(String, usize)>,
    Params(params): Params<PixelParams>,
) -> ApiResult<Json<PixelVerdict>> {
    let open = stop(&state, &id, step)?;
    let limits = LimitParams { limits: params.limits.clone() }.limits()?;
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
        .run(move || {
            let ground =
                ground(&work_state, &open, step, (&Settings::default(), &limits), &CancelFlag::default())?;
            Ok(Json(PixelVerdict::of(&open.traverse, &ground, place)))
        })
        .await
}

/// Stops making a map; asking for it again begins it anew
#[utoipa::path(post, operation_id = "cancel_trackability", path = "/traverses/{id}/steps/{step}/trackability/cancel",
    tag = "trackability", params(("id" = String, Path), ("step" = usize, Path), LimitParams),
    responses((status = 200, body = MapProgress), (status = 204, description = "Nothing was being made"), ApiError))]
async fn cancel(
    State(state): State<AppState>,
    Path((id, step)): Path<(String, usize)>,
    Params(params): Params<LimitParams>,
) -> ApiResult<Response> {
    let limits = params.limits()?;
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

impl Maps {
    fn find_or_begin(&self, traverse: &str, step: usize, limits: TrackabilityLimits) -> (Arc<Making>, bool) {
        let mut making = lock(&self.making);
        if let Some(known) = making.iter().find(|one| one.is_of(traverse, step, &limits)) {
            return (Arc::clone(known), false);
        }
        let progress = MapProgress { k: 0, n: 0, ended: false, failed: None, map: None };
        let (traverse, cancel) = (traverse.to_owned(), CancelFlag::default());
        let new = Arc::new(Making { traverse, step, limits, progress: Mutex::new(progress), cancel });
        making.push_back(Arc::clone(&new));
        // The oldest that is complete goes; those under way are few.
        if making.len() > MAPS
            && let Some(place) = making.iter().position(|one| lock(&one.progress).ended)
        {
            making.remove(place);
        }
        (new, true)
    }

    /// A map that is under way, taken out, so that the next who asks begins anew.
    fn take_unfinished(
        &self,
        traverse: &str,
        step: usize,
        limits: &TrackabilityLimits,
    ) -> Option<Arc<Making>> {
        let mut making = lock(&self.making);
        let place =
            making.iter().position(|one| one.is_of(traverse, step, limits) && !lock(&one.progress).ended)?;
        making.remove(place)
    }
}

impl Making {
    fn is_of(&self, traverse: &str, step: usize, limits: &TrackabilityLimits) -> bool {
        self.traverse == traverse && self.step == step && self.limits == *limits
    }

    /// Nothing more will come; the first reason stands.
    fn end(&self, why: Option<String>) {
        let mut progress = lock(&self.progress);
        if !progress.ended {
            (progress.ended, progress.failed) = (true, why);
        }
    }

    fn event(&self) -> Event {
        let progress = lock(&self.progress);
        let (traverse, step) = (self.traverse.clone(), self.step);
        Event::TrackabilityProgress { traverse, step, k: progress.k, n: progress.n, ended: progress.ended }
    }
}

/// Makes a map row by row.
fn make(state: &AppState, open: &OpenTraverse, making: &Making) -> Result<()> {
    let ground = ground(state, open, making.step, (&Settings::default(), &making.limits), &making.cancel)?;
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

/// What lies under the pixels of a stop, kept for the newest.
fn ground(
    state: &AppState,
    open: &OpenTraverse,
    step: usize,
    (settings, limits): (&Settings, &TrackabilityLimits),
    cancel: &CancelFlag,
) -> Result<Arc<Ground>> {
    let grounds = &state.maps().grounds;
    let is_same = |(id, ground): &&(String, Arc<Ground>)| {
        *id == open.id && ground.step == step && ground.settings == *settings && ground.limits == *limits
    };
    if let Some((_, known)) = lock(grounds).iter().find(is_same) {
        return Ok(Arc::clone(known));
    }
    open.make_ready(step, cancel)?;
    let made = Arc::new(Ground::new(&open.traverse, step, settings, limits)?);
    let mut grounds = lock(grounds);
    grounds.push_back((open.id.clone(), Arc::clone(&made)));
    let surplus = grounds.len().saturating_sub(GROUNDS);
    grounds.drain(..surplus);
    Ok(made)
}

/// The problem of a refused designation, with the nearest good pixel where there is one.
pub fn refusal(
    state: &AppState,
    open: &OpenTraverse,
    designation: Designation,
    settings: &Settings,
    error: Error,
) -> ApiError {
    let Designation { step, pixel: place } = designation;
    let is_refused = matches!(error, Error::Target(_)) && step < open.traverse.stop_count();
    let problem = ApiError::from(error);
    let [width, height] = if is_refused { open.traverse.left_camera(step).size } else { [0, 0] };
    if !place.is_inside(width, height) {
        return problem;
    }
    let limits = TrackabilityLimits::default();
    let found = ground(state, open, step, (settings, &limits), &CancelFlag::default())
        .ok()
        .and_then(|ground| pixel::nearest_good(&open.traverse, &ground, place));
    match found {
        Some(good) => problem
            .hint(format!("The nearest good pixel is ({:.0}, {:.0}).", good.x, good.y))
            .nearest_pixel(good),
        None => problem,
    }
}
