//! `sessions`: a person's work on a traverse, and its cursor.

use axum::Json;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use sightline_core::session::Cursor;
use sightline_core::session::view::SessionView;
use sightline_core::session::wire::{NewSession, SessionEntry};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{Body, Path};
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult};
use crate::state::AppState;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(list, begin)).routes(routes!(show)).routes(routes!(move_cursor))
}

/// The sessions on open traverses, oldest first
#[utoipa::path(get, operation_id = "list_sessions", path = "/sessions", tag = "sessions", responses((status = 200, body = Vec<SessionEntry>)))]
async fn list(State(state): State<AppState>) -> Json<Vec<SessionEntry>> {
    let entries = state.sessions().into_iter().map(|live| SessionEntry {
        id: live.id.clone(),
        traverse: live.traverse.id.clone(),
        target_count: live.with(|session| session.targets.iter().filter(|target| !target.removed).count()),
    });
    Json(entries.collect())
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

/// A session with its targets and runs
#[utoipa::path(get, operation_id = "show_session", path = "/sessions/{session}", tag = "sessions", params(("session" = String, Path)), responses(
    (status = 200, body = SessionView), ApiError))]
async fn show(State(state): State<AppState>, Path(session): Path<String>) -> ApiResult<Json<SessionView>> {
    let live = state.session(&session)?;
    Ok(Json(live.with(|session| session.view())))
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
