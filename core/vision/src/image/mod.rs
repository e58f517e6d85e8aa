//! Images: grey, `f32`, in fractions of full scale (0 = black, 1 = the detector's largest number).
//!
//! Geometry is in `f64` and pixels are in `f32`; conversions happen only between the two. NaN marks an invalid pixel:
//! missing data, or outside the source of a resampled patch (R66).

pub mod rect;
pub mod sample;
pub mod resample;
pub mod patch;
pub mod pyramid;
pub mod gradient;
pub mod invalid;
pub mod io;
pub mod npy;
pub mod npz;

pub use patch::Patch;
pub use rect::PixelRect;

/// A grey image; values are fractions of full scale, NaN = invalid.
pub type GrayImage = image::ImageBuffer<image::Luma<f32>, Vec<f32>>;
