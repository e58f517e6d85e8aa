//! The ground: a fractal height field of bilinear patches on a regular grid, and a plane beyond it.
//!
//! **Relief.** Heights at the grid's vertices follow `relief.rs`. They fade to the mean plane over the outer 1.5 m of the
//! grid, so that the plane beyond continues the surface without a step. A vertex is stored as `f32`; that number *is* the
//! surface, and all geometry on it is done in `f64`.
//!
//! **Tilt.** The mean plane may rise: `z = z_level(x, y) + a x + b y`, (a, b) = −tan(slope) (cos, sin)(azimuth of steepest
//! ascent). The grid stores z_level, and the sum is exact in `f64`; the ground is a shear of level ground, and so is its
//! intersection with a ray (`terrain_cast.rs`). Heights are measured along z, not along the plane's normal: at 20° the
//! relief's amplitude across the slope is 6 % smaller. Far from the site a slope returns to the mean level (`far.rs`).
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | z | `z_m` | m, site frame, down |
//! | a, b | `tilt` | m/m |
//! | u, v | position within a cell, 0 to 1 along x and y | – |

use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::Vector3;

use crate::ground::far::Far;
use crate::ground::level::MEAN_GROUND_Z_M;
use crate::ground::relief::Relief;
use crate::scenario::TerrainSettings;

/// Width over which the relief fades to the plane at the edges of the grid, m.
const FADE_M: f64 = 1.5;

/// Blocks have 2^shift cells along a side: 64, 16, 4 and 1, from the coarsest level to the finest.
pub(crate) const BLOCK_SHIFT: [usize; 4] = [6, 4, 2, 0];

/// Highest point (smallest z) of every block of one size.
#[derive(Clone, Debug)]
pub(crate) struct Tops {
    pub(crate) columns: usize,
    pub(crate) z_m: Vec<f32>,
}

/// The ground of the site.
#[derive(Clone, Debug)]
pub(crate) struct Terrain {
    pub(crate) origin_m: [f64; 2],
    pub(crate) cell_m: f64,
    /// Cells along x and y.
    pub(crate) cells: [usize; 2],
    /// z of the (cells + 1)² vertices without the tilt, m, rows along x.
    z_m: Vec<f32>,
    /// Gradient of the height at the vertices, for smooth shading.
    slope: Vec<[f32; 2]>,
    pub(crate) tops: Vec<Tops>,
    /// The same for each block with its eight neighbours.
    pub(crate) wide_tops: Vec<Tops>,
    pub(crate) highest_z_m: f64,
    steepest: f64,
    /// Gradient of the mean plane, m/m; the stored heights exclude it.
    pub(crate) tilt: [f64; 2],
    /// The ground beyond a slope; `None` for level ground.
    pub(crate) far: Option<Far>,
}

impl Terrain {
    /// A fractal ground over the rectangle `x_m` × `y_m` (from, to) of the site frame.
    #[cfg(test)]
    pub(crate) fn new(settings: &TerrainSettings, x_m: [f64; 2], y_m: [f64; 2], seed: u64) -> Self {
        Self::new_until(settings, x_m, y_m, seed, Cancel::default()).unwrap()
    }

