//! The studies started over REST: one is executed at a time, the others wait.
//!
//! The list is stored with the sessions. The results are also in the study's folder, from which the same study continues
//! when started again. A study interrupted by shutdown is marked as cancelled.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use sightline_api::event::Event;
use sightline_geometry::error::Error;
use sightline_study::row::Row;
use sightline_study::wire::{NewStudy, StudyJob, StudyState};
use tokio::sync::broadcast;

use super::execute::{Progress, carry_out};
use super::order::Order;
use super::saved::{StoredStudy, StudyStore};
use crate::jobs::{Lane, lock};
use crate::limits::SharedLimits;
use crate::priority::in_background;
use crate::problem::{ApiError, ApiResult};

/// The studies of a server.
pub(crate) struct StudyQueue {
    folder: PathBuf,
    events: broadcast::Sender<Event>,
    jobs: Lane,
    store: StudyStore,
    studies: Mutex<Vec<Arc<QueuedStudy>>>,
    limits: SharedLimits,
}

/// A started study.
pub(crate) struct QueuedStudy {
    number: u64,
    new: NewStudy,
    order: Order,
    store: StudyStore,
    events: broadcast::Sender<Event>,
    execution: Mutex<Execution>,
}

struct Execution {
    view: StudyJob,
    rows: Vec<Row>,
    report: Option<String>,
    cancel: Arc<AtomicBool>,
    /// When it was started or resumed; `None` while it waits.
    began: Option<Instant>,
}

impl StudyQueue {
    /// An empty list of studies with results in `folder`; [`StudyQueue::load`] loads the stored list.
    pub(crate) fn new(
        folder: PathBuf,
        events: broadcast::Sender<Event>,
        store: StudyStore,
        limits: &SharedLimits,
    ) -> Self {
        let jobs = Lane::new(1, limits.studies_waiting.count());
        Self { folder, events, jobs, store, studies: Mutex::default(), limits: Arc::clone(limits) }
    }

    /// Loads the stored studies. `order` creates the order of a study; if it fails, because the catalogue has changed, the
    /// study is omitted.
    ///
    /// # Errors
    /// If the list cannot be read.
    pub(crate) fn load(
        &self,
        order: impl Fn(&NewStudy) -> ApiResult<Order>,
    ) -> sightline_geometry::error::Result<()> {
        let mut studies = lock(&self.studies);
        for (number, stored) in self.store.all()? {
            let rows = stored.rows_from_json();
            let StoredStudy { new, job: view, report, .. } = stored.after_a_restart();
            let Ok(order) = order(&new) else { continue };
            let execution = Mutex::new(Execution { view, rows, report, cancel: Arc::default(), began: None });
            let (events, store) = (self.events.clone(), self.store.clone());
            studies.push(Arc::new(QueuedStudy { number, new, order, store, events, execution }));
        }
        Ok(())
    }

    /// The folder with all studies.
    pub(crate) fn folder(&self) -> &PathBuf {
        &self.folder
    }

    /// The studies, oldest first.
    pub(crate) fn all(&self) -> Vec<StudyJob> {
        lock(&self.studies).iter().map(|study| study.view()).collect()
    }

    /// The study with that path name.
    ///
    /// # Errors
    /// A problem if it does not exist.
    pub(crate) fn study(&self, id: &str) -> ApiResult<Arc<QueuedStudy>> {
        let found = lock(&self.studies).iter().find(|study| study.view().id == id).cloned();
        found.ok_or_else(|| ApiError::not_found("There is no such study."))
    }

    /// Adds a study, which starts when the earlier ones are done.
    ///
    /// # Errors
    /// A problem if there are too many.
    pub(crate) fn add(&self, new: NewStudy, order: Order) -> ApiResult<StudyJob> {
        let study = {
            let mut studies = lock(&self.studies);
            let limit = &self.limits.studies;
            let surplus = if studies.len() >= limit.count() {
                let ended = studies.iter().position(|study| study.has_ended());
                Some(ended.ok_or_else(|| {
                    ApiError::conflict(format!("{} studies are under way already.", studies.len()))
                        .hint(limit.hint("Wait until some of them are done, or cancel one."))
                })?)
            } else {
                None
            };
            let number = studies.iter().map(|study| study.number).max().unwrap_or(0) + 1;
            let view = StudyJob {
                id: format!("study-{number}"),
                study: order.plan.study.name.to_owned(),
                state: StudyState::Waiting,
                k: 0,
                n: 0,
                share: 0.0,
                seconds: 0.0,
                revision: 0,
                doing: "waiting".to_owned(),
                notices: Vec::new(),
                command: order.command.clone(),
            };
            let execution =
                Execution { view, rows: Vec::new(), report: None, cancel: Arc::default(), began: None };
            let (events, store) = (self.events.clone(), self.store.clone());
            let study =
                Arc::new(QueuedStudy { number, new, order, store, events, execution: Mutex::new(execution) });
            self.store.save_new(number, &study.stored(&lock(&study.execution)))?;
            if let Some(surplus) = surplus {
                self.store.forget(studies.remove(surplus).number);
            }
            studies.push(Arc::clone(&study));
            study
        };
        if let Err(problem) = self.submit(&study) {
            lock(&self.studies).retain(|other| other.number != study.number);
            self.store.forget(study.number);
            return Err(problem);
        }
        Ok(study.view())
    }

