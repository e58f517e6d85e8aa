//! `traverses/{id}/steps/{step}/odometry`: the motion to a stop by visual odometry, with the fate of every corner.

use axum::Json;
use axum::extract::State;
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::ShowStopOdometry;
use sightline_api::location::AtStop;
use sightline_api::wire::StopOdometry;
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::MeasuredMotion;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::Path;
use crate::problem::{ApiError, ApiResult};
use crate::rendering::OpenTraverse;
use crate::routes::route::route;
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(route::<ShowStopOdometry>(routes!(show)))
}

/// The motion to a stop by visual odometry, with its corners
///
/// The update is recomputed from the images of the stop and the previous one, because no drive stores the corners.
#[utoipa::path(get, operation_id = "show_stop_odometry", path = ShowStopOdometry::PATH, tag = "traverses",
    responses((status = 200, body = StopOdometry), ApiError))]
async fn show(
    State(state): State<AppState>,
    Path(AtStop { id, step }): Path<ShowStopOdometry>,
) -> ApiResult<Json<StopOdometry>> {
    let open = state.traverse(&id)?;
    let measured = measured(&open, step)?.clone();
    let work_state = state.clone();
    let work = move |cancel: &_| {
        let odometry = work_state.odometry().of(&open, step, &measured, cancel)?;
        Ok(Json(StopOdometry::clone(&odometry)))
    };
    state.tries().run_until_dropped(work).await
}

/// The measured motion to a stop, or the reason why there is none.
fn measured(open: &OpenTraverse, step: usize) -> ApiResult<&MeasuredMotion> {
    if step >= open.traverse.stop_count() {
        return Err(ApiError::not_found(format!("The traverse has no step {step}.")));
    }
    if step == 0 {
        return Err(ApiError::not_found("Step 0 has no odometry, because no stop is before it."));
    }
    if open.traverse.is_awaited(step) {
        let problem = format!("Step {step} has no odometry yet: its images are not taken.");
        return Err(ApiError::conflict(problem));
    }
    open.traverse.measured_motion(step).ok_or_else(|| {
        let why = if open.commanded.is_some() {
            "the drive went there with visual odometry off"
        } else {
            "the traverse stores none; drives on commands run it"
        };
        ApiError::not_found(format!("Step {step} has no odometry: {why}."))
    })
}
