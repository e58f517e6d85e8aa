//! What the targets of a traverse share: the features and the surface of a stop, and the motion between two (R207).
//!
//! All are functions of the images, the cameras and the settings, so that keeping them changes nothing but the time: five
//! targets, a second run or a step back find them ready. What was not used for longest is forgotten first.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

use super::features::FeatureSettings;
use super::features::detect::StopFeatures;
use super::features::motion::Motion;
use super::shape_tracker::surface::StopSurface;
use crate::error::Result;
use crate::stereo::StereoSettings;

/// Stops whose features are kept: about a megabyte each.
const STOPS: usize = 64;

/// Motions that are kept.
const MOTIONS: usize = 256;

/// Stops whose surfaces are kept: a dozen megabytes each.
const SURFACES: usize = 3;

/// Features, motions and surfaces that were found before.
#[derive(Default)]
pub struct SharedStore {
    stops: Kept<usize, FeatureSettings, StopFeatures>,
    motions: Kept<[usize; 2], FeatureSettings, Motion>,
    surfaces: Kept<usize, StereoSettings, StopSurface>,
}

/// The store of a traverse, as one stop of it is asked for.
#[derive(Clone, Copy)]
pub struct Shared<'a> {
    /// The store.
    pub store: &'a SharedStore,
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

/// The surface of a stop, kept where there is a store.
///
/// # Errors
/// Those of `find`; a failure is not kept.
pub fn surface(
    shared: Option<Shared<'_>>,
    settings: &StereoSettings,
    find: impl FnOnce() -> Result<StopSurface>,
) -> Result<Arc<StopSurface>> {
    match shared {
        Some(Shared { store, stop }) => store.surfaces.try_get(stop, settings, SURFACES, find),
        None => find().map(Arc::new),
    }
}

/// A value with what it was found for.
type Entry<K, S, V> = (K, S, Arc<V>);

/// Values by key and settings, the most recently used at the back.
struct Kept<K, S, V>(Mutex<VecDeque<Entry<K, S, V>>>);

impl<K, S, V> Default for Kept<K, S, V> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<K: PartialEq, S: PartialEq + Clone, V> Kept<K, S, V> {
    /// The kept value, or the one that `find` makes.
    fn get(&self, key: K, settings: &S, limit: usize, find: impl FnOnce() -> V) -> Arc<V> {
        self.kept(&key, settings).unwrap_or_else(|| self.keep(key, settings, limit, find()))
    }

    /// The same where it may fail.
    fn try_get(
        &self,
        key: K,
        settings: &S,
        limit: usize,
        find: impl FnOnce() -> Result<V>,
    ) -> Result<Arc<V>> {
        match self.kept(&key, settings) {
            Some(found) => Ok(found),
            None => Ok(self.keep(key, settings, limit, find()?)),
        }
    }

    /// The kept value. Nobody waits while one is being found: what two find at once is the same.
    fn kept(&self, key: &K, settings: &S) -> Option<Arc<V>> {
        self.with(|entries| {
            let place = entries.iter().position(|(own, of, _)| own == key && of == settings)?;
            let entry = entries.remove(place)?;
            let value = Arc::clone(&entry.2);
            entries.push_back(entry);
            Some(value)
        })
    }

    fn keep(&self, key: K, settings: &S, limit: usize, value: V) -> Arc<V> {
        let value = Arc::new(value);
        self.with(|entries| {
            entries.push_back((key, settings.clone(), Arc::clone(&value)));
            entries.drain(..entries.len().saturating_sub(limit));
        });
        value
    }

    fn with<T>(&self, work: impl FnOnce(&mut VecDeque<Entry<K, S, V>>) -> T) -> T {
        // A panic elsewhere cannot leave the entries half changed.
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}
