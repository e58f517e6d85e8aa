//! `…/steps/{step}/counterfactual`: what would have saved a step, as a job with its findings as they come.
//!
//! One question for each step; recorded steps never change, so that an answer stays good. A question is answered among the
//! runs; between two trials it looks whether it was cancelled.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};

use axum::Json;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use sightline_core::error::Error;
use sightline_core::session::counterfactual::wire::{Question, QuestionState};
use sightline_core::session::counterfactual::{self, Answer};
use sightline_core::session::wire::Event;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::asked::{Asked, StepPath};
use crate::extract::Path;
use crate::jobs::{blocking, lock};
use crate::live::CancelFlag;
use crate::problem::{ApiError, ApiResult};
use crate::state::AppState;

/// How many questions are kept; the oldest answered ones are forgotten.
const QUESTION_LIMIT: usize = 256;

/// The routes of this resource.
pub fn router() -> OpenApiRouter<AppState> {
    OpenApiRouter::new().routes(routes!(show, ask)).routes(routes!(cancel))
}

/// The questions that were asked.
#[derive(Default)]
pub struct Questions(Mutex<Kept>);

#[derive(Default)]
struct Kept {
    by_step: BTreeMap<StepPath, Arc<Work>>,
    last_number: u64,
}

/// A question that is being answered, or was.
struct Work {
    number: u64,
    question: Mutex<Question>,
    cancel: CancelFlag,
}

/// Asks what would have saved a step
///
/// The smallest change of each setting, and of the prediction, with which the step would have been accepted, each
/// verified by computing the step. A question that was asked before goes on, or is answered already.
#[utoipa::path(post, operation_id = "ask_counterfactual",
    path = "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/counterfactual", tag = "why", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path), ("step" = usize, Path)),
    responses((status = 202, body = Question), ApiError))]
async fn ask(State(state): State<AppState>, Path(path): Path<StepPath>) -> ApiResult<Response> {
    let asked = Asked::find(&state, &path)?;
    let (session, target, run, step) = path.clone();
    let location =
        format!("/api/v1/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/counterfactual");
    let question = blocking(move || begin(&state, path, asked)).await?;
    Ok((StatusCode::ACCEPTED, [(header::LOCATION, location)], Json(question)).into_response())
}

/// What would have saved a step, as far as it is known
#[utoipa::path(get, operation_id = "show_counterfactual",
    path = "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/counterfactual", tag = "why", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path), ("step" = usize, Path)),
    responses((status = 200, body = Question), ApiError))]
async fn show(State(state): State<AppState>, Path(path): Path<StepPath>) -> ApiResult<Json<Question>> {
    if let Ok(work) = state.questions().find(&path) {
        return Ok(Json(work.view()));
    }
    // That nobody has asked is an answer, too; that there is no such step is none.
    Asked::find(&state, &path)?;
    let (session, target, run, step) = path;
    let (state, answer, problem) = (QuestionState::Unasked, None, None);
    Ok(Json(Question { session, target, run, step, state, answer, problem }))
}

/// Stops looking; what was found is kept
#[utoipa::path(post, operation_id = "cancel_counterfactual",
    path = "/sessions/{session}/targets/{target}/runs/{run}/steps/{step}/counterfactual/cancel", tag = "why", params(
    ("session" = String, Path), ("target" = usize, Path), ("run" = usize, Path), ("step" = usize, Path)),
    responses((status = 200, body = Question), ApiError))]
async fn cancel(State(state): State<AppState>, Path(path): Path<StepPath>) -> ApiResult<Json<Question>> {
    let work = state.questions().find(&path)?;
    {
        let mut question = lock(&work.question);
        if question.state.is_over() {
            return Err(ApiError::conflict("The question has ended already."));
        }
        work.cancel.store(true, Ordering::Relaxed);
        // Nothing that is found from now on is taken.
        question.state = QuestionState::Cancelled;
    }
    work.tell(&state);
    Ok(Json(work.view()))
}

impl Questions {
    fn find(&self, path: &StepPath) -> ApiResult<Arc<Work>> {
        let found = lock(&self.0).by_step.get(path).cloned();
        found.ok_or_else(|| {
            ApiError::not_found("Nobody has asked what would have saved this step.")
                .hint("POST to the same path asks it.")
        })
    }

