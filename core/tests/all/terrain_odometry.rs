//! Planned drives whose poses vision corrects: on a steep slope, and with wheels that turn on the spot.

use std::path::Path;

use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Pose;
use sightline_recordings::{Traverse, create_simulated};
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::{OdometryMode, OdometryPreset, pose_change_error};
use sightline_geometry::odometry_error::PoseChangeError;
use sightline_world::scenario::Move;
use sightline_world::{Scenario, library};

/// A world of few small images.
fn small(name: &str) -> Scenario {
    let mut scenario = Scenario { seed: 5311, ..library::scenario(name).unwrap() };
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (512, 2);
    scenario
}

fn with(planned: &Traverse, mode: OdometryMode) -> Traverse {
    planned.with_odometry(mode, OdometryPreset::Sightline, Cancel::default()).unwrap()
}

/// Distances of the estimated positions from the true ones, m.
fn off_m(drive: &Traverse) -> Vec<f64> {
    let off = |stop: usize| {
        let apart: Pose = drive.true_site_from_rover(stop).unwrap().inverse() * drive.site_from_rover(stop);
        apart.translation.vector.norm()
    };
    (0..drive.stop_count()).map(off).collect()
}
