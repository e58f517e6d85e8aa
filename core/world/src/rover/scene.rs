//! The scene of a drive: ground, targets' centre and mast, and the computation of places.
//!
//! A place is x, y of the rover frame's origin and its yaw. The distance D of a place is that from the left camera's
//! centre, with the suspension settled and the mast pointed, to the targets' centre. On a line towards the centre D grows
//! with the horizontal distance ρ of the rover's origin; the ρ with a given D is found by false position, halving the
//! value at an end that is kept (Illinois).
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | D | `distance_m` | m |
//! | ρ | `level_m` | m, horizontal |
//!
//! Frames: site and rover. Source: papers.md R25, R104.

use nalgebra::{Rotation3, UnitQuaternion};

use sightline_geometry::camera::MastAngles;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::{Point3, Pose, Vector3};

use crate::camera::rig::Rig;
use crate::rover::slip::Slip;
use crate::rover::suspension::{Stand, SuspensionAngles, WHEEL_RADIUS_M, axles_in_rover, settle};
use crate::scenario::{DriveSettings, RoverSettings};

/// Largest length of a piece of a leg, m.
const PIECE_M: f64 = 0.05;
/// The largest turn within a piece, rad.
const PIECE_RAD: f64 = 5.0 * std::f64::consts::PI / 180.0;
/// Precision of a distance where the ground allows it, m.
const EXACT_M: f64 = 1e-11;
/// Accepted error of a distance where the wheels jump from one bump to the next, m.
const ACCEPTED_M: f64 = 1e-6;

/// Inputs of a drive: the world, the cameras and the settings.
pub(crate) struct Scene<'a> {
    /// z of the surface that supports wheels at a point (x, y), site frame, m, positive down.
    pub ground_z_m: &'a dyn Fn(f64, f64) -> f64,
    /// Height of a rock at a point that is too high for a wheel to climb, m.
    pub blocked_by_m: &'a dyn Fn(f64, f64) -> Option<f64>,
    /// The targets' centre, site frame, m.
    pub centre: Point3,
    /// The cameras; if they can be pointed, the left one is pointed at the centre.
    pub rig: &'a Rig,
    /// Settings of the drive.
    pub drive: &'a DriveSettings,
    /// Settings of wheels and slip.
    pub rover: &'a RoverSettings,
    /// Once requested, the drive fails soon.
    pub cancel: Cancel<'a>,
}

/// True pose of the rover and commanded mast angles at a stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrueStop {
    /// The true pose of the rover.
    pub site_from_rover: Pose,
    /// The mast angles that project the targets' centre onto the centre of the left image; `None` for cameras on the body.
    pub angles: Option<MastAngles>,
    /// The angles of the suspension.
    pub suspension: SuspensionAngles,
}

/// The path from one stop to the next.
#[derive(Clone, Debug, PartialEq)]
pub struct Leg {
    /// The rover at the ends of the pieces, the start first: one more than there are pieces.
    pub stands: Vec<Stand>,
    /// Advance of the wheels in each piece, along its chord: x and y of the rover frame, m.
    pub wheels_m: Vec<[f64; 2]>,
    /// Length of the wheels' path, m.
    pub driven_m: f64,
    /// Duration, s.
    pub duration_s: f64,
}

/// The true drive.
#[derive(Clone, Debug, PartialEq)]
pub struct TrueDrive {
    /// The stops.
    pub stops: Vec<TrueStop>,
    /// The legs between them: one fewer than there are stops.
    pub legs: Vec<Leg>,
}

/// Horizontal position and heading of the rover, site frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) x_m: f64,
    pub(super) y_m: f64,
    pub(super) yaw_rad: f64,
}

