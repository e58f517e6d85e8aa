//! A recording as a world to drive in: it answers every command with its recorded data, and compares the two.
//!
//! The rover repeats its recorded motion, whatever the command. An [`Answer`] contains the differences of the
//! commanded motion and mast angles from the recorded ones. Every traverse can be replayed, including a simulated one.
//!
//! Frame: the rover frame of the previous stop, horizontal, m and rad. Source: papers.md R94, R104.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_geometry::camera::{CameraName, MastAngles};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Vector3};
use sightline_rover::driving::{ActiveWorld, DriveReport, FollowedCycle, Motion};
use sightline_rover::pipeline::Stops;
use sightline_rover::visual_odometry::MeasuredMotion;
use sightline_track::target::Designation;

use crate::native::Traverse;

/// The difference between a command and the recorded stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Answer {
    /// The step of the stop reached by the command.
    pub step: usize,
    /// The end of the commanded motion, ahead and to the right, m.
    pub commanded_m: [f64; 2],
    /// The commanded turn, rad, positive to the right.
    pub commanded_turn_rad: f64,
    /// The position of the recorded pose estimate, ahead and to the right, m.
    pub recorded_m: [f64; 2],
    /// The recorded turn of the heading, rad, positive to the right.
    pub recorded_turn_rad: f64,
    /// Distance between the commanded and the recorded end, m.
    pub apart_m: f64,
    /// Angle between the commanded and the recorded direction of the mast, deg; null without a mast.
    pub mast_apart_deg: Option<f64>,
}

/// A traverse that answers commands.
pub struct Replayed<'a> {
    traverse: &'a Traverse,
    reached: usize,
    answers: Vec<Answer>,
}

impl<'a> Replayed<'a> {
    /// Replays the traverse from a stop on.
    pub fn new(traverse: &'a Traverse, step: usize) -> Self {
        Self { traverse, reached: step, answers: Vec::new() }
    }

    /// Whether there is a stop after the current one.
    pub fn goes_on(&self) -> bool {
        self.reached + 1 < self.traverse.stop_count()
    }

    /// The comparisons so far, one per command.
    pub fn answers(&self) -> &[Answer] {
        &self.answers
    }

    /// Moves on to the next stop.
    fn go_on(&mut self, motion: Option<&Motion>) -> Result<DriveReport> {
        if !self.goes_on() {
            return Err(Error::Request(format!("the recording ends at stop {}", self.reached)));
        }
        let [then, now] = [self.reached, self.reached + 1].map(|step| self.traverse.site_from_rover(step));
        let times_s = [self.reached, self.reached + 1].map(|step| self.traverse.time_s(step));
        self.reached += 1;
        let (commanded_m, commanded_turn_rad) = motion.map_or(([0.0; 2], 0.0), |motion| motion.after(1.0));
        let step = then.inv_mul(&now);
        let recorded_m = [step.translation.x, step.translation.y];
        self.answers.push(Answer {
            step: self.reached,
            commanded_m,
            commanded_turn_rad,
            recorded_m,
            recorded_turn_rad: step.rotation.euler_angles().2,
            apart_m: (recorded_m[0] - commanded_m[0]).hypot(recorded_m[1] - commanded_m[1]),
            mast_apart_deg: None,
        });
        Ok(DriveReport {
            wheels_m: step.translation.vector.norm(),
            duration_s: (times_s[1] - times_s[0]).max(0.0),
            tilt_deg: (now.rotation * Vector3::z()).z.clamp(-1.0, 1.0).acos().to_degrees(),
            stall: None,
        })
    }
}

