//! What the handlers share: the open traverses, the sessions, and the ways to compute, to save and to tell.

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
use crate::connections::Connections;
use crate::driven::{self, OpenTraverses};
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
use crate::rendering::{Ahead, OpenTraverse};
use crate::requests_first::Requests;
use crate::routes::counterfactual;
use crate::runner::Runner;
use crate::sessions::Sessions;
use crate::store::{self, Store};
use crate::streams::Streams;
use crate::study::jobs::Shelf;
use crate::study::order::order;
use crate::study::saved::Keeper;
use crate::trackability_maps::Maps;
use crate::uploads::Uploads;

mod bounds;
mod changes;
mod lanes;
mod removal;

use self::lanes::Lanes;

/// Events that a slow page may be behind before it is told to read everything again.
const EVENT_BACKLOG: usize = 256;

/// What the handlers share.
#[derive(Clone)]
pub struct AppState(Arc<Inner>);

struct Inner {
    access: Access,
    traverses: OpenTraverses,
    /// The names of the traverses that the server was given, which cannot be removed.
    given: BTreeSet<String>,
    /// Held while a drive is made or removed, because both change its folder.
    making_drives: Mutex<()>,
    folders: Folders,
    sessions: Arc<Mutex<Sessions>>,
    limits: SharedLimits,
    /// Images and other results of all drives.
    cache: Arc<Cache>,
    connections: Arc<Connections>,
    repeated: Arc<idempotency::Answers>,
    requests: Arc<Requests>,
    events: broadcast::Sender<Event>,
    runner: Runner,
    ahead: Arc<Ahead>,
    store: Arc<Store>,
    notices: Vec<String>,
    lanes: Lanes,
    studies: Shelf,
    streams: Streams,
    maps: Maps,
    odometry: OdometryTables,
    questions: Questions,
    imports: Imports,
    uploads: Uploads,
}

impl Drop for Inner {
    fn drop(&mut self) {
        self.ahead.close();
        self.studies.close();
    }
}

impl AppState {
    /// Opens the state: sessions are kept in `folder` and read back from it, studies in a folder inside.
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

    /// The same, whose pages may open the recordings below these folders.
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

