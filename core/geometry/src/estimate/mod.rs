//! Estimation shared by several trackers.

pub mod quantile;
pub mod triangulate;
pub mod unscented;
pub mod horn;
pub mod weighted_motion;
pub mod ransac;
pub mod motion_parameters;
pub mod bootstrap;
pub mod carry;
pub mod confidence;
pub mod drift;
pub mod error_budget;
#[cfg(test)]
mod motion_scene;
