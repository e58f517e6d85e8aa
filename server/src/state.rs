//! The state shared by the handlers: open traverses, sessions, and the means to compute, store and notify.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use sightline_api::event::Event;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::Traverse;
use sightline_session::view::SessionView;
use sightline_track::locate::store::Cache;
use tokio::sync::broadcast;

use crate::access::Access;
use crate::commanded_drive::{self, OpenTraverses};
use crate::connections::Connections;
use crate::drives;
use crate::folders::Folders;
use crate::idempotency;
use crate::imports::{self, Imports};
use crate::jobs::{Lane, lock};
use crate::limits::{Limits, SharedLimits};
use crate::live_session::LiveSession;
use crate::odometry_tables::OdometryTables;
use crate::problem::{ApiError, ApiResult};
use crate::questions::Questions;
use crate::rendering::{OpenTraverse, Prefetcher};
use crate::request_priority::Requests;
use crate::routes::counterfactual;
use crate::runner::Runner;
use crate::sessions::Sessions;
use crate::store::{self, Store};
use crate::streams::Streams;
use crate::study::jobs::StudyQueue;
use crate::study::order::order;
use crate::study::saved::StudyStore;
use crate::trackability_maps::MapCache;
use crate::uploads::Uploads;

mod bounds;
mod changes;
mod lanes;
mod removal;

use self::lanes::Lanes;

/// Number of events that a slow page may lag behind before it must read everything again.
const EVENT_BACKLOG: usize = 256;

/// The state shared by the handlers.
#[derive(Clone)]
pub struct AppState(Arc<Inner>);

struct Inner {
    access: Access,
    traverses: OpenTraverses,
    /// The names of the traverses given at the server's start, which cannot be removed.
    given: BTreeSet<String>,
    /// Locked while a drive is created or removed, because both change its folder.
    drive_folder_lock: Mutex<()>,
    folders: Folders,
    sessions: Arc<Mutex<Sessions>>,
    limits: SharedLimits,
    /// Cache of images and other results of all drives.
    cache: Arc<Cache>,
    connections: Arc<Connections>,
    repeated: Arc<idempotency::Answers>,
    requests: Arc<Requests>,
    events: broadcast::Sender<Event>,
    runner: Runner,
    prefetcher: Arc<Prefetcher>,
    store: Arc<Store>,
    notices: Vec<String>,
    lanes: Lanes,
    studies: StudyQueue,
    streams: Streams,
    maps: MapCache,
    odometry: OdometryTables,
    questions: Questions,
    imports: Imports,
    uploads: Uploads,
}

impl Drop for Inner {
    fn drop(&mut self) {
        self.prefetcher.close();
        self.studies.close();
    }
}

impl AppState {
    /// Creates the state: sessions are loaded from `folder` and stored there, studies in a subfolder.
    ///
    /// # Errors
    /// As `Self::with_folders`.
    pub fn new(traverses: Vec<Traverse>, folder: &Path, access: Access) -> Result<Self> {
        Self::with_limits(traverses, folder, access, Limits::default())
    }

    /// The same with other limits.
    ///
    /// # Errors
    /// As `Self::with_folders`.
    pub fn with_limits(
        traverses: Vec<Traverse>,
        folder: &Path,
        access: Access,
        limits: Limits,
    ) -> Result<Self> {
        Self::with_folders(traverses, &Folders::in_one(folder), access, limits)
    }

    /// The same, with folders whose recordings pages may open.
    ///
    /// # Errors
    /// As `Self::with_folders`, or a folder that does not exist.
    pub fn with_recordings(
        traverses: Vec<Traverse>,
        folder: &Path,
        access: Access,
        limits: Limits,
        recordings: &[PathBuf],
    ) -> Result<Self> {
        let folders = Folders::in_one(folder).with_recordings(recordings)?;
        Self::with_folders(traverses, &folders, access, limits)
    }

