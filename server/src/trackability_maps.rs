//! The trackability maps that were made or are being made, and the surfaces behind the newest.

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

/// The maps that were made or are being made, and the surfaces behind the newest.
pub(crate) struct Maps {
    making: Mutex<VecDeque<Arc<Making>>>,
    grounds: Mutex<VecDeque<(String, Arc<Ground>)>>,
    pub(crate) turn: Lane,
    limits: SharedLimits,
}

/// A map that is made, or was.
pub(crate) struct Making {
    traverse: String,
    pub(crate) step: usize,
    pub(crate) limits: TrackabilityLimits,
    pub(crate) progress: Mutex<MapProgress>,
    pub(crate) cancel: CancelFlag,
}

impl Maps {
    /// No maps yet.
    pub(crate) fn new(limits: &SharedLimits) -> Self {
        let turn = Lane::new(1, limits.maps_waiting.count());
        Self { making: Mutex::default(), grounds: Mutex::default(), turn, limits: Arc::clone(limits) }
    }

    pub(crate) fn find_or_begin(
        &self,
        traverse: &str,
        step: usize,
        limits: TrackabilityLimits,
    ) -> (Arc<Making>, bool) {
        let mut making = lock(&self.making);
        if let Some(known) = making.iter().find(|one| one.is_of(traverse, step, &limits)) {
            return (Arc::clone(known), false);
        }
        let progress = MapProgress { k: 0, n: 0, ended: false, failed: None, map: None };
        let (traverse, cancel) = (traverse.to_owned(), CancelFlag::default());
        let new = Arc::new(Making { traverse, step, limits, progress: Mutex::new(progress), cancel });
        making.push_back(Arc::clone(&new));
        // The oldest that is complete goes; those under way are few.
        if making.len() > self.limits.maps.count()
            && let Some(place) = making.iter().position(|one| lock(&one.progress).ended)
        {
            making.remove(place);
        }
        (new, true)
    }

    /// A map that is under way, taken out, so that the next who asks begins anew.
    pub(crate) fn take_unfinished(
        &self,
        traverse: &str,
        step: usize,
        limits: &TrackabilityLimits,
    ) -> Option<Arc<Making>> {
        let mut making = lock(&self.making);
        let place =
            making.iter().position(|one| one.is_of(traverse, step, limits) && !lock(&one.progress).ended)?;
        making.remove(place)
    }

    /// Forgets everything about a traverse; what is being made ends.
    pub(crate) fn forget(&self, traverse: &str) {
        lock(&self.making).retain(|one| {
            let is_kept = one.traverse != traverse;
            if !is_kept {
                one.cancel.store(true, Ordering::Relaxed);
            }
            is_kept
        });
        lock(&self.grounds).retain(|(id, _)| id != traverse);
    }

    /// What lies under the pixels of a stop, kept for the newest.
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

impl Making {
    pub(crate) fn is_of(&self, traverse: &str, step: usize, limits: &TrackabilityLimits) -> bool {
        self.traverse == traverse && self.step == step && self.limits == *limits
    }

    /// Nothing more will come; the first reason stands.
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
