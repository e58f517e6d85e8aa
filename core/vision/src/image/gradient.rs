//! Gradients of a patch by central differences: `gx = (I(x+1, y) − I(x−1, y)) / 2`, likewise `gy`.
//!
//! Unit: fractions of full scale per px. The gradient is NaN at the outermost pixels and beside invalid pixels, where
//! the difference does not exist.

use image::Luma;

use super::GrayImage;
use super::patch::Patch;

/// Gradients to the right and downwards, in the patch's unit per px; same size as the patch, NaN on its rim.
pub fn central(patch: &Patch) -> (Patch, Patch) {
    (difference(patch, 1, 0), difference(patch, 0, 1))
}

fn difference(patch: &Patch, dx: u32, dy: u32) -> Patch {
    let value = |x: u32, y: u32| patch.get_pixel_checked(x, y).map_or(f32::NAN, |p| p[0]);
    let (width, height) = patch.dimensions();
    GrayImage::from_fn(width, height, |x, y| {
        let before = if x < dx || y < dy { f32::NAN } else { value(x - dx, y - dy) };
        Luma([(value(x + dx, y + dy) - before) / 2.0])
    })
    .into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gradient_of_a_quadratic_is_exact_inside_and_invalid_on_the_rim() {
        let f = |x: f32, y: f32| 0.1 * x - 0.2 * y + 0.01 * x * x + 0.02 * x * y;
        let patch: Patch = GrayImage::from_fn(7, 5, |x, y| Luma([f(x as f32, y as f32)])).into();
        let (gx, gy) = central(&patch);
        for (x, y, g) in gx.enumerate_pixels() {
            let expected = 0.1 + 0.02 * x as f32 + 0.02 * y as f32;
            assert!(if x == 0 || x == 6 { g[0].is_nan() } else { (g[0] - expected).abs() < 1e-6 });
        }
        for (x, y, g) in gy.enumerate_pixels() {
            let expected = -0.2 + 0.02 * x as f32;
            assert!(if y == 0 || y == 4 { g[0].is_nan() } else { (g[0] - expected).abs() < 1e-6 });
        }
    }
}
