//! What was loaded: steps, images and arrays, with a stated limit of memory.
//!
//! Whatever the page wants at the moment stays; of the rest, what was wanted longest ago goes first.

use std::collections::HashMap;
use std::sync::Arc;

use sightline_core::session::wire::{Problem, StopDetail};
use sightline_core::trace::{ArrayName, StepTrace};

use crate::raster::Raster;
use crate::tables::Table;

/// Memory that loaded things may take, bytes.
pub const LIMIT_BYTES: usize = 256 << 20;

/// What a step's record counts as, bytes: it is small beside its images.
const TRACE_BYTES: usize = 32 << 10;

/// Seconds after which something that was not ready is asked for again.
const RETRY_S: f64 = 2.0;

/// One of the two images of a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Eye {
    /// The left (or first) image.
    Left,
    /// The right (or second) image.
    Right,
}

impl Eye {
    /// The word in paths and titles.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// A step of a run of a target of a session.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct StepKey {
    /// The session.
    pub session: String,
    /// The target's number.
    pub target: usize,
    /// The run's number.
    pub run: usize,
    /// The stop.
    pub step: usize,
}

/// The name of something that can be loaded.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Key {
    /// An image of a stop.
    Image {
        /// The traverse.
        traverse: String,
        /// The stop.
        step: usize,
        /// Which of the two.
        eye: Eye,
    },
    /// A stop with its cameras.
    Stop {
        /// The traverse.
        traverse: String,
        /// The stop.
        step: usize,
    },
    /// What a step saw and decided.
    Trace(StepKey),
    /// An array of a step.
    Array(StepKey, ArrayName),
}

/// Something that was loaded.
#[derive(Clone)]
pub enum Item {
    /// Of [`Key::Stop`].
    Stop(Arc<StopDetail>),
    /// Of [`Key::Trace`].
    Trace(Arc<StepTrace>),
    /// Of [`Key::Image`] and of a [`Key::Array`] that is a picture.
    Raster(Arc<Raster>),
    /// Of a [`Key::Array`] that is a table.
    Table(Arc<Table>),
}

impl Item {
    fn bytes(&self) -> usize {
        match self {
            Self::Stop(_) => size_of::<StopDetail>(),
            Self::Trace(_) => TRACE_BYTES,
            Self::Raster(raster) => raster.bytes(),
            Self::Table(table) => table.bytes(),
        }
    }
}

/// How far something is.
pub enum Slot<'a, T> {
    /// Not asked for.
    Absent,
    /// Asked for.
    Loading,
    /// There.
    Ready(&'a T),
    /// Refused, with what the server said.
    Failed(&'a Problem),
}

impl<'a, T> Slot<'a, T> {
    /// What is there, if it is.
    pub fn ready(self) -> Option<&'a T> {
        match self {
            Self::Ready(item) => Some(item),
            _ => None,
        }
    }

    /// What `of` finds in it; absent where it finds nothing.
    pub fn and<U>(self, of: impl FnOnce(&'a T) -> Option<&'a U>) -> Slot<'a, U> {
        match self {
            Self::Absent => Slot::Absent,
            Self::Loading => Slot::Loading,
            Self::Ready(item) => of(item).map_or(Slot::Absent, Slot::Ready),
            Self::Failed(problem) => Slot::Failed(problem),
        }
    }
}

enum Entry {
    Loading,
    Waiting { until: f64 },
    Ready { item: Item, wanted: u64 },
    Failed(Problem),
}

/// What was loaded, is being loaded, or was refused.
#[derive(Default)]
pub struct Cache {
    entries: HashMap<Key, Entry>,
    bytes: usize,
    round: u64,
}

