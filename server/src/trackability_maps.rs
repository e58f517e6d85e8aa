//! Cache of trackability maps, finished or in progress, and of the surfaces for the newest ones.

use std::collections::VecDeque;
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};

use sightline_api::event::Event;
use sightline_geometry::error::Result;
use sightline_rover::trackability::{Ground, MapProgress, TrackabilityLimits};
use sightline_track::settings::Settings;

use crate::cancel::CancelFlag;
use crate::jobs::{Lane, lock};
use crate::limits::SharedLimits;
use crate::rendering::OpenTraverse;

/// Cache of trackability maps, finished or in progress, and of the surfaces for the newest ones.
pub(crate) struct MapCache {
    jobs: Mutex<VecDeque<Arc<MapJob>>>,
    grounds: Mutex<VecDeque<(String, Arc<Ground>)>>,
    pub(crate) turn: Lane,
    limits: SharedLimits,
}

/// A map, finished or in progress.
pub(crate) struct MapJob {
    traverse: String,
    pub(crate) step: usize,
    pub(crate) limits: TrackabilityLimits,
    pub(crate) progress: Mutex<MapProgress>,
    pub(crate) cancel: CancelFlag,
}

impl MapCache {
    /// An empty cache.
    pub(crate) fn new(limits: &SharedLimits) -> Self {
        let turn = Lane::new(1, limits.maps_waiting.count());
        Self { jobs: Mutex::default(), grounds: Mutex::default(), turn, limits: Arc::clone(limits) }
    }

    pub(crate) fn find_or_begin(
        &self,
        traverse: &str,
        step: usize,
        limits: TrackabilityLimits,
    ) -> (Arc<MapJob>, bool) {
        let mut jobs = lock(&self.jobs);
        if let Some(known) = jobs.iter().find(|one| one.is_of(traverse, step, &limits)) {
            return (Arc::clone(known), false);
        }
        let progress = MapProgress { k: 0, n: 0, ended: false, failed: None, map: None };
        let (traverse, cancel) = (traverse.to_owned(), CancelFlag::default());
        let new = Arc::new(MapJob { traverse, step, limits, progress: Mutex::new(progress), cancel });
        jobs.push_back(Arc::clone(&new));
        // Removes the oldest complete map; those in progress are few.
        if jobs.len() > self.limits.maps.count()
            && let Some(index) = jobs.iter().position(|one| lock(&one.progress).ended)
        {
            jobs.remove(index);
        }
        (new, true)
    }

    /// Removes and returns a map in progress, so that the next request starts a new one.
    pub(crate) fn take_unfinished(
        &self,
        traverse: &str,
        step: usize,
        limits: &TrackabilityLimits,
    ) -> Option<Arc<MapJob>> {
        let mut jobs = lock(&self.jobs);
        let index =
            jobs.iter().position(|one| one.is_of(traverse, step, limits) && !lock(&one.progress).ended)?;
        jobs.remove(index)
    }

    /// Removes the maps of a traverse; those in progress are cancelled.
    pub(crate) fn forget(&self, traverse: &str) {
        lock(&self.jobs).retain(|one| {
            let is_kept = one.traverse != traverse;
            if !is_kept {
                one.cancel.store(true, Ordering::Relaxed);
            }
            is_kept
        });
        lock(&self.grounds).retain(|(id, _)| id != traverse);
    }

    /// The surface under the pixels of a stop, cached for the newest ones.
    pub(crate) fn ground(
        &self,
        open: &OpenTraverse,
        step: usize,
        (settings, limits): (&Settings, &TrackabilityLimits),
        cancel: &CancelFlag,
    ) -> Result<Arc<Ground>> {
        let grounds = &self.grounds;
        let is_same = |(id, ground): &&(String, Arc<Ground>)| {
            *id == open.id && ground.step == step && ground.settings == *settings && ground.limits == *limits
        };
        if let Some((_, known)) = lock(grounds).iter().find(is_same) {
            return Ok(Arc::clone(known));
        }
        open.make_ready(step, cancel)?;
        let made =
            Arc::new(Ground::new_until(&open.traverse, step, settings, limits, cancel.as_ref().into())?);
        let mut grounds = lock(grounds);
        grounds.push_back((open.id.clone(), Arc::clone(&made)));
        let surplus = grounds.len().saturating_sub(self.limits.grounds.count());
        grounds.drain(..surplus);
        Ok(made)
    }
}

impl MapJob {
    pub(crate) fn is_of(&self, traverse: &str, step: usize, limits: &TrackabilityLimits) -> bool {
        self.traverse == traverse && self.step == step && self.limits == *limits
    }

    /// Marks the map as ended; the first reason is kept.
    pub(crate) fn end(&self, why: Option<String>) {
        let mut progress = lock(&self.progress);
        if !progress.ended {
            (progress.ended, progress.failed) = (true, why);
        }
    }

    pub(crate) fn event(&self) -> Event {
        let progress = lock(&self.progress);
        let (traverse, step) = (self.traverse.clone(), self.step);
        Event::TrackabilityProgress { traverse, step, k: progress.k, n: progress.n, ended: progress.ended }
    }
}
