//! Everything that crosses the network. Nothing here blocks: answers come in through a channel.

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
use self::request::{Arrived, Request};
use crate::cache::Key;

/// Maximum number of images, arrays and records under way.
const AT_A_TIME: usize = 6;

/// Maximum number of images among them that must be rendered first: a browser has few connections to one server.
const SLOW_AT_A_TIME: usize = 2;

/// The network side of the page.
pub(crate) struct Net {
    origin: String,
    context: egui::Context,
    sender: Sender<Arrived>,
    receiver: Receiver<Arrived>,
    under_way: HashSet<Key>,
    slow: HashSet<Key>,
    in_order: InOrder,
    events: Events,
}

impl Net {
    /// Talks to the server at `origin`; wakes `context` when something arrives.
    pub(crate) fn new(origin: String, context: egui::Context) -> Self {
        let (sender, receiver) = channel();
        let events = Events::new(&origin, context.clone());
        let (under_way, slow, in_order) = (HashSet::new(), HashSet::new(), InOrder::default());
        Self { origin, context, sender, receiver, under_way, slow, in_order, events }
    }

    /// Reserves a place for an item that is requested next; false if all are taken.
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
        http::send(&self.origin, request, &self.context, move |arrived| {
            let is_invisible = arrived.request.is_invisible();
            // Without a receiver the page is closing, and nobody waits for the answer.
            match sender.send(arrived) {
                Ok(()) if is_invisible => context.request_repaint_after(UNHURRIED),
                Ok(()) => context.request_repaint(),
                Err(_) => {}
            }
        });
    }

    /// The answers since the last call.
    pub(crate) fn poll(&mut self) -> Vec<Arrived> {
        let arrived: Vec<Arrived> = self.receiver.try_iter().collect();
        for answer in &arrived {
            if let Request::Item(key) = &answer.request {
                self.under_way.remove(key);
                self.slow.remove(key);
            }
            if let Some(next) = self.in_order.answered(&answer.request) {
                self.send_now(next);
            }
        }
        arrived
    }

    /// When the events want to be polled next although nothing arrived.
    pub(crate) fn retry_at(&self) -> Option<f64> {
        self.events.retry_at()
    }

    /// The events since the last time, and how they come in.
    pub(crate) fn poll_events(&mut self, now: f64) -> (Vec<Event>, Connection) {
        self.events.poll(now)
    }
}
