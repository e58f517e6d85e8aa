//! `sessions/{session}/breakpoints`: conditions that are looked for at all steps of all runs, with what they hit.

use axum::Json;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use sightline_core::session::Session;
use sightline_core::session::breakpoints::{BreakpointChange, BreakpointView, NewBreakpoint};
use sightline_core::session::expression::Refused;
use sightline_core::session::wire::ExpressionProblem;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{Body, Path};
use crate::jobs::blocking;
use crate::live::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::state::AppState;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(list, add)).routes(routes!(change, remove))
}

/// The breakpoints of a session, each with every step of every run at which it is true
#[utoipa::path(get, operation_id = "list_breakpoints", path = "/sessions/{session}/breakpoints", tag = "breakpoints",
    params(("session" = String, Path)), responses((status = 200, body = Vec<BreakpointView>), ApiError))]
async fn list(
    State(state): State<AppState>,
    Path(session): Path<String>,
) -> ApiResult<Json<Vec<BreakpointView>>> {
    let live = state.session(&session)?;
    blocking(move || Ok(Json(live.with(Session::breakpoint_views)))).await
}

/// Sets a breakpoint
///
/// It is a condition, or the stop to break at. One with the same condition is switched on instead.
#[utoipa::path(post, operation_id = "add_breakpoint", path = "/sessions/{session}/breakpoints", tag = "breakpoints",
    params(("session" = String, Path)), request_body = NewBreakpoint, responses((status = 201, body = BreakpointView),
    (status = 422, description = "What is wrong with the condition, and where", body = ExpressionProblem), ApiError))]
async fn add(
    State(state): State<AppState>,
    Path(session): Path<String>,
    Body(new): Body<NewBreakpoint>,
) -> ApiResult<Response> {
    let live = state.session(&session)?;
    let expression = match (new.expression, new.step) {
        (Some(expression), None) => expression,
        (None, Some(step)) => {
            let count = live.with(|session| session.stop_count);
            if step >= count {
                let detail = format!("step: the traverse has {count} stops, so {step} is none of them");
                return Err(ApiError::invalid("field", detail));
            }
            format!("step == {step}")
        }
        _ => return Err(ApiError::invalid("field", "give either `expression` or `step`")),
    };
    blocking(move || {
        let number =
            live.with(|session| session.add_breakpoint(&expression)).map_err(|wrong| refused(&wrong))?;
        state.changed(&live)?;
        let location = format!("/api/v1/sessions/{}/breakpoints/{number}", live.id);
        Ok((StatusCode::CREATED, [(header::LOCATION, location)], view(&live, number)?).into_response())
    })
    .await
}

/// Changes a breakpoint's condition, or switches it on or off
#[utoipa::path(patch, operation_id = "change_breakpoint", path = "/sessions/{session}/breakpoints/{breakpoint}",
    tag = "breakpoints", params(("session" = String, Path), ("breakpoint" = usize, Path)),
    request_body = BreakpointChange, responses((status = 200, body = BreakpointView),
    (status = 422, description = "What is wrong with the condition, and where", body = ExpressionProblem), ApiError))]
async fn change(
    State(state): State<AppState>,
    Path((session, number)): Path<(String, usize)>,
    Body(change): Body<BreakpointChange>,
) -> ApiResult<Json<BreakpointView>> {
    let live = state.session(&session)?;
    blocking(move || {
        live.with(|session| {
            session.breakpoint(number).map_err(|error| ApiError::from(error).about_path())?;
            if let Some(expression) = &change.expression {
                session.change_breakpoint(number, expression).map_err(|wrong| refused(&wrong))?;
            }
            if let Some(on) = change.on {
                session.switch_breakpoint(number, on)?;
            }
            Ok::<_, ApiError>(())
        })?;
        state.changed(&live)?;
        view(&live, number)
    })
    .await
}

/// Removes a breakpoint; its number is not used again
#[utoipa::path(delete, operation_id = "remove_breakpoint", path = "/sessions/{session}/breakpoints/{breakpoint}",
    tag = "breakpoints", params(("session" = String, Path), ("breakpoint" = usize, Path)),
    responses((status = 204, description = "It is gone"), ApiError))]
async fn remove(
    State(state): State<AppState>,
    Path((session, number)): Path<(String, usize)>,
) -> ApiResult<StatusCode> {
    let live = state.session(&session)?;
    blocking(move || {
        let removed = live.with(|session| session.remove_breakpoint(number));
        removed.map_err(|error| ApiError::from(error).about_path())?;
        state.changed(&live)?;
        Ok(StatusCode::NO_CONTENT)
    })
    .await
}

fn view(live: &LiveSession, number: usize) -> ApiResult<Json<BreakpointView>> {
    let found =
        live.with(|session| session.breakpoint_views().into_iter().find(|view| view.number == number));
    found.map(Json).ok_or_else(|| ApiError::not_found("There is no such breakpoint."))
}

/// What is wrong with an expression, with its place.
pub fn refused(wrong: &Refused) -> ApiError {
    let problem = ApiError::invalid("expression", format!("expression: {wrong}"));
    let problem = problem.place("expression", wrong.from, wrong.to);
    match &wrong.hint {
        Some(hint) => problem.hint(hint.clone()),
        None => problem,
    }
}
