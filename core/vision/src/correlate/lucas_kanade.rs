//! Gradient descent on the position of a window: Lucas & Kanade (1981), affine as Shi & Tomasi (1994) (R217, R218,
//! R222).
//!
//! The template T is fixed; the image J is sampled through the map `x = c + A o`, o the offset from the template's
//! centre. A step solves the least squares of the inverse compositional form (Baker & Matthews 2004),
//! ```text
//! min over δ, a, b   Σ ( T(o) + ∇T(o)·W(o) δ − a J(c + A o) − b )²        W = [1 | o_x 1 | o_y 1]
//! A ← A (1 + D)⁻¹,   c ← c − A d                                           δ = (d, D)
//! ```
//! A translation solves for d alone and leaves A unchanged. With `photometric`, gain a and bias b are solved for
//! together with the step, so that a change of light does not bias it; otherwise a = 1 and b = 0, as in the papers of
//! the two trackers. Steps end when the window's pixels move less than `stop_px`, or after `iterations`.
//!
//! From a pyramid's coarsest level down, each level starts where the last one ended.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | c | `Placed::centre` | px |
//! | A | `Placed::map` | px per px |
//! | d, D | step | px, px per px |

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

use crate::image::GrayImage;
use crate::image::gradient;
use crate::image::patch::{self, Patch};
use crate::image::pyramid;
use crate::image::sample::Kernel;
use sightline_geometry::frames::Pixel;

/// Reason why a descent found no minimum.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DescentFailure {
    /// The template extends over the border of its image.
    #[error("the template reaches over the border of its image")]
    TemplateOutside,
    /// The normal equations are singular.
    #[error("the window has too little texture to descend on")]
    TooLittleTexture,
    /// A step inverted the window.
    #[error("the descent folded the window")]
    Folded,
    /// The window left the image.
    #[error("the descent left the image")]
    LeftImage,
    /// A step was too long.
    #[error("the descent diverged")]
    RanAway,
}

/// Unknowns of a step: two of the translation, four of the map, gain and bias.
const UNKNOWNS: usize = 8;

/// Unknowns and stopping rule of a descent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Descend {
    /// Whether to solve for the map A in addition to the translation.
    pub affine: bool,
    /// Whether to solve for gain and bias.
    pub photometric: bool,
    /// Largest number of steps at each level.
    pub iterations: u32,
    /// A step that moves the window's pixels by less ends the level, px.
    pub stop_px: f64,
}

/// Position and shape of a window in an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// Position of the centre, px.
    pub centre: Pixel,
    /// Maps offsets from the centre into the image, px per px.
    pub map: Matrix2<f64>,
    /// Number of steps, over all levels.
    pub iterations: u32,
    /// RMS difference of template and window at the last step, fractions of full scale.
    pub residual: f64,
}

impl Placed {
    /// A window without rotation or stretch, centred at a pixel.
    pub fn at(centre: Pixel) -> Self {
        Self { centre, map: Matrix2::identity(), iterations: 0, residual: 0.0 }
    }

    /// The `size` × `size` window of `image`, resampled to the template's frame.
    pub fn window(&self, image: &GrayImage, size: u32, kernel: Kernel) -> Patch {
        patch::resample_through(image, size, kernel, |o| {
            let moved = self.map * o;
            Some(self.centre.offset(moved.x, moved.y))
        })
    }
}

/// Side of the template at the levels of the pyramid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Footprint {
    /// The same number of pixels at every level, so that coarse levels cover more of the surroundings.
    SamePixels(u32),
    /// The same part of the scene at every level.
    SameScene(u32),
}

impl Footprint {
    fn size(self, level: usize) -> u32 {
        match self {
            Self::SamePixels(size) => size,
            Self::SameScene(size) => ((size / 2) >> level) * 2 + 1,
        }
    }

    /// Side of the patch required by all levels, with its centre on a pixel of every level, px.
    pub fn wide_px(self, levels: usize) -> u32 {
        let coarsest = levels.saturating_sub(1);
        // Two pixels for the blur of the pyramid and one for the gradient.
        2 * ((self.size(coarsest) / 2 + 3) << coarsest) + 1
    }
}