    /// A fractal ground over the rectangle `x_m` × `y_m` (from, to) of the site frame; cancellable.
    pub(crate) fn new_until(
        settings: &TerrainSettings,
        x_m: [f64; 2],
        y_m: [f64; 2],
        seed: u64,
        cancel: Cancel<'_>,
    ) -> Result<Self> {
        let cell_m = settings.cell_m;
        let cells = [x_m, y_m].map(|[from, to]| (((to - from) / cell_m).ceil() as usize).max(1));
        let relief = Relief::new(settings, seed);
        let mut z_m = Vec::with_capacity((cells[0] + 1) * (cells[1] + 1));
        for iy in 0..=cells[1] {
            cancel.check()?;
            for ix in 0..=cells[0] {
                let (x, y) = (x_m[0] + ix as f64 * cell_m, y_m[0] + iy as f64 * cell_m);
                let edge_cells = ix.min(cells[0] - ix).min(iy).min(cells[1] - iy);
                let t = (edge_cells as f64 * cell_m / FADE_M).min(1.0);
                z_m.push((MEAN_GROUND_Z_M + t * t * (3.0 - 2.0 * t) * relief.z_m(x, y)) as f32);
            }
        }
        let (sin, cos) = settings.slope_azimuth_deg.to_radians().sin_cos();
        let tangent = settings.slope_deg.to_radians().tan();
        // Level ground must not get a sum of −0 and 0 that differs between directions.
        let tilt = if tangent == 0.0 { [0.0; 2] } else { [-tangent * cos, -tangent * sin] };
        let mut terrain = Self::from_heights([x_m[0], y_m[0]], cell_m, cells, z_m, tilt);
        // The grid is always inside the slope, whatever the setting.
        let corner_m = x_m[0].abs().max(x_m[1].abs()).hypot(y_m[0].abs().max(y_m[1].abs()));
        let radius_m = settings.slope_reach_m.max(corner_m + 1.0);
        terrain.far = (tangent != 0.0).then(|| Far::new(radius_m, tilt));
        Ok(terrain)
    }

    /// A ground of given vertex heights, m, positive down; `z_m` contains (cells + 1) vertices along each axis.
    fn from_heights(
        origin_m: [f64; 2],
        cell_m: f64,
        cells: [usize; 2],
        z_m: Vec<f32>,
        tilt: [f64; 2],
    ) -> Self {
        let tops: Vec<Tops> = BLOCK_SHIFT.iter().map(|&shift| tops(&z_m, cells, 1 << shift)).collect();
        let wide_tops = tops.iter().map(Tops::with_neighbours).collect();
        let highest_z_m = tops[0].z_m.iter().copied().fold(MEAN_GROUND_Z_M, |a, b| a.min(f64::from(b)));
        let slope = vertex_slopes(&z_m, cells, cell_m);
        let steepest = steepest(&z_m, cells) / cell_m + tilt[0].hypot(tilt[1]);
        Self { origin_m, cell_m, cells, z_m, slope, tops, wide_tops, highest_z_m, steepest, tilt, far: None }
    }

    /// Upper bound of the ground's slope, m/m.
    ///
    /// A ray that rises more steeply never meets the ground again after leaving it.
    pub(crate) fn steepest(&self) -> f64 {
        self.steepest
    }

    /// z of the mean plane relative to level ground at a point, m, positive down.
    #[inline(always)]
    pub(crate) fn tilt_m(&self, x_m: f64, y_m: f64) -> f64 {
        self.tilt[0] * x_m + self.tilt[1] * y_m
    }

    /// The unit normal of the mean plane, pointing up (negative z), site frame.
    pub(crate) fn mean_normal(&self) -> Vector3 {
        Vector3::new(self.tilt[0], self.tilt[1], -1.0).normalize()
    }

    /// The unit normal of the mean ground at a point, pointing up (negative z), site frame.
    pub(crate) fn mean_normal_at(&self, x_m: f64, y_m: f64) -> Vector3 {
        match self.far.and_then(|far| far.gradient_at(x_m, y_m)) {
            Some([zx, zy]) => Vector3::new(zx, zy, -1.0).normalize(),
            None => self.mean_normal(),
        }
    }

    /// The cell of a point and the position within it; `None` beyond the grid.
    fn locate(&self, x_m: f64, y_m: f64) -> Option<([usize; 2], f64, f64)> {
        let p = [(x_m - self.origin_m[0]) / self.cell_m, (y_m - self.origin_m[1]) / self.cell_m];
        if !(0..2).all(|k| p[k] >= 0.0 && p[k] < self.cells[k] as f64) {
            return None;
        }
        let cell = [p[0] as usize, p[1] as usize];
        Some((cell, p[0] - cell[0] as f64, p[1] - cell[1] as f64))
    }

