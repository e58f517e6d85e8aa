//! `sessions/{session}/breakpoints`: conditions evaluated at all steps of all runs, with their hits.

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{AddBreakpoint, ChangeBreakpoint, ListBreakpoints, RemoveBreakpoint};
use sightline_api::location::AtBreakpoint;
use sightline_session::Session;
use sightline_session::breakpoints::{BreakpointChange, BreakpointView, NewBreakpoint};
use sightline_session::expression::Refused;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{Body, Path, SessionPath};
use crate::jobs::blocking;
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult, ExpressionRefusal};
use crate::routes::route::{location, route};
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ListBreakpoints>(routes!(list)))
        .routes(route::<AddBreakpoint>(routes!(add)))
        .routes(route::<ChangeBreakpoint>(routes!(change)))
        .routes(route::<RemoveBreakpoint>(routes!(remove)))
}

/// The breakpoints of a session, each with every step of every run at which it is true
#[utoipa::path(get, operation_id = "list_breakpoints", path = ListBreakpoints::PATH, tag = "breakpoints",
    responses((status = 200, body = Vec<BreakpointView>), ApiError))]
async fn list(SessionPath(live): SessionPath) -> ApiResult<Json<Vec<BreakpointView>>> {
    blocking(move || Ok(Json(live.with(Session::breakpoint_views)))).await
}

/// Sets a breakpoint
///
/// It is a condition or a stop. An existing breakpoint with the same condition is enabled instead.
#[utoipa::path(post, operation_id = "add_breakpoint", path = AddBreakpoint::PATH, tag = "breakpoints",
    request_body = NewBreakpoint, responses((status = 201, body = BreakpointView),
    ExpressionRefusal, ApiError))]
async fn add(
    State(state): State<AppState>,
    SessionPath(live): SessionPath,
    Body(new): Body<AddBreakpoint>,
) -> ApiResult<Response> {
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
        let number = state
            .change(&live, |session| session.add_breakpoint(&expression).map_err(|wrong| refused(&wrong)))?;
        let at = AtBreakpoint { session: live.id.clone(), breakpoint: number };
        Ok((StatusCode::CREATED, location::<ChangeBreakpoint>(&at), view(&live, number)?).into_response())
    })
    .await
}

/// Changes a breakpoint's condition, or switches it on or off
#[utoipa::path(patch, operation_id = "change_breakpoint", path = ChangeBreakpoint::PATH,
    tag = "breakpoints", request_body = BreakpointChange, responses((status = 200, body = BreakpointView),
    ExpressionRefusal, ApiError))]
async fn change(
    State(state): State<AppState>,
    Path(AtBreakpoint { session, breakpoint: number }): Path<ChangeBreakpoint>,
    Body(change): Body<ChangeBreakpoint>,
) -> ApiResult<Json<BreakpointView>> {
    let live = state.session(&session)?;
    blocking(move || {
        state.change(&live, |session| {
            session.breakpoint(number).map_err(|error| ApiError::from(error).about_path())?;
            if let Some(expression) = &change.expression {
                session.change_breakpoint(number, expression).map_err(|wrong| refused(&wrong))?;
            }
            if let Some(on) = change.on {
                session.switch_breakpoint(number, on)?;
            }
            Ok(())
        })?;
        view(&live, number)
    })
    .await
}

/// Removes a breakpoint; its number is not reused
#[utoipa::path(delete, operation_id = "remove_breakpoint", path = RemoveBreakpoint::PATH,
    tag = "breakpoints", responses((status = 204, description = "It is gone"), ApiError))]
async fn remove(
    State(state): State<AppState>,
    Path(AtBreakpoint { session, breakpoint: number }): Path<RemoveBreakpoint>,
) -> ApiResult<StatusCode> {
    let live = state.session(&session)?;
    blocking(move || {
        state.change(&live, |session| {
            session.remove_breakpoint(number).map_err(|error| ApiError::from(error).about_path())
        })?;
        Ok(StatusCode::NO_CONTENT)
    })
    .await
}

fn view(live: &LiveSession, number: usize) -> ApiResult<Json<BreakpointView>> {
    let found =
        live.with(|session| session.breakpoint_views().into_iter().find(|view| view.number == number));
    found.map(Json).ok_or_else(|| ApiError::not_found("There is no such breakpoint."))
}

/// The problem of an invalid expression, with the position of the error.
pub(crate) fn refused(wrong: &Refused) -> ApiError {
    let problem = ApiError::invalid("expression", format!("expression: {wrong}"));
    let problem = problem.with_range("expression", wrong.from, wrong.to);
    match &wrong.hint {
        Some(hint) => problem.hint(hint.clone()),
        None => problem,
    }
}
