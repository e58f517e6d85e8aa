//! `GET settings`: every setting with unit, default, range and source.

use axum::Json;
use sightline_core::limits::SettingInfo;
use sightline_core::settings::Settings;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::state::AppState;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(table))
}

/// The table of settings
#[utoipa::path(get, operation_id = "list_settings", path = "/settings", tag = "settings", responses((status = 200, body = Vec<SettingInfo>)))]
async fn table() -> Json<Vec<SettingInfo>> {
    Json(Settings::table())
}
