//! Estimation that several trackers use.

pub mod drift;
pub mod triangulate;
pub mod unscented;
