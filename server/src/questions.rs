//! The questions that were asked: what would have saved a step. One for each step, kept with its answer, also on disk: one
//! that was not answered when the server ended goes on when its session is asked for and its runs are computed again.

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

/// The questions that were asked; the oldest answered ones are forgotten beyond the limit.
pub(crate) struct Questions {
    kept: Mutex<Kept>,
    limits: SharedLimits,
}

#[derive(Default)]
struct Kept {
    by_step: BTreeMap<AtStep, Arc<Work>>,
    last_number: u64,
}

/// A question that is being answered, or was.
pub(crate) struct Work {
    number: u64,
    pub(crate) question: Mutex<Question>,
    pub(crate) cancel: CancelFlag,
}

impl Questions {
    /// The questions on disk; those without an answer wait for [`Self::waiting_of`].
    ///
    /// # Errors
    /// When the database cannot be read.
    pub(crate) fn read_back(store: &Store, limits: &SharedLimits) -> Result<Self> {
        let mut kept = Kept::default();
        for mut question in store.questions()? {
            let Question { session, target, run, step, .. } = question.clone();
            if question.state == QuestionState::Running {
                question.state = QuestionState::Waiting;
            }
            kept.last_number += 1;
            let (number, cancel) = (kept.last_number, CancelFlag::default());
            let work = Arc::new(Work { number, question: Mutex::new(question), cancel });
            kept.by_step.insert(AtStep { session, target, run, step }, work);
        }
        Ok(Self { kept: Mutex::new(kept), limits: Arc::clone(limits) })
    }

    /// The questions of a session that wait.
    pub(crate) fn waiting_of(&self, session: &str) -> Vec<(AtStep, Arc<Work>)> {
        let waits = |work: &Work| lock(&work.question).state == QuestionState::Waiting;
        let kept = lock(&self.kept);
        let of_session = kept.by_step.iter().filter(|(path, work)| path.session == session && waits(work));
        of_session.map(|(path, work)| (path.clone(), Arc::clone(work))).collect()
    }

    pub(crate) fn find(&self, path: &AtStep) -> ApiResult<Arc<Work>> {
        let found = lock(&self.kept).by_step.get(path).cloned();
        found.ok_or_else(|| {
            ApiError::not_found("Nobody has asked what would have saved this step.")
                .hint("POST to the same path asks it.")
        })
    }

    /// The work on a question; none where it goes on or is answered already.
    pub(crate) fn begin(&self, path: AtStep, store: &Store) -> ApiResult<(Arc<Work>, bool)> {
        let mut kept = lock(&self.kept);
        let state_of = |work: &Work| lock(&work.question).state;
        if let Some(work) = kept.by_step.get(&path) {
            if !matches!(state_of(work), QuestionState::Cancelled | QuestionState::Failed) {
                return Ok((Arc::clone(work), false));
            }
        } else if kept.by_step.len() >= self.limits.questions.count() {
            let over = kept.by_step.iter().filter(|(_, work)| state_of(work).is_over());
            let oldest = over.min_by_key(|(_, work)| work.number).map(|(path, _)| path.clone());
            let oldest = oldest.ok_or_else(|| ApiError::full(&self.limits.questions))?;
            if let Some(work) = kept.by_step.remove(&oldest) {
                store.forget_question(&work.view());
            }
        }
        kept.last_number += 1;
        let AtStep { session, target, run, step } = path.clone();
        let state = QuestionState::Waiting;
        let question = Question { session, target, run, step, state, answer: None, problem: None };
        let (number, cancel) = (kept.last_number, CancelFlag::default());
        store.save_question(&question)?;
        let work = Arc::new(Work { number, question: Mutex::new(question), cancel });
        kept.by_step.insert(path, Arc::clone(&work));
        Ok((work, true))
    }

    /// Forgets the questions of a session; those that are being answered end.
    pub(crate) fn forget_session(&self, session: &str) {
        lock(&self.kept).by_step.retain(|path, work| {
            let is_kept = path.session != session;
            if !is_kept {
                work.cancel.store(true, Ordering::Relaxed);
            }
            is_kept
        });
    }

    /// Forgets a question that nobody can answer now.
    pub(crate) fn forget(&self, path: &AtStep, store: &Store) {
        if let Some(work) = lock(&self.kept).by_step.remove(path) {
            store.forget_question(&work.view());
        }
    }
}

impl Work {
    pub(crate) fn view(&self) -> Question {
        lock(&self.question).clone()
    }

    /// Changes the question, unless it has ended.
    pub(crate) fn change(&self, change: impl FnOnce(&mut Question)) -> bool {
        let mut question = lock(&self.question);
        let goes_on = !question.state.is_over();
        if goes_on {
            change(&mut question);
        }
        goes_on
    }

    /// How far the answer has come.
    pub(crate) fn progress(&self) -> Event {
        let view = self.view();
        let (k, n) = view.answer.as_ref().map_or((0, 0), |answer| (answer.k, answer.n));
        let (session, target, run, step) = (view.session, view.target, view.run, view.step);
        Event::QuestionProgress { session, target, run, step, k, n, ended: view.state.is_over() }
    }
}