    /// Creates the state with its folders.
    ///
    /// # Errors
    /// A folder that cannot be read or created, a drive beyond the limits, or a system that cannot start threads.
    pub(crate) fn with_folders(
        traverses: Vec<Traverse>,
        folders: &Folders,
        access: Access,
        limits: Limits,
    ) -> Result<Self> {
        folders.prepare().map_err(|source| Error::Write { path: folders.sessions.clone(), source })?;
        let no_threads = |error: std::io::Error| Error::Request(format!("cannot start a thread: {error}"));
        let events = broadcast::Sender::new(EVENT_BACKLOG);
        traverses.iter().try_for_each(|traverse| limits.check_drive(traverse))?;
        let (cache, limits) = (Arc::new(Cache::new(limits.cache_bytes.count())), Arc::new(limits));
        let traverses = traverses.into_iter().map(|traverse| traverse.with_cache(&cache)).collect();
        let (mut open, of_drives) = drives::open_initial(traverses, folders, &events)?;
        let given = open.iter().map(|open| open.id.clone()).collect();
        let store = Store::open(&folders.sessions)?;
        let lost = reopen(&store, folders, &cache, &mut open, &events)?;
        let (sessions, mut notices) = Sessions::load(&store, &open)?;
        notices.extend(of_drives.into_iter().chain(lost));
        for notice in &notices {
            tracing::warn!("{}", crate::printable::printable(notice));
        }
        let prefetcher = Prefetcher::start().map_err(no_threads)?;
        if let Some(first) = open.first() {
            prefetcher.prefetch_from(first, 0);
        }
        let questions = Questions::load(&store, &limits)?;
        let store = Arc::new(store);
        let study_store = StudyStore::new(&store);
        let studies = StudyQueue::new(folders.studies.clone(), events.clone(), study_store, &limits);
        let (traverses, sessions) = (Arc::new(Mutex::new(open)), Arc::new(Mutex::new(sessions)));
        let runs = lanes::lane(&limits.runs_at_a_time, &limits.runs_waiting);
        let requests = Arc::<Requests>::default();
        studies.load(|new| order(&folders.studies, new))?;
        Ok(Self(Arc::new(Inner {
            access,
            given,
            drive_folder_lock: Mutex::default(),
            folders: folders.clone(),
            runner: Runner::new(runs, events.clone(), (&traverses, &sessions), &store, &limits, &requests),
            traverses,
            sessions,
            cache,
            connections: Arc::default(),
            repeated: Arc::new(idempotency::Answers::new(&limits)),
            requests,
            events,
            prefetcher,
            store,
            notices,
            lanes: Lanes::new(&limits),
            studies,
            streams: Streams::default(),
            maps: MapCache::new(&limits),
            odometry: OdometryTables::new(&limits),
            questions,
            imports: Imports::new(&limits),
            uploads: Uploads::new(&limits),
            limits,
        })))
    }

    /// The requests in progress.
    pub(crate) fn requests(&self) -> &Arc<Requests> {
        &self.0.requests
    }

    /// The access rules: token and host names.
    pub(crate) fn access(&self) -> &Access {
        &self.0.access
    }

    /// Notices about this start of the server and about current failures, one sentence each.
    pub(crate) fn notices(&self) -> Vec<String> {
        self.0.store.trouble().into_iter().chain(self.0.notices.iter().cloned()).collect()
    }

    /// The open traverses; those opened from a page are last.
    pub fn traverses(&self) -> Vec<Arc<OpenTraverse>> {
        lock(&self.0.traverses).clone()
    }

    /// The folders with the server's data.
    pub(crate) fn folders(&self) -> &Folders {
        &self.0.folders
    }

