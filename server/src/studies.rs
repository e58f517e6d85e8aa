//! `studies`: the validation experiments as jobs, with their progress, their rows and their report.

use std::path::Path;

use axum::Json;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use sightline_core::error::Error;
use sightline_core::study::catalogue::{STUDIES, Study};
use sightline_core::study::plan::Plan;
use sightline_core::study::wire::{NewStudy, StudyInfo, StudyJob, StudyRows};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{self, Body};
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult};
use crate::state::{AppState, hash};
use crate::study::{Order, Seeds};

/// The most worlds of a study that is started here.
const WORLD_LIMIT: u64 = 100;
/// The largest seed that a browser takes exactly.
const SEED_LIMIT: u64 = 1 << 53;

/// What the report may do: show itself.
const REPORT_POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; \
                             form-action 'none'; frame-ancestors 'self'; sandbox";

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(routes!(catalogue))
        .routes(routes!(list, start))
        .routes(routes!(show))
        .routes(routes!(cancel))
        .routes(routes!(resume))
        .routes(routes!(rows))
        .routes(routes!(report))
}

/// The studies that can be started
#[utoipa::path(get, operation_id = "list_studies", path = "/studies", tag = "studies", responses(
    (status = 200, body = Vec<StudyInfo>), ApiError))]
async fn catalogue() -> ApiResult<Json<Vec<StudyInfo>>> {
    let infos: Result<Vec<StudyInfo>, Error> = STUDIES.iter().map(info).collect();
    Ok(Json(infos?))
}

/// The studies that were started
#[utoipa::path(get, operation_id = "list_study_jobs", path = "/studies/jobs", tag = "studies", responses(
    (status = 200, body = Vec<StudyJob>), ApiError))]
async fn list(State(state): State<AppState>) -> Json<Vec<StudyJob>> {
    Json(state.studies().all())
}

/// Starts a study
///
/// What is kept of an earlier one with the same worlds, configurations and points is not done again.
#[utoipa::path(post, operation_id = "start_study", path = "/studies/jobs", tag = "studies", request_body = NewStudy,
    responses((status = 202, body = StudyJob), ApiError))]
async fn start(State(state): State<AppState>, Body(new): Body<NewStudy>) -> ApiResult<Response> {
    let job = blocking(move || {
        let order = order(state.studies().folder(), &new)?;
        state.studies().add(new, order)
    })
    .await?;
    let location = [(header::LOCATION, format!("/api/v1/studies/jobs/{}", job.id))];
    Ok((StatusCode::ACCEPTED, location, Json(job)).into_response())
}

/// How a study stands
#[utoipa::path(get, operation_id = "show_study_job", path = "/studies/jobs/{job}", tag = "studies",
    params(("job" = String, Path)), responses((status = 200, body = StudyJob), ApiError))]
async fn show(
    State(state): State<AppState>,
    extract::Path(job): extract::Path<String>,
) -> ApiResult<Json<StudyJob>> {
    Ok(Json(state.studies().work(&job)?.view()))
}

/// Stops a study; what it found is kept
#[utoipa::path(post, operation_id = "cancel_study", path = "/studies/jobs/{job}/cancel", tag = "studies",
    params(("job" = String, Path)), responses((status = 200, body = StudyJob), ApiError))]
async fn cancel(
    State(state): State<AppState>,
    extract::Path(job): extract::Path<String>,
) -> ApiResult<Json<StudyJob>> {
    Ok(Json(state.studies().cancel(&job)?))
}

/// Lets a stopped study go on
#[utoipa::path(post, operation_id = "resume_study", path = "/studies/jobs/{job}/resume", tag = "studies",
    params(("job" = String, Path)), responses((status = 202, body = StudyJob), ApiError))]
async fn resume(
    State(state): State<AppState>,
    extract::Path(job): extract::Path<String>,
) -> ApiResult<(StatusCode, Json<StudyJob>)> {
    Ok((StatusCode::ACCEPTED, Json(state.studies().resume(&job)?)))
}

/// The table of a study, as far as it is
#[utoipa::path(get, operation_id = "study_rows", path = "/studies/jobs/{job}/rows", tag = "studies",
    params(("job" = String, Path)), responses((status = 200, body = StudyRows), ApiError))]
