//! Studies carried out: worlds rendered, units tracked and kept as they come, tables and a report at the end. The
//! command line and the REST resource both come here.
//!
//! ```text
//! folder/<scenario>/world-<seed>/   a world, rendered once and shared by all studies of the folder
//! folder/<study>/results.jsonl      one line a unit, added as it is done: what a stopped study goes on from
//! folder/<study>/rows.csv, rows.parquet, runs.csv, report.html, *.svg   made anew at the end
//! ```
//!
//! A unit is one configuration at one point of the grid in one world. Its line is kept under a key of all that decides
//! it (`core::study::plan`), so that the same folder serves other grids, seeds and configurations later.

pub mod conduct;
pub mod log;
pub mod tables;
pub mod figure;
pub mod step_figure;
pub mod drawn;
pub mod report;
pub mod kept;
pub mod shelf;

pub use conduct::{Order, Outcome, Progress, Seeds, carry_out};
