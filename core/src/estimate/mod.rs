//! Estimation that several trackers use.

pub mod drift;
pub mod error_budget;
pub mod photometry;
pub mod triangulate;
pub mod unscented;
