//! Images: grey, `f32`, in fractions of full scale (0 = black, 1 = the detector's largest number).
//!
//! Geometry is in `f64` and pixels are in `f32`; conversions happen only at this border.

pub mod sample;

/// A grey image; values are fractions of full scale.
pub type GrayImage = image::ImageBuffer<image::Luma<f32>, Vec<f32>>;
