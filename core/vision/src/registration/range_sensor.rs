//! The virtual range sensor: a mesh as a picture of depths, in time proportional to facets and pixels (R191–R194).
//!
//! ```text
//! s' = α_i v'_i + α_j v'_j + α_k v'_k     α_i + α_j + α_k = 1          D-Eq 9, per mesh its own facets (E27)
//! z  = n̂_c · s'                           s' in the sensor's frame     D-Eq 10 (E28)
//! h(p) = n̂_c · T_p (α_i v_i + α_j v_j + α_k v_k)                       D-Eq 11
//! orthographic:  u = x/δ + (W − 1)/2       w = z
//! pinhole:       u = f x/z + (W − 1)/2     w = 1/z
//! ```
//! With either, w is an affine function of (u, v) on a facet, so that one rasteriser (`rasterise.rs`) serves both; the
//! nearest facet counts, and only fronts are seen.
//!
//! **Orthographic** is the default (ours; the paper says camera): its pixels are of one size on the surface, and a shift
//! of the mesh by whole pixels is a shift of the picture, which makes the coarse search exact and cheap. A pinhole with
//! the viewpoint of a scanner sees what that scanner saw.
//!
//! **Where it stands.** It looks at the target along the mean of the two lines of sight, because what either side saw
//! well it then sees well; its columns are as level as they can be; it spans the rock and a margin of ground.
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

/// No facet is seen in this pixel.
pub const NO_FACET: u32 = u32::MAX;
/// Nearest depth that a pinhole sees, m.
pub(super) const NEAR_M: f32 = 0.05;

/// How the sensor maps space to pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Projection {
    /// All rays are parallel; the origin of the frame is in the middle of the picture.
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
    /// Takes points of the fixed surface's frame into the sensor's: x right, y down, z away.
    pub sensor_from_fixed: Pose,
    /// From there to pixels.
    pub projection: Projection,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// What a sensor sees of a mesh, pixel by pixel, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RangeImage {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Depth, m; infinite where nothing is seen.
    pub depth_m: Vec<f32>,
    /// The facet that is seen, by its number in the mesh; else [`NO_FACET`].
    pub facet: Vec<u32>,
    /// α of the facet's three vertices.
    pub weights: Vec<[f32; 3]>,
}

impl RangeSensor {
    /// An orthographic sensor of `side_px` × `side_px` that looks at `target` along `direction` and spans `side_m`.
    pub fn looking_at(target: &Point3, direction: &Vector3, side_m: f64, side_px: usize) -> Self {
        let pitch_m = side_m / side_px as f64;
        Self {
            sensor_from_fixed: Pose::from_parts(Translation3::from(target.coords), axes(direction)).inverse(),
            projection: Projection::Orthographic { pitch_m },
            width: side_px,
            height: side_px,
        }
    }

    /// A pinhole at `viewpoint` that looks along `direction`, `half_angle_rad` to each side.
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

    /// The same sensor with so many more pixels on every side.
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

    /// The point that a pixel sees at a depth, sensor frame, m.
    pub fn point(&self, x: usize, y: usize, depth_m: f64) -> Point3 {
        let centred = |place: usize, count: usize| place as f64 - (count as f64 - 1.0) / 2.0;
        let pixel_m = self.pixel_m(depth_m);
        Point3::new(centred(x, self.width) * pixel_m, centred(y, self.height) * pixel_m, depth_m)
    }

    /// How a point of a pixel's ray moves with its depth: (x, y, 1).
    pub(super) fn along(&self, x: usize, y: usize) -> Vector3 {
        match self.projection {
            Projection::Orthographic { .. } => Vector3::z(),
            Projection::Pinhole { .. } => self.point(x, y, 1.0).coords,
        }
    }

    /// Columns and rows of a point of the sensor's frame, px; none behind a pinhole.
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
    /// Share of the pixels that see something.
    pub fn covered(&self) -> f64 {
        let seen = self.depth_m.iter().filter(|depth| depth.is_finite()).count();
        seen as f64 / self.depth_m.len().max(1) as f64
    }

    /// The mean over a pixel's facet of a value that its vertices have, by the weights of the pixel; 0 without a facet.
    pub(super) fn interpolate(&self, pixel: usize, triangles: &[[u32; 3]], values: &[f32]) -> f32 {
        let Some(triangle) = triangles.get(self.facet[pixel] as usize) else { return 0.0 };
        let value = |k: usize| values.get(triangle[k] as usize).copied().unwrap_or(0.0);
        let weights = self.weights[pixel];
        weights[0] * value(0) + weights[1] * value(1) + weights[2] * value(2)
    }
}

/// The attitude of a sensor that looks along `direction` with level columns: +z of the reference frame is down.
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
