//! `sessions/{session}/notes`: the user's notes on steps and stops.

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{AddNote, ChangeNote, ListNotes, RemoveNote, RestoreNote, ShowNote};
use sightline_api::event::Event;
use sightline_api::location::AtNote;
use sightline_session::Session;
use sightline_session::notes::{EditNote, NewNote, Note, Notes, Refused};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::clock::now;
use crate::extract::{Body, Path, SessionPath};
use crate::jobs::blocking;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::revision::{self, Read};
use crate::routes::route::{location, route};
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ListNotes>(routes!(list)))
        .routes(route::<AddNote>(routes!(add)))
        .routes(route::<ShowNote>(routes!(show)))
        .routes(route::<ChangeNote>(routes!(edit)))
        .routes(route::<RemoveNote>(routes!(remove)))
        .routes(route::<RestoreNote>(routes!(restore)))
}

/// The notes of a session, in their order
#[utoipa::path(get, operation_id = "list_notes", path = ListNotes::PATH, tag = "notes", responses((status = 200, body = Vec<Note>), ApiError))]
async fn list(SessionPath(live): SessionPath) -> ApiResult<Json<Vec<Note>>> {
    Ok(Json(live.with_notes(|notes| notes.list.clone())))
}

/// Adds a note at the end of the list
#[utoipa::path(post, operation_id = "add_note", path = AddNote::PATH, tag = "notes", request_body = NewNote, responses((status = 201, body = Note), ApiError))]
async fn add(
    State(state): State<AppState>,
    SessionPath(live): SessionPath,
    Body(new): Body<AddNote>,
) -> ApiResult<Response> {
    blocking(move || {
        let note = change(&state, &live, |session, notes| Ok(notes.add(new, session, &now())?))?;
        let at = AtNote { session: live.id.clone(), note: note.id };
        let headers = (revision::tag(note.revision), location::<ShowNote>(&at));
        Ok((StatusCode::CREATED, headers.0, headers.1, Json(note)).into_response())
    })
    .await
}

/// A note
#[utoipa::path(get, operation_id = "show_note", path = ShowNote::PATH, tag = "notes", responses((status = 200, body = Note), ApiError))]
async fn show(
    State(state): State<AppState>,
    Path(AtNote { session, note }): Path<ShowNote>,
) -> ApiResult<Response> {
    let found = state.session(&session)?.with_notes(|notes| notes.get(note).cloned());
    Ok(tagged(found.ok_or_else(|| missing(note))?))
}

/// Changes a note's text or its place in the list
///
/// The header `If-Match` names the revision that was read.
#[utoipa::path(patch, operation_id = "edit_note", path = ChangeNote::PATH, tag = "notes", params(("If-Match" = String, Header, pattern = r#"^("[0-9]{1,18}"|\*)$"#, description = "The revision in quotes, or *")),
    request_body = EditNote, responses((status = 200, body = Note), ApiError))]
async fn edit(
    State(state): State<AppState>,
    Path(AtNote { session, note }): Path<ChangeNote>,
    Read(read): Read,
    Body(edit): Body<ChangeNote>,
) -> ApiResult<Response> {
    let live = state.session(&session)?;
    blocking(move || {
        let edited = change(&state, &live, |_, notes| {
            notes.edit(note, read, edit, &now()).map_err(|refused| problem(note, refused))
        })?;
        Ok(tagged(edited))
    })
    .await
}

/// Removes a note, which can be restored
///
/// The header `If-Match` names the revision that was read.
#[utoipa::path(delete, operation_id = "remove_note", path = RemoveNote::PATH, tag = "notes", params(("If-Match" = String, Header, pattern = r#"^("[0-9]{1,18}"|\*)$"#, description = "The revision in quotes, or *")),
    responses((status = 204), ApiError))]
async fn remove(
    State(state): State<AppState>,
    Path(AtNote { session, note }): Path<RemoveNote>,
    Read(read): Read,
) -> ApiResult<StatusCode> {
    let live = state.session(&session)?;
    blocking(move || {
        change(&state, &live, |_, notes| notes.remove(note, read).map_err(|refused| problem(note, refused)))?;
        Ok(StatusCode::NO_CONTENT)
    })
    .await
}

/// Restores a removed note to its place
#[utoipa::path(post, operation_id = "restore_note", path = RestoreNote::PATH, tag = "notes", responses((status = 200, body = Note), ApiError))]
async fn restore(
    State(state): State<AppState>,
    Path(AtNote { session, note }): Path<RestoreNote>,
) -> ApiResult<Response> {
    let live = state.session(&session)?;
    blocking(move || {
        let back =
            change(&state, &live, |_, notes| notes.restore(note).map_err(|refused| problem(note, refused)))?;
        Ok(tagged(back))
    })
    .await
}

fn tagged(note: Note) -> Response {
    (revision::tag(note.revision), Json(note)).into_response()
}

fn missing(note: u64) -> ApiError {
    ApiError::not_found(format!("This session has no note {note}."))
}

fn problem(note: u64, refused: Refused) -> ApiError {
    match refused {
        Refused::Missing => missing(note),
        Refused::Changed(now) => revision::changed(&format!("Note {note}"), now.revision),
        Refused::Bad(why) => ApiError::invalid("field", why),
    }
}

/// Changes the notes, writes them and notifies every page.
fn change<T>(
    state: &AppState,
    live: &LiveSession,
    work: impl FnOnce(&Session, &mut Notes) -> ApiResult<T>,
) -> ApiResult<T> {
    let value = live.change_notes(state.store(), work)?;
    state.send_event(Event::NotesChanged { session: live.id.clone() });
    Ok(value)
}

/// The notes pinned to a step of a run, or to the stop only.
pub(crate) fn at_step(notes: &Notes, target: usize, run: usize, step: usize) -> Vec<Note> {
    let is_here = |note: &&Note| {
        note.pin.step == step && note.pin.target.is_none_or(|t| t == target && note.pin.run == run)
    };
    notes.list.iter().filter(is_here).cloned().collect()
}
