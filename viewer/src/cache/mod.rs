//! The cache of loaded steps, images and arrays, with a limit of memory.
//!
//! Entries wanted in the current round are never evicted; the others are evicted least recently wanted first.

mod names;
#[cfg(test)]
mod tests;

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use sightline_api::wire::{Problem, StopDetail, StopOdometry};
use sightline_session::step::RunStep;
use sightline_session::times::StageTime;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::locate::template::history::AgainstEarlier;
use sightline_track::trace::ArrayName;

pub(crate) use self::names::{ImageSide, Key, StepKey};
use crate::drawing::raster::Raster;
use crate::driving::hazards::HazardRaster;
use crate::tables::Table;

/// Maximum memory of loaded items, bytes.
pub(crate) const LIMIT_BYTES: usize = 256 << 20;

/// Assumed size of a step's record, bytes; it is small compared with its images.
const TRACE_BYTES: usize = 32 << 10;

/// Seconds after which an item that was not ready is requested again.
const RETRY_S: f64 = 2.0;

/// A loaded item.
#[derive(Clone)]
pub enum Item {
    /// Of [`Key::Stop`].
    Stop(Arc<StopDetail>),
    /// Of [`Key::Odometry`].
    Odometry(Arc<StopOdometry>),
    /// Of [`Key::Hazards`].
    Hazards(Arc<HazardRaster>),
    /// Of [`Key::Trace`].
    Trace(Arc<RunStep>),
    /// Of [`Key::Image`], and of a [`Key::Array`] that is an image.
    Raster(Arc<Raster>),
    /// Of a [`Key::Array`] that is a table.
    Table(Arc<Table>),
    /// Of [`Key::Arrays`]: rasters and tables.
    Arrays(BTreeMap<ArrayName, Item>),
    /// Of [`Key::EarlierTemplates`].
    EarlierTemplates(Vec<AgainstEarlier>),
    /// Of [`Key::Times`].
    Times(Vec<StageTime>),
}

impl Item {
    fn rasters(&self) -> Vec<&Raster> {
        match self {
            Self::Raster(raster) => vec![raster.as_ref()],
            Self::Arrays(all) => all.values().flat_map(Self::rasters).collect(),
            Self::Stop(_) | Self::Odometry(_) | Self::Trace(_) | Self::Table(_) => Vec::new(),
            Self::EarlierTemplates(_) | Self::Times(_) | Self::Hazards(_) => Vec::new(),
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Stop(_) => size_of::<StopDetail>(),
            Self::Odometry(odometry) => size_of::<StopOdometry>() + size_of_val(odometry.corners.as_slice()),
            Self::Hazards(raster) => raster.bytes(),
            Self::Trace(_) => TRACE_BYTES,
            Self::Raster(raster) => raster.bytes(),
            Self::Table(table) => table.bytes(),
            Self::Arrays(all) => all.values().map(Self::bytes).sum(),
            Self::EarlierTemplates(all) => size_of_val(all.as_slice()),
            Self::Times(all) => size_of_val(all.as_slice()),
        }
    }
}

/// The state of an item.
pub enum Slot<'a, T: ?Sized> {
    /// Not requested.
    Absent,
    /// Requested.
    Loading,
    /// Loaded.
    Ready(&'a T),
    /// Refused, with the problem that the server reported.
    Failed(&'a Problem),
}

impl<'a, T: ?Sized> Slot<'a, T> {
    /// The item if it is loaded.
    pub fn ready(self) -> Option<&'a T> {
        match self {
            Self::Ready(item) => Some(item),
            _ => None,
        }
    }

    /// Maps the loaded item with `of`; absent if `of` returns `None`.
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
    Ready { item: Item, used: u64 },
    Failed(Problem),
}

/// The items that are loaded, being loaded, or refused.
#[derive(Default)]
pub struct Cache {
    entries: HashMap<Key, Entry>,
    bytes: usize,
    round: u64,
}

impl Cache {
    /// Memory used, bytes.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Marks `keys`, most urgent first, as wanted, and returns those to load now: the missing ones for which `room`
    /// returns true.
    pub fn request(&mut self, keys: &[Key], mut room: impl FnMut(&Key) -> bool, now: f64) -> Vec<Key> {
        self.round += 1;
        let mut missing = Vec::new();
        for key in keys {
            let key = self.holder(key).into_owned();
            let is_missing = match self.entries.get_mut(&key) {
                Some(Entry::Ready { used, .. }) => {
                    *used = self.round;
                    false
                }
                Some(Entry::Waiting { until }) => *until <= now,
                Some(_) => false,
                None => true,
            };
            if is_missing && room(&key) {
                self.entries.insert(key.clone(), Entry::Loading);
                missing.push(key);
            }
        }
        missing
    }

    /// Stores the outcome for `key`. An item that is not ready yet is requested again later.
    pub fn store(&mut self, key: Key, outcome: Result<Item, Problem>, now: f64) {
        let entry = match outcome {
            Ok(item) => {
                self.bytes += item.bytes();
                Entry::Ready { item, used: self.round }
            }
            Err(problem) if is_passing(&problem) => Entry::Waiting { until: now + RETRY_S },
            Err(problem) => Entry::Failed(problem),
        };
        if let Some(Entry::Ready { item, .. }) = self.entries.insert(key, entry) {
            self.bytes -= item.bytes();
        }
        self.evict(LIMIT_BYTES);
    }

    /// Removes failed and waiting entries selected by `which`, so that they are requested again.
    pub fn retry(&mut self, which: impl Fn(&Key) -> bool) {
        self.entries
            .retain(|key, entry| matches!(entry, Entry::Ready { .. } | Entry::Loading) || !which(key));
    }

