//! The surface of a stop by dense stereo, and the mesh of its part around a target (R187, R188).
//!
//! ```text
//! σ_r = σ_d r / d         1σ of a point along its line of sight, for a disparity noise of σ_d
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | d | `disparity_px` | px of the aligned images |
//! | σ_d | `surface_sigma_px` | px |
//! | r | distance from the left camera | m |
//!
//! Dense stereo covers the whole image and is shared by all targets; only the surroundings of a target become a mesh,
//! since nothing else is compared. Frame: rover, m.
//!
//! Source: D§2 "3D shape based tracker"; domain.md 3.4 for the noise.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::settings::ShapeTrackerSettings;
use crate::locate::features::evidence::Table;
use crate::locate::store::{self, HeapBytes, Shared};
use crate::stages::capture::StereoPair;
use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::Point3;
use sightline_record::{Declaration, Record, Unit};
use sightline_vision::registration::{Mesh, MeshSettings, PointGrid, Region};
use sightline_vision::stereo::{Alignment, DisparityMap, Outcome, StereoSettings, dense_stereo_until};

/// Largest side of the disparities and ranges that are shown, px.
const SHOWN_PX: usize = 512;

/// Number of stops whose surfaces the store keeps: a dozen megabytes each.
const SURFACES_KEPT: usize = 3;

/// The surface of a stop.
#[derive(Clone, Debug)]
pub struct StopSurface {
    /// The aligned cameras.
    pub alignment: Alignment,
    /// The disparities of the aligned left image.
    pub disparities: DisparityMap,
    /// The point of each of its pixels, m, rover frame; NaN without a disparity.
    pub points_m: Vec<[f32; 3]>,
    /// Position of the left camera, m, rover frame.
    pub viewpoint: Point3,
}

/// The result of dense stereo in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SurfaceSeen {
    /// Size of the aligned left image, px.
    pub size: [u32; 2],
    /// Number of pixels per outcome: found, outside, without texture, not unique, not confirmed by the right image,
    /// in too small a patch, out of range.
    pub pixels: [usize; 7],
    /// Number of vertices of the mesh around the target.
    pub vertices: usize,
    /// Number of its triangles.
    pub triangles: usize,
    /// Points per side of the block that became one vertex.
    pub stride: usize,
    /// RMS error of the mesh at the points, m; includes the noise of the points.
    pub detail_rms_m: f64,
    /// Step in pixels and rows at which the disparities are shown.
    pub shown_every: usize,
}

impl HeapBytes for StopSurface {
    fn heap_bytes(&self) -> usize {
        let DisparityMap { disparity_px, outcome, .. } = &self.disparities;
        size_of_val(&**disparity_px) + size_of_val(&**outcome) + size_of_val(&*self.points_m)
    }
}

impl StopSurface {
    /// Returns the surface of a stop, from the store if it was measured before.
    ///
    /// # Errors
    /// As [`StopSurface::measure`].
    pub fn shared(
        shared: Option<Shared<'_>>,
        pair: &StereoPair,
        cameras: [&Camera; 2],
        settings: &StereoSettings,
        cancel: Cancel<'_>,
    ) -> Result<Arc<Self>> {
        store::shared(shared, settings, SURFACES_KEPT, || Self::measure(pair, cameras, settings, cancel))
    }

    /// Measures the surface of a pair by dense stereo.
    ///
    /// # Errors
    /// As [`dense_stereo_until`].
    pub fn measure(
        pair: &StereoPair,
        cameras: [&Camera; 2],
        settings: &StereoSettings,
        cancel: Cancel<'_>,
    ) -> Result<Self> {
        let seen = dense_stereo_until([&pair.left, &pair.right], cameras, settings, cancel)?;
        Ok(Self {
            alignment: seen.alignment,
            disparities: seen.disparities,
            points_m: seen.points_m,
            viewpoint: cameras[0].model.centre(),
        })
    }

    /// Returns the mesh of the surface within a region.
    pub fn mesh(&self, region: &Region, settings: &ShapeTrackerSettings) -> Mesh {
        let grid = self.grid(region, settings.surface_sigma_px);
        let own = settings.registration().mesh;
        let spacing_m = own.spacing_m.max(2.0 * self.range_sigma_m(region, settings.surface_sigma_px));
        Mesh::from_grid(&grid, &self.viewpoint, Some(region), &MeshSettings { spacing_m, ..own })
    }

    /// 1σ of the range of a point in the middle of a region, m: noise dominates the slope of smaller facets.
    fn range_sigma_m(&self, region: &Region, sigma_px: f64) -> f64 {
        let distance_m = (region.centre - self.viewpoint).norm();
        sigma_px * distance_m / self.alignment.disparity_px(distance_m)
    }

