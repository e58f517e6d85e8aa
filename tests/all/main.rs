//! All tests that cross crates.

mod approach;
mod imports;
mod recorded_cameras;
mod recorded_tracking;
mod rerun_export;
mod zncc_reference;
