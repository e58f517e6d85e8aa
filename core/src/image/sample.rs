//! Interpolated reading of images.
