//! `expressions` and `sessions/{session}/query`: the expression language, and queries over all steps.

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
        .routes(route::<QuerySession>(routes!(query_session)))
}

/// The expression language: every name with unit, meaning and stage, every function, every unit
#[utoipa::path(get, operation_id = "show_expression_language", path = ShowExpressions::PATH, tag = "expressions",
    responses((status = 200, body = Language)))]
async fn show() -> ApiResult<Json<Language>> {
    blocking(|| Ok(Json(query::language()))).await
}

/// Completions at a position of an expression
#[utoipa::path(post, operation_id = "complete_expression", path = CompleteExpression::PATH, tag = "expressions",
    request_body = CompletionQuery, responses((status = 200, body = Completion), ApiError))]
async fn completion(Body(request): Body<CompleteExpression>) -> Json<Completion> {
    Json(complete(&request.text, request.cursor))
}

/// Evaluates an expression at every step of every run: where it is true, and its values
#[utoipa::path(post, operation_id = "query_session", path = QuerySession::PATH, tag = "expressions",
    request_body = Query, responses((status = 200, body = QueryAnswer),
    ExpressionRefusal, ApiError))]
async fn query_session(
    State(state): State<AppState>,
    SessionPath(live): SessionPath,
    Body(request): Body<QuerySession>,
) -> ApiResult<Json<QueryAnswer>> {
    let read = if request.values {
        Expression::column(&request.expression)
    } else {
        Expression::read(&request.expression)
    };
    let expression = read.map_err(|wrong| refused(&wrong))?;
    if let Some(target) = request.target {
        let there = live.with(|session| session.target(target).map(|_| ()));
        there
            .map_err(|_| ApiError::invalid("field", format!("target: the session has no target {target}")))?;
    }
    // The steps are shared, so the session is not locked during the query.
    let steps = live.with(|session| session.steps_of(request.target));
    state.queries().run(move || Ok(Json(query::ask(&expression, &steps, request.values)))).await
}