impl Cache {
    /// Memory taken, bytes.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Marks `keys`, most urgent first, as wanted, and returns those to load now: the missing ones for which
    /// `room` finds a place.
    pub fn want(&mut self, keys: &[Key], mut room: impl FnMut(&Key) -> bool, now: f64) -> Vec<Key> {
        self.round += 1;
        let mut missing = Vec::new();
        for key in keys {
            match self.entries.get_mut(key) {
                Some(Entry::Ready { wanted, .. }) => *wanted = self.round,
                Some(Entry::Waiting { until }) if *until <= now && room(key) => missing.push(key.clone()),
                None if room(key) => missing.push(key.clone()),
                _ => {}
            }
        }
        for key in &missing {
            self.entries.insert(key.clone(), Entry::Loading);
        }
        missing
    }

    /// Takes what arrived for `key`. What is not ready yet is asked for again later.
    pub fn arrived(&mut self, key: Key, outcome: Result<Item, Problem>, now: f64) {
        let entry = match outcome {
            Ok(item) => {
                self.bytes += item.bytes();
                Entry::Ready { item, wanted: self.round }
            }
            Err(problem) if is_passing(&problem) => Entry::Waiting { until: now + RETRY_S },
            Err(problem) => Entry::Failed(problem),
        };
        if let Some(Entry::Ready { item, .. }) = self.entries.insert(key, entry) {
            self.bytes -= item.bytes();
        }
        self.evict(LIMIT_BYTES);
    }

    /// Forgets refusals and waiting, so that everything not loaded is asked for again.
    pub fn retry(&mut self, which: impl Fn(&Key) -> bool) {
        self.entries
            .retain(|key, entry| matches!(entry, Entry::Ready { .. } | Entry::Loading) || !which(key));
    }

    /// When the first of what is waited for is to be asked for again.
    pub fn next_retry(&self) -> Option<f64> {
        let waiting = self.entries.values().filter_map(|entry| match entry {
            Entry::Waiting { until } => Some(*until),
            _ => None,
        });
        waiting.min_by(f64::total_cmp)
    }

    /// Whether nothing is under way for it: it is here, was refused, or is to be asked for again later.
    pub fn is_settled(&self, key: &Key) -> bool {
        matches!(self.entries.get(key), Some(Entry::Ready { .. } | Entry::Failed(_) | Entry::Waiting { .. }))
    }

    /// A stop with its cameras.
    pub fn stop(&self, key: &Key) -> Slot<'_, StopDetail> {
        self.slot(key).and(|item| match item {
            Item::Stop(stop) => Some(stop.as_ref()),
            _ => None,
        })
    }

    /// A step's record.
    pub fn trace(&self, key: &StepKey) -> Slot<'_, StepTrace> {
        self.slot(&Key::Trace(key.clone())).and(|item| match item {
            Item::Trace(trace) => Some(trace.as_ref()),
            _ => None,
        })
    }

    /// An image, or an array that is a picture.
    pub fn raster(&self, key: &Key) -> Slot<'_, Raster> {
        self.slot(key).and(|item| match item {
            Item::Raster(raster) => Some(raster.as_ref()),
            _ => None,
        })
    }

    /// An array that is a table.
    pub fn table(&self, key: &Key) -> Slot<'_, Table> {
        self.slot(key).and(|item| match item {
            Item::Table(table) => Some(table.as_ref()),
            _ => None,
        })
    }

    /// All that have a texture.
    pub fn rasters(&self) -> impl Iterator<Item = &Raster> {
        self.entries.values().filter_map(|entry| match entry {
            Entry::Ready { item: Item::Raster(raster), .. } => Some(raster.as_ref()),
            _ => None,
        })
    }

    fn slot(&self, key: &Key) -> Slot<'_, Item> {
        match self.entries.get(key) {
            None => Slot::Absent,
            Some(Entry::Loading | Entry::Waiting { .. }) => Slot::Loading,
            Some(Entry::Ready { item, .. }) => Slot::Ready(item),
            Some(Entry::Failed(problem)) => Slot::Failed(problem),
        }
    }

    /// Drops what was wanted longest ago until at most `limit` bytes remain; what is wanted now stays.
    fn evict(&mut self, limit: usize) {
        while self.bytes > limit {
            let oldest = self.entries.iter().filter_map(|(key, entry)| match entry {
                Entry::Ready { wanted, .. } if *wanted < self.round => Some((*wanted, key)),
                _ => None,
            });
            let Some(key) = oldest.min().map(|(_, key)| key.clone()) else { return };
            if let Some(Entry::Ready { item, .. }) = self.entries.remove(&key) {
                self.bytes -= item.bytes();
            }
        }
    }
}

