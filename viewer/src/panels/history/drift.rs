//! How far the tracked point has crept: an earlier window, mapped to how it should look now, searched for in the
//! present one (R72).
//!
//! ```text
//! G_n = A_n G_t(n),  G_pick = I          A_n: image_from_template of step n, t(n): the step of its template
//! now_from_then = G_now G_then⁻¹         px per px, about the windows' middles
//! ```
//! The earlier window is warped by that map, its inner part correlated over the present window, and the distance of
//! the peak from the middle is the shift: what the updates between the two steps have added to each other.

use nalgebra::Matrix2;
use sightline_core::correlate::peak::find_peak;
use sightline_core::correlate::zncc::zncc_surface;
use sightline_core::frames::Pixel;
use sightline_core::image::patch::warp;
use sightline_core::image::sample::Kernel;
use sightline_core::image::{GrayImage, Patch, PixelRect};
use sightline_core::session::view::RunView;

use crate::state::State;

/// Sides of the inner part that is compared, px, the largest that the warped window fills first.
const SIDES_PX: [u32; 4] = [15, 13, 11, 9];

/// The present view against one earlier window.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The earlier step.
    pub step: usize,
    /// The best score within reach.
    pub score: f64,
    /// How far from the middle it lies, px of the present image.
    pub shift_px: f64,
}

/// How offsets in the window of step `then` appear at step `now`; none where a record on the way is not loaded.
pub fn now_from_then(state: &State, run: &RunView, then: usize, now: usize) -> Option<Matrix2<f64>> {
    let pick = run.rows.first()?.step;
    Some(from_pick(state, pick, now)? * from_pick(state, pick, then)?.try_inverse()?)
}

/// How offsets at the pick appear at a step.
fn from_pick(state: &State, pick: usize, step: usize) -> Option<Matrix2<f64>> {
    let (mut step, mut map) = (step, Matrix2::identity());
    while step > pick {
        let prepared = state.trace_at(step).ready()?.template()?.scale_roll.as_ref()?;
        map *= prepared.image_from_template;
        // A template is always older than the step that matches it.
        step = Some(prepared.template_step).filter(|&template| template < step)?;
    }
    Some(map)
}

/// Searches the earlier window, as it should look now, in the present one; none where they have too little in common.
pub fn compare(
    step: usize,
    then: &GrayImage,
    now: &GrayImage,
    now_from_then: &Matrix2<f64>,
) -> Option<Comparison> {
    let middle = |image: &GrayImage| {
        Pixel::new((f64::from(image.width()) - 1.0) / 2.0, (f64::from(image.height()) - 1.0) / 2.0)
    };
    let fitting =
        SIDES_PX.iter().map(|&side| warp(then, middle(then), now_from_then, side, Kernel::Bilinear));
    let inner = fitting.into_iter().find(Patch::is_complete)?;
    let surface = zncc_surface(&inner, now, PixelRect::whole(now.width(), now.height()))?;
    let peak = find_peak(&surface, true)?;
    Some(Comparison { step, score: peak.score, shift_px: peak.pixel.distance(middle(now)) })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A texture with features of a few pixels, magnified by `scale` about the window's middle and moved by `dx`.
    fn window(scale: f64, dx: f64) -> GrayImage {
        GrayImage::from_fn(21, 21, |x, y| {
            let (u, v) = ((f64::from(x) - 10.0 - dx) / scale, (f64::from(y) - 10.0) / scale);
            let value = (0.9 * u + 0.3).sin() * (0.7 * v).cos() + 0.5 * (0.4 * u - 0.8 * v).sin();
            image::Luma([(0.5 + 0.2 * value) as f32])
        })
    }

    #[test]
    fn a_view_that_crept_by_a_pixel_and_a_half_says_so() {
        let map = Matrix2::identity() * 1.25;
        let same = compare(3, &window(1.0, 0.0), &window(1.25, 0.0), &map).unwrap();
        assert!(same.score > 0.995 && same.shift_px < 0.03, "{same:?}");
        let crept = compare(3, &window(1.0, 0.0), &window(1.25, 1.5), &map).unwrap();
        assert!(crept.score > 0.99 && (crept.shift_px - 1.5).abs() < 0.03, "{crept:?}");
    }

    #[test]
    fn windows_with_too_little_in_common_are_not_compared() {
        assert!(compare(0, &window(1.0, 0.0), &window(1.0, 0.0), &(Matrix2::identity() * 0.2)).is_none());
    }
}