    /// The four vertex heights of a cell without the tilt: (0,0), (1,0), (0,1), (1,1).
    #[inline(always)]
    pub(crate) fn corners(&self, cell: [usize; 2]) -> [f64; 4] {
        let at = cell[1] * (self.cells[0] + 1) + cell[0];
        let below = at + self.cells[0] + 1;
        [self.z_m[at], self.z_m[at + 1], self.z_m[below], self.z_m[below + 1]].map(f64::from)
    }

    /// z of the ground at a point, m, positive down.
    pub(crate) fn z_at(&self, x_m: f64, y_m: f64) -> f64 {
        let tilt_m = self.tilt_m(x_m, y_m);
        let Some((cell, u, v)) = self.locate(x_m, y_m) else {
            return self.far.and_then(|far| far.z_at(x_m, y_m)).unwrap_or(MEAN_GROUND_Z_M + tilt_m);
        };
        let [z00, z10, z01, z11] = self.corners(cell);
        z00 + (z10 - z00) * u + (z01 - z00) * v + (z00 - z10 - z01 + z11) * u * v + tilt_m
    }

    /// The unit normal of the true surface at a point, pointing up (negative z).
    pub(crate) fn normal_at(&self, x_m: f64, y_m: f64) -> Vector3 {
        let Some((cell, u, v)) = self.locate(x_m, y_m) else { return self.mean_normal_at(x_m, y_m) };
        let [z00, z10, z01, z11] = self.corners(cell);
        let twist = z00 - z10 - z01 + z11;
        let (zx, zy) = ((z10 - z00 + twist * v) / self.cell_m, (z01 - z00 + twist * u) / self.cell_m);
        Vector3::new(zx + self.tilt[0], zy + self.tilt[1], -1.0).normalize()
    }

    /// The gradient (∂z/∂x, ∂z/∂y) for shading, interpolated smoothly between the vertices.
    ///
    /// The true gradient jumps from cell to cell; shading with it would show the grid.
    #[inline(always)]
    pub(crate) fn smooth_slope_at(&self, x_m: f64, y_m: f64) -> [f32; 2] {
        let Some((cell, u, v)) = self.locate(x_m, y_m) else {
            let gradient = self.far.and_then(|far| far.gradient_at(x_m, y_m)).unwrap_or(self.tilt);
            return gradient.map(|v| v as f32);
        };
        let at = cell[1] * (self.cells[0] + 1) + cell[0];
        let below = at + self.cells[0] + 1;
        let (u, v) = (u as f32, v as f32);
        let corner = [self.slope[at], self.slope[at + 1], self.slope[below], self.slope[below + 1]];
        std::array::from_fn(|k| {
            let near = corner[0][k] + u * (corner[1][k] - corner[0][k]);
            let far = corner[2][k] + u * (corner[3][k] - corner[2][k]);
            near + v * (far - near) + self.tilt[k] as f32
        })
    }
}

impl Tops {
    /// The highest point of every block with its eight neighbours.
    fn with_neighbours(&self) -> Self {
        let (columns, rows) = (self.columns, self.z_m.len() / self.columns);
        let along = |from: &[f32], count: usize, step: usize, at: usize, k: usize| {
            let before = if k > 0 { from[at - step] } else { from[at] };
            let after = if k + 1 < count { from[at + step] } else { from[at] };
            from[at].min(before).min(after)
        };
        let across: Vec<f32> =
            (0..self.z_m.len()).map(|at| along(&self.z_m, columns, 1, at, at % columns)).collect();
        let z_m = (0..across.len()).map(|at| along(&across, rows, columns, at, at / columns)).collect();
        Self { columns, z_m }
    }
}

/// The highest point of every block of `side` × `side` cells.
fn tops(z_m: &[f32], cells: [usize; 2], side: usize) -> Tops {
    let [columns, rows] = cells.map(|n| n.div_ceil(side));
    let mut top = vec![f32::INFINITY; columns * rows];
    let width = cells[0] + 1;
    for row in 0..rows {
        for column in 0..columns {
            let [x1, y1] = [((column + 1) * side).min(cells[0]), ((row + 1) * side).min(cells[1])];
            for y in row * side..=y1 {
                let line = &z_m[y * width + column * side..=y * width + x1];
                top[row * columns + column] =
                    line.iter().copied().fold(top[row * columns + column], f32::min);
            }
        }
    }
    Tops { columns, z_m: top }
}

