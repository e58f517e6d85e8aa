//! Corner detection: pixels around which the image changes in every direction (Shi & Tomasi 1994; R217).
//!
//! ```text
//! G = mean over (2h + 1)² px of ∇I ∇Iᵀ          strength = smaller eigenvalue of G
//! ```
//! Gradients are central differences. A corner is a local maximum of the strength. The best one of every square cell of
//! the image comes first, so that corners are spread; then the others by strength, each at least a minimum distance from
//! the previous ones.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | G | structure tensor | (fraction of full scale per px)² |
//! | h | [`CornerSettings::half_px`] | px |

use pulp::Arch;

use crate::image::GrayImage;
use sightline_geometry::frames::Pixel;

/// Settings of the corner detector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CornerSettings {
    /// Half side of the window of the structure tensor, px.
    pub half_px: u32,
    /// Largest number of corners.
    pub count: usize,
    /// Least distance between two corners, px.
    pub spacing_px: f64,
    /// Width of the border without corners, px.
    pub border_px: u32,
    /// Least strength, (fraction of full scale per px)².
    pub strength_min: f32,
}

/// A corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// Position: a whole pixel.
    pub pixel: Pixel,
    /// Smaller eigenvalue of the structure tensor, (fraction of full scale per px)².
    pub strength: f32,
}

/// Detects the corners of an image, in the order of selection: the best of each cell, then the others.
///
/// A pixel whose window touches an invalid pixel is no corner.
pub fn corners(image: &GrayImage, settings: &CornerSettings) -> Vec<Corner> {
    let [width, height] = [image.width() as usize, image.height() as usize];
    // Two more pixels than the window: the gradient and the neighbours of a maximum.
    let border = (settings.border_px as usize).max(settings.half_px as usize + 2);
    if width <= 2 * border || height <= 2 * border || settings.count == 0 {
        return Vec::new();
    }
    let half = settings.half_px as usize;
    let strengths = Arch::new().dispatch(
        #[inline(always)]
        || strengths(image, half),
    );
    let mut maxima = Vec::new();
    for y in border..height - border {
        for x in border..width - border {
            let strength = strengths[y * width + x];
            // Comparisons with NaN are false.
            if strength >= settings.strength_min && is_maximum(&strengths, width, x, y) {
                maxima.push(Corner { pixel: Pixel::new(x as f64, y as f64), strength });
            }
        }
    }
    maxima.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    spread(&maxima, [width, height], settings)
}

/// Returns whether no neighbour is stronger; of equal ones the first in reading order counts.
fn is_maximum(strengths: &[f32], width: usize, x: usize, y: usize) -> bool {
    let at = y * width + x;
    let before = [at - width - 1, at - width, at - width + 1, at - 1];
    let after = [at + 1, at + width - 1, at + width, at + width + 1];
    before.iter().all(|&i| strengths[i] < strengths[at])
        && after.iter().all(|&i| strengths[i] <= strengths[at])
}

/// Selects the best of each cell, then the best of the rest, each at least `spacing_px` from the previous ones.
fn spread(maxima: &[Corner], [width, height]: [usize; 2], settings: &CornerSettings) -> Vec<Corner> {
    let cell_px = ((width * height) as f64 / settings.count as f64).sqrt().max(1.0);
    let columns = (width as f64 / cell_px).ceil() as usize;
    let cell =
        |corner: &Corner| (corner.pixel.y / cell_px) as usize * columns + (corner.pixel.x / cell_px) as usize;
    let mut has_one = vec![false; columns * (height as f64 / cell_px).ceil() as usize];
    let is_first = |corner: &&Corner| !std::mem::replace(&mut has_one[cell(corner)], true);
    let (first, rest): (Vec<&Corner>, Vec<&Corner>) = maxima.iter().partition(is_first);
    let mut kept = Kept::new([width, height], settings.spacing_px);
    for corner in first.into_iter().chain(rest) {
        if kept.corners.len() == settings.count {
            break;
        }
        kept.add_if_apart(corner);
    }
    kept.corners
}

/// Corners with a minimum distance, in a grid of cells of that width.
struct Kept {
    corners: Vec<Corner>,
    cells: Vec<Vec<usize>>,
    columns: usize,
    spacing_px: f64,
}

impl Kept {
    fn new([width, height]: [usize; 2], spacing_px: f64) -> Self {
        let spacing_px = spacing_px.max(1.0);
        let [columns, rows] = [width, height].map(|side| (side as f64 / spacing_px) as usize + 1);
        Self { corners: Vec::new(), cells: vec![Vec::new(); columns * rows], columns, spacing_px }
    }

    fn add_if_apart(&mut self, corner: &Corner) {
        let [column, row] = [corner.pixel.x, corner.pixel.y].map(|at| (at / self.spacing_px) as usize);
        let rows = self.cells.len() / self.columns;
        let near = |at: usize, count: usize| at.saturating_sub(1)..(at + 2).min(count);
        let is_near = |&other: &usize| self.corners[other].pixel.distance(corner.pixel) < self.spacing_px;
        let is_apart = near(row, rows).all(|row| {
            near(column, self.columns)
                .all(|column| !self.cells[row * self.columns + column].iter().any(is_near))
        });
        if is_apart {
            self.cells[row * self.columns + column].push(self.corners.len());
            self.corners.push(*corner);
        }
    }
}