/// Whether the same request may succeed soon: no answer, not ready yet, or too busy.
fn is_passing(problem: &Problem) -> bool {
    matches!(problem.status, 0 | 202 | 409 | 425 | 429 | 502..=504)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(step: usize) -> Key {
        Key::Image { traverse: "t".to_owned(), step, eye: Eye::Left }
    }

    fn at_most(n: usize) -> impl FnMut(&Key) -> bool {
        let mut left = n;
        move |_| {
            let is_place = left > 0;
            left = left.saturating_sub(1);
            is_place
        }
    }

    fn raster(side: u32) -> Item {
        let values = sightline_core::image::GrayImage::new(side, side);
        let bytes = sightline_core::image::npy::encode(&values).unwrap();
        Item::Raster(Arc::new(
            Raster::from_npy(&egui::Context::default(), ArrayName::Surface, &bytes).unwrap(),
        ))
    }

    fn problem(status: u16) -> Problem {
        Problem {
            code: "x".to_owned(),
            title: String::new(),
            status,
            detail: "no".to_owned(),
            hint: None,
            nearest_pixel: None,
            received: None,
        }
    }

    #[test]
    fn what_is_missing_is_asked_for_once_and_in_order() {
        let mut cache = Cache::default();
        assert_eq!(cache.want(&[key(3), key(4), key(5)], at_most(2), 0.0), vec![key(3), key(4)]);
        assert_eq!(cache.want(&[key(3), key(4), key(5)], at_most(2), 0.0), vec![key(5)]);
        assert!(matches!(cache.raster(&key(3)), Slot::Loading));
        cache.arrived(key(3), Ok(raster(2)), 0.0);
        assert!(cache.raster(&key(3)).ready().is_some());
    }

    #[test]
    fn a_refusal_stays_and_what_is_not_ready_is_asked_for_again() {
        let mut cache = Cache::default();
        cache.want(&[key(1), key(2)], |_| true, 0.0);
        cache.arrived(key(1), Err(problem(404)), 0.0);
        cache.arrived(key(2), Err(problem(503)), 0.0);
        assert!(matches!(cache.raster(&key(1)), Slot::Failed(_)));
        assert_eq!(cache.next_retry(), Some(RETRY_S));
        assert!(cache.want(&[key(1), key(2)], |_| true, 1.0).is_empty());
        assert_eq!(cache.want(&[key(1), key(2)], |_| true, 2.5), vec![key(2)]);
        cache.retry(|_| true);
        assert_eq!(cache.want(&[key(1), key(2)], |_| true, 2.5), vec![key(1)]);
    }

    #[test]
    fn memory_keeps_its_limit_and_what_is_wanted_stays() {
        let mut cache = Cache::default();
        for step in 0..4 {
            cache.want(&[key(step)], |_| true, 0.0);
            cache.arrived(key(step), Ok(raster(16)), 0.0);
        }
        let one = 16 * 16 * 8;
        assert_eq!(cache.bytes(), 4 * one);
        cache.want(&[key(0), key(3)], |_| false, 0.0);
        cache.evict(2 * one);
        assert_eq!(cache.bytes(), 2 * one);
        assert!(cache.raster(&key(0)).ready().is_some() && cache.raster(&key(3)).ready().is_some());
        cache.evict(0);
        assert_eq!(cache.bytes(), 2 * one);
    }
}
