//! The cameras that see it: which pair, samples of a pixel's area, the optics, the exposure, the detector.

pub mod rig;
pub mod sampling;
mod shading;
pub mod optics;
pub mod render;
pub mod exposure;
pub mod noise;
