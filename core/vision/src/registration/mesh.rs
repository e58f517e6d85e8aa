//! Mesh of a surface: triangles between neighbours of a point grid, cut at depth discontinuities (R188).
//!
//! ```text
//! vertex of a block of s × s points:  o + r̃ · mean of the unit directions          r̃ the median of the ranges
//! triangle (i, j, k):   max r / min r ≤ 1.05    and    angle between normal and line of sight ≤ 80°
//! error of thinning:    range of every point − range of the mesh in its direction
//! ```
//! A cell of four vertices is split along its shorter diagonal; if one is missing, the other three may still form a
//! facet. All triangles are clockwise as seen from the viewpoint, which allows the rasteriser to cull back faces.
//!
//! **Level of detail.** A vertex represents s × s points. Its range is their median, not their mean: a block across a
//! depth edge takes one side of it, and single outliers have no effect. s follows from the wanted spacing of vertices.
//! [`Mesh::detail`] measures the RMS error of thinning, which includes the noise of the points.
//!
//! **Ours beyond the paper**: the limits of the cut (R188); the limit of the angle, because facets would otherwise join
//! a rim to ground a few centimetres behind it.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | v | [`Mesh::vertices`] | m, the grid's |
//! | o | [`Mesh::viewpoint`] | m, the grid's |
//! | s | `stride` | points |
//! | r | range from the viewpoint | m |
//!
//! Source: D§2; R188.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::grid::PointGrid;
use sightline_geometry::frames::{Point3, Vector3};

/// Marks a block without a vertex.
const NOTHING: u32 = u32::MAX;

/// Settings of the mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MeshSettings {
    /// Wanted distance between neighbouring vertices, m; the grid is thinned to it, never refined. 0: every point.
    pub spacing_m: f64,
    /// Largest ratio of the ranges of joined neighbours. Too small: slopes tear; too large: rocks stick to the ground
    /// behind them.
    pub depth_ratio_max: f64,
    /// Greatest angle between a facet's normal and the line of sight, deg.
    pub grazing_max_deg: f64,
}

impl Default for MeshSettings {
    /// 1 cm, about a pixel of the virtual sensor (ours); 1.05 (R188); 80° (ours).
    fn default() -> Self {
        Self { spacing_m: 0.01, depth_ratio_max: 1.05, grazing_max_deg: 80.0 }
    }
}

/// The part of a surface to be meshed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// Centre, in the frame of the points, m.
    pub centre: Point3,
    /// Radius, m.
    pub radius_m: f64,
}

/// Error of a thinned mesh at the points of the grid, along their lines of sight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Detail {
    /// Points per side of the block that became one vertex.
    pub stride: usize,
    /// Number of points compared.
    pub points: usize,
    /// Root mean square error, m; includes the noise of the points.
    pub rms_m: f64,
    /// Largest error, m.
    pub worst_m: f64,
}

/// A triangulated surface seen from one viewpoint.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// v, m, in the frame of the grid.
    pub vertices: Vec<Point3>,
    /// 1σ of each vertex along its line of sight, m: the median of its points' σ, because the errors of neighbours are
    /// correlated; 0 where unknown.
    pub range_sigma_m: Vec<f32>,
    /// Vertex indices of each facet, clockwise as seen from the viewpoint: (b − a) × (c − a) points away from it.
    pub triangles: Vec<[u32; 3]>,
    /// o: position of the instrument, m, in the same frame.
    pub viewpoint: Point3,
    /// Error of thinning.
    pub detail: Detail,
}

/// One vertex per block of points, row by row.
struct Lattice {
    columns: usize,
    rows: usize,
    stride: usize,
    /// Vertex indices; `NOTHING` where a block has no vertex.
    vertices: Vec<u32>,
    ranges_m: Vec<f64>,
}

impl Mesh {
    /// Meshes a grid whose points were measured from `viewpoint`; with a region, only the vertices inside it.
    pub fn from_grid(
        grid: &PointGrid,
        viewpoint: &Point3,
        region: Option<&Region>,
        settings: &MeshSettings,
    ) -> Self {
        let mut mesh = Self { viewpoint: *viewpoint, ..Self::default() };
        let stride = stride_for(grid, region, settings.spacing_m);
        let lattice = mesh.add_vertices(grid, region, stride);
        for row in 1..lattice.rows {
            for column in 1..lattice.columns {
                mesh.add_cell(&lattice, column, row, settings);
            }
        }
        mesh.detail = detail(grid, viewpoint, &lattice, settings.depth_ratio_max);
        mesh
    }

