//! All tests that cross crates.

// A test may stop at the first thing that is not as it should be, and so may its helpers.
#![allow(clippy::unwrap_used)]

mod imports;
mod page;
mod recorded_cameras;
mod rerun_export;
mod zncc_reference;
mod api;
mod api_security;
mod cli;
