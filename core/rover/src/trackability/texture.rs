//! Grey-value criteria of a window: noise, light, contrast, the expected match error, and ambiguity.
//!
//! **Expected match.** Two windows that differ by noise (2σ_n²) and by the change of a step ((1 − ρ²) s²) are matched by
//! least squares with the Gaussian window w of the refinement:
//! ```text
//! A = Σ w g gᵀ,  B = Σ w² g gᵀ,  Σ = (2σ_n² + k (1 − ρ²) s²) A⁻¹ B A⁻¹,     σ = √(largest eigenvalue)
//! ```
//! It is large if the smaller eigenvalue of A (Shi & Tomasi 1994) is small: along an edge a window slides.
//!
//! **Noise.** σ_n is the median of │I ∗ M│ / (6 · 0.6745) with M the difference of two Laplacians (Immerkær 1996), which
//! cancels slope and curvature. The median over the image is dominated by its smoother half, so that texture adds little.
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

/// The sensor's noise, 1σ, fraction of full scale; 0 if the image is too small.
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

/// The best score of the window at another position of the search area; `None` without another peak, or without contrast.
pub fn likeness(image: &GrayImage, pixel: Pixel, window: &Patch, search_px: u32) -> Option<f64> {
    let surface = zncc_surface(window, image, PixelRect::centred(pixel, search_px))?;
    let best = find_peak(&surface, false)?;
    second_peak(&surface, &best, f64::from(window.width()) / 2.0).map(|second| second.score)
}

/// The fraction of a window's pixels that satisfy `is`.
pub fn share(window: &Patch, is: impl Fn(f32) -> bool) -> f64 {
    let count = window.iter().filter(|value| is(**value)).count();
    count as f64 / window.as_raw().len().max(1) as f64
}
