//! Stage 8, `map_hazards`: traversability of the ground around the rover, from range data, for `select_path`.
//!
//! ```text
//! stereo pair ─► range_points ─► map_hazards (sums of cells, kept from stop to stop) ─► assess ─► goodness map
//! ```
//! | file | content |
//! |---|---|
//! | `points` | points of a stereo pair |
//! | `grid`, `map`, `moments` | window that wraps around the rover; sums of a cell; plane fit |
//! | `disc_sums`, `steps` | the disc of the rover's radius around every cell |
//! | `slope` | the slope of the ground, above which steps are measured |
//! | `goodness` | tilt, roughness, step, certainty, goodness; exemption and start |
//!
//! The map is inflated: the goodness of a cell is that of the whole disc around it, so that a path is evaluated along its
//! centre line.
//!
//! Departures from domain.md 8.2: cells of 0.10 m instead of 0.20 m and a window of 16 m instead of 10 m; the age of the
//! observations; steps are measured relative to the slope of the ground. Heights are not corrected for pose errors between
//! two stops: their weights decay with the distance driven.
//!
//! Frame: site, z down, m. Sources: domain.md 8; papers.md R9, R99–R102.

pub mod settings;
pub mod grid;
mod moments;
pub mod map;
mod disc_sums;
mod slope;
mod steps;
mod deck;
pub mod goodness;
pub mod points;
#[cfg(test)]
mod tests;

pub use goodness::{CellBasis, Circle, GoodnessCell, GoodnessMap, HazardTerm, MapRules, assess};
pub use grid::Grid;
pub use map::{HazardMap, RangeNoise, Scan, map_hazards};
pub(crate) use points::range_noise;
pub use points::range_points;
pub use settings::HazardSettings;