    /// Resumes a cancelled or failed study.
    ///
    /// # Errors
    /// A problem in any other state.
    pub(crate) fn resume(&self, id: &str) -> ApiResult<StudyJob> {
        let study = self.study(id)?;
        let may = study.change(|execution| {
            let may = matches!(execution.view.state, StudyState::Cancelled | StudyState::Failed);
            if may {
                (execution.cancel, execution.rows) = (Arc::default(), Vec::new());
                (execution.view.state, execution.view.k) = (StudyState::Waiting, 0);
                (execution.view.share, execution.view.seconds, execution.began) = (0.0, 0.0, None);
                "waiting".clone_into(&mut execution.view.doing);
            }
            may
        });
        if !may {
            return Err(ApiError::conflict("The study was not stopped."));
        }
        self.submit(&study)?;
        Ok(study.view())
    }

    /// Stops a study; its results are kept.
    ///
    /// # Errors
    /// A problem if it has already ended.
    pub(crate) fn cancel(&self, id: &str) -> ApiResult<StudyJob> {
        let study = self.study(id)?;
        let was_going = study.change(|execution| {
            execution.cancel.store(true, Ordering::Relaxed);
            matches!(execution.view.state, StudyState::Waiting | StudyState::Running)
        });
        if was_going { Ok(study.view()) } else { Err(ApiError::conflict("The study has ended already.")) }
    }

    /// Stops all studies.
    pub(crate) fn close(&self) {
        for study in lock(&self.studies).iter() {
            lock(&study.execution).cancel.store(true, Ordering::Relaxed);
        }
    }

    fn submit(&self, study: &Arc<QueuedStudy>) -> ApiResult<()> {
        let study = Arc::clone(study);
        self.jobs.submit(move || in_background(|| study.carry_out()))
    }
}

impl QueuedStudy {
    /// The current state.
    pub(crate) fn view(&self) -> StudyJob {
        lock(&self.execution).view.clone()
    }

    /// The rows so far.
    pub(crate) fn rows(&self) -> Vec<Row> {
        lock(&self.execution).rows.clone()
    }

    /// The report; `None` until the study is done.
    pub(crate) fn report(&self) -> Option<String> {
        lock(&self.execution).report.clone()
    }

    fn has_ended(&self) -> bool {
        !matches!(self.view().state, StudyState::Waiting | StudyState::Running)
    }

    /// Stores the state.
    fn save(&self, execution: &Execution) {
        self.store.save_or_defer(self.number, &self.stored(execution));
    }

    /// The stored form of the study.
    fn stored(&self, execution: &Execution) -> StoredStudy {
        let (job, report) = (execution.view.clone(), execution.report.clone());
        // Rows of an unfinished study are read from the study's folder again.
        let rows = if report.is_some() { StoredStudy::rows_to_json(&execution.rows) } else { Vec::new() };
        StoredStudy { new: self.new.clone(), job, rows, report }
    }

    /// Changes the state and sends it to every page, in the order of the changes.
    fn change<T>(&self, change: impl FnOnce(&mut Execution) -> T) -> T {
        let mut execution = lock(&self.execution);
        let result = change(&mut execution);
        execution.stamp();
        self.send_progress(&execution);
        result
    }

    fn send_progress(&self, execution: &Execution) {
        // An error only means that there are no subscribers.
        let _ = self.events.send(Event::StudyProgress { job: execution.view.clone() });
    }

    fn carry_out(&self) {
        let cancel = Arc::clone(&lock(&self.execution).cancel);
        if cancel.load(Ordering::Relaxed) {
            self.finish(|execution| end(execution, StudyState::Cancelled, ""));
            return;
        }
        self.change(|execution| {
            (execution.view.state, execution.began) = (StudyState::Running, Some(Instant::now()));
        });
        self.save(&lock(&self.execution));
        let run = std::panic::AssertUnwindSafe(|| {
            carry_out(self.order.clone(), &cancel, &|progress| self.on_progress(progress))
        });
        match std::panic::catch_unwind(run) {
            Ok(Ok(outcome)) => self.finish(|execution| {
                (execution.rows, execution.report) = (outcome.rows, Some(outcome.report));
                execution.view.share = 1.0;
                // The state is sufficient.
                end(execution, StudyState::Done, "");
            }),
            Ok(Err(Error::Cancelled)) => {
                self.finish(|execution| end(execution, StudyState::Cancelled, ""));
            }
            Ok(Err(error)) => self.finish(|execution| end(execution, StudyState::Failed, &error.to_string())),
            Err(_) => {
                let why = "the server met a fault of its own; its log says more";
                self.finish(|execution| end(execution, StudyState::Failed, why));
            }
        }
    }

    /// Ends the study. The state is on disk before clients see it, so that it survives a restart.
    fn finish(&self, end: impl FnOnce(&mut Execution)) {
        let mut execution = lock(&self.execution);
        end(&mut execution);
        execution.stamp();
        execution.began = None;
        self.save(&execution);
        self.send_progress(&execution);
    }

    fn on_progress(&self, progress: Progress) {
        match progress {
            Progress::Rows(rows) => lock(&self.execution).rows.extend(rows),
            Progress::Units { k, n, share } => self.change(|execution| {
                (execution.view.k, execution.view.n, execution.view.share) = (k, n, share);
                "tracking".clone_into(&mut execution.view.doing);
            }),
            Progress::Rendering { world, k, n, share } => self.change(|execution| {
                execution.view.share = share;
                execution.view.doing = format!("rendering stop {} of {n} of {world}", k + 1);
            }),
            Progress::Notice(text) => self.change(|execution| execution.view.notices.push(text)),
        }
    }
}

impl Execution {
    /// Updates the revision and duration of the state.
    fn stamp(&mut self) {
        if let Some(began) = self.began {
            self.view.seconds = began.elapsed().as_secs_f64();
        }
        self.view.revision += 1;
    }
}

fn end(execution: &mut Execution, state: StudyState, doing: &str) {
    execution.view.state = state;
    doing.clone_into(&mut execution.view.doing);
}
