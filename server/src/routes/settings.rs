//! `GET settings`: every setting with unit, default, range and source.

use axum::Json;
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::ListSettings;
use sightline_track::limits::SettingInfo;
use sightline_track::settings::Settings;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::routes::route::route;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(route::<ListSettings>(routes!(table)))
}

/// The table of settings
#[utoipa::path(get, operation_id = "list_settings", path = ListSettings::PATH, tag = "settings", responses((status = 200, body = Vec<SettingInfo>)))]
async fn table() -> Json<Vec<SettingInfo>> {
    Json(Settings::table())
}
