//! The limits of the state, and its memory usage.

use std::sync::Arc;

use sightline_api::program::Usage;
use sightline_track::locate::store::Cache;

use super::AppState;
use crate::connections::Connections;
use crate::idempotency::Answers;
use crate::limits::SharedLimits;
use crate::memory;

impl AppState {
    /// The limits of the server.
    pub(crate) fn limits(&self) -> &SharedLimits {
        &self.0.limits
    }

    /// Cache of images and other results of all drives.
    pub(crate) fn cache(&self) -> &Arc<Cache> {
        &self.0.cache
    }

    /// The open connections.
    pub(crate) fn connections(&self) -> &Arc<Connections> {
        &self.0.connections
    }

    /// The stored answers to repeatable requests.
    pub(crate) fn repeated(&self) -> &Arc<Answers> {
        &self.0.repeated
    }

    /// Resource usage of the server's parts.
    pub(crate) fn usage(&self) -> Usage {
        let (threads, resident_bytes) = memory::of_process();
        Usage {
            connections: self.0.connections.count(),
            cache_bytes: self.0.cache.bytes(),
            step_bytes: memory::of_steps(&self.0.sessions),
            answer_bytes: self.0.repeated.bytes(),
            threads,
            resident_bytes,
        }
    }
}
