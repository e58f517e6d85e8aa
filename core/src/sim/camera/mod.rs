//! The cameras that see it: samples of a pixel's area, the optics' blur, the exposure and the detector.

pub mod sampling;
pub mod render;
pub mod noise;
