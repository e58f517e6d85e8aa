//! `expressions` and `sessions/{session}/query`: the language of expressions, and asking one at every step.

use axum::Json;
use axum::extract::State;
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{CompleteExpression, QuerySession, ShowExpressions};
use sightline_session::expression::Expression;
use sightline_session::expression::complete::{Completion, complete};
use sightline_session::query::{self, CompletionQuery, Language, Query, QueryAnswer};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{Body, SessionPath};
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult, ExpressionRefusal};
use crate::routes::breakpoints::refused;
use crate::routes::route::route;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ShowExpressions>(routes!(show)))
        .routes(route::<CompleteExpression>(routes!(completion)))
        .routes(route::<QuerySession>(routes!(ask)))
}

/// The language of expressions: every name with unit, meaning and stage, every function, every unit
#[utoipa::path(get, operation_id = "show_expression_language", path = ShowExpressions::PATH, tag = "expressions",
    responses((status = 200, body = Language)))]
async fn show() -> ApiResult<Json<Language>> {
    blocking(|| Ok(Json(query::language()))).await
}

/// What could be written at a place of an expression
#[utoipa::path(post, operation_id = "complete_expression", path = CompleteExpression::PATH, tag = "expressions",
    request_body = CompletionQuery, responses((status = 200, body = Completion), ApiError))]
async fn completion(Body(asked): Body<CompleteExpression>) -> Json<Completion> {
    Json(complete(&asked.text, asked.cursor))
}

/// Asks an expression at every step of every run: where it is true, and what its values are
#[utoipa::path(post, operation_id = "query_session", path = QuerySession::PATH, tag = "expressions",
    request_body = Query, responses((status = 200, body = QueryAnswer),
    ExpressionRefusal, ApiError))]
async fn ask(
    State(state): State<AppState>,
    SessionPath(live): SessionPath,
    Body(asked): Body<QuerySession>,
) -> ApiResult<Json<QueryAnswer>> {
    let read = if asked.values {
        Expression::column(&asked.expression)
    } else {
        Expression::read(&asked.expression)
    };
    let expression = read.map_err(|wrong| refused(&wrong))?;
    if let Some(target) = asked.target {
        let there = live.with(|session| session.target(target).map(|_| ()));
        there
            .map_err(|_| ApiError::invalid("field", format!("target: the session has no target {target}")))?;
    }
    // The steps are shared, so that the session is free while they are asked.
    let steps = live.with(|session| session.steps_of(asked.target));
    state.queries().run(move || Ok(Json(query::ask(&expression, &steps, asked.values)))).await
}
