//! The corners of visual odometry at the stops that were asked for last. No drive stores them: the update is computed again
//! from the images, which takes about a second.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

use sightline_api::wire::StopOdometry;
use sightline_geometry::error::Result;
use sightline_rover::visual_odometry::MeasuredMotion;

use crate::cancel::CancelFlag;
use crate::jobs::lock;
use crate::limits::SharedLimits;
use crate::rendering::OpenTraverse;

/// The stops with their corners, the newest last.
pub(crate) struct OdometryTables {
    kept: Mutex<VecDeque<StopTable>>,
    limits: SharedLimits,
}

/// The odometry of a stop.
struct StopTable {
    traverse: String,
    step: usize,
    odometry: Arc<StopOdometry>,
}

impl OdometryTables {
    /// No stops yet.
    pub(crate) fn new(limits: &SharedLimits) -> Self {
        Self { kept: Mutex::default(), limits: Arc::clone(limits) }
    }

    /// The motion `measured` at a stop, with its corners.
    ///
    /// # Errors
    /// As [`MeasuredMotion::again`].
    pub(crate) fn of(
        &self,
        open: &OpenTraverse,
        step: usize,
        measured: &MeasuredMotion,
        cancel: &CancelFlag,
    ) -> Result<Arc<StopOdometry>> {
        let is_same = |table: &&StopTable| {
            table.traverse == open.id && table.step == step && table.odometry.measured == *measured
        };
        if let Some(known) = lock(&self.kept).iter().find(is_same) {
            return Ok(Arc::clone(&known.odometry));
        }
        for needed in [step - 1, step] {
            open.make_ready(needed, cancel)?;
        }
        let corners = measured.again(&open.traverse, step, cancel.as_ref().into())?.table;
        let settings = measured.preset.settings();
        let odometry = Arc::new(StopOdometry { settings, measured: measured.clone(), corners });
        let table = StopTable { traverse: open.id.clone(), step, odometry: Arc::clone(&odometry) };
        let mut kept = lock(&self.kept);
        kept.push_back(table);
        let surplus = kept.len().saturating_sub(self.limits.odometry_tables.count());
        kept.drain(..surplus);
        Ok(odometry)
    }

    /// Forgets everything about a traverse.
    pub(crate) fn forget(&self, traverse: &str) {
        lock(&self.kept).retain(|table| table.traverse != traverse);
    }
}
