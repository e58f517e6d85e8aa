//! The network. Nothing here blocks: answers arrive through a channel.

pub(crate) mod events;
pub(crate) mod calls;
mod http;
mod in_order;
pub(crate) mod items;
mod reply;
pub(crate) mod request;

use std::collections::HashSet;
use std::sync::mpsc::{Receiver, Sender, channel};

use sightline_api::event::Event;

use self::events::{Connection, Events, UNHURRIED};
use self::in_order::InOrder;
use self::request::{CompletedRequest, Request};
use crate::cache::Key;

/// Maximum number of concurrent requests for images, arrays and records.
const AT_A_TIME: usize = 6;

/// Maximum number of images among them that must be rendered first: a browser opens few connections per server.
const SLOW_AT_A_TIME: usize = 2;

/// The network side of the page.
pub(crate) struct Net {
    origin: String,
    context: egui::Context,
    sender: Sender<CompletedRequest>,
    receiver: Receiver<CompletedRequest>,
    under_way: HashSet<Key>,
    slow: HashSet<Key>,
    in_order: InOrder,
    events: Events,
}

impl Net {
    /// The network side for the server at `origin`; wakes `context` when an answer arrives.
    pub(crate) fn new(origin: String, context: egui::Context) -> Self {
        let (sender, receiver) = channel();
        let events = Events::new(&origin, context.clone());
        let (under_way, slow, in_order) = (HashSet::new(), HashSet::new(), InOrder::default());
        Self { origin, context, sender, receiver, under_way, slow, in_order, events }
    }

    /// Reserves a slot for an item that is requested next; `false` if none is free.
    pub(crate) fn take_place(&mut self, key: &Key, is_slow: bool) -> bool {
        let is_place = self.under_way.len() < AT_A_TIME && (!is_slow || self.slow.len() < SLOW_AT_A_TIME);
        if is_place {
            self.under_way.insert(key.clone());
        }
        if is_place && is_slow {
            self.slow.insert(key.clone());
        }
        is_place
    }

    /// Sends a request; its answer arrives later.
    pub(crate) fn send(&mut self, request: Request) {
        if request == Request::Reconnect {
            self.events.reconnect_now();
        } else if request.is_in_order() {
            if let Some(first) = self.in_order.add(request) {
                self.send_now(first);
            }
        } else {
            self.send_now(request);
        }
    }

    fn send_now(&self, request: Request) {
        let (sender, context) = (self.sender.clone(), self.context.clone());
        http::send(&self.origin, request, &self.context, move |completed| {
            let is_invisible = completed.request.is_invisible();
            // Without a receiver the page is closing and the answer is not needed.
            match sender.send(completed) {
                Ok(()) if is_invisible => context.request_repaint_after(UNHURRIED),
                Ok(()) => context.request_repaint(),
                Err(_) => {}
            }
        });
    }

    /// The answers since the last call.
    pub(crate) fn poll(&mut self) -> Vec<CompletedRequest> {
        let completed: Vec<CompletedRequest> = self.receiver.try_iter().collect();
        for answer in &completed {
            if let Request::Item(key) = &answer.request {
                self.under_way.remove(key);
                self.slow.remove(key);
            }
            if let Some(next) = self.in_order.answered(&answer.request) {
                self.send_now(next);
            }
        }
        completed
    }

    /// Time at which the events must be polled even if nothing has arrived, s.
    pub(crate) fn retry_at(&self) -> Option<f64> {
        self.events.retry_at()
    }

    /// Returns the events since the last poll and the state of their connection.
    pub(crate) fn poll_events(&mut self, now: f64) -> (Vec<Event>, Connection) {
        self.events.poll(now)
    }
}
