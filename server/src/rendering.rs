//! Renders simulated stops: one at a time for each traverse, requested stops first.
//!
//! A background render yields to a requested one, except for the same stop, for which the request then waits. Renders have
//! their own thread pool, because in the tracker's pool a step would wait for the pixels of a whole image.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, OnceLock, PoisonError, Weak};
use std::time::Duration;

use sightline_api::event::Event;
use sightline_geometry::camera::CameraName;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::Traverse;
use tokio::sync::broadcast;

use crate::commanded_drive::CommandedDrive;
use crate::identity::Identity;
use crate::jobs::lock;

/// Polling interval of the cancel flag while waiting.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// An opened traverse, with the lock for rendering its stops.
pub struct OpenTraverse {
    /// Its name in paths.
    pub id: String,
    /// The traverse.
    pub traverse: Traverse,
    /// The identity that determines its name.
    pub(crate) identity: Identity,
    /// The world of a commanded drive.
    pub(crate) commanded: Option<Arc<CommandedDrive>>,
    is_closed: AtomicBool,
    turn: Mutex<Turn>,
    turned: Condvar,
    events: broadcast::Sender<Event>,
}

#[derive(Default)]
struct Turn {
    /// The stop that is being rendered.
    step: Option<usize>,
    /// Cancels it, if it is a background render.
    yields: Option<Arc<AtomicBool>>,
    /// Number of waiting requests.
    urgent: usize,
}

impl OpenTraverse {
    /// A traverse named by its identity, which reports progress to `events`.
    pub(crate) fn new(identity: Identity, traverse: Traverse, events: broadcast::Sender<Event>) -> Self {
        let id = identity.id();
        let (is_closed, turn, turned) = (AtomicBool::new(false), Mutex::default(), Condvar::new());
        Self { id, traverse, identity, commanded: None, is_closed, turn, turned, events }
    }

    /// The traverse of a commanded drive in this world.
    pub(crate) fn in_world_of(self, drive: Arc<CommandedDrive>) -> Self {
        Self { commanded: Some(drive), ..self }
    }

    /// The same drive with more stops.
    pub(crate) fn grown(&self, traverse: Traverse) -> Self {
        let grown = Self::new(self.identity.clone(), traverse, self.events.clone());
        Self { commanded: self.commanded.clone(), ..grown }
    }

    /// Stops further rendering, because the traverse is removed.
    pub(crate) fn close(&self) {
        self.is_closed.store(true, Ordering::Relaxed);
    }

    /// Whether the traverse is removed.
    pub(crate) fn is_closed(&self) -> bool {
        self.is_closed.load(Ordering::Relaxed)
    }

    /// Ensures that the images of a stop's main pair exist; a recorded stop is always ready.
    ///
    /// # Errors
    /// As [`Traverse::render_step`]; [`Error::Cancelled`] soon after `cancel` is set.
    pub(crate) fn make_ready(&self, step: usize, cancel: &AtomicBool) -> Result<()> {
        self.make_camera_ready(step, None, cancel)
    }

    /// The same for the main pair or a further camera; a stop without the camera is ready.
    ///
    /// # Errors
    /// As [`Self::make_ready`].
    pub(crate) fn make_camera_ready(
        &self,
        step: usize,
        camera: Option<CameraName>,
        cancel: &AtomicBool,
    ) -> Result<()> {
        if self.is_ready(step, camera) {
            return Ok(());
        }
        self.take_turn(step, cancel, None)?;
        self.render(step, camera, cancel)
    }

    /// The same in the background; returns [`Error::Cancelled`] when it yields to [`Self::make_ready`].
    fn make_ready_in_background(&self, step: usize, cancel: &Arc<AtomicBool>) -> Result<()> {
        self.take_turn(step, cancel, Some(cancel))?;
        self.render(step, None, cancel)
    }

    /// The number of ready stops; `ready` is a stop that has just become ready.
    pub fn progress(&self, ready: Option<usize>) -> Event {
        // A stop whose images are pending does not count.
        let n = self.traverse.stop_count() - usize::from(self.traverse.awaits().is_some());
        let k = (0..n).filter(|&step| self.traverse.is_ready(step)).count();
        Event::RenderProgress { traverse: self.id.clone(), k, n, ready }
    }

    fn is_ready(&self, step: usize, camera: Option<CameraName>) -> bool {
        step >= self.traverse.stop_count() || self.traverse.is_rendered(step, camera)
    }

    fn take_turn(&self, step: usize, cancel: &AtomicBool, yields: Option<&Arc<AtomicBool>>) -> Result<()> {
        let mut turn = lock(&self.turn);
        turn.urgent += usize::from(yields.is_none());
        let taken = loop {
            if cancel.load(Ordering::Relaxed) || self.is_closed() {
                break Err(Error::Cancelled);
            }
            if turn.step.is_none() && (yields.is_none() || turn.urgent == 0) {
                (turn.step, turn.yields) = (Some(step), yields.cloned());
                break Ok(());
            }
            if let Some(background) =
                turn.yields.as_ref().filter(|_| yields.is_none() && turn.step != Some(step))
            {
                background.store(true, Ordering::Relaxed);
            }
            turn = self.turned.wait_timeout(turn, POLL_INTERVAL).unwrap_or_else(PoisonError::into_inner).0;
        };
        turn.urgent -= usize::from(yields.is_none());
        taken
    }

