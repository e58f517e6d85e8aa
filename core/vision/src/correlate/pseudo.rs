//! Pseudo-normalised cross-correlation (Moravec 1980), as in the visual odometry of the Mars Exploration Rovers.
//!
//! ```text
//! pnc = 2 Σ t j / (Σ t² + Σ j²)        t, j: template and window, each minus its mean
//! ```
//! Its magnitude is at most that of the normalised correlation, and equal for equal contrast. Two windows without
//! contrast score 0. Sums are in `f64`, position by position: twenty times the time of `zncc`.
//!
//! Source: domain.md 9.2.

use super::surface::Surface;
use crate::image::{GrayImage, Patch, PixelRect};

/// Least mean square of template and window together that counts as contrast, (fraction of full scale)².
const FLAT: f64 = 1e-12;

/// Scores of a square template with an odd side at every position whose window is inside `region` and the image.
///
/// `None` if the template is not square, has an even side or an invalid pixel, or fits at no position. A position whose
/// window touches an invalid pixel is excluded.
pub fn pseudo_surface(template: &Patch, image: &GrayImage, region: PixelRect) -> Option<Surface> {
    let size = template.width();
    if template.height() != size || size.is_multiple_of(2) || !template.is_complete() {
        return None;
    }
    let region = region.intersect(&PixelRect::whole(image.width(), image.height()))?;
    let width = (region.width + 1).checked_sub(size).filter(|w| *w > 0)?;
    let height = (region.height + 1).checked_sub(size).filter(|h| *h > 0)?;
    let values: Vec<f64> = template.as_raw().iter().copied().map(f64::from).collect();
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let values: Vec<f64> = values.iter().map(|value| value - mean).collect();
    let own: f64 = values.iter().map(|value| value * value).sum();
    let mut flat_positions = 0;
    let mut scores = Vec::with_capacity(width as usize * height as usize);
    for (iy, ix) in (0..height).flat_map(|iy| (0..width).map(move |ix| (iy, ix))) {
        let first = [region.x as usize + ix as usize, region.y as usize + iy as usize];
        let (mut sum, mut squares, mut product) = (0.0, 0.0, 0.0);
        for (row, line) in values.chunks_exact(size as usize).enumerate() {
            let start = (first[1] + row) * image.width() as usize + first[0];
            for (t, j) in line.iter().zip(&image.as_raw()[start..]) {
                let j = f64::from(*j);
                sum += j;
                squares += j * j;
                product += t * j;
            }
        }
        let other = (squares - sum * sum / count).max(0.0);
        // The template has zero mean, so that the window's does not affect the product. Invalid pixels are NaN.
        let is_flat = own + other < FLAT * count;
        flat_positions += u32::from(is_flat);
        scores.push(if is_flat { 0.0 } else { (2.0 * product / (own + other)) as f32 });
    }
    let half = (size / 2) as i32;
    let origin = [region.x + half, region.y + half];
    Some(Surface { origin, width, height, scores, flat_positions, template_size: size })
}

#[cfg(test)]
mod tests {
    use image::Luma;
    use sightline_geometry::frames::Pixel;

    use super::*;
    use crate::correlate::zncc::zncc_surface;
    use crate::image::patch::extract;
    use crate::image::sample::Kernel;

    fn textured(gain: f32) -> GrayImage {
        GrayImage::from_fn(40, 40, |x, y| {
            let (x, y) = (x as f32, y as f32);
            Luma([0.5 + gain * ((0.9 * x + 0.2 * y * y * 0.1).sin() + (0.7 * y - 0.3 * x).cos())])
        })
    }

    #[test]
    fn a_window_scores_one_at_itself_and_no_more_than_the_normalised_correlation() {
        let image = textured(0.1);
        let template = extract(&image, Pixel::new(17.0, 21.0), 4, Kernel::Bicubic);
        let whole = PixelRect::whole(40, 40);
        let (ours, normalised) = (
            pseudo_surface(&template, &image, whole).unwrap(),
            zncc_surface(&template, &image, whole).unwrap(),
        );
        let (ix, iy, score) = ours.maximum().unwrap();
        assert_eq!(ours.pixel_of(ix, iy), Pixel::new(17.0, 21.0));
        assert!((score - 1.0).abs() < 1e-6);
        let pairs = || ours.scores.iter().zip(&normalised.scores);
        assert!(pairs().all(|(a, b)| a.abs() <= b.abs() + 1e-4));
        assert!(pairs().any(|(a, b)| a.abs() < b.abs() - 1e-3));
    }

    #[test]
    fn twice_the_contrast_scores_four_fifths() {
        // 2 · 2 / (1 + 4).
        let template = extract(&textured(0.1), Pixel::new(17.0, 21.0), 4, Kernel::Bicubic);
        let at = PixelRect::centred(Pixel::new(17.0, 21.0), 9);
        let score = pseudo_surface(&template, &textured(0.2), at).unwrap().scores[0];
        assert!((score - 0.8).abs() < 1e-5, "{score}");
    }

    #[test]
    fn flat_windows_score_zero_and_invalid_ones_are_excluded() {
        let flat = GrayImage::from_pixel(20, 20, Luma([0.3]));
        let template = extract(&flat, Pixel::new(10.0, 10.0), 2, Kernel::Bicubic);
        let surface = pseudo_surface(&template, &flat, PixelRect::whole(20, 20)).unwrap();
        assert!(surface.scores.iter().all(|score| *score == 0.0) && surface.flat_positions == 16 * 16);
        let mut holed = textured(0.1);
        holed.put_pixel(20, 20, Luma([f32::NAN]));
        let template = extract(&textured(0.1), Pixel::new(10.0, 10.0), 2, Kernel::Bicubic);
        let surface = pseudo_surface(&template, &holed, PixelRect::whole(40, 40)).unwrap();
        assert_eq!(surface.scores.len() - surface.valid_positions(), 25);
    }
}
