//! Triangulates the points of the disparities from the pixels of the real images and the true cameras.
//!
//! ```text
//! (x, y), (x − d, y) aligned  →  their positions in the real images  →  two rays  →  the midpoint     (triangulate)
//! ```
//! The aligned cameras only define the correspondence of pixels; distortion, toe-in and moving pupils are those of the
//! true models. Points are stored as `f32`: 4e-6 m at 50 m.
//!
//! Frame: the frame of the cameras (rover), m.

use rayon::prelude::*;

use super::align::Alignment;
use super::{DisparityMap, Outcome};
use sightline_geometry::camera::Camera;
use sightline_geometry::estimate::triangulate::midpoint;

/// Returns the point of every pixel, row by row, NaN without a disparity. Pixels farther than `range_max_m` from the
/// left camera, and those whose rays do not intersect, lose their disparity.
pub(super) fn points(
    map: &mut DisparityMap,
    alignment: &Alignment,
    [left, right]: [&Camera; 2],
    range_max_m: f64,
) -> Vec<[f32; 3]> {
    let width = map.width as usize;
    let mut points = vec![[f32::NAN; 3]; map.disparity_px.len()];
    let rows = map.disparity_px.par_chunks_mut(width.max(1)).zip(map.outcome.par_chunks_mut(width.max(1)));
    rows.zip(points.par_chunks_mut(width.max(1))).enumerate().for_each(
        |(y, ((disparities, outcomes), points))| {
            let (left_row, right_row) = (alignment.left_row(y as f64), alignment.right_row(y as f64));
            for x in 0..width {
                if outcomes[x] != Outcome::Found {
                    continue;
                }
                let at = x as f64;
                let rays =
                    left.ray(left_row.at(at)).zip(right.ray(right_row.at(at - f64::from(disparities[x]))));
                let met = rays.and_then(|(left, right)| midpoint(&left, &right));
                match met.filter(|met| met.range_left_m <= range_max_m) {
                    Some(met) => points[x] = [met.point.x, met.point.y, met.point.z].map(|v| v as f32),
                    None => (disparities[x], outcomes[x]) = (f32::NAN, Outcome::OutOfRange),
                }
            }
        },
    );
    points
}
