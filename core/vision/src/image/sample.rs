//! Interpolation of images at sub-pixel positions.
//!
//! Bicubic is the interpolating cubic convolution of Keys (1981) with a = −0.5 (Catmull–Rom), which reproduces
//! polynomials up to the second degree exactly:
//! ```text
//! w(t) = (a+2)|t|³ − (a+3)|t|² + 1            |t| ≤ 1
//! w(t) = a|t|³ − 5a|t|² + 8a|t| − 4a      1 < |t| < 2
//! ```
//! **At the border.** Values exist between the centres of the outermost pixels, [0, W − 1] × [0, H − 1]; outside
//! (including the outer half pixel) the result is `None`. A tap of the cubic outside the image is extrapolated by Keys'
//! boundary condition f₋₁ = 3f₀ − 3f₁ + f₂, which preserves the second degree; images with fewer than three columns or
//! rows are interpolated bilinearly. Taps with weight zero are not read, so a whole pixel next to an invalid one has a
//! value.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | t | distance of a tap from the position | px |

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::GrayImage;
use sightline_geometry::frames::Pixel;

/// Interpolation kernel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Kernel {
    /// Linear in both directions: 2 × 2 taps.
    Bilinear,
    /// Cubic convolution (Catmull–Rom): 4 × 4 taps.
    #[default]
    Bicubic,
}

impl Kernel {
    /// The value of `image` at `at`, as a fraction of full scale; `None` outside or touching an invalid pixel.
    pub fn sample(self, image: &GrayImage, at: Pixel) -> Option<f32> {
        match self {
            Self::Bilinear => bilinear(image, at),
            Self::Bicubic => bicubic(image, at),
        }
    }
}

/// Bilinear value at `at`; `None` outside [0, W − 1] × [0, H − 1] or touching an invalid pixel.
pub fn bilinear(image: &GrayImage, at: Pixel) -> Option<f32> {
    let (x, tx) = cell(at.x, image.width())?;
    let (y, ty) = cell(at.y, image.height())?;
    weighted(image, (x, &[1.0 - tx, tx]), (y, &[1.0 - ty, ty]))
}

/// Bicubic (Catmull–Rom) value at `at`; `None` outside [0, W − 1] × [0, H − 1] or touching an invalid pixel.
pub fn bicubic(image: &GrayImage, at: Pixel) -> Option<f32> {
    if image.width() < 3 || image.height() < 3 {
        return bilinear(image, at);
    }
    let (x, x_weights) = cubic_taps(at.x, image.width())?;
    let (y, y_weights) = cubic_taps(at.y, image.height())?;
    weighted(image, (x, &x_weights), (y, &y_weights))
}

/// The pixel before the position and the fraction beyond it; the last pixel belongs to the last cell.
fn cell(position: f64, length: u32) -> Option<(u32, f64)> {
    if !(position >= 0.0 && position <= f64::from(length) - 1.0) {
        return None;
    }
    let before = (position as u32).min(length.saturating_sub(2));
    Some((before, position - f64::from(before)))
}

/// Coefficients of 1, t, t², t³ of the weights of the four taps of the cubic.
const CUBIC: [[f64; 4]; 4] =
    [[0.0, 1.0, 0.0, 0.0], [-0.5, 0.0, 0.5, 0.0], [1.0, -2.5, 2.0, -0.5], [-0.5, 1.5, -1.5, 0.5]];

/// Weights of the four taps of the cubic around a position at the fraction `t` beyond the second one, as one vector.
#[inline(always)]
pub(super) fn cubic_weights(t: f64) -> [f64; 4] {
    std::array::from_fn(|i| CUBIC[0][i] + t * (CUBIC[1][i] + t * (CUBIC[2][i] + t * CUBIC[3][i])))
}

/// First tap and weights of the cubic along one axis, extrapolated over the border by Keys' condition.
fn cubic_taps(position: f64, length: u32) -> Option<(u32, [f64; 4])> {
    let (before, t) = cell(position, length)?;
    let mut w = cubic_weights(t);
    let mut first = i64::from(before) - 1;
    if first < 0 {
        w = [w[1] + 3.0 * w[0], w[2] - 3.0 * w[0], w[3] + w[0], 0.0];
        first += 1;
    }
    if first + 3 >= i64::from(length) && w[3] != 0.0 {
        w = [w[0] + w[3], w[1] - 3.0 * w[3], w[2] + 3.0 * w[3], 0.0];
    }
    Some((first as u32, w))
}

/// Sum over the taps; those with weight zero are not read and need not exist.
fn weighted(image: &GrayImage, (x, wx): (u32, &[f64]), (y, wy): (u32, &[f64])) -> Option<f32> {
    let (width, pixels) = (image.width() as usize, image.as_raw().as_slice());
    let mut sum = 0.0;
    for (row, wy) in wy.iter().enumerate().filter(|(_, w)| **w != 0.0) {
        let start = (y as usize + row) * width + x as usize;
        for (column, wx) in wx.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            sum += wy * wx * f64::from(pixels[start + column]);
        }
    }
    sum.is_finite().then_some(sum as f32)
}

#[cfg(test)]
#[path = "sample_tests.rs"]
mod tests;
