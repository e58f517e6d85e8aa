//! The light: sun, sky and reflection.

pub(crate) mod sky;
pub(crate) mod law;
pub(crate) mod reflection;
pub(crate) mod openness;
