//! Caches the corners of visual odometry at the most recently requested stops. No drive stores them; they are recomputed
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

/// The stops with their corners, newest last.
pub(crate) struct OdometryTables {
    tables: Mutex<VecDeque<StopTable>>,
    limits: SharedLimits,
}

/// The visual odometry of a stop.
struct StopTable {
    traverse: String,
    step: usize,
    odometry: Arc<StopOdometry>,
}

impl OdometryTables {
    /// An empty cache.
    pub(crate) fn new(limits: &SharedLimits) -> Self {
        Self { tables: Mutex::default(), limits: Arc::clone(limits) }
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
        if let Some(known) = lock(&self.tables).iter().find(is_same) {
            return Ok(Arc::clone(&known.odometry));
        }
        for needed in [step - 1, step] {
            open.make_ready(needed, cancel)?;
        }
        let corners = measured.again(&open.traverse, step, cancel.as_ref().into())?.table;
        let settings = measured.preset.settings();
        let odometry = Arc::new(StopOdometry { settings, measured: measured.clone(), corners });
        let table = StopTable { traverse: open.id.clone(), step, odometry: Arc::clone(&odometry) };
        let mut tables = lock(&self.tables);
        tables.push_back(table);
        let surplus = tables.len().saturating_sub(self.limits.odometry_tables.count());
        tables.drain(..surplus);
        Ok(odometry)
    }

    /// Removes the entries of a traverse.
    pub(crate) fn forget(&self, traverse: &str) {
        lock(&self.tables).retain(|table| table.traverse != traverse);
    }
}
