//! `POST login`: exchanges the token for a cookie, which browsers send with images, downloads and WebSockets.

use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{AppendHeaders, IntoResponse};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::LogIn;
use sightline_api::wire::Login;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::Body;
use crate::problem::{ApiError, ApiResult};
use crate::routes::route::route;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(route::<LogIn>(routes!(log_in)))
}

/// Exchanges the access token for a cookie
///
/// The page calls it once, with the token from its address. Scripts send the token itself with every request:
/// `Authorization: Bearer TOKEN`.
#[utoipa::path(post, operation_id = "log_in", path = LogIn::PATH, tag = "about", request_body = Login, security(()),
    responses((status = 204, description = "The cookie is set, or the server asks for no token"), ApiError))]
async fn log_in(State(state): State<AppState>, Body(login): Body<LogIn>) -> ApiResult<impl IntoResponse> {
    let cookie = state.access().log_in(&login.token)?;
    Ok((StatusCode::NO_CONTENT, AppendHeaders(cookie.map(|cookie| (header::SET_COOKIE, cookie)))))
}
