//! Preprocessing of images for odometry: reduction by averaging blocks of pixels, or smoothing.
//!
//! A detector has pixels that are brighter than others in every image (fixed-pattern noise). If the view moves by a pixel
//! or two, windows would match this pattern and show no motion; smoothing by (1, 4, 6, 4, 1)/16 along rows and columns
//! reduces it to a quarter.

use image::Luma;

use sightline_geometry::camera::Camera;
use sightline_vision::image::{GrayImage, PixelRect};

use super::windows::Eye;

/// A reduced image with its camera.
pub(crate) struct Reduced {
    pub(crate) camera: Camera,
    pub(crate) image: GrayImage,
}

impl Reduced {
    /// Averages blocks of `factor` × `factor` pixels; drops incomplete blocks. An invalid pixel makes its block invalid.
    pub(crate) fn new(eye: Eye<'_>, factor: u32) -> Self {
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

    /// The smoothed image; invalid within two pixels of the border or of an invalid pixel.
    pub(super) fn smoothed(eye: Eye<'_>) -> Self {
        let [width, height] = [eye.image.width() as usize, eye.image.height() as usize];
        let pixels = eye.image.as_raw();
        let mut image = GrayImage::from_pixel(width as u32, height as u32, Luma([f32::NAN]));
        if width >= 5 && height >= 5 {
            let mut columns = vec![0.0f32; width];
            for (y, line) in image.chunks_exact_mut(width).enumerate().take(height - 2).skip(2) {
                let row = |k: usize| &pixels[(y + k - 2) * width..(y + k - 1) * width];
                let rows = row(0).iter().zip(row(1)).zip(row(2)).zip(row(3)).zip(row(4));
                for (sum, ((((a, b), c), d), e)) in columns.iter_mut().zip(rows) {
                    *sum = binomial([*a, *b, *c, *d, *e]);
                }
                for (value, near) in line[2..].iter_mut().zip(columns.array_windows::<5>()) {
                    *value = binomial(*near);
                }
            }
        }
        Self { camera: eye.camera.clone(), image }
    }

    /// The image without its outermost pixels if these are invalid, as after smoothing.
    pub(super) fn inside(&self) -> PixelRect {
        let [width, height] = [self.image.width(), self.image.height()];
        let is_whole = self.image.as_raw().first().is_some_and(|value| value.is_finite());
        if is_whole {
            return PixelRect::whole(width, height);
        }
        PixelRect::new(1, 1, width.saturating_sub(2), height.saturating_sub(2))
    }

    pub(super) fn eye(&self) -> Eye<'_> {
        Eye { camera: &self.camera, image: &self.image }
    }
}

fn binomial([a, b, c, d, e]: [f32; 5]) -> f32 {
    (a + e + 4.0 * (b + d) + 6.0 * c) * 0.0625
}

#[cfg(test)]
mod tests {
    use sightline_geometry::camera::{Cahv, CameraModel};
    use sightline_geometry::frames::{Point3, Vector3};

    use super::*;

    fn camera(size: u32) -> Camera {
        let middle = Vector3::x() * (0.5 * f64::from(size) - 0.5);
        let (h, v) = (Vector3::y() * 50.0 + middle, Vector3::z() * 50.0 + middle);
        Camera::new(CameraModel::Cahv(Cahv::as_printed(Point3::origin(), Vector3::x(), h, v)), size, size)
    }

    #[test]
    fn a_single_pixel_is_spread_by_the_weights_and_a_plane_stays() {
        let camera = camera(12);
        let mut image = GrayImage::from_fn(12, 12, |x, y| Luma([0.01 * x as f32 + 0.02 * y as f32]));
        let plane = Reduced::smoothed(Eye { camera: &camera, image: &image }).image;
        assert!((plane.get_pixel(5, 7)[0] - image.get_pixel(5, 7)[0]).abs() < 1e-6);
        assert!(plane.get_pixel(1, 5)[0].is_nan() && plane.get_pixel(5, 10)[0].is_nan());
        image.put_pixel(6, 6, Luma([0.18 + 1.0]));
        let spread = Reduced::smoothed(Eye { camera: &camera, image: &image }).image;
        let added = |x: u32, y: u32| spread.get_pixel(x, y)[0] - plane.get_pixel(x, y)[0];
        assert!((added(6, 6) - 36.0 / 256.0).abs() < 1e-5 && (added(7, 8) - 4.0 / 256.0).abs() < 1e-5);
    }

    #[test]
    fn blocks_are_averaged_and_the_camera_goes_with_them() {
        let camera = camera(9);
        let image = GrayImage::from_fn(9, 9, |x, y| Luma([(x + 10 * y) as f32]));
        let reduced = Reduced::new(Eye { camera: &camera, image: &image }, 2);
        assert_eq!((reduced.image.dimensions(), reduced.camera.size), ((4, 4), [4, 4]));
        assert_eq!(reduced.image.get_pixel(1, 2)[0], 2.5 + 45.0);
        let point = Point3::new(4.0, 0.1, -0.2);
        let (whole, small) = (camera.project(&point).unwrap(), reduced.camera.project(&point).unwrap());
        assert!(
            (whole.x - (2.0 * small.x + 0.5)).abs() < 1e-9 && (whole.y - (2.0 * small.y + 0.5)).abs() < 1e-9
        );
    }
}
