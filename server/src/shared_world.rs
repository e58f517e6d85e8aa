//! Access to the world of a drive during long operations: locked only for each change, and read from a snapshot, so that it
//! is available while images are rendered and visual odometry runs.

use std::sync::{Arc, Mutex};

use sightline_geometry::camera::{CameraName, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::Pixel;
use sightline_recordings::{DrivenTraverse, Traverse};
use sightline_rover::driving::{ActiveWorld, DriveReport, FollowedCycle, Motion};
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::MeasuredMotion;
use sightline_track::locate::store::Cache;
use sightline_track::target::Designation;

use crate::jobs::lock;

/// A world that is shared during a long operation.
pub(crate) struct SharedWorld<'a> {
    world: &'a Mutex<DrivenTraverse>,
    cache: &'a Arc<Cache>,
    stops: Traverse,
}

impl<'a> SharedWorld<'a> {
    /// A snapshot of the world, including pending images of the last stop.
    ///
    /// # Errors
    /// An index that cannot be read.
    pub(crate) fn new(world: &'a Mutex<DrivenTraverse>, cache: &'a Arc<Cache>) -> Result<Self> {
        let stops = snapshot(&lock(world), cache)?;
        Ok(Self { world, cache, stops })
    }

    fn change<T>(&mut self, change: impl FnOnce(&mut DrivenTraverse) -> Result<T>) -> Result<T> {
        let mut world = lock(self.world);
        let changed = change(&mut world)?;
        self.stops = snapshot(&world, self.cache)?;
        Ok(changed)
    }
}

fn snapshot(world: &DrivenTraverse, cache: &Arc<Cache>) -> Result<Traverse> {
    Ok(world.snapshot_with_images()?.with_cache(cache))
}

impl ActiveWorld for SharedWorld<'_> {
    fn stops(&self) -> &dyn Stops {
        &self.stops
    }

    fn drive(&mut self, motion: &Motion, cancel: Cancel<'_>) -> Result<DriveReport> {
        self.change(|world| world.drive(motion, cancel))
    }

    fn keep_decision(&mut self, followed: &FollowedCycle<'_>) {
        lock(self.world).keep_decision(followed);
    }

    fn stay(&mut self) -> Result<()> {
        self.change(DrivenTraverse::stay)
    }

    fn hand_over(&mut self, to: CameraName) -> Result<()> {
        self.change(|world| world.hand_over(to))
    }

    fn correct(&mut self, measured: MeasuredMotion) -> Result<()> {
        self.change(|world| world.correct(measured))
    }

    fn leave_to_odometry(&mut self) -> Result<()> {
        self.change(DrivenTraverse::leave_to_odometry)
    }

    fn keep_mast_target(&mut self, target: Designation) -> Result<()> {
        self.change(|world| world.keep_mast_target(target))
    }

    fn point_mast(&mut self, angles: Option<MastAngles>) -> Result<()> {
        self.change(|world| world.point_mast(angles))
    }

    fn look(&mut self, angles: MastAngles) -> Result<()> {
        self.change(|world| world.look(angles))
    }

    fn expose(&mut self, around: Option<Pixel>) -> Result<()> {
        self.change(|world| world.expose(around))
    }
}
