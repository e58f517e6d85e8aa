//! All tests that cross crates.

mod api;
mod api_security;
mod approach;
mod cli;
mod imports;
mod page;
mod recorded_cameras;
mod recorded_tracking;
mod rerun_export;
mod zncc_reference;
