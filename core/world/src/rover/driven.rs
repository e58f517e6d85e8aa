//! A commanded drive: the true rover moves step by step, each step a function of the previous stop, the command and the
//! scenario's seed.
//!
//! The rover rolls as in an open-loop replay (`course.rs`): wheels advance as commanded, slip reduces the motion, the
//! suspension settles on the ground after every 5 cm or 5°. The slip of a step is spread by `rover.slip_spread`. A wheel
//! that meets a rock too high to climb ends the step at the rover's current place.
//!
//! All random numbers follow from the seed and the index of the stop, so that a list of [`DrivenStop`]s is the whole
//! state: truncated after any stop, it continues with the same bits.
//!
//! Frames: site and rover. Sources: domain.md 5.4, 5.5; papers.md R104, R107.

use std::f64::consts::{PI, TAU};

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};

use sightline_geometry::camera::{CameraName, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{POSITION_LIMIT_M, Pixel, Pose, PoseRecord, Vector3};

use sightline_rover::driving::flight_time::{SPEED_M_S, TURN_RAD_S};
use sightline_rover::visual_odometry::MeasuredMotion;
use sightline_track::cycle_stage::CycleStage;
use sightline_track::target::Designation;

use crate::ground::texture::mix;
use crate::index::{PAUSE_S, Rigs, odometry_pair, seen_by_body, simulated_stop};
use crate::rover::drive::{first_stop, in_scene};
use crate::rover::mast_error;
use crate::rover::odometry::Belief;
use crate::rover::scene::{Leg, Place, Scene, pieces};
use crate::rover::slip::{self, Slip};
use crate::rover::touch::touched_rocks;
use crate::rover::tracks::places_m;
use crate::scenario::Scenario;
use crate::traverse::{Stop, StopTruth, WheelPlaces};
use crate::world::World;

/// One stop of a commanded drive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DrivenStop {
    /// Time since the first stop, s.
    pub time_s: f64,
    /// The true pose.
    pub true_site_from_rover: PoseRecord,
    /// The estimated pose.
    pub site_from_rover: PoseRecord,
    /// Error of the estimated attitude (roll, pitch, yaw), rad; used by the odometry model `wheels_and_imu`.
    pub attitude_error_rad: [f64; 3],
    /// The angles at which the mast was pointed; `None` without a mast.
    pub mast_angles: Option<MastAngles>,
    /// The mast angles of a pair that visual odometry took in addition; `None` without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry_look: Option<MastAngles>,
    /// Centre of the exposure subframe in the left image, px; `None` for the image's centre.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metered_px: Option<Pixel>,
    /// Length of the wheels' path to this stop, m.
    pub wheels_m: f64,
    /// Duration of the drive to this stop, s.
    pub drive_s: f64,
    /// Completed fraction of the commanded motion, 0 to 1; below 1 if a wheel met a rock that is too high.
    pub completed: f64,
    /// Number of rocks with a vertex inside the rover's body at this stop.
    pub touched_rocks: u32,
    /// Wheel positions on the motion to this stop, site frame, m; empty if the wheels leave no tracks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wheel_places_m: Vec<WheelPlaces>,
    /// Visual odometry's measurement of the motion to this stop; `None` without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<MeasuredMotion>,
    /// Whether visual odometry runs alone at this stop.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub odometry_alone: bool,
    /// The target at which the mast was pointed at this stop; `None` before that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mast_target: Option<Designation>,
    /// The pair on the body that takes over from the main one at this stop; `None` if the main pair tracks the target.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub handed_to: Option<CameraName>,
    /// Tilt of the rover from the accelerometers, deg; `None` if the estimated pose still contains it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured_tilt_deg: Option<f64>,
    /// The first stage postponed because the drive is paused at this stop: `point_mast` or `capture`; `None` without one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub awaits: Option<CycleStage>,
}

impl DrivenStop {
    /// The first stop of a scenario's drive, with the mast pointed at the targets' centre.
    ///
    /// # Errors
    /// A scenario whose rover cannot settle there, or [`Error::Cancelled`].
    pub fn first(world: &World, scenario: &Scenario, cancel: Cancel<'_>) -> Result<Self> {
        let stop = first_stop(world, scenario, cancel)?;
        let pose = PoseRecord::from(&stop.site_from_rover);
        Ok(Self {
            time_s: 0.0,
            true_site_from_rover: pose,
            site_from_rover: pose,
            attitude_error_rad: [0.0; 3],
            mast_angles: stop.angles,
            odometry_look: None,
            metered_px: None,
            wheels_m: 0.0,
            drive_s: 0.0,
            completed: 1.0,
            touched_rocks: 0,
            wheel_places_m: Vec::new(),
            odometry: None,
            odometry_alone: false,
            mast_target: None,
            handed_to: None,
            measured_tilt_deg: None,
            awaits: None,
        })
    }

