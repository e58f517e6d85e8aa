//! The recorded poses as true motion in a simulated world, and the motion by wheels and gyro.
//!
//! **Poses.** The recorded ones, all turned about the vertical and shifted together, so that the first stands at x = y = 0
//! and heads along x of the world. Every relative motion, z and attitude included, is the recorded one.
//!
//! **Ground.** The plane `z = a x + b y + c` of least squares through the recorded places is the mean ground: its slope and
//! direction are `terrain.slope_deg` and `terrain.slope_azimuth_deg`, and the poses are shifted by −c, so that the rover's
//! origin is on average where it is on flat ground (0.294 m above it). Relief, rocks and texture are those of the scenario.
//! The rover is not settled on them: its height above the ground varies by the relief and by what the site differs from a
//! plane. The mean tilt of the rover is not the slope of this plane, because wheels had sunk in.
//!
//! **Wheels.** Where a recorded translation is at least half a commanded step of 0.5 m, the wheels advanced as recorded.
//! Where it is less, turns in place included, they turned for 0.5 m along x of the rover, to the side of the recorded motion,
//! or of the one before where there is none. Errors: 1 % along, 0.5 % across (the scenario's). The turn is the recorded one
//! with 0.1° in roll, pitch and yaw (1σ each). Commands are not in the file, so this is an assumption.
//!
//! Frames: site of the world (level, z down) and rover, m.

use nalgebra::{Matrix3, Translation3, UnitQuaternion};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pose, Vector3, attitude_from_roll_pitch_yaw};
use sightline_world::scenario::{Course, Move};
use sightline_world::{Scenario, library};

use super::rvf::RecordedPose;

/// Length of a commanded step, m: that of the recorded drives of sol 1870.
pub const COMMANDED_M: f64 = 0.5;
/// 1σ error of the turn by gyro and accelerometers about each axis, deg.
const TURN_SIGMA_DEG: f64 = 0.1;
/// Least distance of the places of the plan, m; the plan only tells where ground and rocks are needed.
const PLAN_STEP_M: f64 = 1.0;

/// The recorded path in a simulated world.
#[derive(Clone, Debug)]
pub struct Path {
    /// The drive counter of each pose.
    pub drives: Vec<u32>,
    /// The true poses, site of the world from rover.
    pub poses: Vec<Pose>,
    /// Slope of the plane through the recorded places, deg.
    pub slope_deg: f64,
    /// Direction of its steepest ascent in the world, deg clockwise from above, 0 along x.
    pub slope_azimuth_deg: f64,
    /// Angle between the mean vertical of the rover and that of the site, deg.
    pub mean_tilt_deg: f64,
}

impl Path {
    /// The path through recorded poses.
    ///
    /// # Errors
    /// Fewer than three poses, or places on one line.
    pub fn new(recorded: &[RecordedPose]) -> Result<Self> {
        let (Some(first), 3..) = (recorded.first(), recorded.len()) else {
            let problem = format!("a path needs 3 recorded poses or more, not {}", recorded.len());
            return Err(Error::Request(problem));
        };
        let start = first.site_from_rover;
        let level = UnitQuaternion::from_euler_angles(0.0, 0.0, -start.rotation.euler_angles().2);
        let turned = |pose: &RecordedPose| {
            let mut from_start = pose.site_from_rover;
            from_start.translation.vector -= start.translation.vector;
            Pose::from_parts(Translation3::identity(), level) * from_start
        };
        let mut poses: Vec<Pose> = recorded.iter().map(turned).collect();
        let [a, b, c] = plane(&poses)?;
        poses.iter_mut().for_each(|pose| pose.translation.vector.z -= c);
        let down: Vector3 = poses.iter().map(|pose| pose.rotation * Vector3::z()).sum();
        Ok(Self {
            drives: recorded.iter().map(RecordedPose::drive).collect(),
            slope_deg: a.hypot(b).atan().to_degrees(),
            slope_azimuth_deg: (-b).atan2(-a).to_degrees(),
            mean_tilt_deg: down.angle(&Vector3::z()).to_degrees(),
            poses,
        })
    }

    /// The same up to and including pose `count`.
    #[must_use]
    pub fn first(mut self, count: usize) -> Self {
        self.poses.truncate(count);
        self.drives.truncate(count);
        self
    }

