//! The accept loop: limits the number of open connections and the time of each request and answer.
//!
//! ```text
//!             first byte … whole head        body sent
//! waiting ─────────────────────────► busy ────────────► waiting
//!    └─ closed after `header_s`, or earlier when a new connection needs its slot
//! ```
//! A connection without a request in progress is *waiting*: it is idle, or sends the head of a request slowly. At the limit,
//! the longest waiting one is closed for a new connection; busy ones are never closed. Connections that send nothing
//! therefore cannot exhaust the server. A client that reads nothing of an answer for `send_s` is disconnected.

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

/// File descriptors reserved for databases, images, exports and Rerun if the system allows few.
#[cfg(unix)]
const RESERVED_DESCRIPTORS: u64 = 96;
/// Minimum number of connections, however few descriptors there are.
#[cfg(unix)]
const MIN_CONNECTIONS: usize = 16;
/// Length of the accept queue. With the 128 of the standard library, a new connection behind some hundred others is delayed
/// by a second, because the system drops its first packet.
#[cfg(unix)]
const BACKLOG: i32 = 1024;
/// How long accepting pauses after an error of the system, for example when all descriptors are in use.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);

/// The open connections of a server.
#[derive(Debug, Default)]
pub(crate) struct Connections {
    open: Mutex<Open>,
    /// Notified when a connection closes or starts to wait.
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
    /// When it started to wait for a request; `None` during one.
    waiting: Option<Instant>,
    /// Closes the connection; `None` once used.
    close: Option<AbortHandle>,
    /// Whether it was upgraded to a WebSocket and answers no more requests.
    is_web_socket: bool,
}

impl State {
    /// Whether it may be closed for a new connection.
    fn is_idle(&self) -> bool {
        self.waiting.is_some() && self.close.is_some() && !self.is_web_socket
    }
}

impl Connections {
    /// Number of open connections.
    pub(crate) fn count(&self) -> usize {
        lock(&self.open).by_number.len()
    }

    fn enter(self: &Arc<Self>) -> Arc<ConnectionSlot> {
        let mut open = lock(&self.open);
        open.last_number += 1;
        let number = open.last_number;
        open.by_number
            .insert(number, State { waiting: Some(Instant::now()), close: None, is_web_socket: false });
        Arc::new(ConnectionSlot { connections: Arc::clone(self), number })
    }

    /// Waits until there are fewer connections than `limit`, closing waiting ones.
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

/// One open connection, until its stream is closed.
#[derive(Debug)]
struct ConnectionSlot {
    connections: Arc<Connections>,
    number: u64,
}

impl Drop for ConnectionSlot {
    fn drop(&mut self) {
        lock(&self.connections.open).by_number.remove(&self.number);
        self.connections.changed.notify_one();
    }
}

/// A request in progress, until its answer is complete.
#[derive(Debug)]
struct Busy(Arc<ConnectionSlot>);

impl Busy {
    fn new(slot: &Arc<ConnectionSlot>) -> Self {
        slot.connections.set(slot.number, |state| state.waiting = None);
        Self(Arc::clone(slot))
    }
}

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.connections.set(self.0.number, |state| state.waiting = Some(Instant::now()));
    }
}

/// Maximum number of connections: the limit, or fewer if the system allows too few descriptors.
fn connection_limit(limits: &Limits) -> usize {
    let configured = limits.connections.count();
    #[cfg(unix)]
    {
        let allowed = rustix::process::getrlimit(rustix::process::Resource::Nofile).current;
        let room = allowed.map_or(u64::MAX, |descriptors| descriptors.saturating_sub(RESERVED_DESCRIPTORS));
        configured.min(usize::try_from(room).unwrap_or(usize::MAX).max(MIN_CONNECTIONS))
    }
    #[cfg(not(unix))]
    configured
}

/// Accepts connections and answers their requests, forever.
pub(crate) async fn serve(
    listener: TcpListener,
    app: Router,
    limits: &Limits,
    connections: Arc<Connections>,
) -> Infallible {
    let limit = connection_limit(limits);
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
                tokio::time::sleep(ACCEPT_PAUSE).await;
                continue;
            }
        };
        connections.make_room(limit).await;
        let slot = connections.enter();
        let work = answer(stream, app.clone(), limits, &slot);
        let close = tokio::spawn(work).abort_handle();
        connections.set(slot.number, |state| state.close = Some(close));
    }
}

/// Whether an error of `accept` only means that the client disconnected.
fn is_of_client(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionAborted, ConnectionRefused, ConnectionReset};
    matches!(error.kind(), ConnectionAborted | ConnectionRefused | ConnectionReset)
}

/// Answers the requests of one connection.
fn answer(
    stream: TcpStream,
    app: Router,
    limits: &Limits,
    slot: &Arc<ConnectionSlot>,
) -> impl Future<Output = ()> + Send + 'static {
    let mut http = http1::Builder::new();
    http.timer(TokioTimer::new()).header_read_timeout(limits.header_s.time());
    let write_timeout = limits.send_s.time();
    let stream =
        TokioIo::new(WriteTimeoutStream { stream, write_timeout, stalled: None, _slot: Arc::clone(slot) });
    let (app, slot) = (TowerToHyperService::new(app), Arc::clone(slot));
    let (connections, number) = (Arc::clone(&slot.connections), slot.number);
    let service = service_fn(move |request: Request<Incoming>| {
        let busy = Busy::new(&slot);
        let answer = app.call(request);
        async move { answer.await.map(|answer| answer.map(|body| Body::new(Sending { body, _busy: busy }))) }
    });
    async move {
        // A client that disconnects or is too slow is not an error of the program.
        let _ = http.serve_connection(stream, service).with_upgrades().await;
        // If the stream is still open, it is a WebSocket, which waits for no request.
        connections.set(number, |state| state.is_web_socket = true);
    }
}

/// The body of an answer, which keeps its connection busy until it is sent.
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

/// A stream that fails if its client does not read.
struct WriteTimeoutStream {
    stream: TcpStream,
    write_timeout: Option<Duration>,
    /// The timeout, running while the client reads nothing.
    stalled: Option<Pin<Box<Sleep>>>,
    _slot: Arc<ConnectionSlot>,
}

impl WriteTimeoutStream {
    /// Passes on the result of a write, or fails once writing has stalled too long.
    fn watch(
        &mut self,
        written: Poll<io::Result<usize>>,
        context: &mut Context<'_>,
    ) -> Poll<io::Result<usize>> {
        if written.is_ready() {
            self.stalled = None;
            return written;
        }
        let Some(write_timeout) = self.write_timeout else { return written };
        let stalled = self.stalled.get_or_insert_with(|| Box::pin(tokio::time::sleep(write_timeout)));
        ready!(stalled.as_mut().poll(context));
        Poll::Ready(Err(io::ErrorKind::TimedOut.into()))
    }
}

impl AsyncRead for WriteTimeoutStream {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_read(context, buffer)
    }
}

impl AsyncWrite for WriteTimeoutStream {
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
