//! The server's events over a WebSocket, which is reconnected after increasing delays.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Duration;

use ewebsock::{Options, WsEvent, WsMessage, WsReceiver, WsSender};
use sightline_api::event::Event;

/// Maximum delay between two connection attempts, s.
const PATIENCE_S: f64 = 10.0;

/// Maximum delay before events and invisible replies are handled. Usually another repaint handles them earlier.
pub(super) const UNHURRIED: Duration = Duration::from_millis(50);
/// The same during a stream of events: a fast run needs the processor more than a repaint for each of its steps.
const STREAMING: Duration = Duration::from_millis(150);
/// Minimum number of events per poll that counts as a stream.
const STREAM_LENGTH: usize = 6;

/// State of the event connection.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Connection {
    /// The first attempt is under way.
    #[default]
    Connecting,
    /// Connected; events are received.
    Live,
    /// The server does not respond.
    Gone {
        /// Failed attempts so far.
        attempts: u32,
    },
}

/// The event connection to one server.
pub(super) struct Events {
    url: String,
    context: egui::Context,
    // Dropping the sender closes the connection.
    socket: Option<(WsSender, WsReceiver)>,
    is_open: bool,
    attempts: u32,
    retry_at: f64,
    /// Whether the last poll returned a stream of events.
    is_stream: Arc<AtomicBool>,
}

impl Events {
    /// The connection to the server at `origin`; the first poll opens it.
    pub(super) fn new(origin: &str, context: egui::Context) -> Self {
        let url = format!("{}/api/v1/events", origin.replacen("http", "ws", 1));
        let is_stream = Arc::default();
        Self { url, context, socket: None, is_open: false, attempts: 0, retry_at: 0.0, is_stream }
    }

    /// Makes the next poll reconnect at once, unless a connection is open.
    pub(super) fn reconnect_now(&mut self) {
        if !self.is_open {
            (self.socket, self.retry_at) = (None, 0.0);
        }
    }

    /// Time of the next attempt, s; `None` while there is a connection.
    pub(super) fn retry_at(&self) -> Option<f64> {
        self.socket.is_none().then_some(self.retry_at)
    }

    /// Returns the events since the last poll and the state of the connection.
    pub(super) fn poll(&mut self, now: f64) -> (Vec<Event>, Connection) {
        if self.socket.is_none() && now >= self.retry_at {
            self.connect(now);
        }
        let mut events = Vec::new();
        let mut is_lost = false;
        while let Some(event) = self.socket.as_ref().and_then(|(_, receiver)| receiver.try_recv()) {
            match event {
                WsEvent::Opened => (self.is_open, self.attempts) = (true, 0),
                // Events of unknown kinds are for newer versions of the page.
                WsEvent::Message(WsMessage::Text(text)) => {
                    events.extend(serde_json::from_str::<Event>(&text));
                }
                WsEvent::Message(_) => {}
                WsEvent::Error(_) | WsEvent::Closed => is_lost = true,
            }
        }
        if is_lost {
            self.lose(now);
        }
        self.is_stream.store(events.len() >= STREAM_LENGTH, Relaxed);
        (events, self.connection())
    }

    fn connection(&self) -> Connection {
        match (self.is_open, self.attempts) {
            (true, _) => Connection::Live,
            (false, 0) => Connection::Connecting,
            (false, attempts) => Connection::Gone { attempts },
        }
    }

    fn connect(&mut self, now: f64) {
        let (context, is_stream) = (self.context.clone(), Arc::clone(&self.is_stream));
        let wake = move || {
            let pause = if is_stream.load(Relaxed) { STREAMING } else { UNHURRIED };
            context.request_repaint_after(pause);
        };
        match ewebsock::connect_with_wakeup(self.url.clone(), Options::default(), wake) {
            Ok(socket) => self.socket = Some(socket),
            Err(_) => self.lose(now),
        }
    }

    fn lose(&mut self, now: f64) {
        (self.socket, self.is_open) = (None, false);
        self.attempts += 1;
        let pause = f64::from(1_u32 << self.attempts.min(4) >> 1).min(PATIENCE_S);
        self.retry_at = now + pause;
    }
}
