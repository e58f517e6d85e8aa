//! A store shared by the targets of a traverse: results that depend only on a stop and on settings (R207).
//!
//! Images, features, surfaces and motions are functions of the files, the cameras and the settings, so that storing
//! them changes nothing but the time: other targets, a second run or a step back reuse them. All traverses of a
//! program may share one [`Cache`] with a limit in bytes, which evicts the least recently used value of any traverse
//! and type. Dropping the store of a traverse removes its values.

use std::any::Any;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The default limit of a cache, bytes: 64 pairs of 1024 × 1024.
pub const CACHE_BYTES: usize = 512 << 20;

/// A value that reports its memory.
pub trait HeapBytes {
    /// Memory outside of the value itself, bytes; small parts may be omitted.
    fn heap_bytes(&self) -> usize;
}

/// Values of any traverse and type within a fixed amount of memory.
#[derive(Debug)]
pub struct Cache(Mutex<Entries>);

#[derive(Debug)]
struct Entries {
    all: Vec<Entry>,
    bytes: usize,
    limit_bytes: usize,
    /// Number of uses so far; a larger number is a later use.
    clock: u64,
    last_owner: u64,
}

/// A value with its owner and its last use.
#[derive(Debug)]
struct Entry {
    owner: u64,
    used: u64,
    bytes: usize,
    /// An [`Item`] of its types.
    item: Box<dyn Any + Send>,
}

/// Key, settings and value.
type Item<K, S, V> = (K, S, Arc<V>);

impl Cache {
    /// Creates a cache of at most `limit_bytes`.
    pub fn new(limit_bytes: usize) -> Self {
        Self(Mutex::new(Entries { all: Vec::new(), bytes: 0, limit_bytes, clock: 0, last_owner: 0 }))
    }

    /// Memory of all values, bytes.
    pub fn bytes(&self) -> usize {
        self.lock().bytes
    }

    fn lock(&self) -> MutexGuard<'_, Entries> {
        // A panic elsewhere cannot leave the entries half changed.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Default for Cache {
    fn default() -> Self {
        Self::new(CACHE_BYTES)
    }
}

impl Entries {
    /// The index of an owner's value for a key.
    fn find<K, S, V>(&self, owner: u64, key: &K, settings: &S) -> Option<usize>
    where
        K: PartialEq + 'static,
        S: PartialEq + 'static,
        V: 'static,
    {
        self.all.iter().position(|entry| {
            let item = (entry.owner == owner).then(|| entry.item.downcast_ref::<Item<K, S, V>>());
            item.flatten().is_some_and(|(own, of, _)| own == key && of == settings)
        })
    }

    fn remove(&mut self, place: usize) {
        self.bytes -= self.all.swap_remove(place).bytes;
    }

    /// Removes the least recently used entry among those for which `is_meant` is true.
    fn remove_oldest(&mut self, is_meant: impl Fn(&Entry) -> bool) {
        let meant = self.all.iter().enumerate().filter(|(_, entry)| is_meant(entry));
        if let Some((place, _)) = meant.min_by_key(|(_, entry)| entry.used) {
            self.remove(place);
        }
    }
}

/// The part of a cache that belongs to one traverse.
#[derive(Debug)]
pub struct SharedStore {
    cache: Arc<Cache>,
    owner: u64,
}

impl Default for SharedStore {
    /// Creates a store with a cache of its own.
    fn default() -> Self {
        Self::within(&Arc::default())
    }
}

impl Drop for SharedStore {
    fn drop(&mut self) {
        let mut entries = self.cache.lock();
        while let Some(place) = entries.all.iter().position(|entry| entry.owner == self.owner) {
            entries.remove(place);
        }
    }
}

impl SharedStore {
    /// Creates a store within a shared cache.
    pub fn within(cache: &Arc<Cache>) -> Self {
        let owner = {
            let mut entries = cache.lock();
            entries.last_owner += 1;
            entries.last_owner
        };
        Self { cache: Arc::clone(cache), owner }
    }

    /// Returns the stored value of `key` and `settings`, or stores that of `find`; keeps at most `limit` values of its type.
    pub fn get<K, S, V>(&self, key: K, settings: &S, limit: usize, find: impl FnOnce() -> V) -> Arc<V>
    where
        K: PartialEq + Send + 'static,
        S: PartialEq + Clone + Send + 'static,
        V: HeapBytes + Send + Sync + 'static,
    {
        self.kept(&key, settings).unwrap_or_else(|| self.keep(key, settings, limit, Arc::new(find())))
    }

    /// As [`Self::get`], for a computation that may fail; a failure is not stored.
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
        V: HeapBytes + Send + Sync + 'static,
    {
        match self.kept(&key, settings) {
            Some(found) => Ok(found),
            None => Ok(self.keep(key, settings, limit, Arc::new(find()?))),
        }
    }

