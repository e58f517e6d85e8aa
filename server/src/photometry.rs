//! `…/photometry.csv`: how bright a target was at each stop, and under which angles (R136); the same for the command line.

use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use axum::extract::State;
use axum::response::Response;
use sightline_core::error::Result;
use sightline_core::estimate::photometry::photometry;
use sightline_core::settings::Settings;
use sightline_core::trace::StepTrace;
use sightline_core::traverse::Traverse;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::Path;
use crate::problem::{ApiError, ApiResult};
use crate::runs::{RunPath, download};
use crate::state::AppState;
use crate::traverses::CancelOnDrop;

/// The header of the table.
const HEADER: &str =
    "step,mean_level,std_level,exposure_s,rate_per_s,incidence_deg,emission_deg,phase_deg,range_m";

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(photometry_csv))
}

/// The target's light over a run: level, exposure, incidence, emission and phase of every accepted update
#[utoipa::path(get, operation_id = "run_photometry_csv", path = "/sessions/{session}/targets/{target}/runs/{run}/photometry.csv", tag = "runs", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path)),
    responses((status = 200, content_type = "text/csv", body = String), ApiError))]
async fn photometry_csv(
    State(state): State<AppState>,
    Path((session, target, run)): Path<RunPath>,
) -> ApiResult<Response> {
    let live = state.session(&session)?;
    let (settings, steps) = live
        .with(|session| {
            session.run(target, run).map(|found| (Arc::clone(&found.settings), found.steps.clone()))
        })
        .map_err(|error| ApiError::from(error).about_path())?;
    let name = format!("{}-target-{target}-run-{run}-photometry.csv", live.id);
    let cancel = CancelOnDrop::default();
    let flag = cancel.flag();
    // Exposures of a simulated drive may have to be metered again.
    let text =
        state.exports().run(move || Ok(table(&live.traverse.traverse, &steps, &settings, &flag)?)).await?;
    Ok(download("text/csv; charset=utf-8", &name, text))
}

/// The step with the image of its template, which a run lets go of once the next step is there.
fn with_image(traverse: &Traverse, trace: &Arc<StepTrace>) -> Result<Arc<StepTrace>> {
    let mut trace = Arc::clone(trace);
    let appearance = &trace.update.target.appearance;
    // Only the designation's window is read from the image; later steps keep theirs.
    if trace.judge.is_none() && appearance.step == trace.step && appearance.image.is_empty() {
        let image = traverse.capture(appearance.step)?.left;
        Arc::make_mut(&mut trace).update.target.appearance.image = image;
    }
    Ok(trace)
}

/// The light of all accepted updates of a run, as comma separated values; what is not known is empty.
///
/// # Errors
/// A simulated exposure that cannot be metered, or a cancelled one.
pub fn table(
    traverse: &Traverse,
    steps: &[Arc<StepTrace>],
    settings: &Settings,
    cancel: &AtomicBool,
) -> Result<String> {
    let mut text = format!("{HEADER}\n");
    for trace in steps {
        let light = traverse.light(trace.step, cancel)?;
        let pose = traverse.site_from_rover(trace.step);
        let trace = with_image(traverse, trace)?;
        let Some(found) = photometry(&trace, &pose, light.as_ref(), &settings.template) else { continue };
        let optional =
            [found.exposure_s, found.rate_per_s, found.incidence_deg, found.emission_deg, found.phase_deg]
                .map(|value| value.map_or_else(String::new, |value| value.to_string()))
                .join(",");
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{},{},{},{optional},{}",
            found.step, found.mean_level, found.std_level, found.range_m
        );
    }
    Ok(text)
}