    /// The work on a question; none where it goes on or is answered already.
    fn begin(&self, path: StepPath) -> ApiResult<(Arc<Work>, bool)> {
        let mut kept = lock(&self.0);
        let state_of = |work: &Work| lock(&work.question).state;
        if let Some(work) = kept.by_step.get(&path) {
            if !matches!(state_of(work), QuestionState::Cancelled | QuestionState::Failed) {
                return Ok((Arc::clone(work), false));
            }
        } else if kept.by_step.len() >= QUESTION_LIMIT {
            let over = kept.by_step.iter().filter(|(_, work)| state_of(work).is_over());
            let oldest = over.min_by_key(|(_, work)| work.number).map(|(path, _)| path.clone());
            kept.by_step.remove(&oldest.ok_or_else(ApiError::busy)?);
        }
        kept.last_number += 1;
        let (session, target, run, step) = path.clone();
        let state = QuestionState::Waiting;
        let question = Question { session, target, run, step, state, answer: None, problem: None };
        let (number, cancel) = (kept.last_number, CancelFlag::default());
        let work = Arc::new(Work { number, question: Mutex::new(question), cancel });
        kept.by_step.insert(path, Arc::clone(&work));
        Ok((work, true))
    }

    fn forget(&self, path: &StepPath) {
        lock(&self.0).by_step.remove(path);
    }
}

/// Begins to answer, unless that goes on already.
fn begin(state: &AppState, path: StepPath, asked: Asked) -> ApiResult<Question> {
    counterfactual::goal(&asked.base())?;
    let (work, is_new) = state.questions().begin(path.clone())?;
    if is_new {
        let (own_state, own_work) = (state.clone(), Arc::clone(&work));
        let submitted = state.jobs().submit(move || answer(&own_state, &own_work, asked));
        submitted.inspect_err(|_| state.questions().forget(&path))?;
    }
    Ok(work.view())
}

/// Answers a question; a fault of our own ends only this one.
fn answer(state: &AppState, work: &Work, mut asked: Asked) {
    if !work.change(|question| question.state = QuestionState::Running) {
        return;
    }
    work.tell(state);
    let outcome = catch_unwind(AssertUnwindSafe(|| {
        asked.prepare(&work.cancel).map_err(|problem| problem.problem().detail.clone())?;
        let mut told = 0;
        let mut on = |answer: &Answer| {
            let is_told = work.change(|question| question.answer = Some(answer.clone()));
            if is_told && answer.k > told {
                told = answer.k;
                work.tell(state);
            }
        };
        let drive = &asked.live.traverse.traverse;
        match counterfactual::look(drive, asked.base(), &work.cancel, &mut on) {
            Ok(answer) => Ok(Some(answer)),
            Err(Error::Cancelled) => Ok(None),
            Err(error) => Err(error.to_string()),
        }
    }));
    let outcome =
        outcome.unwrap_or_else(|_| Err("the server met a fault of its own; its log says more".to_owned()));
    work.change(|question| match outcome {
        Ok(Some(answer)) => (question.state, question.answer) = (QuestionState::Done, Some(answer)),
        Ok(None) => question.state = QuestionState::Cancelled,
        Err(why) => (question.state, question.problem) = (QuestionState::Failed, Some(why)),
    });
    work.tell(state);
}

impl Work {
    fn view(&self) -> Question {
        lock(&self.question).clone()
    }

    /// Changes the question, unless it has ended.
    fn change(&self, change: impl FnOnce(&mut Question)) -> bool {
        let mut question = lock(&self.question);
        let goes_on = !question.state.is_over();
        if goes_on {
            change(&mut question);
        }
        goes_on
    }

    fn tell(&self, state: &AppState) {
        let view = self.view();
        let (k, n) = view.answer.as_ref().map_or((0, 0), |answer| (answer.k, answer.n));
        let (session, target, run, step) = (view.session, view.target, view.run, view.step);
        state.tell(Event::QuestionProgress { session, target, run, step, k, n, ended: view.state.is_over() });
    }
}
