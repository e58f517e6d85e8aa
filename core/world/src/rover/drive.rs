//! The true drive of a scenario in its world: its stops and legs.
//!
//! In an approach the rover keeps its heading on the line to the targets' centre (`approach.rs`). Other courses:
//! `course.rs`. The plan of a drive, which needs no world: `plan.rs`.
//!
//! Frames: site and rover. Source: domain.md 5.4.

use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;

use crate::camera::rig::Rig;
use crate::rover::course;
use crate::rover::scene::{Scene, TrueDrive, TrueStop};
use crate::scenario::Scenario;
use crate::world::World;

/// Calls a function with the scene of a scenario's world.
pub(super) fn in_scene<T>(
    world: &World,
    scenario: &Scenario,
    cancel: Cancel<'_>,
    act: impl FnOnce(&Scene<'_>) -> T,
) -> T {
    act(&Scene {
        ground_z_m: &|x_m, y_m| world.footing_z_at(x_m, y_m),
        blocked_by_m: &|x_m, y_m| world.blocked_by_m(x_m, y_m),
        centre: world.targets_centre(),
        rig: &Rig::new(&scenario.camera),
        drive: &scenario.drive,
        rover: &scenario.rover,
        cancel,
    })
}

/// The true drive in the scenario's world.
pub(crate) fn true_drive(world: &World, scenario: &Scenario, cancel: Cancel<'_>) -> Result<TrueDrive> {
    in_scene(world, scenario, cancel, course::drive)
}

/// The first stop of the scenario.
pub(crate) fn first_stop(world: &World, scenario: &Scenario, cancel: Cancel<'_>) -> Result<TrueStop> {
    in_scene(world, scenario, cancel, course::first_stop)
}