    /// Opens the state on its folders.
    ///
    /// # Errors
    /// A folder that cannot be read or made, a drive beyond the limits, or a system without threads.
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
        let (mut open, of_drives) = drives::open_given(traverses, folders, &events)?;
        let given = open.iter().map(|open| open.id.clone()).collect();
        let store = Store::open(&folders.sessions)?;
        let lost = open_again(&store, folders, &cache, &mut open, &events)?;
        let (sessions, mut notices) = Sessions::read_back(&store, &open)?;
        notices.extend(of_drives.into_iter().chain(lost));
        for notice in &notices {
            tracing::warn!("{}", crate::printable::printable(notice));
        }
        let ahead = Ahead::start().map_err(no_threads)?;
        if let Some(first) = open.first() {
            ahead.look_at(first, 0);
        }
        let questions = Questions::read_back(&store, &limits)?;
        let store = Arc::new(store);
        let keeper = Keeper::new(&store);
        let studies = Shelf::new(folders.studies.clone(), events.clone(), keeper, &limits);
        let (traverses, sessions) = (Arc::new(Mutex::new(open)), Arc::new(Mutex::new(sessions)));
        let runs = lanes::lane(&limits.runs_at_a_time, &limits.runs_waiting);
        let requests = Arc::<Requests>::default();
        studies.read_back(|new| order(&folders.studies, new))?;
        Ok(Self(Arc::new(Inner {
            access,
            given,
            making_drives: Mutex::default(),
            folders: folders.clone(),
            runner: Runner::new(runs, events.clone(), (&traverses, &sessions), &store, &limits, &requests),
            traverses,
            sessions,
            cache,
            connections: Arc::default(),
            repeated: Arc::new(idempotency::Answers::new(&limits)),
            requests,
            events,
            ahead,
            store,
            notices,
            lanes: Lanes::new(&limits),
            studies,
            streams: Streams::default(),
            maps: Maps::new(&limits),
            odometry: OdometryTables::new(&limits),
            questions,
            imports: Imports::new(&limits),
            uploads: Uploads::new(&limits),
            limits,
        })))
    }

    /// The requests that are being answered.
    pub(crate) fn requests(&self) -> &Arc<Requests> {
        &self.0.requests
    }

    /// Who may use the server, and under which names.
    pub(crate) fn access(&self) -> &Access {
        &self.0.access
    }

    /// What a person should know about this start of the server, and about what fails now, one sentence each.
    pub(crate) fn notices(&self) -> Vec<String> {
        self.0.store.trouble().into_iter().chain(self.0.notices.iter().cloned()).collect()
    }

    /// The open traverses, those that were opened from a page last.
    pub fn traverses(&self) -> Vec<Arc<OpenTraverse>> {
        lock(&self.0.traverses).clone()
    }

    /// Where the server keeps what it makes.
    pub(crate) fn folders(&self) -> &Folders {
        &self.0.folders
    }

    /// Adds a traverse with the sessions that it had when it was open before; the one of that name where it is open already.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub(crate) fn add_traverse(&self, open: Arc<OpenTraverse>) -> Result<Arc<OpenTraverse>> {
        let mut traverses = lock(&self.0.traverses);
        if let Some(known) = traverses.iter().find(|known| known.id == open.id) {
            return Ok(Arc::clone(known));
        }
        let (found, notices) = Sessions::read_back(&self.0.store, std::slice::from_ref(&open))?;
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

    /// The traverse of that name.
    ///
    /// # Errors
    /// A problem when there is none.
    pub fn traverse(&self, id: &str) -> ApiResult<Arc<OpenTraverse>> {
        let found = lock(&self.0.traverses).iter().find(|open| open.id == id).cloned();
        found.ok_or_else(|| ApiError::not_found("There is no such traverse."))
    }

    /// The sessions, in the order in which they were begun.
    pub(crate) fn sessions(&self) -> Vec<Arc<LiveSession>> {
        lock(&self.0.sessions).by_number.values().cloned().collect()
    }

    /// The session of that name; one that sleeps is woken, and its runs computed again.
    ///
    /// # Errors
    /// A problem when there is none.
    pub fn session(&self, id: &str) -> ApiResult<Arc<LiveSession>> {
        let number = store::number_of(id);
        let found = number.and_then(|number| lock(&self.0.sessions).by_number.get(&number).cloned());
        let live = found.ok_or_else(|| ApiError::not_found("There is no such session."))?;
        live.memory.is_asked_for();
        if live.wake() {
            let (state, restored) = (self.clone(), Arc::clone(&live));
            let go_on = move || counterfactual::go_on(&state, &restored);
            self.0.runner.restore(&live, go_on).inspect_err(|_| live.sleep())?;
        }
        Ok(live)
    }

    /// What survives the server.
    pub fn store(&self) -> &Store {
        &self.0.store
    }

    /// Renders the stops of `traverse` from `from` on before all others.
    pub(crate) fn look_at(&self, traverse: &Arc<OpenTraverse>, from: usize) {
        self.0.ahead.look_at(traverse, from);
    }

    /// Tells every page.
    pub(crate) fn tell(&self, event: Event) {
        // Nobody may be listening.
        let _ = self.0.events.send(event);
    }

    /// Where events are told.
    pub fn events(&self) -> &broadcast::Sender<Event> {
        &self.0.events
    }

    /// What a page must hear that may have missed anything.
    pub(crate) fn everything_may_have_changed(&self) -> Vec<Event> {
        let sessions =
            self.sessions().into_iter().map(|live| Event::SessionChanged { session: live.id.clone() });
        let traverses = self.traverses().into_iter().filter(|open| open.traverse.index().scenario.is_some());
        sessions.chain(traverses.map(|open| open.progress(None))).collect()
    }

    /// The session as pages and scripts see it, with what its runs wait for.
    pub(crate) fn view(&self, live: &LiveSession) -> SessionView {
        let mut view = live.with(|session| session.view());
        for target in &mut view.targets {
            for run in &mut target.runs {
                run.waits_for = self.0.runner.waits_for(live, target.number, run.number);
            }
        }
        view
    }

    /// What computes runs.
    pub(crate) fn runner(&self) -> &Runner {
        &self.0.runner
    }

    /// Where runs are computed.
    pub(crate) fn jobs(&self) -> &Lane {
        self.0.runner.lane()
    }

    /// The studies that were started.
    pub(crate) fn studies(&self) -> &Shelf {
        &self.0.studies
    }

    /// The trackability of stops.
    pub(crate) fn maps(&self) -> &Maps {
        &self.0.maps
    }

    /// The odometry of stops with its corners.
    pub(crate) fn odometry(&self) -> &OdometryTables {
        &self.0.odometry
    }

    /// The imports of recordings.
    pub(crate) fn imports(&self) -> &Imports {
        &self.0.imports
    }

    /// The recordings that pages send.
    pub(crate) fn uploads(&self) -> &Uploads {
        &self.0.uploads
    }

    /// The live Rerun streams, by session.
    pub(crate) fn streams(&self) -> &Streams {
        &self.0.streams
    }

    /// What would have saved steps: the questions that were asked.
    pub(crate) fn questions(&self) -> &Questions {
        &self.0.questions
    }
}

/// Opens the drives of earlier starts; what cannot be opened is said in one sentence each.
///
/// # Errors
/// As [`drives::open_again`].
fn open_again(
    store: &Store,
    folders: &Folders,
    cache: &Arc<Cache>,
    open: &mut Vec<Arc<OpenTraverse>>,
    events: &broadcast::Sender<Event>,
) -> Result<Vec<String>> {
    let mut lost = drives::open_again(store, folders, cache, open, events)?;
    lost.extend(driven::open_again(folders, cache, open, events));
    lost.extend(imports::open_again(folders, cache, open, events));
    Ok(lost)
}
