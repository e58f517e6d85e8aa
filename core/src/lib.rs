//! The visual target tracker of Sightline.

pub mod frames;
pub mod error;
pub mod camera;
pub mod image;
pub mod correlate;
pub mod estimate;
pub mod sim;
pub mod traverse;
