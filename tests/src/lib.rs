//! Helpers shared by the integration tests.

// Tests report failures by panicking, in their helpers too.
#![allow(clippy::unwrap_used)]

pub mod browser;
pub mod controls;
pub mod browser_fixture;
pub mod data;
mod processes;
pub mod rrd;
pub mod scenario;
pub mod faulty_drive;
pub mod server;
pub mod stopwatch;
