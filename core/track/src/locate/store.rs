//! A store that the targets of a traverse share: results that depend on a stop and on settings alone (R207).
//!
//! Features, surfaces and motions are functions of the images, the cameras and the settings, so that keeping them changes
//! nothing but the time: five targets, a second run or a step back find them ready. The least recently used is forgotten
//! first. The store does not know its contents: each type of value has a cache of its own.

use std::any::{Any, TypeId};
use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};

/// Results that were found before, by type.
#[derive(Default)]
pub struct SharedStore(Mutex<HashMap<TypeId, Arc<dyn Any + Send + Sync>>>);

impl SharedStore {
    /// The kept value of `key` and `settings`, or the one that `find` returns; at most `limit` of its type are kept.
    pub fn get<K, S, V>(&self, key: K, settings: &S, limit: usize, find: impl FnOnce() -> V) -> Arc<V>
    where
        K: PartialEq + Send + 'static,
        S: PartialEq + Clone + Send + 'static,
        V: Send + Sync + 'static,
    {
        self.cache().get(key, settings, limit, find)
    }

    /// The same for a computation that may fail; a failure is not kept.
    ///
    /// # Errors
    /// Those of `find`.
    pub(crate) fn try_get<K, S, V, E>(
        &self,
        key: K,
        settings: &S,
        limit: usize,
        find: impl FnOnce() -> Result<V, E>,
    ) -> Result<Arc<V>, E>
    where
        K: PartialEq + Send + 'static,
        S: PartialEq + Clone + Send + 'static,
        V: Send + Sync + 'static,
    {
        self.cache().try_get(key, settings, limit, find)
    }

    /// The cache of one type of value.
    fn cache<K: Send + 'static, S: Send + 'static, V: Send + Sync + 'static>(&self) -> Arc<Kept<K, S, V>> {
        let mut caches = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let new = || -> Arc<dyn Any + Send + Sync> { Arc::new(Kept::<K, S, V>::default()) };
        let cache = Arc::clone(caches.entry(TypeId::of::<Kept<K, S, V>>()).or_insert_with(new));
        // The type is that of the key.
        cache.downcast().unwrap_or_default()
    }
}

impl std::fmt::Debug for SharedStore {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("SharedStore")
    }
}

/// The store of a traverse, together with the stop that is processed.
#[derive(Clone, Copy)]
pub struct Shared<'a> {
    /// The store.
    pub store: &'a SharedStore,
    /// The stop of the recording, however a study numbers those that it visits.
    pub stop: usize,
}

impl std::fmt::Debug for Shared<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Shared {{ stop: {} }}", self.stop)
    }
}

/// A result of one stop, kept where there is a store.
///
/// # Errors
/// Those of `find`; a failure is not kept.
pub(crate) fn shared<S, V, E>(
    shared: Option<Shared<'_>>,
    settings: &S,
    limit: usize,
    find: impl FnOnce() -> Result<V, E>,
) -> Result<Arc<V>, E>
where
    S: PartialEq + Clone + Send + 'static,
    V: Send + Sync + 'static,
{
    match shared {
        Some(Shared { store, stop }) => store.try_get(stop, settings, limit, find),
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
    fn try_get<E>(
        &self,
        key: K,
        settings: &S,
        limit: usize,
        find: impl FnOnce() -> Result<V, E>,
    ) -> Result<Arc<V>, E> {
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
