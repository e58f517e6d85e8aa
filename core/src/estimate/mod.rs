//! Estimation that several trackers use.

pub mod triangulate;
pub mod unscented;
