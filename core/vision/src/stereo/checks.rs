//! Gates of a disparity; the first one that a pixel fails is its outcome.
//!
//! ```text
//! both pixels are valid  →  t ≥ t_min (`texture`)  →  unique (`winner`)  →  | d − d_R(x − d) | ≤ limit  →  no speckle
//! ```
//! d_R is the disparity that the right image's pixel finds among the same sums. Pixels of a surface that is occluded in
//! the right image match pixels that have better partners of their own.

use super::row::RowResult;
use super::scene::Scene;
use super::subpixel::fraction;
use super::{DisparityMap, Outcome, speckle};

/// Writes the disparities and outcomes of row `y`; `texture` is that of the row, empty if the gate is off.
pub(super) fn finish_row(
    scene: &Scene<'_>,
    (y, row): (usize, &RowResult),
    texture: &[f32],
    disparities: &mut [f32],
    outcomes: &mut [Outcome],
) {
    let settings = scene.settings;
    let (left_is_none, right_is_none) = (scene.left.is_none(y), scene.right.is_none(y));
    let (texture_min, has_rivals) = (settings.texture_min as f32, settings.uniqueness_min > 0.0);
    let apart_max = settings.left_right_max_px;
    for (x, pixel) in row.pixels.iter().enumerate() {
        let apart = pixel.index().abs_diff(usize::from(row.right_index[x])) as f64;
        let partner = (scene.first + pixel.index()).wrapping_sub(x + scene.margin);
        outcomes[x] = if left_is_none[x] != 0 || right_is_none.get(partner).is_none_or(|none| *none != 0) {
            Outcome::Outside
        } else if texture.get(x).is_some_and(|texture| *texture < texture_min) {
            Outcome::NoTexture
        } else if has_rivals && !pixel.is_unique() {
            Outcome::NotUnique
        } else if apart_max >= 0.0 && apart > apart_max {
            Outcome::LeftRight
        } else {
            let whole = (settings.disparity_first_px + pixel.index() as i32) as f32;
            disparities[x] = whole + pixel.three().map_or(0.0, fraction);
            Outcome::Found
        };
    }
}

/// Removes the disparities of small patches.
pub(super) fn remove_speckles(map: &mut DisparityMap, least: usize, step_px: f32) {
    for pixels in speckle::small_patches(&map.disparity_px, map.width as usize, least, step_px) {
        map.disparity_px[pixels.clone()].fill(f32::NAN);
        map.outcome[pixels].fill(Outcome::Speckle);
    }
}
