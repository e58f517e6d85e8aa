//! The server's events over a WebSocket, connected again with growing patience when it is lost.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::Duration;

use ewebsock::{Options, WsEvent, WsMessage, WsReceiver, WsSender};
use sightline_api::event::Event;

/// The longest pause between two attempts, s.
const PATIENCE_S: f64 = 10.0;

/// After how long at the latest the page takes in what nobody waits for; mostly it comes with a frame that is laid out
/// anyway.
pub(super) const UNHURRIED: Duration = Duration::from_millis(50);
/// The same while events stream in: a quick run needs the processors more than a picture of each of its steps.
const STREAMING: Duration = Duration::from_millis(150);
/// So many events at a time are a stream.
const STREAM_LENGTH: usize = 6;

/// How the server's events come in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Connection {
    /// The first attempt is under way.
    #[default]
    Connecting,
    /// Events come in.
    Live,
    /// The server does not answer.
    Gone {
        /// Attempts so far.
        attempts: u32,
    },
}

/// The events of one server.
pub(super) struct Events {
    url: String,
    context: egui::Context,
    // The sender closes the connection when it is dropped.
    socket: Option<(WsSender, WsReceiver)>,
    is_open: bool,
    attempts: u32,
    retry_at: f64,
    /// Whether the last events came as a stream.
    is_stream: Arc<AtomicBool>,
}

impl Events {
    /// The events of the server at `origin`; the first poll connects.
    pub(super) fn new(origin: &str, context: egui::Context) -> Self {
        let url = format!("{}/api/v1/events", origin.replacen("http", "ws", 1));
        let is_stream = Arc::default();
        Self { url, context, socket: None, is_open: false, attempts: 0, retry_at: 0.0, is_stream }
    }

    /// Does not wait for the next attempt.
    pub(super) fn reconnect_now(&mut self) {
        if !self.is_open {
            (self.socket, self.retry_at) = (None, 0.0);
        }
    }

    /// When the next attempt is due, while there is no connection.
    pub(super) fn retry_at(&self) -> Option<f64> {
        self.socket.is_none().then_some(self.retry_at)
    }

    /// What was told since the last time, and how the connection is.
    pub(super) fn poll(&mut self, now: f64) -> (Vec<Event>, Connection) {
        if self.socket.is_none() && now >= self.retry_at {
            self.connect(now);
        }
        let mut told = Vec::new();
        let mut is_lost = false;
        while let Some(event) = self.socket.as_ref().and_then(|(_, receiver)| receiver.try_recv()) {
            match event {
                WsEvent::Opened => (self.is_open, self.attempts) = (true, 0),
                // An event that this page does not know is for a newer one.
                WsEvent::Message(WsMessage::Text(text)) => told.extend(serde_json::from_str::<Event>(&text)),
                WsEvent::Message(_) => {}
                WsEvent::Error(_) | WsEvent::Closed => is_lost = true,
            }
        }
        if is_lost {
            self.lose(now);
        }
        self.is_stream.store(told.len() >= STREAM_LENGTH, Relaxed);
        (told, self.connection())
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
