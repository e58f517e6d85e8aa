//! The state of the hazard map: sums over the points of each cell, kept while the cell is in the window.
//!
//! ```text
//! w ← w · ½^(Δs/h)      for every sum of every cell, s: distance driven, h: half-life
//! ```
//! Points enter at the pose estimate of their stop. Sums are relative to the centre of the cell and to the height of the
//! rover at the first stop: a map that has moved has the same bits as one built in place.
//!
//! Frame: site, m. Source: domain.md 8.1 (wrap-around grid), 8.2.

use serde::{Deserialize, Serialize};

use sightline_geometry::error::Error;
use sightline_geometry::frames::{Point3, Pose};

use super::grid::Grid;
use super::moments::{Moments, SUMS};
use super::settings::HazardSettings;

/// The heights of a face's points must spread by more than `face_spread_m` plus this many 1σ.
const FACE_SIGMAS: f64 = 2.0;
/// Cells with fewer points (decayed) are cleared.
const FORGOTTEN: f64 = 1e-3;

/// Range data of one stop.
#[derive(Clone, Copy, Debug)]
pub struct Scan<'a> {
    /// Points, rover frame, m.
    pub points_in_rover: &'a [Point3],
    /// The pose estimate.
    pub site_from_rover: &'a Pose,
    /// Distance driven since the first stop, m.
    pub driven_m: f64,
    /// Error model of the points; `None` if they are exact.
    pub noise: Option<RangeNoise>,
}

/// Error of a stereo pair's range, and the resulting error of a point's height.
///
/// ```text
/// σ_range = R² σ_d / (f B)      σ_height = σ_range |h| / R
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeNoise {
    /// Position of the left camera, rover frame, m.
    pub camera_in_rover: Point3,
    /// σ_d/(f B): 1σ of the disparity over focal length and baseline, 1/m.
    pub per_m: f64,
}

impl RangeNoise {
    /// Variance of the height of a point, rover frame, m².
    fn height_variance_m2(&self, point_in_rover: &Point3) -> f64 {
        let from_camera = point_in_rover - self.camera_in_rover;
        (self.per_m * from_camera.norm() * from_camera.z).powi(2)
    }
}

/// Hazard map of a drive: the complete state carried from stop to stop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "Stored", try_from = "Stored")]
pub struct HazardMap {
    pub(super) grid: Grid,
    /// Reference height of the sums, z of the site frame, m.
    pub(super) height_m: f64,
    /// Distance driven, m.
    pub(super) driven_m: f64,
    /// By storage index.
    cells: Vec<Moments>,
    /// z of the highest point of each cell, by storage index, relative to the reference, m; infinite without one.
    highest_m: Vec<f64>,
}

/// Stage 8, `map_hazards`: the map of the previous stop, moved and decayed, with the points of this one. Starts a new map
/// without a previous one, or if the size of cell or window has changed.
pub fn map_hazards(before: Option<&HazardMap>, scan: &Scan<'_>, settings: &HazardSettings) -> HazardMap {
    let origin = scan.site_from_rover.translation.vector;
    let grid = Grid::around([origin.x, origin.y], settings.cell_m, settings.side_cells());
    let mut map = match before.filter(|map| (map.grid.cell_m, map.grid.side) == (grid.cell_m, grid.side)) {
        Some(before) => before.moved(grid, scan.driven_m, settings),
        None => HazardMap {
            grid,
            height_m: origin.z,
            driven_m: scan.driven_m,
            cells: vec![Moments::default(); grid.len()],
            highest_m: vec![f64::INFINITY; grid.len()],
        },
    };
    map.add(scan, settings);
    map
}

impl HazardMap {
    /// Sums of a cell.
    #[inline]
    pub(super) fn cell(&self, row: usize, column: usize) -> &Moments {
        &self.cells[self.grid.slot(row, column)]
    }

