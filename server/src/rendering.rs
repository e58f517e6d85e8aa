//! Rendering of simulated stops: one at a time for each traverse, what a person waits for first.
//!
//! A render in the background gives way to one in the foreground, except when both are of the same stop, for
//! which the latter then waits. Renders have a thread pool of their own, because in the tracker's pool a step
//! would wait behind the pixels of a whole image.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, OnceLock, PoisonError, Weak};
use std::time::Duration;

use sightline_api::event::Event;
use sightline_geometry::camera::CameraName;
use sightline_geometry::error::{Error, Result};
use sightline_recordings::Traverse;
use tokio::sync::broadcast;

use crate::driven::Driven;
use crate::identity::Identity;
use crate::jobs::lock;

/// How soon a cancelled wait is noticed.
const GLANCE: Duration = Duration::from_millis(50);

/// An opened traverse with the turn to render its stops.
pub struct OpenTraverse {
    /// Its name in paths.
    pub id: String,
    /// The traverse.
    pub traverse: Traverse,
    /// From which its name follows.
    pub(crate) identity: Identity,
    /// The world of a drive on commands.
    pub(crate) driven: Option<Arc<Driven>>,
    is_closed: AtomicBool,
    turn: Mutex<Turn>,
    turned: Condvar,
    events: broadcast::Sender<Event>,
}

#[derive(Default)]
struct Turn {
    /// The stop that is being rendered.
    step: Option<usize>,
    /// How to stop it, when it is a render in the background.
    yields: Option<Arc<AtomicBool>>,
    /// How many renders in the foreground are waiting.
    urgent: usize,
}

impl OpenTraverse {
    /// A traverse under the name of its identity; its progress is told to `events`.
    pub(crate) fn new(identity: Identity, traverse: Traverse, events: broadcast::Sender<Event>) -> Self {
        let id = identity.id();
        let (is_closed, turn, turned) = (AtomicBool::new(false), Mutex::default(), Condvar::new());
        Self { id, traverse, identity, driven: None, is_closed, turn, turned, events }
    }

    /// The traverse of a drive on commands in this world.
    pub(crate) fn driven_in(self, driven: Arc<Driven>) -> Self {
        Self { driven: Some(driven), ..self }
    }

    /// The same drive with more stops.
    pub(crate) fn grown(&self, traverse: Traverse) -> Self {
        let grown = Self::new(self.identity.clone(), traverse, self.events.clone());
        Self { driven: self.driven.clone(), ..grown }
    }

    /// Renders nothing any more, because the traverse is removed.
    pub(crate) fn close(&self) {
        self.is_closed.store(true, Ordering::Relaxed);
    }

    /// Whether the traverse is removed.
    pub(crate) fn is_closed(&self) -> bool {
        self.is_closed.load(Ordering::Relaxed)
    }

    /// Makes sure that the images of a stop's main pair are there; a recorded stop is always ready.
    ///
    /// # Errors
    /// As [`Traverse::render_step`]; [`Error::Cancelled`] soon after `cancel` is set.
    pub(crate) fn make_ready(&self, step: usize, cancel: &AtomicBool) -> Result<()> {
        self.make_camera_ready(step, None, cancel)
    }

    /// The same for the main pair or a further camera; a stop that lacks the camera is ready.
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

    /// The same in the background: gives way to [`Self::make_ready`] with [`Error::Cancelled`].
    fn make_ready_in_background(&self, step: usize, cancel: &Arc<AtomicBool>) -> Result<()> {
        self.take_turn(step, cancel, Some(cancel))?;
        self.render(step, None, cancel)
    }

    /// How many stops are ready, and whether `ready` has just become so.
    pub fn progress(&self, ready: Option<usize>) -> Event {
        // A stop without images yet is none that is rendered.
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
            turn = self.turned.wait_timeout(turn, GLANCE).unwrap_or_else(PoisonError::into_inner).0;
        };
        turn.urgent -= usize::from(yields.is_none());
        taken
    }

    /// Renders in this thread's turn, which ends here, also by a panic.
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
            // Nobody may be listening.
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

/// The threads that render; none where the system refuses them, and then the tracker's pool has to do.
fn pool() -> Option<&'static rayon::ThreadPool> {
    static POOL: OnceLock<Option<rayon::ThreadPool>> = OnceLock::new();
    let name = |number| format!("render-{number}");
    POOL.get_or_init(|| rayon::ThreadPoolBuilder::new().thread_name(name).build().ok()).as_ref()
}

/// The background thread that renders the stops ahead of where a person looks.
pub(crate) struct Ahead {
    wish: Mutex<Wish>,
    changed: Condvar,
}

#[derive(Default)]
struct Wish {
    /// The traverse that is looked at.
    traverse: Weak<OpenTraverse>,
    /// The stop that is looked at.
    from: usize,
    /// Stops that could not be rendered.
    failed: BTreeSet<(String, usize)>,
    /// How to stop the present render.
    cancel: Arc<AtomicBool>,
    closed: bool,
}

impl Ahead {
    /// Starts the thread.
    ///
    /// # Errors
    /// When the system starts no thread.
    pub(crate) fn start() -> std::io::Result<Arc<Self>> {
        let ahead = Arc::new(Self { wish: Mutex::default(), changed: Condvar::new() });
        let own = Arc::clone(&ahead);
        std::thread::Builder::new().name("render-ahead".to_owned()).spawn(move || own.work())?;
        Ok(ahead)
    }

    /// From now on the stops of `traverse` from `from` on come first, then those before.
    pub(crate) fn look_at(&self, traverse: &Arc<OpenTraverse>, from: usize) {
        let mut wish = lock(&self.wish);
        (wish.traverse, wish.from) = (Arc::downgrade(traverse), from);
        self.changed.notify_all();
    }

    /// Ends the thread soon.
    pub(crate) fn close(&self) {
        let mut wish = lock(&self.wish);
        wish.closed = true;
        wish.cancel.store(true, Ordering::Relaxed);
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
            lock(&self.wish).failed.insert((traverse.id.clone(), step));
        }
    }

    /// Waits for the next stop to render; none when the thread shall end.
    fn next(&self) -> Option<(Arc<OpenTraverse>, usize, Arc<AtomicBool>)> {
        let mut wish = lock(&self.wish);
        while !wish.closed {
            if let Some((traverse, step)) = wish.pick() {
                wish.cancel = Arc::default();
                return Some((traverse, step, Arc::clone(&wish.cancel)));
            }
            wish = self.changed.wait(wish).unwrap_or_else(PoisonError::into_inner);
        }
        None
    }
}

impl Wish {
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
