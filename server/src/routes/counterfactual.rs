//! `…/steps/{step}/counterfactual`: which changes would have prevented a failed step, as a job with intermediate results.
//!
//! One question per step; recorded steps never change, so answers stay valid. Questions have their own lane, so that runs do
//! not wait for them; the cancel flag is checked between two trials.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use axum::Json;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use sightline_api::endpoint::Endpoint;
use sightline_api::endpoints::{AskCounterfactual, CancelCounterfactual, ShowCounterfactual};
use sightline_api::location::AtStep;
use sightline_geometry::error::Error;
use sightline_session::counterfactual::wire::{Question, QuestionState};
use sightline_session::counterfactual::{self, Answer};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::extract::Path;
use crate::jobs::{blocking, lock};
use crate::live_session::LiveSession;
use crate::problem::{ApiError, ApiResult};
use crate::questions::QuestionJob;
use crate::recorded_step::RecordedStep;
use crate::routes::route::{location, route};
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ShowCounterfactual>(routes!(show)))
        .routes(route::<AskCounterfactual>(routes!(ask_question)))
        .routes(route::<CancelCounterfactual>(routes!(cancel)))
}

/// Asks which changes would have prevented the failure of a step
///
/// For each setting, and for the prediction, finds the smallest change with which the step would have been accepted,
/// verified by recomputing the step. A repeated request returns the existing question.
#[utoipa::path(post, operation_id = "ask_counterfactual",
    path = AskCounterfactual::PATH, tag = "why", responses((status = 202, body = Question), ApiError))]
async fn ask_question(
    State(state): State<AppState>,
    Path(at): Path<AskCounterfactual>,
    step: RecordedStep,
) -> ApiResult<Response> {
    let location = location::<ShowCounterfactual>(&at);
    let question = blocking(move || begin(&state, at, step)).await?;
    Ok((StatusCode::ACCEPTED, location, Json(question)).into_response())
}

/// The changes that would have prevented the failure of a step, as far as computed
#[utoipa::path(get, operation_id = "show_counterfactual",
    path = ShowCounterfactual::PATH, tag = "why", responses((status = 200, body = Question), ApiError))]
async fn show(
    State(state): State<AppState>,
    Path(at): Path<ShowCounterfactual>,
) -> ApiResult<Json<Question>> {
    if let Ok(job) = state.questions().find(&at) {
        // A question interrupted by shutdown resumes with its session, which is woken here.
        state.session(&at.session)?;
        return Ok(Json(job.view()));
    }
    // An unasked question has an answer, too; a step that does not exist is an error.
    RecordedStep::find(&state, &at)?;
    let AtStep { session, target, run, step } = at;
    let (state, answer, problem) = (QuestionState::Unasked, None, None);
    Ok(Json(Question { session, target, run, step, state, answer, problem }))
}

/// Cancels the search; the findings so far are kept
#[utoipa::path(post, operation_id = "cancel_counterfactual",
    path = CancelCounterfactual::PATH, tag = "why", responses((status = 200, body = Question), ApiError))]
async fn cancel(
    State(state): State<AppState>,
    Path(at): Path<CancelCounterfactual>,
) -> ApiResult<Json<Question>> {
    let job = state.questions().find(&at)?;
    {
        let mut question = lock(&job.question);
        if question.state.is_over() {
            return Err(ApiError::conflict("The question has ended already."));
        }
        job.cancel.store(true, Ordering::Relaxed);
        // Later findings are discarded.
        question.state = QuestionState::Cancelled;
    }
    state.send_event(job.progress());
    let (own, question) = (state.clone(), job.view());
    blocking(move || {
        own.store().save_or_defer_question(&question);
        Ok(())
    })
    .await?;
    Ok(Json(job.view()))
}

/// Starts to answer a question, unless it is in progress or answered.
fn begin(state: &AppState, path: AtStep, failed_step: RecordedStep) -> ApiResult<Question> {
    counterfactual::goal(&failed_step.base())?;
    let (job, is_new) = state.questions().begin(path.clone(), state.store())?;
    if is_new {
        let (own_state, own_job) = (state.clone(), Arc::clone(&job));
        let submitted = state.answers().submit(move || answer(&own_state, &own_job, failed_step));
        submitted.inspect_err(|_| state.questions().forget(&path, state.store()))?;
    }
    Ok(job.view())
}

/// Resumes the questions of a restored session, after its runs are recomputed.
pub(crate) fn resume_questions(state: &AppState, live: &LiveSession) {
    for (path, job) in state.questions().waiting_of(&live.id) {
        let (own_state, own_job) = (state.clone(), Arc::clone(&job));
        let submitted = RecordedStep::find(state, &path).and_then(|failed_step| {
            state.answers().submit(move || answer(&own_state, &own_job, failed_step))
        });
        if let Err(problem) = submitted {
            let why = problem.problem().detail.clone();
            job.change(|question| (question.state, question.problem) = (QuestionState::Failed, Some(why)));
            state.store().save_or_defer_question(&job.view());
            state.send_event(job.progress());
        }
    }
}

/// Answers a question; an internal error ends only this question.
fn answer(state: &AppState, job: &QuestionJob, mut failed_step: RecordedStep) {
    if !job.change(|question| question.state = QuestionState::Running) {
        return;
    }
    state.send_event(job.progress());
    let live = Arc::clone(&failed_step.live);
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        failed_step.prepare(&job.cancel).map_err(|problem| problem.problem().detail.clone())?;
        let mut reported_k = 0;
        let mut on_answer = |answer: &Answer| {
            let is_changed = job.change(|question| question.answer = Some(answer.clone()));
            if is_changed && answer.k > reported_k {
                reported_k = answer.k;
                state.send_event(job.progress());
            }
        };
        let open = failed_step.live.traverse();
        let drive = &open.traverse;
        match counterfactual::look(drive, failed_step.base(), &job.cancel, &mut on_answer) {
            Ok(answer) => Ok(Some(answer)),
            Err(Error::Cancelled) => Ok(None),
            Err(error) => Err(error.to_string()),
        }
    }));
    let outcome =
        outcome.unwrap_or_else(|_| Err("the server met a fault of its own; its log says more".to_owned()));
    let mut ended = job.view();
    match outcome {
        Ok(Some(answer)) => (ended.state, ended.answer) = (QuestionState::Done, Some(answer)),
        Ok(None) => ended.state = QuestionState::Cancelled,
        Err(why) => (ended.state, ended.problem) = (QuestionState::Failed, Some(why)),
    }
    // Written to disk before clients see it, unless the session and its questions were removed.
    let store = |question: &Question| {
        if !live.is_removed() {
            state.store().save_or_defer_question(question);
        }
    };
    store(&ended);
    if !job.change(|question| *question = ended) {
        // Cancelled in the meantime.
        store(&job.view());
    }
    state.send_event(job.progress());
}
