//! `…/photometry.csv`: brightness of a target at each stop, with the photometric angles (R136); also for the command line.

use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::ShowPhotometry;
use sightline_geometry::error::Result;
use sightline_recordings::Traverse;
use sightline_session::photometry::photometry;
use sightline_session::step::RunStep;
use sightline_track::settings::Settings;
use sightline_world::traverse::StopLight;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::cancel::CancelOnDrop;
use crate::extract::RunPath;
use crate::problem::{ApiError, ApiResult};
use crate::routes::route::route;
use crate::state::AppState;

/// The header of the table.
const HEADER: &str =
    "step,mean_level,std_level,exposure_s,rate_per_s,incidence_deg,emission_deg,phase_deg,range_m";

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(route::<ShowPhotometry>(routes!(photometry_csv)))
}

/// The target's illumination over a run: level, exposure, incidence, emission and phase of every accepted update
#[utoipa::path(get, operation_id = "run_photometry_csv", path = ShowPhotometry::PATH, tag = "runs", responses((status = 200, content_type = "text/csv", body = String), ApiError))]
async fn photometry_csv(State(state): State<AppState>, path: RunPath) -> ApiResult<Response> {
    let (settings, steps) = path.with_run(|_, run| (Arc::clone(&run.settings), run.steps.clone()))?;
    let RunPath { live, target, run } = path;
    let name = format!("{}-target-{target}-run-{run}-photometry.csv", live.id);
    let cancel = CancelOnDrop::default();
    let flag = cancel.flag();
    // Exposures of a simulated drive may have to be metered again.
    let text =
        state.exports().run(move || Ok(table(&live.traverse().traverse, &steps, &settings, &flag)?)).await?;
    Ok(download("text/csv; charset=utf-8", &name, text))
}

/// A download with the file name `name`, which the server composes.
fn download(media_type: &'static str, name: &str, text: String) -> Response {
    let disposition = format!("attachment; filename=\"{name}\"");
    let headers = [(header::CONTENT_TYPE, media_type.to_owned()), (header::CONTENT_DISPOSITION, disposition)];
    (headers, text).into_response()
}

/// Adds the left image to the designation, because recorded steps do not store it; later steps are unchanged.
fn with_image(traverse: &Traverse, trace: &Arc<RunStep>) -> Result<Arc<RunStep>> {
    let mut trace = Arc::clone(trace);
    let is_designation = trace.verdict().is_none() && trace.update.target.designation.step == trace.step;
    if is_designation && trace.capture().is_some_and(|capture| capture.pair.left.is_empty()) {
        let left = traverse.capture_one(trace.step, trace.update.target.designation.camera, true)?;
        if let Some(capture) = Arc::make_mut(&mut trace).capture_mut() {
            capture.pair.left = left;
        }
    }
    Ok(trace)
}

/// The illumination at all accepted updates of a run, as CSV; unknown values are empty.
///
/// # Errors
/// A simulated exposure that cannot be metered, or a cancellation.
pub(crate) fn table(
    traverse: &Traverse,
    steps: &[Arc<RunStep>],
    settings: &Settings,
    cancel: &AtomicBool,
) -> Result<String> {
    let mut text = format!("{HEADER}\n");
    for trace in steps {
        let is_of_main = trace.update.target.designation.camera.is_none();
        // The exposure of a stop is that of its main pair.
        let exposed =
            |light: StopLight| StopLight { exposure_s: light.exposure_s.filter(|_| is_of_main), ..light };
        let light = traverse.light(trace.step, cancel)?.map(exposed);
        let pose = traverse.site_from_rover(trace.step);
        let trace = with_image(traverse, trace)?;
        let Some(found) = photometry(&trace, &pose, light.as_ref(), &settings.template) else { continue };
        let optional =
            [found.exposure_s, found.rate_per_s, found.incidence_deg, found.emission_deg, found.phase_deg]
                .map(|value| value.map_or_else(String::new, |value| value.to_string()))
                .join(",");
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{},{},{},{optional},{}",
            found.step, found.mean_level, found.std_level, found.range_m
        );
    }
    Ok(text)
}