    /// The points of the smallest part of the image that contains a region.
    fn grid(&self, region: &Region, sigma_px: f64) -> PointGrid {
        let width = self.disparities.width as usize;
        let (centre, radius) = (region.centre.coords.map(|value| value as f32), region.radius_m as f32);
        let is_inside = |point: &[f32; 3]| {
            let [x, y, z] = [point[0] - centre.x, point[1] - centre.y, point[2] - centre.z];
            x * x + y * y + z * z <= radius * radius
        };
        let (mut first, mut last) = ([usize::MAX; 2], [0; 2]);
        for (number, point) in self.points_m.iter().enumerate() {
            // NaN is not inside.
            if is_inside(point) {
                let at = [number % width, number / width];
                for axis in 0..2 {
                    (first[axis], last[axis]) = (first[axis].min(at[axis]), last[axis].max(at[axis]));
                }
            }
        }
        if first[0] > last[0] {
            return PointGrid::empty(0, 0);
        }
        let mut grid = PointGrid::empty(last[0] - first[0] + 1, last[1] - first[1] + 1);
        let mut sigma_m = vec![0.0; grid.width * grid.height];
        for row in 0..grid.height {
            for column in 0..grid.width {
                let (from, to) = ((first[1] + row) * width + first[0] + column, row * grid.width + column);
                let point = self.points_m[from];
                if point[0].is_finite() {
                    let point = Point3::from(point.map(f64::from));
                    let range_m = (point - self.viewpoint).norm();
                    sigma_m[to] =
                        (sigma_px * range_m / f64::from(self.disparities.disparity_px[from])) as f32;
                    grid.points[to] = Some(point);
                }
            }
        }
        grid.range_sigma_m = Some(sigma_m);
        grid
    }

    /// Summarises the surface and the mesh around the target.
    pub fn seen(&self, mesh: &Mesh) -> SurfaceSeen {
        use Outcome::{Found, LeftRight, NoTexture, NotUnique, OutOfRange, Outside, Speckle};
        let kinds = [Found, Outside, NoTexture, NotUnique, LeftRight, Speckle, OutOfRange];
        SurfaceSeen {
            size: [self.disparities.width, self.disparities.height],
            pixels: kinds.map(|kind| self.disparities.count(kind)),
            vertices: mesh.vertices.len(),
            triangles: mesh.triangles.len(),
            stride: mesh.detail.stride,
            detail_rms_m: mesh.detail.rms_m,
            shown_every: self.shown_every(),
        }
    }

    fn shown_every(&self) -> usize {
        (self.disparities.width.max(self.disparities.height) as usize).div_ceil(SHOWN_PX).max(1)
    }

    /// The disparities, px, subsampled for display; NaN if missing.
    pub fn shown_disparities(&self) -> Table {
        self.shown(|number| self.disparities.disparity_px[number])
    }

    /// The distances from the left camera, m, subsampled in the same way.
    pub fn shown_ranges(&self) -> Table {
        let from = self.viewpoint.coords.map(|value| value as f32);
        self.shown(|number| {
            let [x, y, z] = self.points_m[number];
            let [x, y, z] = [x - from.x, y - from.y, z - from.z];
            (x * x + y * y + z * z).sqrt()
        })
    }

    fn shown(&self, value: impl Fn(usize) -> f32) -> Table {
        let (every, width) = (self.shown_every(), self.disparities.width as usize);
        let rows = (0..self.disparities.height as usize).step_by(every);
        let values = rows.flat_map(|y| (0..width).step_by(every).map(move |x| y * width + x)).map(value);
        Table { columns: width.div_ceil(every) as u32, values: values.collect() }
    }
}

impl Record for SurfaceSeen {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("size", Unit::Pixel, |s| s.size).describe("Width and height of the aligned left image.");
        r.quantity("vertices", Unit::One, |s| s.vertices).describe("Vertices of the mesh around the target.");
        r.quantity("triangles", Unit::One, |s| s.triangles).describe("Triangles of the mesh.");
        r.quantity("stride", Unit::One, |s| s.stride)
            .describe("Side of the block of points that became one vertex.");
        r.quantity("detail_rms_m", Unit::Metre, |s| s.detail_rms_m)
            .describe("RMS of the detail lost by the mesh, noise of the points included.");
        r.quantity("shown_every", Unit::One, |s| s.shown_every)
            .describe("Stride of the shown disparities in pixels and rows.");
    }
}