async fn rows(
    State(state): State<AppState>,
    extract::Path(job): extract::Path<String>,
) -> ApiResult<Json<StudyRows>> {
    Ok(Json(StudyRows { rows: state.studies().work(&job)?.rows() }))
}

/// The report of a study that is done, a page that needs no other
#[utoipa::path(get, operation_id = "study_report", path = "/studies/jobs/{job}/report.html", tag = "studies",
    params(("job" = String, Path)), responses((status = 200, content_type = "text/html", body = String), ApiError))]
async fn report(
    State(state): State<AppState>,
    extract::Path(job): extract::Path<String>,
) -> ApiResult<Response> {
    let report = state.studies().work(&job)?.report();
    let report =
        report.ok_or_else(|| ApiError::conflict("The study is not done, so that it has no report."))?;
    let headers = [
        (header::CONTENT_TYPE, "text/html; charset=utf-8"),
        (header::CONTENT_SECURITY_POLICY, REPORT_POLICY),
    ];
    Ok((headers, report).into_response())
}

fn info(study: &Study) -> Result<StudyInfo, Error> {
    let plan = Plan::new(study.name, &[], &[])?;
    let owned = |words: &[&str]| words.iter().map(|&word| word.to_owned()).collect::<Vec<String>>();
    Ok(StudyInfo {
        name: study.name.to_owned(),
        question: study.question.to_owned(),
        variable: study.variable.to_owned(),
        unit: study.unit.to_owned(),
        grid: owned(study.default_grid()),
        configurations: owned(&study.default_configurations()),
        scenarios: owned(&plan.scenarios()),
    })
}

/// What is to be done for a study that is asked for, with its worlds below `folder`.
///
/// # Errors
/// A problem that names what is wrong with it.
pub fn order(folder: &Path, new: &NewStudy) -> ApiResult<Order> {
    let plan = Plan::new(&new.study, &new.configurations, &new.grid)?;
    let seeds = seeds(new)?;
    let scenario = match &new.scenario {
        Some(scenario) => {
            scenario.validate()?;
            // Its worlds have a folder of their own.
            Some((format!("own-{}", &hash(scenario.to_toml().as_bytes())[..12]), scenario.clone()))
        }
        None => None,
    };
    let command = command(new, &plan, &seeds);
    Ok(Order { plan, seeds, scenario, folder: folder.to_owned(), command })
}

fn seeds(new: &NewStudy) -> ApiResult<Seeds> {
    let wrong = |field: &str, why: String| Err(ApiError::invalid("field", format!("{field}: {why}")));
    if new.seeds.is_empty() {
        let (worlds, first) = (new.worlds.unwrap_or(10), new.first_seed.unwrap_or(1));
        if !(1..=WORLD_LIMIT).contains(&worlds) {
            return wrong("worlds", format!("must be from 1 to {WORLD_LIMIT}, not {worlds}"));
        }
        // Ten seeds are tried for each world.
        if first > SEED_LIMIT - 10 * WORLD_LIMIT {
            return wrong("first_seed", format!("{first} is too large"));
        }
        return Ok(Seeds::Count { worlds, first });
    }
    if new.worlds.is_some() || new.first_seed.is_some() {
        return wrong("seeds", "leave out worlds and first_seed, or the seeds".to_owned());
    }
    if new.seeds.len() as u64 > WORLD_LIMIT {
        return wrong("seeds", format!("may be at most {WORLD_LIMIT}, not {}", new.seeds.len()));
    }
    match new.seeds.iter().find(|seed| **seed > SEED_LIMIT) {
        Some(seed) => wrong("seeds", format!("{seed} is above 2^53")),
        None => Ok(Seeds::Named(new.seeds.clone())),
    }
}

/// The command line that does the same.
fn command(new: &NewStudy, plan: &Plan, seeds: &Seeds) -> String {
    let worlds = match seeds {
        Seeds::Named(seeds) => {
            format!("--seeds {}", seeds.iter().map(u64::to_string).collect::<Vec<_>>().join(","))
        }
        Seeds::Count { worlds, first } => format!("--worlds {worlds} --first-seed {first}"),
    };
    let names: Vec<&str> = plan.configurations.iter().map(|c| c.name.as_str()).collect();
    let grid = if new.grid.is_empty() { String::new() } else { format!(" --grid {}", new.grid.join(",")) };
    format!("sightline study {} {worlds} --configurations {}{grid}", plan.study.name, names.join(","))
}
