//! Counterfactual questions: which changes would have prevented a step's failure? One per step, stored on disk with its
//! answer. A question that was unanswered at shutdown resumes when its session is requested and its runs are recomputed.

use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};

use sightline_api::event::Event;
use sightline_api::location::AtStep;
use sightline_geometry::error::Result;
use sightline_session::counterfactual::wire::{Question, QuestionState};

use crate::cancel::CancelFlag;
use crate::jobs::lock;
use crate::limits::SharedLimits;
use crate::problem::{ApiError, ApiResult};
use crate::store::Store;

/// The questions; beyond the limit, the oldest answered ones are discarded.
pub(crate) struct Questions {
    contents: Mutex<Contents>,
    limits: SharedLimits,
}

#[derive(Default)]
struct Contents {
    by_step: BTreeMap<AtStep, Arc<QuestionJob>>,
    last_number: u64,
}

/// A question, answered or in progress.
pub(crate) struct QuestionJob {
    number: u64,
    pub(crate) question: Mutex<Question>,
    pub(crate) cancel: CancelFlag,
}

impl Questions {
    /// Reads the questions from disk; unanswered ones wait for [`Self::waiting_of`].
    ///
    /// # Errors
    /// When the database cannot be read.
    pub(crate) fn load(store: &Store, limits: &SharedLimits) -> Result<Self> {
        let mut contents = Contents::default();
        for mut question in store.questions()? {
            let Question { session, target, run, step, .. } = question.clone();
            if question.state == QuestionState::Running {
                question.state = QuestionState::Waiting;
            }
            contents.last_number += 1;
            let (number, cancel) = (contents.last_number, CancelFlag::default());
            let job = Arc::new(QuestionJob { number, question: Mutex::new(question), cancel });
            contents.by_step.insert(AtStep { session, target, run, step }, job);
        }
        Ok(Self { contents: Mutex::new(contents), limits: Arc::clone(limits) })
    }

    /// The waiting questions of a session.
    pub(crate) fn waiting_of(&self, session: &str) -> Vec<(AtStep, Arc<QuestionJob>)> {
        let waits = |job: &QuestionJob| lock(&job.question).state == QuestionState::Waiting;
        let contents = lock(&self.contents);
        let of_session = contents.by_step.iter().filter(|(path, job)| path.session == session && waits(job));
        of_session.map(|(path, job)| (path.clone(), Arc::clone(job))).collect()
    }

    pub(crate) fn find(&self, path: &AtStep) -> ApiResult<Arc<QuestionJob>> {
        let found = lock(&self.contents).by_step.get(path).cloned();
        found.ok_or_else(|| {
            ApiError::not_found("Nobody has asked what would have saved this step.")
                .hint("POST to the same path asks it.")
        })
    }

    /// The work on a question, and whether the caller must start it: false if it is in progress or answered.
    pub(crate) fn begin(&self, path: AtStep, store: &Store) -> ApiResult<(Arc<QuestionJob>, bool)> {
        let mut contents = lock(&self.contents);
        let state_of = |job: &QuestionJob| lock(&job.question).state;
        if let Some(job) = contents.by_step.get(&path) {
            if !matches!(state_of(job), QuestionState::Cancelled | QuestionState::Failed) {
                return Ok((Arc::clone(job), false));
            }
        } else if contents.by_step.len() >= self.limits.questions.count() {
            let over = contents.by_step.iter().filter(|(_, job)| state_of(job).is_over());
            let oldest = over.min_by_key(|(_, job)| job.number).map(|(path, _)| path.clone());
            let oldest = oldest.ok_or_else(|| ApiError::full(&self.limits.questions))?;
            if let Some(job) = contents.by_step.remove(&oldest) {
                store.forget_question(&job.view());
            }
        }
        contents.last_number += 1;
        let AtStep { session, target, run, step } = path.clone();
        let state = QuestionState::Waiting;
        let question = Question { session, target, run, step, state, answer: None, problem: None };
        let (number, cancel) = (contents.last_number, CancelFlag::default());
        store.save_question(&question)?;
        let job = Arc::new(QuestionJob { number, question: Mutex::new(question), cancel });
        contents.by_step.insert(path, Arc::clone(&job));
        Ok((job, true))
    }

    /// Removes the questions of a session and cancels those in progress.
    pub(crate) fn forget_session(&self, session: &str) {
        lock(&self.contents).by_step.retain(|path, job| {
            let is_kept = path.session != session;
            if !is_kept {
                job.cancel.store(true, Ordering::Relaxed);
            }
            is_kept
        });
    }

    /// Removes a question that cannot be answered.
    pub(crate) fn forget(&self, path: &AtStep, store: &Store) {
        if let Some(job) = lock(&self.contents).by_step.remove(path) {
            store.forget_question(&job.view());
        }
    }
}

impl QuestionJob {
    pub(crate) fn view(&self) -> Question {
        lock(&self.question).clone()
    }

    /// Changes the question unless it has ended; returns whether it was changed.
    pub(crate) fn change(&self, change: impl FnOnce(&mut Question)) -> bool {
        let mut question = lock(&self.question);
        let goes_on = !question.state.is_over();
        if goes_on {
            change(&mut question);
        }
        goes_on
    }

    /// The progress of the answer.
    pub(crate) fn progress(&self) -> Event {
        let view = self.view();
        let (k, n) = view.answer.as_ref().map_or((0, 0), |answer| (answer.k, answer.n));
        let (session, target, run, step) = (view.session, view.target, view.run, view.step);
        Event::QuestionProgress { session, target, run, step, k, n, ended: view.state.is_over() }
    }
}