    /// The next stop, of index `number`, after the wheels advance by `length_m` while the rover is commanded to turn by
    /// `turn_rad`. Its mast angles are those of this stop.
    ///
    /// # Errors
    /// Ground on which the suspension does not settle, or [`Error::Cancelled`].
    pub fn next(
        &self,
        world: &World,
        scenario: &Scenario,
        number: usize,
        [length_m, turn_rad]: [f64; 2],
        cancel: Cancel<'_>,
    ) -> Result<Self> {
        in_scene(world, scenario, cancel, |scene| {
            let (leg, completed) = self.roll(scene, scenario, number, [length_m, turn_rad])?;
            let stand = leg.stands[leg.stands.len() - 1];
            let before = self.true_site_from_rover.to_pose();
            let belief =
                Belief { pose: self.site_from_rover.to_pose(), attitude_error_rad: self.attitude_error_rad };
            let belief = belief.after(&leg, [&before, &stand.site_from_rover], number, scenario);
            Ok(Self {
                time_s: self.time_s + PAUSE_S + leg.duration_s,
                true_site_from_rover: PoseRecord::from(&stand.site_from_rover),
                site_from_rover: PoseRecord::from(&belief.pose),
                attitude_error_rad: belief.attitude_error_rad,
                mast_angles: self.mast_angles,
                odometry_look: None,
                metered_px: None,
                wheels_m: leg.driven_m,
                drive_s: leg.duration_s,
                completed,
                touched_rocks: touched_rocks(world, &stand),
                wheel_places_m: if scenario.rover.tracks { places_m(&leg) } else { Vec::new() },
                odometry: None,
                odometry_alone: false,
                mast_target: None,
                handed_to: None,
                measured_tilt_deg: None,
                awaits: None,
            })
        })
    }

    /// The next stop if the rover does not move.
    #[must_use]
    pub fn stay(&self) -> Self {
        Self {
            time_s: self.time_s + PAUSE_S,
            wheels_m: 0.0,
            drive_s: 0.0,
            odometry_look: None,
            metered_px: None,
            completed: 1.0,
            // A rock is counted at the stop at which it is reached.
            touched_rocks: 0,
            wheel_places_m: Vec::new(),
            odometry: None,
            odometry_alone: false,
            mast_target: None,
            handed_to: None,
            awaits: None,
            ..self.clone()
        }
    }

    /// Stores visual odometry's measurement of the motion to this stop and corrects the estimated pose by it, and thereby
    /// the heading of the following steps. `before` is the estimated pose at the previous stop.
    pub fn correct(&mut self, measured: MeasuredMotion, before: &Pose) {
        let pose = measured.pose_after(before);
        self.measured_tilt_deg = Some(self.tilt_deg());
        if measured.corrects {
            let truth = self.true_site_from_rover.to_pose().rotation.euler_angles();
            let (roll, pitch, yaw) = pose.rotation.euler_angles();
            let off = |angle: f64| (angle + PI).rem_euclid(TAU) - PI;
            self.attitude_error_rad = [off(roll - truth.0), off(pitch - truth.1), off(yaw - truth.2)];
        }
        self.site_from_rover = PoseRecord::from(&pose);
        self.odometry = Some(measured);
    }

    /// Rolls the true rover; returns the leg and the completed fraction of the motion.
    fn roll(
        &self,
        scene: &Scene<'_>,
        scenario: &Scenario,
        number: usize,
        [length_m, turn_rad]: [f64; 2],
    ) -> Result<(Leg, f64)> {
        let pose = self.true_site_from_rover.to_pose();
        let origin = pose.translation.vector;
        let mut place = Place { x_m: origin.x, y_m: origin.y, yaw_rad: pose.rotation.euler_angles().2 };
        let stand = scene.settle(place).ok_or_else(|| no_stand(place))?;
        let mut leg = Leg { stands: vec![stand], wheels_m: Vec::new(), driven_m: 0.0, duration_s: 0.0 };
        let count = pieces(length_m, turn_rad);
        let (length_m, turn_rad) = (length_m / f64::from(count), turn_rad / f64::from(count));
        let half = 0.5 * turn_rad;
        let chord_m = if half == 0.0 { length_m } else { length_m * half.sin() / half };
        let spread = slip_factor(scenario, number);
        let forced = scenario.rover.forced_slip_to(number);
        for done in 0..count {
            scene.cancel.check()?;
            let attitude = leg.stands[leg.stands.len() - 1].site_from_rover.rotation;
            let slip = forced.map_or_else(
                || {
                    let slip = slip::on_slope(scene.rover, &attitude, [chord_m.signum(), 0.0]);
                    Slip { along: slip.along * spread, aside: slip.aside * spread }
                },
                |along| Slip { along, aside: 0.0 },
            );
            let next = place.rolled(&attitude, slip, chord_m, turn_rad * (1.0 - forced.unwrap_or(0.0)));
            let stand = scene.settle(next).ok_or_else(|| no_stand(next))?;
            if scene.blocked(&stand).is_some() {
                return Ok((leg, f64::from(done) / f64::from(count)));
            }
            place = next;
            leg.stands.push(stand);
            leg.wheels_m.push([chord_m, 0.0]);
            leg.driven_m += chord_m.abs();
            leg.duration_s += (chord_m.abs() / SPEED_M_S).max(turn_rad.abs() / TURN_RAD_S);
        }
        Ok((leg, 1.0))
    }