/// The smaller eigenvalue at every pixel; NaN where the window leaves the image or touches an invalid pixel.
#[inline(always)]
fn strengths(image: &GrayImage, half: usize) -> Vec<f32> {
    let [width, height] = [image.width() as usize, image.height() as usize];
    let pixels = image.as_raw();
    let side = 2 * half + 1;
    let scale = 1.0 / (side * side) as f32;
    let mut strengths = vec![f32::NAN; width * height];
    // Sums of the products over the columns of a window, for the rows of one window at a time. A running sum would
    // accumulate errors and keep NaN of invalid pixels, so each row of windows sums its own rows of products.
    let empty = || [vec![f32::NAN; width], vec![f32::NAN; width], vec![f32::NAN; width]];
    let mut rows: Vec<[Vec<f32>; 3]> = (0..side).map(|_| empty()).collect();
    let (mut products, mut sums) = (empty(), empty());
    for y in 0..height {
        row_products(pixels, [width, height], y, &mut products);
        for (sum, product) in rows[y % side].iter_mut().zip(&products) {
            windowed(product, half, sum);
        }
        // The centre of the window whose last row this is.
        let Some(middle) = y.checked_sub(half).filter(|middle| *middle > half) else { continue };
        sums.iter_mut().for_each(|sum| sum.fill(0.0));
        for row in (y + 1 - side..=y).map(|y| &rows[y % side]) {
            for (sum, product) in sums.iter_mut().zip(row) {
                for (sum, product) in sum.iter_mut().zip(product) {
                    *sum += product;
                }
            }
        }
        let [xx, xy, yy] = &sums;
        let line = &mut strengths[middle * width..(middle + 1) * width];
        for (((strength, xx), xy), yy) in line.iter_mut().zip(xx).zip(xy).zip(yy) {
            let (mean, half_gap) = (0.5 * (xx + yy), 0.5 * (xx - yy));
            *strength = scale * (mean - (half_gap * half_gap + xy * xy).sqrt());
        }
    }
    strengths
}

/// The products of the gradients in a row: xx, xy, yy; NaN at the border.
#[inline(always)]
fn row_products(pixels: &[f32], [width, height]: [usize; 2], y: usize, products: &mut [Vec<f32>; 3]) {
    if y == 0 || y + 1 >= height || width < 3 {
        products.iter_mut().for_each(|product| product.fill(f32::NAN));
        return;
    }
    let row = |y: usize| &pixels[y * width..(y + 1) * width];
    let (above, here, below) = (row(y - 1), row(y), row(y + 1));
    let [xx, xy, yy] = products;
    for x in 1..width - 1 {
        let gx = 0.5 * (here[x + 1] - here[x - 1]);
        let gy = 0.5 * (below[x] - above[x]);
        xx[x] = gx * gx;
        xy[x] = gx * gy;
        yy[x] = gy * gy;
    }
}

/// Sums over the 2·half + 1 values around each; NaN where one is missing.
#[inline(always)]
fn windowed(values: &[f32], half: usize, sums: &mut [f32]) {
    let inner = &mut sums[half..values.len() - half];
    inner.fill(0.0);
    // One value of all windows at a time, so that the additions of neighbouring windows are vectorised.
    for shift in 0..=2 * half {
        for (sum, value) in inner.iter_mut().zip(&values[shift..]) {
            *sum += value;
        }
    }
}

#[cfg(test)]
mod tests {
    use image::Luma;

    use super::*;

    const SETTINGS: CornerSettings =
        CornerSettings { half_px: 2, count: 100, spacing_px: 6.0, border_px: 8, strength_min: 1e-4 };

    /// Bright squares of 12 px, 24 px apart, on black.
    fn squares(side: u32) -> GrayImage {
        GrayImage::from_fn(side, side, |x, y| Luma([f32::from(x % 24 < 12 && y % 24 < 12)]))
    }

    #[test]
    fn corners_of_squares_are_found_and_their_edges_are_not() {
        let found = corners(&squares(120), &SETTINGS);
        // Nine edges in each direction inside the border.
        assert_eq!(found.len(), 81, "{found:?}");
        for corner in &found {
            let off = |v: f64| {
                let at = v % 24.0;
                (at + 0.5).min((at - 11.5).abs()).min((at - 23.5).abs())
            };
            assert!(off(corner.pixel.x) <= 2.0 && off(corner.pixel.y) <= 2.0, "{corner:?}");
        }
    }

    #[test]
    fn an_edge_alone_and_a_flat_image_have_no_corner() {
        let edge = GrayImage::from_fn(64, 64, |x, _| Luma([f32::from(x > 30)]));
        assert!(corners(&edge, &SETTINGS).is_empty());
        assert!(corners(&GrayImage::from_pixel(64, 64, Luma([0.5])), &SETTINGS).is_empty());
        assert!(corners(&GrayImage::new(4, 4), &SETTINGS).is_empty());
    }

    #[test]
    fn few_corners_spread_over_the_image_though_one_half_is_stronger() {
        let strong = GrayImage::from_fn(120, 120, |x, y| {
            let value = f32::from(x % 12 < 4 && y % 12 < 4);
            Luma([if x < 60 { value } else { 0.3 * value }])
        });
        let found = corners(&strong, &CornerSettings { count: 16, ..SETTINGS });
        assert_eq!(found.len(), 16);
        let left = found.iter().filter(|corner| corner.pixel.x < 60.0).count();
        assert!((6..=10).contains(&left), "{left}");
        for (i, a) in found.iter().enumerate() {
            assert!(found[..i].iter().all(|b| a.pixel.distance(b.pixel) >= SETTINGS.spacing_px));
        }
    }

    #[test]
    fn no_corner_is_near_an_invalid_pixel() {
        let mut image = squares(120);
        image.put_pixel(56, 56, Luma([f32::NAN]));
        let found = corners(&image, &SETTINGS);
        assert!(found.iter().all(|c| (c.pixel.x - 56.0).abs().max((c.pixel.y - 56.0).abs()) > 3.0));
        assert!(found.len() > 50);
    }
}