/// An upper bound of the steepness of any cell, m per cell: a patch's slopes along x and along y are
/// between those of its edges.
fn steepest(z_m: &[f32], cells: [usize; 2]) -> f64 {
    let width = cells[0] + 1;
    let mut steepest = 0.0f64;
    for y in 0..cells[1] {
        for x in 0..cells[0] {
            let at = y * width + x;
            let [a, b, c, d] = [z_m[at], z_m[at + 1], z_m[at + width], z_m[at + width + 1]].map(f64::from);
            let (along_x, along_y) = ((b - a).abs().max((d - c).abs()), (c - a).abs().max((d - b).abs()));
            steepest = steepest.max(along_x.hypot(along_y));
        }
    }
    steepest
}

/// Central differences of the vertex heights (one-sided at the edges).
fn vertex_slopes(z_m: &[f32], cells: [usize; 2], cell_m: f64) -> Vec<[f32; 2]> {
    let width = cells[0] + 1;
    let z = |x: usize, y: usize| f64::from(z_m[y * width + x]);
    let mut slopes = Vec::with_capacity(z_m.len());
    for y in 0..=cells[1] {
        for x in 0..=cells[0] {
            let (x0, x1) = (x.saturating_sub(1), (x + 1).min(cells[0]));
            let (y0, y1) = (y.saturating_sub(1), (y + 1).min(cells[1]));
            let along_x = (z(x1, y) - z(x0, y)) / ((x1 - x0) as f64 * cell_m);
            let along_y = (z(x, y1) - z(x, y0)) / ((y1 - y0) as f64 * cell_m);
            slopes.push([along_x as f32, along_y as f32]);
        }
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ground(seed: u64, rms_m: f64) -> Terrain {
        let settings = TerrainSettings { rms_at_1m_m: rms_m, ..TerrainSettings::default() };
        Terrain::new(&settings, [-2.0, 10.0], [-4.0, 4.0], seed)
    }

    #[test]
    fn tilted_ground_rises_by_its_slope_along_its_azimuth_and_nowhere_else() {
        let level = ground(3, 0.02);
        let settings =
            TerrainSettings { slope_deg: 18.0, slope_azimuth_deg: 120.0, ..TerrainSettings::default() };
        let tilted = Terrain::new(&settings, [-2.0, 10.0], [-4.0, 4.0], 3);
        let rise = 18f64.to_radians().tan();
        let (sin, cos) = 120f64.to_radians().sin_cos();
        for (x, y) in [(0.0, 0.0), (3.3, 1.7), (8.1, -3.2), (40.0, -9.0)] {
            let expected_m = level.z_at(x, y) - rise * (x * cos + y * sin);
            assert!((tilted.z_at(x, y) - expected_m).abs() < 1e-12);
            let (a, b) = (level.normal_at(x, y), tilted.normal_at(x, y));
            assert!((b.x / -b.z - (a.x / -a.z - rise * cos)).abs() < 1e-12);
            assert!((b.y / -b.z - (a.y / -a.z - rise * sin)).abs() < 1e-12);
        }
        // On the right (y > 0) the ground is higher for this azimuth: smaller z.
        assert!(tilted.z_at(0.0, 3.0) < tilted.z_at(0.0, -3.0));
        assert!((tilted.mean_normal().angle(&-Vector3::z()).to_degrees() - 18.0).abs() < 1e-9);
    }

    #[test]
    fn the_surface_joins_the_plane_beyond_the_grid() {
        let terrain = ground(3, 0.02);
        for k in 0..800 {
            let y = -4.0 + f64::from(k) * 0.01;
            assert!((terrain.z_at(9.999_999, y) - MEAN_GROUND_Z_M).abs() < 1e-6);
        }
    }
}
