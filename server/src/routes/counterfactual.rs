//! `…/steps/{step}/counterfactual`: what would have saved a step, as a job with its findings as they come.
//!
//! One question for each step; recorded steps never change, so that an answer stays good. Questions have a
//! lane of their own, so that runs do not wait for them; between two trials it looks whether it was cancelled.

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
use crate::questions::Work;
use crate::recorded_step::RecordedStep;
use crate::routes::route::{location, route};
use crate::state::AppState;

/// The routes of this resource.
pub(crate) fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        .routes(route::<ShowCounterfactual>(routes!(show)))
        .routes(route::<AskCounterfactual>(routes!(ask)))
        .routes(route::<CancelCounterfactual>(routes!(cancel)))
}

/// Asks what would have saved a step
///
/// The smallest change of each setting, and of the prediction, with which the step would have been accepted, each
/// verified by computing the step. A question that was asked before goes on, or is answered already.
#[utoipa::path(post, operation_id = "ask_counterfactual",
    path = AskCounterfactual::PATH, tag = "why", responses((status = 202, body = Question), ApiError))]
async fn ask(
    State(state): State<AppState>,
    Path(at): Path<AskCounterfactual>,
    step: RecordedStep,
) -> ApiResult<Response> {
    let location = location::<ShowCounterfactual>(&at);
    let question = blocking(move || begin(&state, at, step)).await?;
    Ok((StatusCode::ACCEPTED, location, Json(question)).into_response())
}

/// What would have saved a step, as far as it is known
#[utoipa::path(get, operation_id = "show_counterfactual",
    path = ShowCounterfactual::PATH, tag = "why", responses((status = 200, body = Question), ApiError))]
async fn show(
    State(state): State<AppState>,
    Path(at): Path<ShowCounterfactual>,
) -> ApiResult<Json<Question>> {
    if let Ok(work) = state.questions().find(&at) {
        // A question that the end of the server interrupted goes on with its session, which is woken.
        state.session(&at.session)?;
        return Ok(Json(work.view()));
    }
    // That nobody has asked is an answer, too; that there is no such step is none.
    RecordedStep::find(&state, &at)?;
    let AtStep { session, target, run, step } = at;
    let (state, answer, problem) = (QuestionState::Unasked, None, None);
    Ok(Json(Question { session, target, run, step, state, answer, problem }))
}

/// Stops looking; what was found is kept
#[utoipa::path(post, operation_id = "cancel_counterfactual",
    path = CancelCounterfactual::PATH, tag = "why", responses((status = 200, body = Question), ApiError))]
async fn cancel(
    State(state): State<AppState>,
    Path(at): Path<CancelCounterfactual>,
) -> ApiResult<Json<Question>> {
    let work = state.questions().find(&at)?;
    {
        let mut question = lock(&work.question);
        if question.state.is_over() {
            return Err(ApiError::conflict("The question has ended already."));
        }
        work.cancel.store(true, Ordering::Relaxed);
        // Nothing that is found from now on is taken.
        question.state = QuestionState::Cancelled;
    }
    state.tell(work.progress());
    let (own, kept) = (state.clone(), work.view());
    blocking(move || {
        own.store().keep_question(&kept);
        Ok(())
    })
    .await?;
    Ok(Json(work.view()))
}

/// Begins to answer, unless that goes on already.
fn begin(state: &AppState, path: AtStep, asked: RecordedStep) -> ApiResult<Question> {
    counterfactual::goal(&asked.base())?;
    let (work, is_new) = state.questions().begin(path.clone(), state.store())?;
    if is_new {
        let (own_state, own_work) = (state.clone(), Arc::clone(&work));
        let submitted = state.answers().submit(move || answer(&own_state, &own_work, asked));
        submitted.inspect_err(|_| state.questions().forget(&path, state.store()))?;
    }
    Ok(work.view())
}

/// Goes on with the questions of a session that was read back, once its runs are computed again.
pub(crate) fn go_on(state: &AppState, live: &LiveSession) {
    for (path, work) in state.questions().waiting_of(&live.id) {
        let (own_state, own_work) = (state.clone(), Arc::clone(&work));
        let submitted = RecordedStep::find(state, &path)
            .and_then(|asked| state.answers().submit(move || answer(&own_state, &own_work, asked)));
        if let Err(problem) = submitted {
            let why = problem.problem().detail.clone();
            work.change(|question| (question.state, question.problem) = (QuestionState::Failed, Some(why)));
            state.store().keep_question(&work.view());
            state.tell(work.progress());
        }
    }
}

/// Answers a question; a fault of our own ends only this one.
fn answer(state: &AppState, work: &Work, mut asked: RecordedStep) {
    if !work.change(|question| question.state = QuestionState::Running) {
        return;
    }
    state.tell(work.progress());
    let live = Arc::clone(&asked.live);
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        asked.prepare(&work.cancel).map_err(|problem| problem.problem().detail.clone())?;
        let mut told = 0;
        let mut on = |answer: &Answer| {
            let is_told = work.change(|question| question.answer = Some(answer.clone()));
            if is_told && answer.k > told {
                told = answer.k;
                state.tell(work.progress());
            }
        };
        let open = asked.live.traverse();
        let drive = &open.traverse;
        match counterfactual::look(drive, asked.base(), &work.cancel, &mut on) {
            Ok(answer) => Ok(Some(answer)),
            Err(Error::Cancelled) => Ok(None),
            Err(error) => Err(error.to_string()),
        }
    }));
    let outcome =
        outcome.unwrap_or_else(|_| Err("the server met a fault of its own; its log says more".to_owned()));
    let mut ended = work.view();
    match outcome {
        Ok(Some(answer)) => (ended.state, ended.answer) = (QuestionState::Done, Some(answer)),
        Ok(None) => ended.state = QuestionState::Cancelled,
        Err(why) => (ended.state, ended.problem) = (QuestionState::Failed, Some(why)),
    }
    // On disk before anybody sees it, unless the session is gone with its questions.
    let keep = |question: &Question| {
        if !live.is_removed() {
            state.store().keep_question(question);
        }
    };
    keep(&ended);
    if !work.change(|question| *question = ended) {
        // Cancelled meanwhile.
        keep(&work.view());
    }
    state.tell(work.progress());
}
