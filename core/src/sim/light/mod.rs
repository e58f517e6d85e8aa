//! The light on it: sun, sky and reflection.

pub mod sky;
pub mod law;
pub mod reflection;
pub mod openness;