impl ActiveWorld for Replayed<'_> {
    fn stops(&self) -> &dyn Stops {
        self.traverse
    }

    fn drive(&mut self, motion: &Motion, _cancel: Cancel<'_>) -> Result<DriveReport> {
        self.go_on(Some(motion))
    }

    fn stay(&mut self) -> Result<()> {
        self.go_on(None).map(drop)
    }

    fn hand_over(&mut self, _to: CameraName) -> Result<()> {
        self.go_on(None).map(drop)
    }

    fn keep_decision(&mut self, _followed: &FollowedCycle<'_>) {}

    fn correct(&mut self, _measured: MeasuredMotion) -> Result<()> {
        Ok(())
    }

    fn leave_to_odometry(&mut self) -> Result<()> {
        Ok(())
    }

    fn keep_mast_target(&mut self, _target: Designation) -> Result<()> {
        Ok(())
    }

    fn point_mast(&mut self, angles: Option<MastAngles>) -> Result<()> {
        let recorded = self.traverse.mast_angles(self.reached);
        if let (Some(answer), Some(wanted), Some(recorded)) = (self.answers.last_mut(), angles, recorded) {
            answer.mast_apart_deg = Some(apart_deg(wanted, recorded));
        }
        Ok(())
    }

    fn look(&mut self, _angles: MastAngles) -> Result<()> {
        Ok(())
    }

    fn expose(&mut self, _around: Option<Pixel>) -> Result<()> {
        Ok(())
    }
}

/// The angle between two directions of the mast, deg.
fn apart_deg(a: MastAngles, b: MastAngles) -> f64 {
    let [a, b] = [a, b].map(|angles| {
        let (sine, cosine) = angles.elevation_rad.sin_cos();
        Vector3::new(cosine * angles.azimuth_rad.cos(), cosine * angles.azimuth_rad.sin(), -sine)
    });
    a.angle(&b).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::create_simulated;
    use sightline_world::Scenario;

    fn scenario() -> Scenario {
        let mut scenario = Scenario { seed: 5, ..Scenario::default() };
        (scenario.camera.image_size, scenario.camera.samples_per_axis) = (128, 1);
        scenario.terrain.rms_at_1m_m = 0.0;
        scenario.odometry_error.along_fraction = 0.0;
        scenario.odometry_error.across_fraction = 0.0;
        scenario.odometry_error.attitude_deg = 0.0;
        scenario
    }

    #[test]
    fn a_recording_goes_its_own_way_and_says_how_far_off_the_command_is() {
        let folder = tempfile::tempdir().unwrap();
        let traverse = create_simulated(&scenario(), folder.path()).unwrap();
        let [first, second] = [0, 1].map(|step| traverse.site_from_rover(step));
        let length_m = (second.translation.vector - first.translation.vector).norm();
        let mut world = Replayed::new(&traverse, 0);
        let straight = |length_m| Motion::Arc { length_m, curvature_per_m: 0.0 };
        let report = world.drive(&straight(length_m), Cancel::default()).unwrap();
        assert!((report.wheels_m - length_m).abs() < 1e-12 && report.stall.is_none());
        assert!(world.answers()[0].apart_m < 1e-6, "{:?}", world.answers());
        let recorded = traverse.mast_angles(1).unwrap();
        let aside = MastAngles { elevation_rad: recorded.elevation_rad + 0.01, ..recorded };
        world.point_mast(Some(aside)).unwrap();
        assert!((world.answers()[0].mast_apart_deg.unwrap() - 0.01f64.to_degrees()).abs() < 1e-9);
        // A turn instead of the next metre.
        world.drive(&Motion::Turn { angle_rad: 0.5 }, Cancel::default()).unwrap();
        let answer = world.answers()[1];
        assert_eq!((answer.step, answer.commanded_m, answer.commanded_turn_rad), (2, [0.0; 2], 0.5));
        assert!(answer.recorded_turn_rad.abs() < 1e-6 && answer.apart_m > 0.5, "{answer:?}");
        assert_eq!(world.stops().stop_count(), traverse.stop_count());
        let mut last = Replayed::new(&traverse, traverse.stop_count() - 1);
        assert!(!last.goes_on());
        let refused = last.drive(&straight(1.0), Cancel::default()).unwrap_err().to_string();
        assert!(refused.contains("the recording ends at stop"), "{refused}");
    }
}