/// Descends from `start` at the coarsest of `levels` to the finest.
///
/// `wide` is the template with surroundings of [`Footprint::wide_px`].
///
/// # Errors
/// [`DescentFailure`]: no contrast, a window outside the image, or divergence.
pub fn descend(
    wide: &Patch,
    footprint: Footprint,
    levels: usize,
    image: &GrayImage,
    start: Placed,
    options: &Descend,
) -> Result<Placed, DescentFailure> {
    let templates = pyramid::pyramid(wide.image().clone(), levels);
    let images = pyramid::pyramid(image.clone(), levels);
    let mut place = start;
    for level in (0..levels.min(templates.len()).min(images.len())).rev() {
        let scale = f64::from(1_u32 << level);
        let coarse = Placed { centre: pyramid::at_level(place.centre, level), ..place };
        let found = patch::middle(&Patch::from(templates[level].clone()), footprint.size(level) + 2)
            .filter(Patch::is_complete)
            .ok_or(DescentFailure::TemplateOutside)
            .and_then(|template| solve(&template, &images[level], coarse, options));
        match found {
            Ok(found) => {
                place =
                    Placed { centre: Pixel::new(found.centre.x * scale, found.centre.y * scale), ..found };
            }
            // A coarse level only improves the start: near a border there may be one level fewer.
            Err(_) if level > 0 => {}
            Err(missing) => return Err(missing),
        }
    }
    Ok(place)
}

/// Runs the steps of one level; the rim of `template` is used for its gradients only.
fn solve(
    template: &Patch,
    image: &GrayImage,
    start: Placed,
    options: &Descend,
) -> Result<Placed, DescentFailure> {
    let size = template.width() - 2;
    let (gx, gy) = gradient::central(template);
    let half = f64::from(size / 2);
    let mut place = start;
    for _ in 0..options.iterations {
        let window = place.window(image, size, Kernel::Bicubic);
        if !window.is_complete() {
            return Err(DescentFailure::LeftImage);
        }
        let mut normal = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
        let mut right = SVector::<f64, UNKNOWNS>::zeros();
        let (mut squares, mut count) = (0.0, 0.0);
        for (x, y, pixel) in window.enumerate_pixels() {
            let o = Vector2::new(f64::from(x) - half, f64::from(y) - half);
            let g = [gx.get_pixel(x + 1, y + 1)[0], gy.get_pixel(x + 1, y + 1)[0]].map(f64::from);
            let (t, j) = (f64::from(template.get_pixel(x + 1, y + 1)[0]), f64::from(pixel[0]));
            let row = SVector::from([g[0], g[1], g[0] * o.x, g[1] * o.x, g[0] * o.y, g[1] * o.y, -j, -1.0]);
            // With gain 1 and bias 0 the image is on the right-hand side.
            let value = if options.photometric { -t } else { j - t };
            normal += row * row.transpose();
            right += row * value;
            squares += (j - t) * (j - t);
            count += 1.0;
        }
        let step = step(normal, right, options).ok_or(DescentFailure::TooLittleTexture)?;
        place.residual = f64::sqrt(squares / count);
        place.iterations += 1;
        let (d, change) = (Vector2::new(step[0], step[1]), Matrix2::new(step[2], step[4], step[3], step[5]));
        let inverse = (Matrix2::identity() + change).try_inverse().ok_or(DescentFailure::Folded)?;
        let moved = place.map * inverse * d;
        place.map *= inverse;
        place.centre = place.centre.offset(-moved.x, -moved.y);
        let largest = d.norm() + change.norm() * half;
        if !largest.is_finite() || largest > f64::from(size) {
            return Err(DescentFailure::RanAway);
        }
        if largest < options.stop_px {
            break;
        }
    }
    Ok(place)
}

/// Solves the normal equations for the selected unknowns; the others are zero.
fn step(
    mut normal: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    mut right: SVector<f64, UNKNOWNS>,
    options: &Descend,
) -> Option<SVector<f64, UNKNOWNS>> {
    let is_solved = |index: usize| match index {
        0 | 1 => true,
        2..=5 => options.affine,
        _ => options.photometric,
    };
    for index in (0..UNKNOWNS).filter(|index| !is_solved(*index)) {
        normal.row_mut(index).fill(0.0);
        normal.column_mut(index).fill(0.0);
        normal[(index, index)] = 1.0;
        right[index] = 0.0;
    }
    // Unknowns in px and in px per px differ by orders of magnitude: each is scaled to 1.
    let scale = normal.diagonal().map(|d| if d > 1e-12 { 1.0 / d.sqrt() } else { 0.0 });
    if scale.iter().any(|s| *s == 0.0) {
        return None;
    }
    let scaled = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::from_fn(|r, c| normal[(r, c)] * scale[r] * scale[c]);
    let solved = scaled.cholesky()?.solve(&right.component_mul(&scale));
    Some(solved.component_mul(&scale)).filter(|step| step.iter().all(|v| v.is_finite()))
}

#[cfg(test)]
#[path = "lucas_kanade_tests.rs"]
mod tests;