    /// z of the upper edge of a cell whose heights spread more than those of ground, as on the face of a rock, relative to
    /// the reference, m; `None` for other cells. See `steps.rs`.
    pub(super) fn upper_edge_m(&self, row: usize, column: usize, face_spread_m: f64) -> Option<f64> {
        let slot = self.grid.slot(row, column);
        let cell = &self.cells[slot];
        let least_m = face_spread_m + FACE_SIGMAS * cell.variance_m2().sqrt();
        let spread_m = Some(cell.spread_m()).filter(|spread_m| *spread_m > least_m)?;
        // z is down.
        Some((cell.mean_height_m() - 3f64.sqrt() * spread_m).max(self.highest_m[slot]))
    }

    /// The map moved to another window and decayed to a distance driven.
    fn moved(&self, grid: Grid, driven_m: f64, settings: &HazardSettings) -> Self {
        let factor = 0.5_f64.powf((driven_m - self.driven_m).max(0.0) / settings.half_life_m);
        let mut cells = vec![Moments::default(); grid.len()];
        let mut highest_m = vec![f64::INFINITY; grid.len()];
        for row in 0..grid.side {
            for column in 0..grid.side {
                let slot = grid.slot(row, column);
                if grid.is_in(row, column, &self.grid) && self.cells[slot].count() * factor >= FORGOTTEN {
                    cells[slot] = self.cells[slot];
                    cells[slot].scale(factor);
                    highest_m[slot] = self.highest_m[slot];
                }
            }
        }
        Self { grid, height_m: self.height_m, driven_m, cells, highest_m }
    }

    fn add(&mut self, scan: &Scan<'_>, settings: &HazardSettings) {
        for point in scan.points_in_rover {
            if -point.z > settings.height_max_m {
                continue;
            }
            let variance_m2 = scan.noise.map_or(0.0, |noise| noise.height_variance_m2(point));
            let point = scan.site_from_rover * point;
            let Some([row, column]) = self.grid.cell_at([point.x, point.y]) else { continue };
            let centre = self.grid.centre_m(row * self.grid.side + column);
            let relative = [point.x - centre[0], point.y - centre[1], point.z - self.height_m];
            let slot = self.grid.slot(row, column);
            self.cells[slot].add(relative, scan.driven_m, variance_m2);
            self.highest_m[slot] = self.highest_m[slot].min(relative[2]);
        }
    }
}

/// Serialised form of a map: the cells with points, by storage index.
#[derive(Serialize, Deserialize)]
struct Stored {
    grid: Grid,
    height_m: f64,
    driven_m: f64,
    /// Storage index, sums, and z of the highest point.
    cells: Vec<(u32, [f64; SUMS], f64)>,
}

/// Largest number of cells along a side of a stored map.
const SIDE_MAX: usize = 2000;

impl From<HazardMap> for Stored {
    fn from(map: HazardMap) -> Self {
        let known = map.cells.iter().enumerate().filter(|(_, cell)| cell.count() > 0.0);
        let cells = known.map(|(slot, cell)| (slot as u32, cell.0, map.highest_m[slot])).collect();
        Self { grid: map.grid, height_m: map.height_m, driven_m: map.driven_m, cells }
    }
}

impl TryFrom<Stored> for HazardMap {
    type Error = Error;

    fn try_from(stored: Stored) -> Result<Self, Error> {
        let Stored { grid, height_m, driven_m, cells: known } = stored;
        if grid.side == 0 || grid.side > SIDE_MAX || grid.cell_m.is_nan() || grid.cell_m <= 0.0 {
            return Err(Error::Request(format!(
                "a hazard map of {} × {} cells of {} m cannot be read",
                grid.side, grid.side, grid.cell_m
            )));
        }
        let mut cells = vec![Moments::default(); grid.len()];
        let mut highest_m = vec![f64::INFINITY; grid.len()];
        for (slot, sums, top_m) in known {
            let Some(cell) = cells.get_mut(slot as usize) else {
                return Err(Error::Request(format!("a hazard map has no cell {slot}")));
            };
            *cell = Moments(sums);
            highest_m[slot as usize] = top_m;
        }
        Ok(Self { grid, height_m, driven_m, cells, highest_m })
    }
}