    /// Rejects implausible values, which a file may contain.
    ///
    /// # Errors
    /// A message that begins with the field.
    pub fn check(&self) -> Result<(), String> {
        for (field, pose) in
            [("true_site_from_rover", &self.true_site_from_rover), ("site_from_rover", &self.site_from_rover)]
        {
            if !pose.is_plausible() {
                return Err(format!(
                    "{field}: must have a position_m within {POSITION_LIMIT_M:.0e} m and a quaternion_sxyz of unit length"
                ));
            }
        }
        self.odometry.as_ref().map_or(Ok(()), MeasuredMotion::check)?;
        if !(0.0..=1.0).contains(&self.completed) {
            return Err(format!("completed: is {}, but it must be from 0 to 1", self.completed));
        }
        Ok(())
    }

    /// Tilt of the rover from the accelerometers: angle between the vertical axes of rover and site, deg.
    pub fn tilt_deg(&self) -> f64 {
        self.measured_tilt_deg.unwrap_or_else(|| {
            let down = self.site_from_rover.to_pose().rotation * Vector3::z();
            down.z.clamp(-1.0, 1.0).acos().to_degrees()
        })
    }
}

/// The stops of a traverse's index for the stops of a commanded drive, with images to be rendered.
pub fn index_stops(driven: &[DrivenStop], scenario: &Scenario) -> Vec<Stop> {
    let rigs = Rigs::new(&scenario.camera);
    let told: Vec<MastAngles> = driven.iter().filter_map(|stop| stop.mast_angles).collect();
    let true_angles = mast_error::true_angles(&told, scenario);
    let with_error =
        |number: usize| true_angles.get(number).copied().filter(|_| mast_error::is_present(&scenario.drive));
    let stop = |(number, stop): (usize, &DrivenStop)| {
        let poses = [stop.true_site_from_rover, stop.site_from_rover].map(PoseRecord::to_pose);
        let metered_px = stop.metered_px;
        let made = simulated_stop(number, stop.time_s, poses, stop.mast_angles, with_error(number), &rigs);
        let made = match stop.handed_to {
            Some(name) => seen_by_body(made, number, name, &rigs),
            None => made,
        };
        let mut cameras = made.cameras;
        cameras.extend(stop.odometry_look.map(|told| {
            let pointed = mast_error::true_angles_of_look(told, scenario, number);
            let pointed = Some(pointed).filter(|_| mast_error::is_present(&scenario.drive));
            odometry_pair(number, &rigs, [Some(told), pointed])
        }));
        let wheel_places_m = scenario.rover.tracks.then(|| stop.wheel_places_m.clone());
        let truth = made.truth.map(|truth| StopTruth { wheel_places_m, ..truth });
        let (odometry, odometry_alone) = (stop.odometry.clone(), stop.odometry_alone);
        let mast_target = stop.mast_target;
        Stop { metered_px, truth, odometry, odometry_alone, mast_target, cameras, ..made }
    };
    driven.iter().enumerate().map(stop).collect()
}

/// Factor on the slip of the step to a stop.
fn slip_factor(scenario: &Scenario, number: usize) -> f64 {
    let seed = mix(scenario.seed ^ mix(number as u64 ^ 0x511b_0000));
    let draw: f64 = StandardNormal.sample(&mut Pcg64::new(u128::from(seed), 0x511b_511b_511b_511b));
    (1.0 + scenario.rover.slip_spread * draw).max(0.0)
}

fn no_stand(place: Place) -> Error {
    Error::Request(format!("the rover has no stable footing at x {:.2} m, y {:.2} m", place.x_m, place.y_m))
}

#[cfg(test)]
#[path = "driven_tests.rs"]
mod tests;
