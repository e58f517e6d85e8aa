//! All tests that cross crates.

mod imports;
mod recorded_cameras;
mod rerun_export;
mod zncc_reference;
