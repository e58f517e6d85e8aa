//! What a window's grey values say: noise, light, contrast, the error that a match would have, and whether the same is seen again.
//!
//! **Expected match.** Two windows that show the same but for noise (2σ_n²) and what a step changes ((1 − ρ²) s²) are
//! matched by least squares through the Gaussian window w of the refinement:
//! ```text
//! A = Σ w g gᵀ,  B = Σ w² g gᵀ,  Σ = (2σ_n² + k (1 − ρ²) s²) A⁻¹ B A⁻¹,     σ = √(largest eigenvalue)
//! ```
//! The smaller eigenvalue of A (Shi & Tomasi 1994) is what makes it large: an edge, along which a window slides.
//!
//! **Noise.** σ_n is the median of │I ∗ M│ / (6 · 0.6745) with M the difference of two Laplacians (Immerkær 1996): it sees no
//! slope and no bend. The median over the image is that of its smoother half, so that texture adds little.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | g | gradient | full scale per px |
//! | σ_n | `noise` | full scale |
//! | s | standard deviation of the window | full scale |
//! | ρ | `step_score` | – |
//! | k | `ALIKE`: number of pixels whose changes over a step are correlated | – |

use nalgebra::{Matrix2, Vector2};

use sightline_geometry::estimate::quantile::upper_median;
use sightline_geometry::frames::Pixel;
use sightline_vision::correlate::Focus;
use sightline_vision::correlate::peak::{find_peak, second_peak};
use sightline_vision::correlate::zncc::zncc_surface;
use sightline_vision::image::patch::Patch;
use sightline_vision::image::{GrayImage, PixelRect, gradient};

/// Number of pixels whose changes over a step are correlated: three by three.
const ALIKE: f64 = 9.0;

/// The sensor's noise, 1σ, fraction of full scale; 0 for an image too small to tell.
pub fn noise(image: &GrayImage) -> f64 {
    const MASK: [[f32; 3]; 3] = [[1.0, -2.0, 1.0], [-2.0, 4.0, -2.0], [1.0, -2.0, 1.0]];
    let (width, height) = image.dimensions();
    let mut responses = Vec::new();
    // Every third pixel: no two masks overlap.
    for y in (1..height.saturating_sub(1)).step_by(3) {
        for x in (1..width.saturating_sub(1)).step_by(3) {
            let mut sum = 0.0;
            for (v, row) in (0..).zip(&MASK) {
                for (u, weight) in (0..).zip(row) {
                    sum += weight * image.get_pixel(x + u - 1, y + v - 1)[0];
                }
            }
            if sum.is_finite() {
                responses.push(sum.abs());
            }
        }
    }
    upper_median(&mut responses).map_or(0.0, |middle| f64::from(middle) / (6.0 * 0.6745))
}

/// The expected 1σ of a match along the worst direction, px; `None` without any gradient in one direction.
pub fn match_sigma_px(window: &Patch, noise: f64, step_score: f64, focus: &Focus) -> Option<f64> {
    let deviation = window.std()?;
    // Noise is independent from pixel to pixel; changes of the scene are not.
    let changed = (1.0 - step_score * step_score) * deviation * deviation;
    let residual = 2.0 * noise * noise + ALIKE * changed;
    let (gx, gy) = gradient::central(window);
    let (mut a, mut b) = (Matrix2::zeros(), Matrix2::zeros());
    for ((gx, gy), weight) in gx.iter().zip(gy.iter()).zip(focus.weights()) {
        let g = Vector2::new(f64::from(*gx), f64::from(*gy));
        if g.iter().all(|value| value.is_finite()) {
            let product = g * g.transpose();
            a += product * *weight;
            b += product * (weight * weight);
        }
    }
    let inverse: Matrix2<f64> = a.try_inverse()?;
    let covariance = inverse * b * inverse * residual;
    let largest = (covariance + covariance.transpose()).symmetric_eigenvalues().max() / 2.0;
    (largest.is_finite() && largest >= 0.0).then(|| largest.sqrt())
}

/// The best score of the window with another place of the search area; `None` where there is none, or no contrast.
pub fn likeness(image: &GrayImage, pixel: Pixel, window: &Patch, search_px: u32) -> Option<f64> {
    let surface = zncc_surface(window, image, PixelRect::centred(pixel, search_px))?;
    let best = find_peak(&surface, false)?;
    second_peak(&surface, &best, f64::from(window.width()) / 2.0).map(|second| second.score)
}

/// The share of a window's pixels that `is` holds for.
pub fn share(window: &Patch, is: impl Fn(f32) -> bool) -> f64 {
    let count = window.iter().filter(|value| is(**value)).count();
    count as f64 / window.as_raw().len().max(1) as f64
}
