//! The decoded pairs that were asked for last, within a fixed amount of memory.

use std::collections::VecDeque;

use sightline_track::stages::capture::StereoPair;

/// Pairs by step, the most recently used at the back.
pub(super) struct ImageCache {
    pairs: VecDeque<(usize, StereoPair)>,
    limit_bytes: usize,
}

impl ImageCache {
    pub(super) fn new(limit_bytes: usize) -> Self {
        Self { pairs: VecDeque::new(), limit_bytes }
    }

    pub(super) fn get(&mut self, step: usize) -> Option<StereoPair> {
        let place = self.pairs.iter().position(|(own, _)| *own == step)?;
        let used = self.pairs.remove(place)?;
        let pair = used.1.clone();
        self.pairs.push_back(used);
        Some(pair)
    }

    /// Keeps `pair` and drops the pairs that were not used for longest until all fit into the limit.
    pub(super) fn insert(&mut self, step: usize, pair: StereoPair) {
        self.pairs.retain(|(own, _)| *own != step);
        self.pairs.push_back((step, pair));
        while self.bytes() > self.limit_bytes {
            self.pairs.pop_front();
        }
    }

    fn bytes(&self) -> usize {
        self.pairs.iter().map(|(_, pair)| bytes_of(pair)).sum()
    }
}

/// The memory of both images, bytes.
fn bytes_of(pair: &StereoPair) -> usize {
    (pair.left.as_raw().len() + pair.right.as_raw().len()) * size_of::<f32>()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use sightline_vision::image::GrayImage;

    fn pair() -> StereoPair {
        let image = Arc::new(GrayImage::new(4, 4));
        StereoPair { left: Arc::clone(&image), right: image }
    }

    #[test]
    fn the_pair_that_was_unused_for_longest_goes_first() {
        let mut cache = ImageCache::new(2 * bytes_of(&pair()));
        cache.insert(0, pair());
        cache.insert(1, pair());
        assert!(cache.get(0).is_some());
        cache.insert(2, pair());
        assert!(cache.get(1).is_none());
        assert!(cache.get(0).is_some() && cache.get(2).is_some());
        assert_eq!(cache.bytes(), 2 * bytes_of(&pair()));
    }

    #[test]
    fn a_pair_beyond_the_limit_is_not_kept() {
        let mut cache = ImageCache::new(bytes_of(&pair()) - 1);
        cache.insert(0, pair());
        assert!(cache.get(0).is_none());
    }
}
