//! `sessions`: a user's work on a traverse, and its cursor.

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{
    BeginSession, BringSession, ListSessions, MoveCursor, ShowCursor, ShowSession,
};
use sightline_api::location::AtSession;
use sightline_api::wire::{NewSession, SessionEntry};
use sightline_session::Cursor;
use sightline_session::reproduce::Reproduction;
use sightline_session::view::SessionView;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::cancel::CancelFlag;
use crate::extract::{Body, SessionPath};
use crate::import_session;
use crate::jobs::blocking;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::routes::route::{location, route};
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ListSessions>(routes!(list)))
        .routes(route::<BeginSession>(routes!(begin)))
        .routes(route::<BringSession>(routes!(import_session)))
        .routes(route::<ShowSession>(routes!(show)))
        .routes(route::<ShowCursor>(routes!(show_cursor)))
        .routes(route::<MoveCursor>(routes!(move_cursor)))
}

/// The sessions on open traverses, oldest first
#[utoipa::path(get, operation_id = "list_sessions", path = ListSessions::PATH, tag = "sessions", responses((status = 200, body = Vec<SessionEntry>)))]
async fn list(State(state): State<AppState>) -> Json<Vec<SessionEntry>> {
    Json(state.sessions().iter().map(|live| entry(live)).collect())
}

fn entry(live: &LiveSession) -> SessionEntry {
    let open = live.traverse();
    let traverse = &open.traverse;
    let used = live.used();
    let (target_count, run_count, step) = live.with(|session| {
        let targets = || session.targets.iter().filter(|target| !target.removed);
        let runs = targets().flat_map(|target| &target.runs).filter(|run| !run.removed);
        (targets().count(), runs.count(), session.cursor.step)
    });
    SessionEntry {
        id: live.id.clone(),
        traverse: live.traverse().id.clone(),
        target_count,
        traverse_name: traverse.index().name.clone(),
        run_count,
        step,
        stop_count: traverse.stop_count(),
        used: used.map(|used| used.to_string()),
        // If the clock was set back, the time would be negative.
        idle_s: used.map(|used| jiff::Timestamp::now().duration_since(used).as_secs_f64().max(0.0)),
    }
}

/// Begins a session
#[utoipa::path(post, operation_id = "begin_session", path = BeginSession::PATH, tag = "sessions", request_body = NewSession, responses(
    (status = 201, body = SessionView), ApiError))]
async fn begin(State(state): State<AppState>, Body(new): Body<BeginSession>) -> ApiResult<Response> {
    let traverse = state.traverse(&new.traverse).map_err(|_| {
        let name = crate::printable::printable(&new.traverse);
        ApiError::invalid("field", format!("traverse: there is no traverse {name}"))
    })?;
    blocking(move || {
        let live = state.begin_session(traverse)?;
        state.prefetch_from(&live.traverse(), 0);
        let location = location::<ShowSession>(&AtSession { session: live.id.clone() });
        Ok((StatusCode::CREATED, location, Json(state.view(&live))).into_response())
    })
    .await
}

/// Creates a session from an exported `reproduce.json`
///
/// The file contains the scenario of a simulated drive; a recorded drive must already be open. Targets, runs, breakpoints,
/// cursor and notes are restored, and the runs are recomputed.
#[utoipa::path(post, operation_id = "bring_session", path = BringSession::PATH, tag = "sessions", request_body = Reproduction, responses(
    (status = 201, body = SessionView), ApiError))]
async fn import_session(State(state): State<AppState>, Body(new): Body<BringSession>) -> ApiResult<Response> {
    let work_state = state.clone();
    let work = move |cancel: &CancelFlag| {
        let live = import_session::import_session(&work_state, new, cancel)?;
        let location = location::<ShowSession>(&AtSession { session: live.id.clone() });
        Ok((StatusCode::CREATED, location, Json(work_state.view(&live))).into_response())
    };
    state.designations().run_until_dropped(work).await
}

/// A session with its targets and runs
#[utoipa::path(get, operation_id = "show_session", path = ShowSession::PATH, tag = "sessions", responses(
    (status = 200, body = SessionView), ApiError))]
async fn show(State(state): State<AppState>, SessionPath(live): SessionPath) -> ApiResult<Json<SessionView>> {
    Ok(Json(state.view(&live)))
}

/// The selection
#[utoipa::path(get, operation_id = "show_cursor", path = ShowCursor::PATH, tag = "sessions", responses((status = 200, body = Cursor), ApiError))]
async fn show_cursor(SessionPath(live): SessionPath) -> ApiResult<Json<Cursor>> {
    Ok(Json(live.with(|session| session.cursor)))
}

/// Moves the cursor
#[utoipa::path(put, operation_id = "move_cursor", path = MoveCursor::PATH, tag = "sessions", request_body = Cursor, responses((status = 200, body = Cursor), ApiError))]
async fn move_cursor(
    State(state): State<AppState>,
    SessionPath(live): SessionPath,
    Body(cursor): Body<MoveCursor>,
) -> ApiResult<Json<Cursor>> {
    blocking(move || {
        let before = live.with(|session| {
            let before = session.cursor;
            session.move_cursor(cursor).map(|()| before)
        })?;
        if before != cursor {
            state.prefetch_from(&live.traverse(), cursor.step);
            state.move_cursor(&live, cursor);
        }
        Ok(Json(cursor))
    })
    .await
}
