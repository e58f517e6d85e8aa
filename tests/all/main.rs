//! All tests that cross crates.

// A test says what went wrong by panicking, in its helpers too.
#![allow(clippy::unwrap_used)]

mod api;
mod api_security;
mod cli;
mod expressions;
mod imports;
mod page;
mod recorded_cameras;
mod recorded_tracking;
mod rerun_export;
mod studies;
mod zncc_reference;