/// Wraps an angle to (−π, π], rad.
pub(super) fn wrapped(angle_rad: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let turned = angle_rad.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

impl Place {
    /// Interpolates towards another place; `part` is 0 to 1.
    pub(super) fn towards(self, to: Self, part: f64) -> Self {
        Self {
            x_m: self.x_m + part * (to.x_m - self.x_m),
            y_m: self.y_m + part * (to.y_m - self.y_m),
            yaw_rad: self.yaw_rad + part * wrapped(to.yaw_rad - self.yaw_rad),
        }
    }

    /// The place after wheels with this slip have advanced along a chord, m, with the rover's true rotation.
    pub(super) fn rolled(
        self,
        attitude: &UnitQuaternion<f64>,
        slip: Slip,
        chord_m: f64,
        turned_rad: f64,
    ) -> Self {
        let [x, y] = slip.true_from_wheels([chord_m.signum(), 0.0], chord_m.abs());
        let midway = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.5 * turned_rad);
        let motion = attitude * (midway * Vector3::new(x, y, 0.0));
        Self { x_m: self.x_m + motion.x, y_m: self.y_m + motion.y, yaw_rad: self.yaw_rad + turned_rad }
    }

    /// The places on the path to another, the last one included, in pieces of a leg's length.
    pub(super) fn way_to(self, to: Self) -> impl Iterator<Item = Self> {
        let length_m = (to.x_m - self.x_m).hypot(to.y_m - self.y_m);
        let turn_rad = wrapped(to.yaw_rad - self.yaw_rad).abs();
        let pieces = pieces(length_m, turn_rad);
        (1..=pieces).map(
            move |k| {
                if k == pieces { to } else { self.towards(to, f64::from(k) / f64::from(pieces)) }
            },
        )
    }

    /// The horizontal motion to another place, along and to the right of the mean heading, m.
    pub(super) fn motion_to(self, to: Self) -> [f64; 2] {
        let half = self.towards(to, 0.5).yaw_rad;
        let (dx, dy) = (to.x_m - self.x_m, to.y_m - self.y_m);
        [half.cos() * dx + half.sin() * dy, half.cos() * dy - half.sin() * dx]
    }
}

/// Number of pieces into which a motion is divided, at least one.
pub(super) fn pieces(length_m: f64, turn_rad: f64) -> u32 {
    (length_m.abs() / PIECE_M).max(turn_rad.abs() / PIECE_RAD).ceil().max(1.0) as u32
}

impl Scene<'_> {
    /// The angles that point the mast at the targets' centre, and the distance D, m.
    pub(super) fn look(&self, site_from_rover: &Pose) -> Option<(Option<MastAngles>, f64)> {
        let angles = self.rig.point_at(&site_from_rover.inverse_transform_point(&self.centre)).ok()?;
        let (left, _) = self.rig.cameras_in_rover(angles);
        Some((angles, (site_from_rover * left.model.centre() - self.centre).norm()))
    }

    /// Azimuth of the targets' centre as seen from a place, site frame, rad.
    pub(super) fn azimuth_rad(&self, place: Place) -> f64 {
        (self.centre.y - place.y_m).atan2(self.centre.x - place.x_m)
    }

    pub(super) fn settle(&self, place: Place) -> Option<Stand> {
        settle(self.ground_z_m, place.x_m, place.y_m, place.yaw_rad)
    }

    /// The first wheel that a rock blocks: its position, site frame, m, and the rock's height, m.
    ///
    /// A wheel is tested at its axle and at the front and the rear of its rim.
    pub(super) fn blocked(&self, stand: &Stand) -> Option<(Point3, f64)> {
        axles_in_rover(&stand.angles).into_iter().find_map(|axle| {
            [-WHEEL_RADIUS_M, 0.0, WHEEL_RADIUS_M].into_iter().find_map(|ahead_m| {
                let point = stand.site_from_rover * (axle + ahead_m * Vector3::x());
                Some((point, (self.blocked_by_m)(point.x, point.y)?))
            })
        })
    }

    /// The place at a distance D, with the targets' centre in the direction `azimuth_rad` from it.
    pub(super) fn place_at_distance(&self, azimuth_rad: f64, yaw_rad: f64, distance_m: f64) -> Option<Place> {
        let (sine, cosine) = azimuth_rad.sin_cos();
        let place = |level_m: f64| Place {
            x_m: self.centre.x - level_m * cosine,
            y_m: self.centre.y - level_m * sine,
            yaw_rad,
        };
        let excess_m = |level_m: f64| -> Option<f64> {
            Some(self.look(&self.settle(place(level_m))?.site_from_rover)?.1 - distance_m)
        };
        let (mut near_m, mut far_m) = (0.8, distance_m + 2.0);
        let (mut near_excess_m, mut far_excess_m) = (excess_m(near_m)?, excess_m(far_m)?);
        if near_excess_m > 0.0 || far_excess_m < 0.0 {
            return None;
        }
        for _ in 0..100 {
            let level_m = (near_m * far_excess_m - far_m * near_excess_m) / (far_excess_m - near_excess_m);
            let found_m = excess_m(level_m).filter(|_| !self.cancel.is_requested())?;
            if found_m.abs() <= EXACT_M || (far_m - near_m < 1e-12 && found_m.abs() <= ACCEPTED_M) {
                return Some(place(level_m));
            }
            // Without the halving one end would stay fixed and the other creep.
            if found_m > 0.0 {
                (far_m, far_excess_m) = (level_m, found_m);
                near_excess_m *= 0.5;
            } else {
                (near_m, near_excess_m) = (level_m, found_m);
                far_excess_m *= 0.5;
            }
        }
        None
    }
}
