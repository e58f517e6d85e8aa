//! All tests that cross crates.

mod imports;
mod page;
mod recorded_cameras;
mod rerun_export;
mod zncc_reference;
mod api;
mod api_security;
mod cli;