    /// Thins the grid to one vertex per block.
    fn add_vertices(&mut self, grid: &PointGrid, region: Option<&Region>, stride: usize) -> Lattice {
        let (columns, rows) = (grid.width / stride, grid.height / stride);
        let mut lattice = Lattice {
            columns,
            rows,
            stride,
            vertices: Vec::with_capacity(columns * rows),
            ranges_m: Vec::new(),
        };
        let mut block = Block::default();
        for row in 0..rows {
            for column in 0..columns {
                block.gather(grid, [column * stride, row * stride], stride, &self.viewpoint);
                let vertex = block.vertex(stride * stride, &self.viewpoint).filter(|(point, ..)| {
                    region.is_none_or(|region| {
                        (point - region.centre).norm_squared() <= region.radius_m * region.radius_m
                    })
                });
                let Some((point, range_m, sigma_m)) = vertex else {
                    lattice.vertices.push(NOTHING);
                    continue;
                };
                lattice.vertices.push(self.vertices.len() as u32);
                lattice.ranges_m.push(range_m);
                self.vertices.push(point);
                self.range_sigma_m.push(sigma_m);
            }
        }
        lattice
    }

    /// Adds the facets of the cell whose last corner is at (`column`, `row`).
    fn add_cell(&mut self, lattice: &Lattice, column: usize, row: usize, settings: &MeshSettings) {
        let at = |x: usize, y: usize| lattice.vertices[y * lattice.columns + x];
        let [a, b, c, d] =
            [at(column - 1, row - 1), at(column, row - 1), at(column - 1, row), at(column, row)];
        let length = |i: u32, j: u32| {
            if i == NOTHING || j == NOTHING {
                return f64::INFINITY;
            }
            (self.vertices[i as usize] - self.vertices[j as usize]).norm_squared()
        };
        let pair = if length(a, d) <= length(b, c) { [[a, b, d], [a, d, c]] } else { [[a, b, c], [b, d, c]] };
        for triangle in pair {
            if triangle.iter().all(|&vertex| vertex != NOTHING)
                && let Some(triangle) = self.facet(triangle, lattice, settings)
            {
                self.triangles.push(triangle);
            }
        }
    }

    /// Orients a triangle clockwise as seen from the viewpoint; `None` at a depth discontinuity or if the facet is seen
    /// edge-on.
    fn facet(&self, mut triangle: [u32; 3], lattice: &Lattice, settings: &MeshSettings) -> Option<[u32; 3]> {
        let ranges_m = triangle.map(|vertex| lattice.ranges_m[vertex as usize]);
        let (nearest, farthest) =
            (ranges_m.iter().copied().fold(f64::MAX, f64::min), ranges_m.iter().copied().fold(0.0, f64::max));
        if farthest > settings.depth_ratio_max * nearest {
            return None;
        }
        let [a, b, c] = triangle.map(|vertex| self.vertices[vertex as usize]);
        let normal = (b - a).cross(&(c - a));
        let sight = self.viewpoint - a;
        let facing = normal.dot(&sight);
        if facing.abs() < settings.grazing_max_deg.to_radians().cos() * normal.norm() * sight.norm() {
            return None;
        }
        if facing > 0.0 {
            triangle.swap(1, 2);
        }
        Some(triangle)
    }
}

/// Points per side of a block for vertices `spacing_m` apart, from the median distance of neighbours.
fn stride_for(grid: &PointGrid, region: Option<&Region>, spacing_m: f64) -> usize {
    if spacing_m <= 0.0 {
        return 1;
    }
    let is_inside = |point: &Point3| {
        region
            .is_none_or(|region| (point - region.centre).norm_squared() <= region.radius_m * region.radius_m)
    };
    // Every seventh point of every seventh row is a sufficient sample for the median.
    let mut gaps_m = Vec::new();
    for y in (0..grid.height).step_by(7) {
        for x in (1..grid.width).step_by(7) {
            if let (Some(left), Some(point)) = (grid.at(x - 1, y), grid.at(x, y))
                && is_inside(point)
            {
                gaps_m.push((point - left).norm());
            }
        }
    }
    if gaps_m.is_empty() {
        return 1;
    }
    let middle = gaps_m.len() / 2;
    let (_, median_m, _) = gaps_m.select_nth_unstable_by(middle, f64::total_cmp);
    ((spacing_m / *median_m).floor() as usize).clamp(1, 32)
}