    /// Adds a traverse with its stored sessions; returns the existing one if a traverse of that name is open.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub(crate) fn add_traverse(&self, open: Arc<OpenTraverse>) -> Result<Arc<OpenTraverse>> {
        let mut traverses = lock(&self.0.traverses);
        if let Some(known) = traverses.iter().find(|known| known.id == open.id) {
            return Ok(Arc::clone(known));
        }
        let (found, notices) = Sessions::load(&self.0.store, std::slice::from_ref(&open))?;
        for notice in &notices {
            tracing::warn!("{}", crate::printable::printable(notice));
        }
        let mut sessions = lock(&self.0.sessions);
        for (number, live) in found.by_number {
            sessions.by_number.entry(number).or_insert(live);
        }
        traverses.push(Arc::clone(&open));
        Ok(open)
    }

    /// The open traverse named `id`.
    ///
    /// # Errors
    /// A problem if it does not exist.
    pub fn traverse(&self, id: &str) -> ApiResult<Arc<OpenTraverse>> {
        let found = lock(&self.0.traverses).iter().find(|open| open.id == id).cloned();
        found.ok_or_else(|| ApiError::not_found("There is no such traverse."))
    }

    /// The sessions, oldest first.
    pub(crate) fn sessions(&self) -> Vec<Arc<LiveSession>> {
        lock(&self.0.sessions).by_number.values().cloned().collect()
    }

    /// The session named `id`; wakes a sleeping one, whose runs are then recomputed.
    ///
    /// # Errors
    /// A problem if it does not exist.
    pub fn session(&self, id: &str) -> ApiResult<Arc<LiveSession>> {
        let number = store::number_of(id);
        let found = number.and_then(|number| lock(&self.0.sessions).by_number.get(&number).cloned());
        let live = found.ok_or_else(|| ApiError::not_found("There is no such session."))?;
        live.memory.mark_requested();
        if live.wake() {
            let (state, restored) = (self.clone(), Arc::clone(&live));
            let resume_questions = move || counterfactual::resume_questions(&state, &restored);
            self.0.runner.restore(&live, resume_questions).inspect_err(|_| live.sleep())?;
        }
        Ok(live)
    }

    /// The persistent store.
    pub fn store(&self) -> &Store {
        &self.0.store
    }

    /// Renders the stops of `traverse` from `from` onwards before all others.
    pub(crate) fn prefetch_from(&self, traverse: &Arc<OpenTraverse>, from: usize) {
        self.0.prefetcher.prefetch_from(traverse, from);
    }

    /// Sends an event to every page.
    pub(crate) fn send_event(&self, event: Event) {
        // An error only means that there are no subscribers.
        let _ = self.0.events.send(event);
    }

    /// The channel of events.
    pub fn events(&self) -> &broadcast::Sender<Event> {
        &self.0.events
    }

    /// The events for a page that may have missed any change.
    pub(crate) fn everything_may_have_changed(&self) -> Vec<Event> {
        let sessions =
            self.sessions().into_iter().map(|live| Event::SessionChanged { session: live.id.clone() });
        let traverses = self.traverses().into_iter().filter(|open| open.traverse.index().scenario.is_some());
        sessions.chain(traverses.map(|open| open.progress(None))).collect()
    }

    /// The session as sent to pages and scripts, with the queue positions of its runs.
    pub(crate) fn view(&self, live: &LiveSession) -> SessionView {
        let mut view = live.with(|session| session.view());
        for target in &mut view.targets {
            for run in &mut target.runs {
                run.waits_for = self.0.runner.waits_for(live, target.number, run.number);
            }
        }
        view
    }

    /// The runner, which computes runs.
    pub(crate) fn runner(&self) -> &Runner {
        &self.0.runner
    }

    /// The lane of runs.
    pub(crate) fn jobs(&self) -> &Lane {
        self.0.runner.lane()
    }

    /// The studies started so far.
    pub(crate) fn studies(&self) -> &StudyQueue {
        &self.0.studies
    }

    /// The trackability maps of stops.
    pub(crate) fn maps(&self) -> &MapCache {
        &self.0.maps
    }

    /// The odometry tables of stops, with their corners.
    pub(crate) fn odometry(&self) -> &OdometryTables {
        &self.0.odometry
    }

    /// The imports of recordings.
    pub(crate) fn imports(&self) -> &Imports {
        &self.0.imports
    }

    /// The uploads of recordings.
    pub(crate) fn uploads(&self) -> &Uploads {
        &self.0.uploads
    }

    /// The live Rerun streams, by session.
    pub(crate) fn streams(&self) -> &Streams {
        &self.0.streams
    }

    /// The counterfactual questions.
    pub(crate) fn questions(&self) -> &Questions {
        &self.0.questions
    }
}

/// Reopens the drives of earlier starts; returns one sentence for each that cannot be opened.
///
/// # Errors
/// As [`drives::reopen`].
fn reopen(
    store: &Store,
    folders: &Folders,
    cache: &Arc<Cache>,
    open: &mut Vec<Arc<OpenTraverse>>,
    events: &broadcast::Sender<Event>,
) -> Result<Vec<String>> {
    let mut lost = drives::reopen(store, folders, cache, open, events)?;
    lost.extend(commanded_drive::reopen(folders, cache, open, events));
    lost.extend(imports::reopen(folders, cache, open, events));
    Ok(lost)
}
