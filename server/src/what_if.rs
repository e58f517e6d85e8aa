//! `…/steps/{step}/what_if`: one step computed again with changed settings or a displaced prediction, not stored.

use axum::Json;
use axum::extract::State;
use sightline_core::frames::Pixel;
use sightline_core::session::what_if::{Ghost, WhatIf, try_step};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::asked::{Asked, StepPath};
use crate::extract::{Body, Path};
use crate::live::CancelFlag;
use crate::problem::{ApiError, ApiResult};
use crate::state::AppState;

/// How far outside every image a prediction may be put, px.
const PIXEL_LIMIT: f64 = 1e5;
/// How many arrays may be asked for at a time.
const ARRAY_LIMIT: usize = 8;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(what_if))
}

/// Tries a step with changed settings or a displaced prediction
///
/// From what the run's previous step left; nothing is stored. To go on like that, run the target again from this step
/// with the same settings and prediction.
#[utoipa::path(post, operation_id = "what_if", path = "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/what_if",
    tag = "why", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path), ("step" = usize, Path)),
    request_body = WhatIf, responses((status = 200, body = Ghost), ApiError))]
async fn what_if(
    State(state): State<AppState>,
    Path(path): Path<StepPath>,
    Body(what_if): Body<WhatIf>,
) -> ApiResult<Json<Ghost>> {
    check_pixel(what_if.prediction_px)?;
    if what_if.arrays.len() > ARRAY_LIMIT {
        let detail = format!("arrays: at most {ARRAY_LIMIT} can be asked for at a time");
        return Err(ApiError::invalid("field", detail));
    }
    let mut asked = Asked::find(&state, &path)?;
    let settings = asked.settings.with(&what_if.settings)?;
    state
        .tries()
        .run(move || {
            asked.prepare(&CancelFlag::default())?;
            let tried = try_step(&asked.live.traverse.traverse, asked.base(), &what_if)?;
            Ok(Json(Ghost::new(what_if, &tried, &asked.recorded, &settings)))
        })
        .await
}

/// Refuses a pixel that no prediction can have.
///
/// # Errors
/// A problem that names the field.
pub fn check_pixel(pixel: Option<Pixel>) -> ApiResult<()> {
    let is_far = |v: f64| !(-PIXEL_LIMIT..=PIXEL_LIMIT).contains(&v);
    match pixel.filter(|pixel| is_far(pixel.x) || is_far(pixel.y)) {
        Some(_) => Err(ApiError::invalid(
            "field",
            format!("prediction_px: x and y must be from -{PIXEL_LIMIT} to {PIXEL_LIMIT} px"),
        )),
        None => Ok(()),
    }
}