    /// Renders while this thread has the turn, which ends here, even after a panic.
    fn render(&self, step: usize, camera: Option<CameraName>, cancel: &AtomicBool) -> Result<()> {
        let _turn = EndOfTurn(self);
        if self.is_ready(step, camera) {
            return Ok(());
        }
        let render = || self.traverse.render_camera(step, camera, cancel);
        match pool() {
            Some(pool) => pool.install(render),
            None => render(),
        }?;
        if camera.is_none() {
            // An error only means that there are no subscribers.
            let _ = self.events.send(self.progress(Some(step)));
        }
        Ok(())
    }
}

struct EndOfTurn<'a>(&'a OpenTraverse);

impl Drop for EndOfTurn<'_> {
    fn drop(&mut self) {
        let mut turn = lock(&self.0.turn);
        (turn.step, turn.yields) = (None, None);
        self.0.turned.notify_all();
    }
}

/// The threads for rendering; `None` if they cannot be started, in which case the tracker's pool is used.
fn pool() -> Option<&'static rayon::ThreadPool> {
    static POOL: OnceLock<Option<rayon::ThreadPool>> = OnceLock::new();
    let name = |number| format!("render-{number}");
    POOL.get_or_init(|| rayon::ThreadPoolBuilder::new().thread_name(name).build().ok()).as_ref()
}

/// The background thread that renders the stops after the cursor.
pub(crate) struct Prefetcher {
    request: Mutex<PrefetchRequest>,
    changed: Condvar,
}

#[derive(Default)]
struct PrefetchRequest {
    /// The traverse on display.
    traverse: Weak<OpenTraverse>,
    /// The stop on display.
    from: usize,
    /// Stops with a rendering error.
    failed: BTreeSet<(String, usize)>,
    /// Cancels the current render.
    cancel: Arc<AtomicBool>,
    closed: bool,
}

impl Prefetcher {
    /// Starts the thread.
    ///
    /// # Errors
    /// When the system cannot start the thread.
    pub(crate) fn start() -> std::io::Result<Arc<Self>> {
        let prefetcher = Arc::new(Self { request: Mutex::default(), changed: Condvar::new() });
        let own = Arc::clone(&prefetcher);
        std::thread::Builder::new().name("render-ahead".to_owned()).spawn(move || own.work())?;
        Ok(prefetcher)
    }

    /// Renders the stops of `traverse` from `from` onwards first, then the earlier ones.
    pub(crate) fn prefetch_from(&self, traverse: &Arc<OpenTraverse>, from: usize) {
        let mut request = lock(&self.request);
        (request.traverse, request.from) = (Arc::downgrade(traverse), from);
        self.changed.notify_all();
    }

    /// Ends the thread soon.
    pub(crate) fn close(&self) {
        let mut request = lock(&self.request);
        request.closed = true;
        request.cancel.store(true, Ordering::Relaxed);
        self.changed.notify_all();
    }

    fn work(&self) {
        while let Some((traverse, step, cancel)) = self.next() {
            let render = || traverse.make_ready_in_background(step, &cancel);
            let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(render));
            let why = match outcome {
                Ok(Ok(()) | Err(Error::Cancelled)) => continue,
                Ok(Err(error)) => error.to_string(),
                Err(_) => "the renderer panicked".to_owned(),
            };
            tracing::warn!(step, "cannot render ahead: {}", crate::printable::printable(&why));
            lock(&self.request).failed.insert((traverse.id.clone(), step));
        }
    }

    /// Waits for the next stop to render; `None` when the thread must end.
    fn next(&self) -> Option<(Arc<OpenTraverse>, usize, Arc<AtomicBool>)> {
        let mut request = lock(&self.request);
        while !request.closed {
            if let Some((traverse, step)) = request.pick() {
                request.cancel = Arc::default();
                return Some((traverse, step, Arc::clone(&request.cancel)));
            }
            request = self.changed.wait(request).unwrap_or_else(PoisonError::into_inner);
        }
        None
    }
}

impl PrefetchRequest {
    fn pick(&self) -> Option<(Arc<OpenTraverse>, usize)> {
        let traverse = self.traverse.upgrade()?;
        let count = traverse.traverse.stop_count();
        let from = self.from.min(count);
        let mut order = (from..count).chain(0..from);
        let step = order.find(|&step| {
            let is_missing = !traverse.traverse.is_ready(step) && !traverse.traverse.is_awaited(step);
            is_missing && !self.failed.contains(&(traverse.id.clone(), step))
        })?;
        Some((traverse, step))
    }
}
