//! All tests that cross crates.

mod api;
mod cli;
mod imports;
mod recorded_cameras;
mod rerun_export;
mod zncc_reference;
