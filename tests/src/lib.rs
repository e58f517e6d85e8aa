//! Helpers shared by the integration tests.

pub mod browser;
pub mod data;
pub mod rrd;
pub mod troubled;
pub mod server;