    /// Returns the stored value. Concurrent computations of the same value do not wait for each other: their results
    /// are equal.
    pub fn kept<K, S, V>(&self, key: &K, settings: &S) -> Option<Arc<V>>
    where
        K: PartialEq + Send + 'static,
        S: PartialEq + Clone + Send + 'static,
        V: Send + Sync + 'static,
    {
        let mut entries = self.cache.lock();
        let place = entries.find::<K, S, V>(self.owner, key, settings)?;
        entries.clock += 1;
        entries.all[place].used = entries.clock;
        entries.all[place].item.downcast_ref::<Item<K, S, V>>().map(|(_, _, value)| Arc::clone(value))
    }

    /// Stores a value and evicts the least recently used ones beyond the limits: `limit` values of its type, and the
    /// bytes of the cache.
    pub fn keep<K, S, V>(&self, key: K, settings: &S, limit: usize, value: Arc<V>) -> Arc<V>
    where
        K: PartialEq + Send + 'static,
        S: PartialEq + Clone + Send + 'static,
        V: HeapBytes + Send + Sync + 'static,
    {
        let mut entries = self.cache.lock();
        if let Some(place) = entries.find::<K, S, V>(self.owner, &key, settings) {
            entries.remove(place);
        }
        let bytes = value.heap_bytes() + size_of::<V>() + size_of::<Item<K, S, V>>();
        let item: Box<dyn Any + Send> = Box::new((key, settings.clone(), Arc::clone(&value)));
        entries.clock += 1;
        let entry = Entry { owner: self.owner, used: entries.clock, bytes, item };
        entries.all.push(entry);
        entries.bytes += bytes;
        let is_alike = |entry: &Entry| entry.owner == self.owner && entry.item.is::<Item<K, S, V>>();
        if entries.all.iter().filter(|entry| is_alike(entry)).count() > limit {
            entries.remove_oldest(is_alike);
        }
        while entries.bytes > entries.limit_bytes {
            entries.remove_oldest(|_| true);
        }
        value
    }
}

/// The store of a traverse, together with the stop that is processed.
#[derive(Clone, Copy)]
pub struct Shared<'a> {
    /// The store.
    pub store: &'a SharedStore,
    /// Index of the stop in the recording, independent of the numbering in a study.
    pub stop: usize,
}

impl std::fmt::Debug for Shared<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Shared {{ stop: {} }}", self.stop)
    }
}

/// Returns the result of one stop, from the store if there is one.
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
    V: HeapBytes + Send + Sync + 'static,
{
    match shared {
        Some(Shared { store, stop }) => store.try_get(stop, settings, limit, find),
        None => find().map(Arc::new),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A value of this many bytes.
    struct Block(usize);

    impl HeapBytes for Block {
        fn heap_bytes(&self) -> usize {
            self.0
        }
    }

    fn kept(store: &SharedStore, key: usize) -> bool {
        store.kept::<usize, (), Block>(&key, &()).is_some()
    }

    fn keep(store: &SharedStore, key: usize, bytes: usize) {
        store.keep(key, &(), usize::MAX, Arc::new(Block(bytes)));
    }

    #[test]
    fn the_value_unused_for_longest_goes_first_of_any_traverse() {
        let cache = Arc::new(Cache::new(3 << 20));
        let (one, other) = (SharedStore::within(&cache), SharedStore::within(&cache));
        keep(&one, 0, 1 << 20);
        keep(&other, 0, 1 << 20);
        assert!(kept(&one, 0));
        keep(&one, 1, 1 << 20);
        assert!(!kept(&other, 0) && kept(&one, 0) && kept(&one, 1));
        assert!((2 << 20..3 << 20).contains(&cache.bytes()), "{}", cache.bytes());
        // A value larger than the cache is not kept, and evicts all others.
        keep(&other, 7, 4 << 20);
        assert!(!kept(&other, 7) && cache.bytes() == 0);
    }

    #[test]
    fn a_store_that_goes_away_gives_its_memory_back() {
        let cache = Arc::new(Cache::default());
        let (one, other) = (SharedStore::within(&cache), SharedStore::within(&cache));
        (0..5).for_each(|key| keep(&one, key, 1000));
        keep(&other, 0, 10);
        keep(&other, 0, 10);
        drop(one);
        assert!((10..1000).contains(&cache.bytes()), "{}", cache.bytes());
        assert!(kept(&other, 0));
    }

    #[test]
    fn each_type_has_a_number_of_its_own() {
        let store = SharedStore::default();
        let block = |key: usize| store.get(key, &(), 2, || Block(1));
        (0..4).for_each(|key| drop(block(key)));
        assert_eq!((0..4).filter(|&key| kept(&store, key)).count(), 2);
        let other = store.get("text", &1, 2, || Block(5));
        assert!(Arc::ptr_eq(&other, &store.get("text", &1, 2, || unreachable!("it is kept"))));
        assert!(kept(&store, 3), "values of another key do not count");
        let failed: Result<Arc<Block>, &str> = store.try_get(9, &(), 2, || Err("no"));
        assert!(failed.is_err() && !kept(&store, 9));
    }
}
