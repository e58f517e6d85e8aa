//! Execution of studies: renders worlds, tracks units and stores each result, then writes tables and a report. Used by the
//! command line and the REST resource.
//!
//! ```text
//! folder/<scenario>/world-<seed>/   a world, rendered once and shared by all studies of the folder
//! folder/<study>/results.jsonl      one line per unit, appended when it is done: a stopped study continues from it
//! folder/<study>/rows.csv, rows.parquet, runs.csv, report.html, *.svg   rewritten at the end
//! ```
//!
//! A unit is one configuration at one point of the grid in one world. Its line contains a key of all its inputs
//! (`core::study::plan`), so that other grids, seeds and configurations can share the folder.

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
