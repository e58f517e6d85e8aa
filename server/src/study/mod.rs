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

pub(crate) mod order;
pub(crate) mod execute;
pub(crate) mod log;
pub(crate) mod tables;
pub(crate) mod figure;
pub(crate) mod step_figure;
pub mod chart;
pub(crate) mod report;
pub(crate) mod saved;
pub(crate) mod jobs;

pub use execute::{Outcome, Progress, carry_out};
pub use order::{Order, Seeds};
