//! What the targets of a traverse share: the features of a stop, and the motion between two (R207).
//!
//! Both are functions of the images, the cameras and the settings, so that keeping them changes nothing but the time: five
//! targets, a second run or a step back find them ready. What was not used for longest is forgotten first.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use super::detect::StopFeatures;
use super::motion::Motion;
use super::settings::FeatureSettings;

/// Stops whose features are kept: about a megabyte each.
const STOPS: usize = 64;

/// Motions that are kept.
const MOTIONS: usize = 256;

/// Features and motions that were found before.
#[derive(Default)]
pub struct FeatureStore {
    stops: Kept<usize, StopFeatures>,
    motions: Kept<[usize; 2], Motion>,
}

/// The store of a traverse, as one stop of it is asked for.
#[derive(Clone, Copy)]
pub struct Shared<'a> {
    /// The store.
    pub store: &'a FeatureStore,
    /// Which stop of the recording this is, however a study numbers those that it visits.
    pub stop: usize,
}

impl std::fmt::Debug for Shared<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Shared {{ stop: {} }}", self.stop)
    }
}

/// The features of a stop, kept where there is a store.
pub fn features(
    shared: Option<Shared<'_>>,
    settings: &FeatureSettings,
    find: impl FnOnce() -> StopFeatures,
) -> Arc<StopFeatures> {
    match shared {
        Some(Shared { store, stop }) => store.stops.get(stop, settings, STOPS, find),
        None => Arc::new(find()),
    }
}

/// The motion from an earlier stop of the recording to this one, kept where there is a store and the pose estimates, which
/// a study may disturb, have no part in it.
pub fn motion(
    shared: Option<Shared<'_>>,
    earlier: Option<usize>,
    settings: &FeatureSettings,
    find: impl FnOnce() -> Motion,
) -> Arc<Motion> {
    match (shared, earlier) {
        (Some(Shared { store, stop }), Some(earlier)) if settings.prior_radius_px <= 0.0 => {
            store.motions.get([earlier, stop], settings, MOTIONS, find)
        }
        _ => Arc::new(find()),
    }
}

/// A value with what it was found for.
type Entry<K, V> = (K, FeatureSettings, Arc<V>);

/// Values by key and settings, the most recently used at the back.
struct Kept<K, V>(Mutex<VecDeque<Entry<K, V>>>);

impl<K, V> Default for Kept<K, V> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<K: PartialEq, V> Kept<K, V> {
    /// The kept value, or the one that `find` makes. Nobody waits while it is being found: what two find at once is the same.
    fn get(&self, key: K, settings: &FeatureSettings, limit: usize, find: impl FnOnce() -> V) -> Arc<V> {
        if let Some(found) = self.with(|entries| {
            let place = entries.iter().position(|(own, of, _)| *own == key && of == settings)?;
            let entry = entries.remove(place)?;
            let value = Arc::clone(&entry.2);
            entries.push_back(entry);
            Some(value)
        }) {
            return found;
        }
        let value = Arc::new(find());
        self.with(|entries| {
            entries.push_back((key, settings.clone(), Arc::clone(&value)));
            entries.drain(..entries.len().saturating_sub(limit));
        });
        value
    }

    fn with<T>(&self, work: impl FnOnce(&mut VecDeque<Entry<K, V>>) -> T) -> T {
        // A panic elsewhere cannot leave the entries half changed.
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
