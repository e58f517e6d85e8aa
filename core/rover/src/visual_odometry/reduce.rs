//! Images reduced by averaging blocks of pixels, with the camera of the result.

use image::Luma;

use sightline_geometry::camera::Camera;
use sightline_vision::image::GrayImage;

use super::windows::Eye;

/// A reduced image with its camera.
pub(super) struct Reduced {
    pub(super) camera: Camera,
    pub(super) image: GrayImage,
}

impl Reduced {
    /// Averages blocks of `factor` × `factor` pixels; incomplete blocks are dropped, an invalid pixel makes its block invalid.
    pub(super) fn new(eye: Eye<'_>, factor: u32) -> Self {
        let camera = eye.camera.downsampled(factor);
        let [width, height] = camera.size;
        let scale = 1.0 / (factor * factor) as f32;
        let pixels = eye.image.as_raw();
        let row_length = eye.image.width() as usize;
        let image = GrayImage::from_fn(width, height, |x, y| {
            let rows = (0..factor).map(|row| {
                let start = (y * factor + row) as usize * row_length + (x * factor) as usize;
                pixels[start..start + factor as usize].iter().sum::<f32>()
            });
            Luma([rows.sum::<f32>() * scale])
        });
        Self { camera, image }
    }

    pub(super) fn eye(&self) -> Eye<'_> {
        Eye { camera: &self.camera, image: &self.image }
    }
}