    /// Removes the entries selected by `which`, loaded or not, so that they are requested again.
    pub(crate) fn forget(&mut self, which: impl Fn(&Key) -> bool) {
        let bytes = &mut self.bytes;
        self.entries.retain(|key, entry| {
            let is_kept = !which(key);
            if let (false, Entry::Ready { item, .. }) = (is_kept, entry) {
                *bytes -= item.bytes();
            }
            is_kept
        });
    }

    /// The steps of paused drives, each with the first stage that was not computed.
    pub(crate) fn begun(&self) -> Vec<(StepKey, CycleStage)> {
        let begun = |(key, entry): (&Key, &Entry)| match (key, entry) {
            (Key::Trace(key), Entry::Ready { item: Item::Trace(trace), .. }) => {
                Some((key.clone(), trace.paused_before()?))
            }
            _ => None,
        };
        self.entries.iter().filter_map(begun).collect()
    }

    /// The time of the next retry, s, on the clock of `now`; `None` if nothing waits for one.
    pub fn next_retry(&self) -> Option<f64> {
        let waiting = self.entries.values().filter_map(|entry| match entry {
            Entry::Waiting { until } => Some(*until),
            _ => None,
        });
        waiting.min_by(f64::total_cmp)
    }

    /// Whether no request for an item is under way: it is loaded, was refused, or waits for a retry.
    pub fn is_settled(&self, key: &Key) -> bool {
        matches!(
            self.entries.get(&self.holder(key)),
            Some(Entry::Ready { .. } | Entry::Failed(_) | Entry::Waiting { .. })
        )
    }

    /// A stop with its cameras.
    pub fn stop(&self, key: &Key) -> Slot<'_, StopDetail> {
        self.slot(key).and(|item| match item {
            Item::Stop(stop) => Some(stop.as_ref()),
            _ => None,
        })
    }

    /// The odometry of a stop with its corners.
    pub(crate) fn odometry(&self, key: &Key) -> Slot<'_, StopOdometry> {
        self.slot(key).and(|item| match item {
            Item::Odometry(odometry) => Some(odometry.as_ref()),
            _ => None,
        })
    }

    /// The goodness map of a stop.
    pub(crate) fn hazards(&self, key: &Key) -> Slot<'_, HazardRaster> {
        self.slot(key).and(|item| match item {
            Item::Hazards(raster) => Some(raster.as_ref()),
            _ => None,
        })
    }

    /// A step's record.
    pub fn trace(&self, key: &StepKey) -> Slot<'_, RunStep> {
        self.slot(&Key::Trace(key.clone())).and(|item| match item {
            Item::Trace(trace) => Some(trace.as_ref()),
            _ => None,
        })
    }

    /// An image, or an array that is an image.
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

    /// The comparison of a step's view with the earlier templates of its run.
    pub fn earlier_templates(&self, key: &StepKey) -> Slot<'_, [AgainstEarlier]> {
        match self.slot(&Key::EarlierTemplates(key.clone())) {
            Slot::Ready(Item::EarlierTemplates(all)) => Slot::Ready(all),
            Slot::Ready(_) | Slot::Absent => Slot::Absent,
            Slot::Loading => Slot::Loading,
            Slot::Failed(problem) => Slot::Failed(problem),
        }
    }

    /// The times of a step's stages.
    pub fn times(&self, key: &StepKey) -> Option<&[StageTime]> {
        match self.slot(&Key::Times(key.clone())) {
            Slot::Ready(Item::Times(all)) => Some(all),
            _ => None,
        }
    }

    /// All items that have a texture.
    pub fn rasters(&self) -> impl Iterator<Item = &Raster> {
        let ready = self.entries.values().filter_map(|entry| match entry {
            Entry::Ready { item, .. } => Some(item),
            _ => None,
        });
        ready.flat_map(Item::rasters)
    }

    /// The key under which an item is stored: an array is loaded with all arrays of its step.
    fn holder<'a>(&self, key: &'a Key) -> Cow<'a, Key> {
        match key {
            Key::Array(step, _) if !self.entries.contains_key(key) => Cow::Owned(Key::Arrays(step.clone())),
            _ => Cow::Borrowed(key),
        }
    }

    fn slot(&self, key: &Key) -> Slot<'_, Item> {
        let holder = self.holder(key);
        match (self.entries.get(&holder), key) {
            (None, _) => Slot::Absent,
            (Some(Entry::Loading | Entry::Waiting { .. }), _) => Slot::Loading,
            (Some(Entry::Ready { item: Item::Arrays(all), .. }), Key::Array(_, name)) => {
                all.get(name).map_or(Slot::Absent, Slot::Ready)
            }
            (Some(Entry::Ready { item, .. }), _) => Slot::Ready(item),
            (Some(Entry::Failed(problem)), _) => Slot::Failed(problem),
        }
    }

    /// Removes the least recently wanted items until at most `limit` bytes remain; currently wanted items are kept.
    fn evict(&mut self, limit: usize) {
        while self.bytes > limit {
            let oldest = self.entries.iter().filter_map(|(key, entry)| match entry {
                Entry::Ready { used, .. } if *used < self.round => Some((*used, key)),
                _ => None,
            });
            let Some(key) = oldest.min().map(|(_, key)| key.clone()) else { return };
            if let Some(Entry::Ready { item, .. }) = self.entries.remove(&key) {
                self.bytes -= item.bytes();
            }
        }
    }
}

/// Whether the same request may succeed soon: no response, not ready yet, or server busy.
fn is_passing(problem: &Problem) -> bool {
    matches!(problem.status, 0 | 202 | 409 | 425 | 429 | 502..=504)
}
