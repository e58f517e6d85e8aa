//! The conventions of the whole project for frames, pixels and rays.
//!
//! | frame | axes | origin |
//! |---|---|---|
//! | rover | +x forward, +y right, +z down | on the axis of the middle wheels; flat ground is near z = 0.294 m |
//! | site | +x north, +y east, +z down | fixed; the rover's pose in it drifts with odometry |
//! | head | the rover's axes, panned by azimuth and tilted by elevation | intersection of the mast's pan and tilt axes |
//!
//! A pose is named `a_from_b` and maps points of frame b to frame a; products are written so that the names touch:
//! `site_from_camera = site_from_rover * rover_from_camera`. Quaternions in files are scalar first (PDS labels,
//! domain.md 1.4) and rotate vectors of the moving frame into the reference frame.
//!
//! Pixels: x is the column to the right, y the row down; (0, 0) is the *centre* of the first pixel, so an
//! image of W × H spans [−0.5, W − 0.5] × [−0.5, H − 0.5] (domain.md 1.1).
//! Angles: azimuth clockwise seen from above, zero along +x; elevation positive up (domain.md 1.5).

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// A point in metres; the frame is in the variable's name.
pub type Point3 = nalgebra::Point3<f64>;
/// A vector in metres or without unit; the frame is in the variable's name.
pub type Vector3 = nalgebra::Vector3<f64>;
/// A rigid motion `a_from_b`.
pub type Pose = Isometry3<f64>;

/// A position in an image, in pixels; (0, 0) is the centre of the first pixel.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Pixel {
    /// Column, to the right, px.
    pub x: f64,
    /// Row, down, px.
    pub y: f64,
}

impl Pixel {
    /// The pixel at column `x` and row `y`.
    #[inline]
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// Euclidean distance to `other`, px.
    #[inline]
    pub fn distance(self, other: Self) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }

    /// The pixel moved by `(dx, dy)`.
    #[inline]
    pub fn offset(self, dx: f64, dy: f64) -> Self {
        Self::new(self.x + dx, self.y + dy)
    }

    /// Whether the pixel is in an image of `width` × `height`, its border pixels included.
    #[inline]
    pub fn is_inside(self, width: u32, height: u32) -> bool {
        self.x >= -0.5
            && self.y >= -0.5
            && self.x <= f64::from(width) - 0.5
            && self.y <= f64::from(height) - 0.5
    }
}

/// A half-line in space: origin in metres and unit direction, both in the frame of the camera model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Origin of the ray, m. For CAHVORE it depends on the pixel (the entrance pupil moves).
    pub origin: Point3,
    /// Unit direction.
    pub direction: Vector3,
}

impl Ray {
    /// The point at `distance_m` along the ray.
    #[inline]
    pub fn at(&self, distance_m: f64) -> Point3 {
        self.origin + self.direction * distance_m
    }
}

/// Largest accepted coordinate of a pose, m: beyond any planet, and small enough to print.
pub const POSITION_LIMIT_M: f64 = 1e9;

/// A pose in files and in the interface: origin of the moving frame and its attitude, scalar first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PoseRecord {
    /// Origin of the moving frame in the reference frame, m.
    pub position_m: [f64; 3],
    /// Attitude quaternion (s, x, y, z); normalised when read.
    pub quaternion_sxyz: [f64; 4],
}

impl PoseRecord {
    /// The identity.
    pub const IDENTITY: Self = Self { position_m: [0.0; 3], quaternion_sxyz: [1.0, 0.0, 0.0, 0.0] };

    /// The rigid motion `reference_from_moving`; the quaternion is normalised first.
    pub fn to_pose(self) -> Pose {
        let [s, x, y, z] = self.quaternion_sxyz;
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(s, x, y, z));
        Pose::from_parts(Translation3::from(Vector3::from(self.position_m)), rotation)
    }

    /// Whether the position is within [`POSITION_LIMIT_M`] and the quaternion is close to unit length (within 1 %).
    pub fn is_plausible(&self) -> bool {
        let norm = self.quaternion_sxyz.iter().map(|q| q * q).sum::<f64>().sqrt();
        self.position_m.iter().all(|v| v.abs() <= POSITION_LIMIT_M) && (norm - 1.0).abs() < 0.01
    }
}

impl From<&Pose> for PoseRecord {
    fn from(pose: &Pose) -> Self {
        let q = pose.rotation.quaternion();
        Self { position_m: pose.translation.vector.into(), quaternion_sxyz: [q.w, q.i, q.j, q.k] }
    }
}

/// The attitude of yaw (about z), then pitch (about y), then roll (about x), rad (domain.md 1.4).
pub fn attitude_from_roll_pitch_yaw(roll_rad: f64, pitch_rad: f64, yaw_rad: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(roll_rad, pitch_rad, yaw_rad)
}
