//! The light on it: sun, sky and reflection.

pub mod reflection;
pub mod openness;