/// The points of one block.
#[derive(Default)]
struct Block {
    ranges_m: Vec<f64>,
    sigmas_m: Vec<f32>,
    directions: Vector3,
}

impl Block {
    fn gather(&mut self, grid: &PointGrid, [x, y]: [usize; 2], stride: usize, viewpoint: &Point3) {
        self.ranges_m.clear();
        self.sigmas_m.clear();
        self.directions = Vector3::zeros();
        for y in y..y + stride {
            for x in x..x + stride {
                let Some(point) = grid.at(x, y) else { continue };
                let way = point - viewpoint;
                let range_m = way.norm();
                if range_m > 0.0 && range_m.is_finite() {
                    self.ranges_m.push(range_m);
                    self.sigmas_m.push(grid.sigma_at(x, y));
                    self.directions += way / range_m;
                }
            }
        }
    }

    /// Point, range and 1σ of the block's vertex; `None` if less than half of its `places` contain points.
    fn vertex(&mut self, places: usize, viewpoint: &Point3) -> Option<(Point3, f64, f32)> {
        let count = self.ranges_m.len();
        if count == 0 || 2 * count < places {
            return None;
        }
        let (below, &mut upper, _) = self.ranges_m.select_nth_unstable_by(count / 2, f64::total_cmp);
        let lower = below.iter().copied().fold(0.0, f64::max);
        let range_m = if count.is_multiple_of(2) { 0.5 * (lower + upper) } else { upper };
        let (_, &mut sigma_m, _) = self.sigmas_m.select_nth_unstable_by(count / 2, f32::total_cmp);
        Some((viewpoint + self.directions.normalize() * range_m, range_m, sigma_m))
    }
}

/// Measures the error of the interpolated mesh at the points of every cell without a depth discontinuity.
fn detail(grid: &PointGrid, viewpoint: &Point3, lattice: &Lattice, ratio_max: f64) -> Detail {
    let stride = lattice.stride;
    let mut detail = Detail { stride, ..Detail::default() };
    let mut squares_m2 = 0.0;
    let middle = (stride as f64 - 1.0) / 2.0;
    for row in 1..lattice.rows {
        for column in 1..lattice.columns {
            let corner = |x: usize, y: usize| {
                let vertex = lattice.vertices[y * lattice.columns + x];
                if vertex == NOTHING { f64::NAN } else { lattice.ranges_m[vertex as usize] }
            };
            let [a, b] = [corner(column - 1, row - 1), corner(column, row - 1)];
            let [c, d] = [corner(column - 1, row), corner(column, row)];
            let (low, high) = (a.min(b).min(c).min(d), a.max(b).max(c).max(d));
            if (a + b + c + d).is_nan() || high > ratio_max * low {
                continue;
            }
            for k in 0..stride * stride {
                let (x, y) = (k % stride, k / stride);
                let first = [(column - 1) * stride, (row - 1) * stride].map(|n| n + stride / 2);
                let Some(point) = grid.at(first[0] + x, first[1] + y) else { continue };
                let [u, v] = [(x, first[0], column), (y, first[1], row)].map(|(k, first, last)| {
                    ((first + k) as f64 - middle - ((last - 1) * stride) as f64) / stride as f64
                });
                let there_m = (a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v;
                let error_m = ((point - viewpoint).norm() - there_m).abs();
                detail.points += 1;
                detail.worst_m = detail.worst_m.max(error_m);
                squares_m2 += error_m * error_m;
            }
        }
    }
    detail.rms_m = (squares_m2 / detail.points.max(1) as f64).sqrt();
    detail
}

#[cfg(test)]
#[path = "mesh_tests.rs"]
mod tests;
