//! The studies that were started over REST: one is carried out at a time, the others wait.
//!
//! The list is kept with the sessions; what a study found lives in its folder, too, from which the same study, started
//! again, goes on. One that the end of the server stopped is found as cancelled.

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
use super::saved::{Keeper, KeptStudy};
use crate::jobs::{Lane, lock};
use crate::limits::SharedLimits;
use crate::priority::in_background;
use crate::problem::{ApiError, ApiResult};

/// The studies of a server.
pub(crate) struct Shelf {
    folder: PathBuf,
    events: broadcast::Sender<Event>,
    jobs: Lane,
    keeper: Keeper,
    works: Mutex<Vec<Arc<Work>>>,
    limits: SharedLimits,
}

/// A study that was started.
pub(crate) struct Work {
    number: u64,
    new: NewStudy,
    order: Order,
    keeper: Keeper,
    events: broadcast::Sender<Event>,
    inside: Mutex<Inside>,
}

struct Inside {
    view: StudyJob,
    rows: Vec<Row>,
    report: Option<String>,
    cancel: Arc<AtomicBool>,
    /// When it began or was resumed; `None` while it waits.
    began: Option<Instant>,
}

impl Shelf {
    /// A shelf whose studies work in `folder`; its list is read back by [`Shelf::read_back`].
    pub(crate) fn new(
        folder: PathBuf,
        events: broadcast::Sender<Event>,
        keeper: Keeper,
        limits: &SharedLimits,
    ) -> Self {
        let jobs = Lane::new(1, limits.studies_waiting.count());
        Self { folder, events, jobs, keeper, works: Mutex::default(), limits: Arc::clone(limits) }
    }

    /// Puts the studies on the shelf that were kept; `order` says what is to be done for one, and where it cannot, because
    /// the catalogue is another by now, the study is left out.
    ///
    /// # Errors
    /// When the list cannot be read.
    pub(crate) fn read_back(
        &self,
        order: impl Fn(&NewStudy) -> ApiResult<Order>,
    ) -> sightline_geometry::error::Result<()> {
        let mut works = lock(&self.works);
        for (number, kept) in self.keeper.all()? {
            let rows = kept.read_rows();
            let KeptStudy { new, job: view, report, .. } = kept.after_a_restart();
            let Ok(order) = order(&new) else { continue };
            let inside = Mutex::new(Inside { view, rows, report, cancel: Arc::default(), began: None });
            let (events, keeper) = (self.events.clone(), self.keeper.clone());
            works.push(Arc::new(Work { number, new, order, keeper, events, inside }));
        }
        Ok(())
    }

    /// The folder of all studies.
    pub(crate) fn folder(&self) -> &PathBuf {
        &self.folder
    }

    /// The studies, in the order in which they were started.
    pub(crate) fn all(&self) -> Vec<StudyJob> {
        lock(&self.works).iter().map(|work| work.view()).collect()
    }

    /// The study of that name in paths.
    ///
    /// # Errors
    /// A problem when there is none.
    pub(crate) fn work(&self, id: &str) -> ApiResult<Arc<Work>> {
        let found = lock(&self.works).iter().find(|work| work.view().id == id).cloned();
        found.ok_or_else(|| ApiError::not_found("There is no such study."))
    }

    /// Adds a study, which begins when those before it are done.
    ///
    /// # Errors
    /// A problem when there are too many already.
    pub(crate) fn add(&self, new: NewStudy, order: Order) -> ApiResult<StudyJob> {
        let work = {
            let mut works = lock(&self.works);
            let limit = &self.limits.studies;
            let surplus = if works.len() >= limit.count() {
                let ended = works.iter().position(|work| work.has_ended());
                Some(ended.ok_or_else(|| {
                    ApiError::conflict(format!("{} studies are under way already.", works.len()))
                        .hint(limit.hint("Wait until some of them are done, or cancel one."))
                })?)
            } else {
                None
            };
            let number = works.iter().map(|work| work.number).max().unwrap_or(0) + 1;
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
            let inside = Inside { view, rows: Vec::new(), report: None, cancel: Arc::default(), began: None };
            let (events, keeper) = (self.events.clone(), self.keeper.clone());
            let work = Arc::new(Work { number, new, order, keeper, events, inside: Mutex::new(inside) });
            self.keeper.keep_new(number, &work.kept(&lock(&work.inside)))?;
            if let Some(surplus) = surplus {
                self.keeper.forget(works.remove(surplus).number);
            }
            works.push(Arc::clone(&work));
            work
        };
        if let Err(problem) = self.submit(&work) {
            lock(&self.works).retain(|other| other.number != work.number);
            self.keeper.forget(work.number);
            return Err(problem);
        }
        Ok(work.view())
    }

    /// Lets a study go on that was cancelled or failed.
    ///
    /// # Errors
    /// A problem when it is neither.
    pub(crate) fn resume(&self, id: &str) -> ApiResult<StudyJob> {
        let work = self.work(id)?;
        let may = work.change(|inside| {
            let may = matches!(inside.view.state, StudyState::Cancelled | StudyState::Failed);
            if may {
                (inside.cancel, inside.rows) = (Arc::default(), Vec::new());
                (inside.view.state, inside.view.k) = (StudyState::Waiting, 0);
                (inside.view.share, inside.view.seconds, inside.began) = (0.0, 0.0, None);
                "waiting".clone_into(&mut inside.view.doing);
            }
            may
        });
        if !may {
            return Err(ApiError::conflict("The study was not stopped."));
        }
        self.submit(&work)?;
        Ok(work.view())
    }

