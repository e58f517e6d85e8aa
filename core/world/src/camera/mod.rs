//! The cameras: the pairs, samples of a pixel's area, the optics, the exposure, the detector.

pub(crate) mod picture;
pub mod rig;
pub(crate) mod sampling;
mod pixel_rays;
mod shading;
pub(crate) mod optics;
pub mod render;
pub mod exposure;
pub(crate) mod dust;
pub(crate) mod ghost;
pub(crate) mod noise;