    /// Length of the path through the true poses in space and in the level, m.
    pub fn length_m(&self) -> [f64; 2] {
        let ways = self.poses.windows(2).map(|pair| pair[1].translation.vector - pair[0].translation.vector);
        ways.fold([0.0; 2], |[space, level], way| [space + way.norm(), level + way.xy().norm()])
    }

    /// The scenario `approach-10` with the site's slope, its planned drive backwards through the recorded places.
    ///
    /// # Errors
    /// The library's scenario, or one that no world can be made of.
    pub fn scenario(&self, seed: u64, image_size: u32, samples_per_axis: u32) -> Result<Scenario> {
        let mut scenario = Scenario { seed, ..library::scenario("approach-10")? };
        scenario.terrain.slope_deg = self.slope_deg;
        scenario.terrain.slope_azimuth_deg = self.slope_azimuth_deg;
        (scenario.camera.image_size, scenario.camera.samples_per_axis) = (image_size, samples_per_axis);
        scenario.drive.course = Course::Moves;
        scenario.drive.moves = self.plan();
        scenario.validate()?;
        Ok(scenario)
    }

    /// Moves backwards through places of the path.
    fn plan(&self) -> Vec<Move> {
        let (mut moves, mut heading_rad) = (Vec::new(), 0.0f64);
        let mut place = self.poses[0].translation.vector.xy();
        for pose in &self.poses {
            let way = pose.translation.vector.xy() - place;
            if way.norm() < PLAN_STEP_M {
                continue;
            }
            let wanted_rad = (-way.y).atan2(-way.x);
            let turn_rad = (wanted_rad - heading_rad).sin().atan2((wanted_rad - heading_rad).cos());
            moves.push(Move::Turn { angle_deg: turn_rad.to_degrees(), stops: 1 });
            moves.push(Move::Forward { distance_m: -way.norm(), stops: 1 });
            (heading_rad, place) = (wanted_rad, place + way);
        }
        if moves.is_empty() {
            moves.push(Move::Turn { angle_deg: 0.0, stops: 1 });
        }
        moves
    }

    /// The motions by wheels and gyro: from the rover frame before to that after, one for each pose but the first.
    pub fn by_wheels(&self, scenario: &Scenario) -> Vec<Pose> {
        let mut random = Pcg64::seed_from_u64(scenario.seed ^ 0x5b12_0137);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let error = &scenario.odometry_error;
        // Spirit drove backwards, its right front wheel dragging.
        let mut side = -1.0;
        let by_wheels = |pair: &[Pose]| {
            let moved = pair[0].inv_mul(&pair[1]);
            if moved.translation.x != 0.0 {
                side = moved.translation.x.signum();
            }
            let wheels = advanced(&moved.translation.vector, side);
            let length_m = wheels.norm();
            let along = wheels / length_m;
            let across = Vector3::z().cross(&along).normalize();
            let upright = along.cross(&across);
            let seen = wheels
                + along * (normal() * error.along_fraction * length_m)
                + across * (normal() * error.across_fraction * length_m)
                + upright * (normal() * error.across_fraction * length_m);
            let [roll, pitch, yaw] = [(); 3].map(|()| normal() * TURN_SIGMA_DEG.to_radians());
            let turn = moved.rotation * attitude_from_roll_pitch_yaw(roll, pitch, yaw);
            Pose::from_parts(Translation3::from(seen), turn).inverse()
        };
        self.poses.windows(2).map(by_wheels).collect()
    }
}

/// How far the wheels advanced where the rover moved by `moved`, rover frame before, m; `side` is 1 ahead and −1 backwards.
fn advanced(moved: &Vector3, side: f64) -> Vector3 {
    if moved.norm() < 0.5 * COMMANDED_M { Vector3::new(side * COMMANDED_M, 0.0, 0.0) } else { *moved }
}

/// The plane `z = a x + b y + c` of least squares through places.
fn plane(poses: &[Pose]) -> Result<[f64; 3]> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for pose in poses {
        let place = pose.translation.vector;
        let row = Vector3::new(place.x, place.y, 1.0);
        normal += row * row.transpose();
        right += row * place.z;
    }
    let solved = normal.cholesky().map(|factor| factor.solve(&right));
    let plane = solved.filter(|plane| plane.iter().all(|value| value.is_finite()));
    let plane = plane
        .ok_or_else(|| Error::Request("the recorded places lie on one line, not on a plane".to_owned()))?;
    Ok(plane.into())
}