    /// Stops a study; what it found is kept.
    ///
    /// # Errors
    /// A problem when it has ended already.
    pub(crate) fn cancel(&self, id: &str) -> ApiResult<StudyJob> {
        let work = self.work(id)?;
        let was_going = work.change(|inside| {
            inside.cancel.store(true, Ordering::Relaxed);
            matches!(inside.view.state, StudyState::Waiting | StudyState::Running)
        });
        if was_going { Ok(work.view()) } else { Err(ApiError::conflict("The study has ended already.")) }
    }

    /// Stops all studies.
    pub(crate) fn close(&self) {
        for work in lock(&self.works).iter() {
            lock(&work.inside).cancel.store(true, Ordering::Relaxed);
        }
    }

    fn submit(&self, work: &Arc<Work>) -> ApiResult<()> {
        let work = Arc::clone(work);
        self.jobs.submit(move || in_background(|| work.carry_out()))
    }
}

impl Work {
    /// How it stands.
    pub(crate) fn view(&self) -> StudyJob {
        lock(&self.inside).view.clone()
    }

    /// The rows so far.
    pub(crate) fn rows(&self) -> Vec<Row> {
        lock(&self.inside).rows.clone()
    }

    /// The report, once it is done.
    pub(crate) fn report(&self) -> Option<String> {
        lock(&self.inside).report.clone()
    }

    fn has_ended(&self) -> bool {
        !matches!(self.view().state, StudyState::Waiting | StudyState::Running)
    }

    /// Writes how it stands.
    fn keep(&self, inside: &Inside) {
        self.keeper.keep(self.number, &self.kept(inside));
    }

    /// As it is kept.
    fn kept(&self, inside: &Inside) -> KeptStudy {
        let (job, report) = (inside.view.clone(), inside.report.clone());
        // Rows before the end are found again in the study's folder.
        let rows = if report.is_some() { KeptStudy::kept_rows(&inside.rows) } else { Vec::new() };
        KeptStudy { new: self.new.clone(), job, rows, report }
    }

    /// Changes it and sends the change to every page, in the order of the changes.
    fn change<T>(&self, change: impl FnOnce(&mut Inside) -> T) -> T {
        let mut inside = lock(&self.inside);
        let result = change(&mut inside);
        inside.stamp();
        self.tell(&inside);
        result
    }

    fn tell(&self, inside: &Inside) {
        // Nobody may be listening.
        let _ = self.events.send(Event::StudyProgress { job: inside.view.clone() });
    }

    fn carry_out(&self) {
        let cancel = Arc::clone(&lock(&self.inside).cancel);
        if cancel.load(Ordering::Relaxed) {
            self.finish(|inside| end(inside, StudyState::Cancelled, ""));
            return;
        }
        self.change(|inside| {
            (inside.view.state, inside.began) = (StudyState::Running, Some(Instant::now()));
        });
        self.keep(&lock(&self.inside));
        let work = std::panic::AssertUnwindSafe(|| {
            carry_out(self.order.clone(), &cancel, &|progress| self.hear(progress))
        });
        match std::panic::catch_unwind(work) {
            Ok(Ok(outcome)) => self.finish(|inside| {
                (inside.rows, inside.report) = (outcome.rows, Some(outcome.report));
                inside.view.share = 1.0;
                // The state says it already.
                end(inside, StudyState::Done, "");
            }),
            Ok(Err(Error::Cancelled)) => {
                self.finish(|inside| end(inside, StudyState::Cancelled, ""));
            }
            Ok(Err(error)) => self.finish(|inside| end(inside, StudyState::Failed, &error.to_string())),
            Err(_) => {
                let why = "the server met a fault of its own; its log says more";
                self.finish(|inside| end(inside, StudyState::Failed, why));
            }
        }
    }

    /// Ends it: on disk before anybody sees it, so that what a person saw outlives the server.
    fn finish(&self, end: impl FnOnce(&mut Inside)) {
        let mut inside = lock(&self.inside);
        end(&mut inside);
        inside.stamp();
        inside.began = None;
        self.keep(&inside);
        self.tell(&inside);
    }

    fn hear(&self, progress: Progress) {
        match progress {
            Progress::Rows(rows) => lock(&self.inside).rows.extend(rows),
            Progress::Units { k, n, share } => self.change(|inside| {
                (inside.view.k, inside.view.n, inside.view.share) = (k, n, share);
                "tracking".clone_into(&mut inside.view.doing);
            }),
            Progress::Rendering { world, k, n, share } => self.change(|inside| {
                inside.view.share = share;
                inside.view.doing = format!("rendering stop {} of {n} of {world}", k + 1);
            }),
            Progress::Notice(text) => self.change(|inside| inside.view.notices.push(text)),
        }
    }
}

impl Inside {
    /// Gives the state its number and how long the study took.
    fn stamp(&mut self) {
        if let Some(began) = self.began {
            self.view.seconds = began.elapsed().as_secs_f64();
        }
        self.view.revision += 1;
    }
}

fn end(inside: &mut Inside, state: StudyState, doing: &str) {
    inside.view.state = state;
    doing.clone_into(&mut inside.view.doing);
}
