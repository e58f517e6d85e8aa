//! The virtual range sensor: renders the depth map of a mesh, in time proportional to facets and pixels (R191–R194).
//!
//! ```text
//! s' = α_i v'_i + α_j v'_j + α_k v'_k     α_i + α_j + α_k = 1          D-Eq 9, facets per mesh (E27)
//! z  = n̂_c · s'                           s' in the sensor's frame     D-Eq 10 (E28)
//! h(p) = n̂_c · T_p (α_i v_i + α_j v_j + α_k v_k)                       D-Eq 11
//! orthographic:  u = x/δ + (W − 1)/2       w = z
//! pinhole:       u = f x/z + (W − 1)/2     w = 1/z
//! ```
//! In both cases w is an affine function of (u, v) on a facet, so that one rasteriser (`rasterise.rs`) serves both. The
//! nearest facet is visible; back faces are culled.
//!
//! **Orthographic** is the default (ours; the paper says camera): its pixels have one size on the surface, and a shift
//! of the mesh by whole pixels is a shift of the depth map, which makes the coarse search exact and cheap. A pinhole at
//! the viewpoint of a scanner reproduces the scanner's view.
//!
//! **Pose.** It points at the target along the mean of the two lines of sight, where both views are good; its rows are
//! level; it spans the rock and a margin of ground.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | c_x, c_y, c_z = n̂_c | axes of the sensor's frame | –; right, down, away |
//! | z, h | [`RangeImage::depth_m`] | m, from the sensor's origin along c_z |
//! | α | [`RangeImage::weights`] | – |
//! | δ, f | [`Projection`] | m, px |
//!
//! Source: D§2, D-Eq 9–11; R191–R194, R203; E27, E28.

use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion};
use serde::{Deserialize, Serialize};

use sightline_geometry::frames::{Point3, Pose, Vector3};

/// Index of a pixel without a facet.
pub const NO_FACET: u32 = u32::MAX;
/// Near plane of a pinhole, m.
pub(super) const NEAR_M: f32 = 0.05;

/// How the sensor maps space to pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Projection {
    /// All rays are parallel; the origin of the frame is at the centre of the image.
    Orthographic {
        /// δ: side of a pixel, m.
        pitch_m: f64,
    },
    /// All rays go through the origin of the frame.
    Pinhole {
        /// f, px.
        focal_px: f64,
    },
}

/// A virtual range sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeSensor {
    /// Maps points of the fixed surface's frame into the sensor's: x right, y down, z away.
    pub sensor_from_fixed: Pose,
    /// Projection from the sensor's frame to pixels.
    pub projection: Projection,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// Rendered depth map of a mesh, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RangeImage {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Depth, m; infinite where there is no facet.
    pub depth_m: Vec<f32>,
    /// Index of the visible facet in the mesh, or [`NO_FACET`].
    pub facet: Vec<u32>,
    /// α of the visible facet's three vertices.
    pub weights: Vec<[f32; 3]>,
}

impl RangeSensor {
    /// An orthographic sensor of `side_px` × `side_px` that points at `target` along `direction` and spans `side_m`.
    pub fn looking_at(target: &Point3, direction: &Vector3, side_m: f64, side_px: usize) -> Self {
        let pitch_m = side_m / side_px as f64;
        Self {
            sensor_from_fixed: Pose::from_parts(Translation3::from(target.coords), axes(direction)).inverse(),
            projection: Projection::Orthographic { pitch_m },
            width: side_px,
            height: side_px,
        }
    }

    /// A pinhole at `viewpoint` that points along `direction`; `half_angle_rad` is half its horizontal field of view.
    pub fn pinhole(
        viewpoint: &Point3,
        direction: &Vector3,
        half_angle_rad: f64,
        [width, height]: [usize; 2],
    ) -> Self {
        Self {
            sensor_from_fixed: Pose::from_parts(Translation3::from(viewpoint.coords), axes(direction))
                .inverse(),
            projection: Projection::Pinhole { focal_px: 0.5 * width as f64 / half_angle_rad.tan() },
            width,
            height,
        }
    }

    /// The same sensor with `border_px` more pixels on every side.
    pub fn widened(&self, border_px: usize) -> Self {
        Self { width: self.width + 2 * border_px, height: self.height + 2 * border_px, ..*self }
    }

    /// Width of a pixel at a depth, m.
    pub fn pixel_m(&self, depth_m: f64) -> f64 {
        match self.projection {
            Projection::Orthographic { pitch_m } => pitch_m,
            Projection::Pinhole { focal_px } => depth_m / focal_px,
        }
    }

    /// The point at a depth on the ray of a pixel, sensor frame, m.
    pub fn point(&self, x: usize, y: usize, depth_m: f64) -> Point3 {
        let centred = |place: usize, count: usize| place as f64 - (count as f64 - 1.0) / 2.0;
        let pixel_m = self.pixel_m(depth_m);
        Point3::new(centred(x, self.width) * pixel_m, centred(y, self.height) * pixel_m, depth_m)
    }

    /// Derivative of a point on a pixel's ray by its depth: (x, y, 1).
    pub(super) fn along(&self, x: usize, y: usize) -> Vector3 {
        match self.projection {
            Projection::Orthographic { .. } => Vector3::z(),
            Projection::Pinhole { .. } => self.point(x, y, 1.0).coords,
        }
    }

    /// Column and row of a point of the sensor's frame, px; `None` nearer than a pinhole's near plane.
    pub fn pixel(&self, point: &Point3) -> Option<[f64; 2]> {
        let scale = match self.projection {
            Projection::Orthographic { pitch_m } => 1.0 / pitch_m,
            Projection::Pinhole { .. } if point.z < f64::from(NEAR_M) => return None,
            Projection::Pinhole { focal_px } => focal_px / point.z,
        };
        let centre = [self.width, self.height].map(|count| (count as f64 - 1.0) / 2.0);
        Some([point.x * scale + centre[0], point.y * scale + centre[1]])
    }
}

impl RangeImage {
    /// Fraction of the pixels with a depth.
    pub fn covered(&self) -> f64 {
        let seen = self.depth_m.iter().filter(|depth| depth.is_finite()).count();
        seen as f64 / self.depth_m.len().max(1) as f64
    }

    /// Interpolates values of the vertices on a pixel's facet; 0 without a facet.
    pub(super) fn interpolate(&self, pixel: usize, triangles: &[[u32; 3]], values: &[f32]) -> f32 {
        let Some(triangle) = triangles.get(self.facet[pixel] as usize) else { return 0.0 };
        let value = |k: usize| values.get(triangle[k] as usize).copied().unwrap_or(0.0);
        let weights = self.weights[pixel];
        weights[0] * value(0) + weights[1] * value(1) + weights[2] * value(2)
    }
}

/// Orientation of a sensor that points along `direction` with level rows: +z of the reference frame is down.
fn axes(direction: &Vector3) -> UnitQuaternion<f64> {
    let away = direction.normalize();
    let right = Vector3::z().cross(&away);
    let right = if right.norm() > 1e-6 { right.normalize() } else { Vector3::y() };
    let columns = Matrix3::from_columns(&[right, away.cross(&right), away]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(columns))
}

#[cfg(test)]
#[path = "range_sensor_tests.rs"]
mod tests;
