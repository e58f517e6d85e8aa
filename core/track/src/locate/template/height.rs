//! The height term of Rocky 7's tracker: relief beside intensity (R220); off by default.
//!
//! If the appearance of the target is repetitive, its shape may not be. The relief of the template is measured when
//! it is taken: the points of eight neighbours around the target (`relief`). Carried into the current rover frame,
//! they predict the pixels of the neighbours and their ranges relative to the target. At each of the highest maxima
//! of the score map the same is measured by stereo, and
//! ```text
//! agreement = 1 − min(1, rms(h_expected − h_measured) / height_scale_m)          h = R − R_target
//! total     = (1 − w) · score + w · agreement
//! ```
//! decides between them; the sub-pixel position remains that of the scores. With fewer than three neighbours that
//! have both heights, the agreement is 0. The scale must include stereo's own error, R²σ_d/(f B): a few centimetres at 5 m.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | w | `height_weight` | – |
//! | R | range along the left ray | m |

use super::first_match::FirstMatch;
pub use super::first_match::WeighedPeak;
use super::point_stereo::StereoInput;
pub use super::relief::Relief;
use super::relief::{around, range_at};
use super::settings::TemplateSettings;
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_record::{Declaration, Record, Unit};
use sightline_vision::correlate::peak;

/// Number of maxima compared.
const CANDIDATES: usize = 5;

/// Smallest number of neighbours with both heights; with fewer, the agreement is 0.
const POINTS_MIN: usize = 3;

/// Measures the relief about the left pixel of `input`, whose point is at `range_m`; `None` if stereo rejects it.
pub(super) fn relief(input: &StereoInput<'_>, range_m: f64, settings: &TemplateSettings) -> Option<Relief> {
    let point = |pixel: Pixel, near_m: f64| -> Option<Point3> {
        Some(input.left.ray(pixel)?.at(range_at(input, pixel, near_m, settings)?))
    };
    let neighbours = around(settings.template_size_px)
        .into_iter()
        .filter_map(|[u, v]| point(input.left_pixel.offset(u, v), range_m))
        .collect();
    Some(Relief { middle: point(input.left_pixel, range_m)?, neighbours })
}

/// A predicted neighbour: offset from the target, px, and range relative to the target's, m.
struct Expected {
    offset_px: [f64; 2],
    height_m: f64,
}

/// Predicts a relief in the current left camera: the range of the target, m, and its neighbours.
fn expected(then: &Relief, now_from_then: &Pose, input: &StereoInput<'_>) -> Option<(f64, Vec<Expected>)> {
    let range_m = |point: &Point3| (point - input.left.model.centre()).norm();
    let middle = now_from_then * then.middle;
    let at = input.left.project(&middle)?;
    let expect = |point: &Point3| {
        let point = now_from_then * point;
        let pixel = input.left.project(&point)?;
        let height_m = range_m(&point) - range_m(&middle);
        Some(Expected { offset_px: [pixel.x - at.x, pixel.y - at.y], height_m })
    };
    Some((range_m(&middle), then.neighbours.iter().filter_map(expect).collect()))
}

/// Moves the match to the maximum with the best total of score and relief; returns all maxima compared.
pub(super) fn weigh(
    first: &mut FirstMatch,
    then: &Relief,
    now_from_then: &Pose,
    input: &StereoInput<'_>,
    settings: &TemplateSettings,
) -> Vec<WeighedPeak> {
    let weight = settings.height_weight;
    let Some((range_m, neighbours)) = expected(then, now_from_then, input) else { return Vec::new() };
    let mut weighed: Vec<(WeighedPeak, [i32; 2])> = Vec::new();
    for (place, score) in peak::highest_maxima(&first.surface, CANDIDATES) {
        let pixel = Pixel::new(f64::from(place[0]), f64::from(place[1]));
        let differences = differences(input, pixel, range_m, &neighbours, settings);
        let agreement = agreement(&differences, settings.height_scale_m);
        let score = f64::from(score);
        let total = (1.0 - weight) * score + weight * agreement;
        weighed.push((WeighedPeak { pixel, score, agreement, total }, place));
    }
    // The first maximum, which has the highest score, wins among equals.
    let best = weighed.iter().fold(None::<&(WeighedPeak, [i32; 2])>, |best, candidate| match best {
        Some(best) if best.0.total >= candidate.0.total => Some(best),
        _ => Some(candidate),
    });
    let index = best.and_then(|(_, place)| first.surface.index_of(place[0], place[1]));
    if let Some(found) = index.and_then(|(ix, iy)| peak::peak_at(&first.surface, ix, iy, settings.sub_pixel))
    {
        first.peak = found;
    }
    weighed.into_iter().map(|(weighed, _)| weighed).collect()
}

/// Measured minus predicted heights about a pixel, m, for the neighbours that stereo accepts.
fn differences(
    input: &StereoInput<'_>,
    pixel: Pixel,
    range_m: f64,
    neighbours: &[Expected],
    settings: &TemplateSettings,
) -> Vec<f64> {
    let Some(middle_m) = range_at(input, pixel, range_m, settings) else { return Vec::new() };
    let difference = |expected: &Expected| {
        let [u, v] = expected.offset_px;
        let there_m = range_at(input, pixel.offset(u, v), middle_m + expected.height_m, settings)?;
        Some(there_m - middle_m - expected.height_m)
    };
    neighbours.iter().filter_map(difference).collect()
}

/// Agreement of two reliefs with these differences, 0 to 1.
fn agreement(differences_m: &[f64], scale_m: f64) -> f64 {
    if differences_m.len() < POINTS_MIN {
        return 0.0;
    }
    let squares: f64 = differences_m.iter().map(|d| d * d).sum();
    1.0 - ((squares / differences_m.len() as f64).sqrt() / scale_m).min(1.0)
}

impl Record for Relief {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("middle", Unit::Metre, |relief| relief.middle)
            .describe("The target in the rover frame of its stop.");
        r.field("neighbours", Unit::Metre);
        r.quantity("neighbour_count", Unit::One, |relief| relief.neighbours.len())
            .describe("Number of neighbours with a reliable height.");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_reliefs_agree_and_those_that_differ_by_the_scale_do_not() {
        assert_eq!(agreement(&[0.0; 8], 0.05), 1.0);
        assert!((agreement(&[0.025, -0.025, 0.025], 0.05) - 0.5).abs() < 1e-12);
        assert_eq!(agreement(&[0.025; 8], 0.025), 0.0);
        assert_eq!(agreement(&[0.0; 2], 0.05), 0.0);
    }
}
