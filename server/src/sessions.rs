//! `sessions`: a person's work on a traverse, and its cursor.

use axum::Json;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use sightline_core::session::Cursor;
use sightline_core::session::reproduce::Reproduction;
use sightline_core::session::view::SessionView;
use sightline_core::session::wire::{NewSession, SessionEntry};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::drives;
use crate::extract::{Body, Path};
use crate::jobs::blocking;
use crate::live::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::state::AppState;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(routes!(list, begin))
        .routes(routes!(bring))
        .routes(routes!(show))
        .routes(routes!(show_cursor, move_cursor))
}

/// The sessions on open traverses, oldest first
#[utoipa::path(get, operation_id = "list_sessions", path = "/sessions", tag = "sessions", responses((status = 200, body = Vec<SessionEntry>)))]
async fn list(State(state): State<AppState>) -> Json<Vec<SessionEntry>> {
    Json(state.sessions().iter().map(|live| entry(live)).collect())
}

fn entry(live: &LiveSession) -> SessionEntry {
    let traverse = &live.traverse.traverse;
    let used = live.used();
    let (target_count, run_count, step) = live.with(|session| {
        let targets = || session.targets.iter().filter(|target| !target.removed);
        let runs = targets().flat_map(|target| &target.runs).filter(|run| !run.removed);
        (targets().count(), runs.count(), session.cursor.step)
    });
    SessionEntry {
        id: live.id.clone(),
        traverse: live.traverse.id.clone(),
        target_count,
        traverse_name: traverse.index().name.clone(),
        run_count,
        step,
        stop_count: traverse.stop_count(),
        used: used.map(|used| used.to_string()),
        // A clock that was set back has nothing in the future.
        idle_s: used.map(|used| jiff::Timestamp::now().duration_since(used).as_secs_f64().max(0.0)),
    }
}

/// Begins a session
#[utoipa::path(post, operation_id = "begin_session", path = "/sessions", tag = "sessions", request_body = NewSession, responses(
    (status = 201, body = SessionView), ApiError))]
async fn begin(State(state): State<AppState>, Body(new): Body<NewSession>) -> ApiResult<Response> {
    let traverse = state.traverse(&new.traverse).map_err(|_| {
        let name = crate::plain(&new.traverse);
        ApiError::invalid("field", format!("traverse: there is no traverse {name}"))
    })?;
    blocking(move || {
        let live = state.begin_session(traverse)?;
        state.look_at(&live.traverse, 0);
        state.changed(&live)?;
        let location = [(header::LOCATION, format!("/api/v1/sessions/{}", live.id))];
        Ok((StatusCode::CREATED, location, Json(live.with(|session| session.view()))).into_response())
    })
    .await
}

/// Begins a session as it was elsewhere, from an exported `reproduce.json`
///
/// A simulated drive comes with its scenario; a recorded one must be open already. Targets, runs, breakpoints, cursor and
/// notes are as they were, and the runs are computed again.
#[utoipa::path(post, operation_id = "bring_session", path = "/sessions/reproduced", tag = "sessions", request_body = Reproduction, responses(
    (status = 201, body = SessionView), ApiError))]
async fn bring(State(state): State<AppState>, Body(new): Body<Reproduction>) -> ApiResult<Response> {
    let work_state = state.clone();
    let work = move || {
        let live = drives::bring(&work_state, new)?;
        let location = [(header::LOCATION, format!("/api/v1/sessions/{}", live.id))];
        Ok((StatusCode::CREATED, location, Json(live.with(|session| session.view()))).into_response())
    };
    state.designations().run(work).await
}

/// A session with its targets and runs
#[utoipa::path(get, operation_id = "show_session", path = "/sessions/{session}", tag = "sessions", params(("session" = String, Path)), responses(
    (status = 200, body = SessionView), ApiError))]
async fn show(State(state): State<AppState>, Path(session): Path<String>) -> ApiResult<Json<SessionView>> {
    let live = state.session(&session)?;
    Ok(Json(live.with(|session| session.view())))
}

/// What is looked at
#[utoipa::path(get, operation_id = "show_cursor", path = "/sessions/{session}/cursor", tag = "sessions", params(("session" = String, Path)),
    responses((status = 200, body = Cursor), ApiError))]
async fn show_cursor(State(state): State<AppState>, Path(session): Path<String>) -> ApiResult<Json<Cursor>> {
    Ok(Json(state.session(&session)?.with(|session| session.cursor)))
}

/// Moves the cursor
#[utoipa::path(put, operation_id = "move_cursor", path = "/sessions/{session}/cursor", tag = "sessions", params(("session" = String, Path)),
    request_body = Cursor, responses((status = 200, body = Cursor), ApiError))]
async fn move_cursor(
    State(state): State<AppState>,
    Path(session): Path<String>,
    Body(cursor): Body<Cursor>,
) -> ApiResult<Json<Cursor>> {
    let live = state.session(&session)?;
    blocking(move || {
        let before = live.with(|session| {
            let before = session.cursor;
            session.move_cursor(cursor).map(|()| before)
        })?;
        if before != cursor {
            state.look_at(&live.traverse, cursor.step);
            state.cursor_moved(&live, cursor);
        }
        Ok(Json(cursor))
    })
    .await
}
