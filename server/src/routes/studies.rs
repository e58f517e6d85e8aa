//! `studies`: the validation experiments as jobs, with their progress, their rows and their report.

use axum::Json;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{
    CancelStudy, ListStudies, ListStudyJobs, ResumeStudy, ShowStudyJob, ShowStudyReport, ShowStudyRows,
    StartStudy,
};
use sightline_api::location::AtStudyJob;
use sightline_geometry::error::Error;
use sightline_study::catalogue::{STUDIES, Study};
use sightline_study::plan::Plan;
use sightline_study::wire::{NewStudy, StudyInfo, StudyJob, StudyRows};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::{self, Body};
use crate::jobs::blocking;
use crate::problem::{ApiError, ApiResult};
use crate::routes::route::{location, route};
use crate::state::AppState;
use crate::study::order::order;

/// The content security policy of the report: it may only display itself.
const REPORT_POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; \
                             form-action 'none'; frame-ancestors 'self'; sandbox";

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ListStudies>(routes!(catalogue)))
        .routes(route::<ListStudyJobs>(routes!(list)))
        .routes(route::<StartStudy>(routes!(start)))
        .routes(route::<ShowStudyJob>(routes!(show)))
        .routes(route::<CancelStudy>(routes!(cancel)))
        .routes(route::<ResumeStudy>(routes!(resume)))
        .routes(route::<ShowStudyRows>(routes!(rows)))
        .routes(route::<ShowStudyReport>(routes!(report)))
}

/// The studies that can be started
#[utoipa::path(get, operation_id = "list_studies", path = ListStudies::PATH, tag = "studies", responses(
    (status = 200, body = Vec<StudyInfo>), ApiError))]
async fn catalogue() -> ApiResult<Json<Vec<StudyInfo>>> {
    let infos: Result<Vec<StudyInfo>, Error> = STUDIES.iter().map(info).collect();
    Ok(Json(infos?))
}

/// The studies that were started
#[utoipa::path(get, operation_id = "list_study_jobs", path = ListStudyJobs::PATH, tag = "studies", responses(
    (status = 200, body = Vec<StudyJob>), ApiError))]
async fn list(State(state): State<AppState>) -> Json<Vec<StudyJob>> {
    Json(state.studies().all())
}

/// Starts a study
///
/// Results of an earlier study with the same worlds, configurations and points are reused.
#[utoipa::path(post, operation_id = "start_study", path = StartStudy::PATH, tag = "studies", request_body = NewStudy,
    responses((status = 202, body = StudyJob), ApiError))]
async fn start(State(state): State<AppState>, Body(new): Body<StartStudy>) -> ApiResult<Response> {
    let job = blocking(move || {
        let order = order(state.studies().folder(), &new)?;
        state.studies().add(new, order)
    })
    .await?;
    let location = location::<ShowStudyJob>(&AtStudyJob { job: job.id.clone() });
    Ok((StatusCode::ACCEPTED, location, Json(job)).into_response())
}

/// The state of a study
#[utoipa::path(get, operation_id = "show_study_job", path = ShowStudyJob::PATH, tag = "studies",
    responses((status = 200, body = StudyJob), ApiError))]
async fn show(
    State(state): State<AppState>,
    extract::Path(AtStudyJob { job }): extract::Path<ShowStudyJob>,
) -> ApiResult<Json<StudyJob>> {
    Ok(Json(state.studies().study(&job)?.view()))
}

/// Stops a study; its results are kept
#[utoipa::path(post, operation_id = "cancel_study", path = CancelStudy::PATH, tag = "studies",
    responses((status = 200, body = StudyJob), ApiError))]
async fn cancel(
    State(state): State<AppState>,
    extract::Path(AtStudyJob { job }): extract::Path<CancelStudy>,
) -> ApiResult<Json<StudyJob>> {
    Ok(Json(state.studies().cancel(&job)?))
}

/// Resumes a stopped study
#[utoipa::path(post, operation_id = "resume_study", path = ResumeStudy::PATH, tag = "studies",
    responses((status = 202, body = StudyJob), ApiError))]
async fn resume(
    State(state): State<AppState>,
    extract::Path(AtStudyJob { job }): extract::Path<ResumeStudy>,
) -> ApiResult<(StatusCode, Json<StudyJob>)> {
    Ok((StatusCode::ACCEPTED, Json(state.studies().resume(&job)?)))
}

/// The table of a study, as far as computed
#[utoipa::path(get, operation_id = "study_rows", path = ShowStudyRows::PATH, tag = "studies",
    responses((status = 200, body = StudyRows), ApiError))]
async fn rows(
    State(state): State<AppState>,
    extract::Path(AtStudyJob { job }): extract::Path<ShowStudyRows>,
) -> ApiResult<Json<StudyRows>> {
    Ok(Json(StudyRows { rows: state.studies().study(&job)?.rows() }))
}

/// The report of a finished study, a self-contained page
#[utoipa::path(get, operation_id = "study_report", path = ShowStudyReport::PATH, tag = "studies",
    responses((status = 200, content_type = "text/html", body = String), ApiError))]
async fn report(
    State(state): State<AppState>,
    extract::Path(AtStudyJob { job }): extract::Path<ShowStudyReport>,
) -> ApiResult<Response> {
    let report = state.studies().study(&job)?.report();
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
        points_per_value: plan.points.len() / study.default_grid().len().max(1),
    })
}
