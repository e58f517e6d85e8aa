//! The accept loop: how many connections are open, and how long each may take for its part.
//!
//! ```text
//!             first byte … whole head        body sent
//! waiting ─────────────────────────► busy ────────────► waiting
//!    └─ closed after `header_s`, or earlier when a newcomer needs its place
//! ```
//! A connection without a request in progress is *waiting*: it is idle, or dribbles the head of a request. At the limit, the one
//! that has waited longest is closed for a newcomer; busy ones are never closed. So connections that send nothing
//! lock nobody out. A client that takes nothing of an answer for `send_s` is cut off.

use std::collections::HashMap;
use std::convert::Infallible;
use std::io;
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, ready};
use std::time::{Duration, Instant};

use axum::Router;
use axum::body::Body;
use axum::http::Request;
use hyper::body::{Bytes, Frame, Incoming, SizeHint};
use hyper::server::conn::http1;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Notify;
use tokio::task::AbortHandle;
use tokio::time::Sleep;

use crate::jobs::lock;
use crate::limits::Limits;

/// Descriptors that are left for files when the system allows few: databases, images, exports, Rerun.
#[cfg(unix)]
const DESCRIPTORS_LEFT: u64 = 96;
/// The least number of connections, however few descriptors there are.
#[cfg(unix)]
const LEAST: usize = 16;
/// Connections that may wait to be accepted: with the 128 of the standard library a newcomer waits for a second behind some
/// hundred others, because the system drops its first packet.
#[cfg(unix)]
const BACKLOG: i32 = 1024;
/// How long accepting rests when the system refuses, for example because all descriptors are in use.
const REST: Duration = Duration::from_millis(50);

/// The open connections of a server.
#[derive(Debug, Default)]
pub(crate) struct Connections {
    open: Mutex<Open>,
    /// Told when a connection leaves or begins to wait.
    changed: Notify,
}

#[derive(Debug, Default)]
struct Open {
    by_number: HashMap<u64, State>,
    last_number: u64,
}

/// A connection.
#[derive(Debug)]
struct State {
    /// Since when it has waited for a request; `None` while it has one.
    waiting: Option<Instant>,
    /// How to close it; `None` once that was done.
    close: Option<AbortHandle>,
    /// Whether it answers no requests any more.
    is_web_socket: bool,
}

impl State {
    /// Whether it may be closed for a newcomer.
    fn is_idle(&self) -> bool {
        self.waiting.is_some() && self.close.is_some() && !self.is_web_socket
    }
}

impl Connections {
    /// How many are open.
    pub(crate) fn count(&self) -> usize {
        lock(&self.open).by_number.len()
    }

    fn enter(self: &Arc<Self>) -> Arc<Place> {
        let mut open = lock(&self.open);
        open.last_number += 1;
        let number = open.last_number;
        open.by_number
            .insert(number, State { waiting: Some(Instant::now()), close: None, is_web_socket: false });
        Arc::new(Place { connections: Arc::clone(self), number })
    }

    /// Waits until there are fewer connections than `limit`, and closes waiting ones for it.
    async fn make_room(&self, limit: usize) {
        while self.count() >= limit {
            self.close_longest_waiting();
            self.changed.notified().await;
        }
    }

    fn close_longest_waiting(&self) {
        let mut open = lock(&self.open);
        let waiting = open.by_number.values_mut().filter(|one| one.is_idle());
        if let Some(close) = waiting.min_by_key(|one| one.waiting).and_then(|one| one.close.take()) {
            close.abort();
        }
    }

    fn set(&self, number: u64, change: impl FnOnce(&mut State)) {
        if let Some(state) = lock(&self.open).by_number.get_mut(&number) {
            change(state);
        }
        self.changed.notify_one();
    }
}

/// One of the open connections, until its stream is closed.
#[derive(Debug)]
struct Place {
    connections: Arc<Connections>,
    number: u64,
}

impl Drop for Place {
    fn drop(&mut self) {
        lock(&self.connections.open).by_number.remove(&self.number);
        self.connections.changed.notify_one();
    }
}

/// A request in progress, until its answer was handed over.
#[derive(Debug)]
struct Busy(Arc<Place>);

