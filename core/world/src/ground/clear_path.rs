//! The strip of ground without high rocks for commanded drives (`rocks.clear_path`).
//!
//! The strip is a rectangle about the straight line from the first stop to the end of the path, extended at both ends by
//! the distance from the rover frame's origin to the outermost wheel. A rock is removed if its outline overlaps the strip
//! and it is higher than `above_m`. All rocks are placed first, so that the others are those of the world without the
//! strip.
//!
//! Frame: site, m. Sources: ours; papers.md R99 (rocks below 10 cm do not disturb an approach).

use crate::rover::suspension::{WHEEL_RADIUS_M, WHEELS_M};
use crate::scenario::ClearPath;

/// Distance from the rover frame's origin to the outermost point of a wheel, with a margin, m.
const WHEELS_REACH_M: f64 = WHEELS_M[0][0] + WHEEL_RADIUS_M + 0.1;

/// Whether a rock at `place_m` is removed; `reach_m` is the radius of its outline. The targets' centre is at `centre_m`,
/// the first stop at the origin.
pub(super) fn removes(
    path: &ClearPath,
    centre_m: [f64; 2],
    place_m: [f64; 2],
    reach_m: f64,
    height_m: f64,
) -> bool {
    let end_m = [centre_m[0] + path.to_x_m, centre_m[1] + path.to_y_m];
    let length_m = end_m[0].hypot(end_m[1]);
    let [cosine, sine] = if length_m > 0.0 { end_m.map(|side_m| side_m / length_m) } else { [1.0, 0.0] };
    let ahead_m = place_m[0] * cosine + place_m[1] * sine;
    let aside_m = (place_m[1] * cosine - place_m[0] * sine).abs();
    let is_along = ahead_m + reach_m > -WHEELS_REACH_M && ahead_m - reach_m < length_m + WHEELS_REACH_M;
    height_m > path.above_m && is_along && aside_m - reach_m < path.half_width_m
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_strip_follows_the_line_and_ends_beyond_its_wheels() {
        // Towards (6, 8): along is (0.6, 0.8), across is (−0.8, 0.6).
        let path = ClearPath { to_x_m: -4.0, to_y_m: 8.0, half_width_m: 1.0, above_m: 0.1 };
        let is_removed = |ahead_m: f64, aside_m: f64, reach_m: f64, height_m: f64| {
            let place_m = [0.6 * ahead_m - 0.8 * aside_m, 0.8 * ahead_m + 0.6 * aside_m];
            removes(&path, [10.0, 0.0], place_m, reach_m, height_m)
        };
        assert!(is_removed(5.0, 0.99, 0.0, 0.2) && !is_removed(5.0, 1.01, 0.0, 0.2));
        assert!(is_removed(5.0, -1.19, 0.2, 0.2) && !is_removed(5.0, -1.21, 0.2, 0.2));
        assert!(!is_removed(5.0, 0.0, 0.2, 0.1) && is_removed(5.0, 0.0, 0.2, 0.101));
        for (ahead_m, inside) in [(-0.9, true), (-1.0, false), (10.9, true), (11.0, false)] {
            assert_eq!(is_removed(ahead_m, 0.5, 0.0, 0.2), inside, "{ahead_m}");
        }
    }
}
