//! Helpers shared by the integration tests.

// A test says what went wrong by panicking, in its helpers too.
#![allow(clippy::unwrap_used)]

pub mod browser;
pub mod controls;
pub mod bench;
pub mod data;
mod processes;
pub mod rrd;
pub mod scenario;
pub mod troubled;
pub mod server;
pub mod stopwatch;