impl Busy {
    fn new(place: &Arc<Place>) -> Self {
        place.connections.set(place.number, |state| state.waiting = None);
        Self(Arc::clone(place))
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.connections.set(self.0.number, |state| state.waiting = Some(Instant::now()));
    }
}

/// How many connections there may be: the limit, or fewer where the system allows too few descriptors.
fn most(limits: &Limits) -> usize {
    let wanted = limits.connections.count();
    #[cfg(unix)]
    {
        let allowed = rustix::process::getrlimit(rustix::process::Resource::Nofile).current;
        let room = allowed.map_or(u64::MAX, |descriptors| descriptors.saturating_sub(DESCRIPTORS_LEFT));
        wanted.min(usize::try_from(room).unwrap_or(usize::MAX).max(LEAST))
    }
    #[cfg(not(unix))]
    wanted
}

/// Accepts connections and answers their requests, for ever.
pub(crate) async fn serve(
    listener: TcpListener,
    app: Router,
    limits: &Limits,
    connections: Arc<Connections>,
) -> Infallible {
    let limit = most(limits);
    #[cfg(unix)]
    if let Err(error) = rustix::net::listen(&listener, BACKLOG) {
        tracing::warn!("few connections can wait to be accepted: {error}");
    }
    loop {
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            Err(error) if is_of_client(&error) => continue,
            Err(error) => {
                tracing::error!("cannot accept a connection: {error}");
                connections.close_longest_waiting();
                tokio::time::sleep(REST).await;
                continue;
            }
        };
        connections.make_room(limit).await;
        let place = connections.enter();
        let work = answer(stream, app.clone(), limits, &place);
        let close = tokio::spawn(work).abort_handle();
        connections.set(place.number, |state| state.close = Some(close));
    }
}

/// Whether an error of `accept` says no more than that a client went away.
fn is_of_client(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionAborted, ConnectionRefused, ConnectionReset};
    matches!(error.kind(), ConnectionAborted | ConnectionRefused | ConnectionReset)
}

/// Answers the requests of one connection.
fn answer(
    stream: TcpStream,
    app: Router,
    limits: &Limits,
    place: &Arc<Place>,
) -> impl Future<Output = ()> + Send + 'static {
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(limits.header_s.time());
    let patience = limits.send_s.time();
    let stream = TokioIo::new(Patient { stream, patience, stalled: None, _place: Arc::clone(place) });
    let (app, place) = (TowerToHyperService::new(app), Arc::clone(place));
    let (connections, number) = (Arc::clone(&place.connections), place.number);
    let service = service_fn(move |request: Request<Incoming>| {
        let busy = Busy::new(&place);
        let answer = app.call(request);
        async move { answer.await.map(|answer| answer.map(|body| Body::new(Sending { body, _busy: busy }))) }
    });
    async move {
        // A client that goes away or is too slow is no fault of the program.
        let _ = http.serve_connection(stream, service).with_upgrades().await;
        // Where the stream lives on, it is a WebSocket, which waits for no request.
        connections.set(number, |state| state.is_web_socket = true);
    }
}

/// The body of an answer, which keeps its connection busy.
struct Sending {
    body: Body,
    _busy: Busy,
}

impl hyper::body::Body for Sending {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.body).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

/// A stream whose client must take what is sent to it.
struct Patient {
    stream: TcpStream,
    patience: Option<Duration>,
    /// Runs while the client takes nothing.
    stalled: Option<Pin<Box<Sleep>>>,
    _place: Arc<Place>,
}

impl Patient {
    /// Passes on how a write went, and fails once it has waited too long.
    fn watch(
        &mut self,
        written: Poll<io::Result<usize>>,
        context: &mut Context<'_>,
    ) -> Poll<io::Result<usize>> {
        if written.is_ready() {
            self.stalled = None;
            return written;
        }
        let Some(patience) = self.patience else { return written };
        let stalled = self.stalled.get_or_insert_with(|| Box::pin(tokio::time::sleep(patience)));
        ready!(stalled.as_mut().poll(context));
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }
}

impl AsyncRead for Patient {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for Patient {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write(context, bytes);
        self.watch(written, context)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        parts: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let written = Pin::new(&mut self.stream).poll_write_vectored(context, parts);
        self.watch(written, context)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}
