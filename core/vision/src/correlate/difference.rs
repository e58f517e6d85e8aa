//! Sums of differences: the measures without normalisation (R216).
//!
//! ```text
//! sad = −(1/N) Σ |I − J|          ssd = −(1/N) Σ (I − J)²          larger = better, 0 = equal
//! ```
//! Scores depend on brightness and contrast, so that no fixed gate separates true from false matches; callers gate on
//! the normalised correlation at the position found. Sums are in `f32` over one row of the template and in `f64` over
//! rows: the relative error of a score is below 1e-6. A window with an invalid pixel sums to NaN, which excludes it
//! (R66).
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | I | `template` | fraction of full scale |
//! | J | window of `image` | fraction of full scale |
//! | N | pixels of the template | – |

use rayon::prelude::*;

use super::grid::Grid;
use super::surface::Surface;
use crate::image::patch::Patch;
use crate::image::{GrayImage, PixelRect};
use sightline_geometry::cancel::Cancel;

/// Mean absolute difference, negated, at every position of `region` that contains the template.
///
/// `None` as for [`super::zncc_surface`].
pub(super) fn sad_surface(
    template: &Patch,
    image: &GrayImage,
    region: PixelRect,
    cancel: Cancel<'_>,
) -> Option<Surface> {
    surface(template, image, region, cancel, f32::abs)
}

/// Mean squared difference, negated, at every position of `region` that contains the template.
///
/// `None` as for [`super::zncc_surface`].
pub(super) fn ssd_surface(
    template: &Patch,
    image: &GrayImage,
    region: PixelRect,
    cancel: Cancel<'_>,
) -> Option<Surface> {
    surface(template, image, region, cancel, |d| d * d)
}

fn surface(
    template: &Patch,
    image: &GrayImage,
    region: PixelRect,
    cancel: Cancel<'_>,
    cost: impl Fn(f32) -> f32 + Sync,
) -> Option<Surface> {
    if !template.is_complete() {
        return None;
    }
    let grid = Grid::new(template.dimensions(), image, region)?;
    let (size, stride) = (template.width() as usize, image.width() as usize);
    let count = (size * size) as f64;
    let mut scores = vec![0.0; grid.len()];
    scores.par_chunks_mut(grid.width as usize).enumerate().for_each(|(iy, out)| {
        if cancel.is_requested() {
            return;
        }
        let mut total = vec![0.0_f64; out.len()];
        let mut row_sum = vec![0.0_f32; out.len()];
        for (v, weights) in template.as_raw().chunks_exact(size).enumerate() {
            row_sum.fill(0.0);
            let start = (grid.region.y as usize + iy + v) * stride + grid.region.x as usize;
            for (u, t) in weights.iter().enumerate() {
                let pixels = &image.as_raw()[start + u..][..row_sum.len()];
                row_sum.iter_mut().zip(pixels).for_each(|(sum, j)| *sum += cost(j - t));
            }
            total.iter_mut().zip(&row_sum).for_each(|(total, sum)| *total += f64::from(*sum));
        }
        out.iter_mut().zip(&total).for_each(|(out, total)| *out = (-total / count) as f32);
    });
    Some(grid.surface(scores, 0))
}
