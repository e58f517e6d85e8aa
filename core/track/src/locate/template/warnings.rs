//! Warnings for an unsuitable target (R21): causes of bad tracking that are visible at the designation.
//!
//! | warning | measured | limit |
//! |---|---|---|
//! | `low_contrast` | standard deviation of the window | ≥ `warn_contrast` |
//! | `depth_range` | (farthest − nearest) / distance in the window | ≤ `warn_depth_range` |
//! | `occluding_boundary` | largest departure from a plane / distance | ≤ `warn_boundary` |
//! | `weak_stereo` | score of point stereo | ≥ `stereo_ncc_min` |
//! | `left_right` | distance between the left pixel and the match of its right pixel in the left image | ≤ `warn_left_right_px` |
//! | `shadow` | share of the window in shadow, if the simulator provides the light | ≤ `warn_shadow_share` |
//!
//! The ranges are those of the target and of eight neighbours in the window (`relief`). With fewer than five ranges
//! there is no warning about them. A plane in space has an inverse range that is linear over the image,
//! ```text
//! 1/R ≈ a + b u + c v
//! ```
//! and extends to the corners of the window: the depth range is that of the plane over the whole window, or of the
//! points if that is larger. The residuals of the fit are independent of the slope of the surface: they measure
//! relief, and a third of the step where two surfaces meet in the window.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | R | range along the left ray | m |
//! | u, v | offset from the target | px |

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::point_stereo::{PointStereo, StereoInput};
use super::relief;
use super::settings::TemplateSettings;
use crate::limits::Limits;
use crate::settings::Settings;
use sightline_vision::image::patch;

/// Smallest number of ranges for a warning about them; a plane takes three.
const POINTS_MIN: usize = 5;

/// The problem of a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WarningKind {
    /// The window has little texture.
    LowContrast,
    /// The ranges in the window differ widely.
    DepthRange,
    /// Two surfaces meet in the window.
    OccludingBoundary,
    /// Much of the window is in shadow.
    Shadow,
    /// Point stereo found no similar window, so that the range may be wrong.
    WeakStereo,
    /// The match of point stereo fails the left–right check, so that the range may be wrong.
    LeftRight,
}

/// One warning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Warning {
    /// The problem.
    pub kind: WarningKind,
    /// The measured value: px for `left_right`, a fraction for the others.
    pub value: f64,
    /// The limit that the value exceeds or falls below.
    pub limit: f64,
    /// The warning as a sentence for the user who designated the target.
    pub sentence: String,
}

/// Checks the window of a designated target at `range_m`, the range of this stereo match.
pub(super) fn look(
    input: &StereoInput<'_>,
    range_m: f64,
    stereo: &PointStereo,
    settings: &Settings,
) -> Vec<Warning> {
    let (limits, template) = (&settings.limits, &settings.template);
    let window =
        patch::extract(input.left_image, input.left_pixel, template.template_size_px / 2, template.kernel);
    let mut found = of_stereo(stereo, limits);
    if let Some(contrast) = window.std().filter(|std| *std < limits.warn_contrast) {
        let sentence = format!(
            "the window has little texture: its standard deviation is {:.2} % of full scale",
            100.0 * contrast
        );
        found.push(Warning {
            kind: WarningKind::LowContrast,
            value: contrast,
            limit: limits.warn_contrast,
            sentence,
        });
    }
    let ranges = ranges(input, range_m, template);
    if ranges.len() >= POINTS_MIN {
        let half_px = f64::from(template.template_size_px / 2);
        found.extend(of_ranges(&ranges, range_m, half_px, limits));
    }
    found
}

/// The warnings for a stereo match.
fn of_stereo(stereo: &PointStereo, limits: &Limits) -> Vec<Warning> {
    let mut found = Vec::new();
    let score = stereo.score;
    if score < limits.stereo_ncc_min {
        found.push(Warning {
            kind: WarningKind::WeakStereo,
            value: score,
            limit: limits.stereo_ncc_min,
            sentence: format!("weak stereo match: score {score:.2}, so that the range may be wrong"),
        });
    }
    if let Some(value) = stereo.left_right_px.filter(|apart_px| *apart_px > limits.warn_left_right_px) {
        found.push(Warning {
            kind: WarningKind::LeftRight,
            value,
            limit: limits.warn_left_right_px,
            sentence: format!(
                "the stereo match leads back to a pixel {value:.1} px away, so that the range may be wrong"
            ),
        });
    }
    found
}

/// The warning for a window with `share` of it in shadow.
pub fn of_shadow(share: f64, limits: &Limits) -> Option<Warning> {
    (share > limits.warn_shadow_share).then(|| Warning {
        kind: WarningKind::Shadow,
        value: share,
        limit: limits.warn_shadow_share,
        sentence: format!(
            "{:.0} % of the window is in shadow, which moves and changes the texture",
            100.0 * share
        ),
    })
}

/// A range at an offset from the target.
#[derive(Clone, Copy, Debug)]
pub struct Ranged {
    /// Offset to the right, px.
    pub u_px: f64,
    /// Offset downwards, px.
    pub v_px: f64,
    /// Range along the left ray, m.
    pub range_m: f64,
}

fn of_ranges(ranges: &[Ranged], distance_m: f64, half_px: f64, limits: &Limits) -> Vec<Warning> {
    let mut found = Vec::new();
    let Some(plane) = plane(ranges) else { return found };
    let reach = half_px * (plane[1].abs() + plane[2].abs());
    let nearest = ranges.iter().map(|r| r.range_m).fold(1.0 / (plane[0] + reach), f64::min);
    // A plane that reaches infinity inside the window counts only as far as the points.
    let corner_m = Some(1.0 / (plane[0] - reach)).filter(|r| *r > 0.0).unwrap_or(0.0);
    let farthest = ranges.iter().map(|r| r.range_m).fold(corner_m, f64::max);
    let spread = (farthest - nearest) / distance_m;
    if spread > limits.warn_depth_range {
        let sentence = format!(
            "the window holds ranges from {nearest:.2} m to {farthest:.2} m: it will look different from elsewhere"
        );
        found.push(Warning {
            kind: WarningKind::DepthRange,
            value: spread,
            limit: limits.warn_depth_range,
            sentence,
        });
    }
    if let Some(step) =
        Some(departure(&plane, ranges, distance_m)).filter(|step| *step > limits.warn_boundary)
    {
        let sentence = format!(
            "an occluding boundary runs through the window, or deep relief: ranges leave a plane by {:.0} % of the \
             distance",
            100.0 * step
        );
        found.push(Warning {
            kind: WarningKind::OccludingBoundary,
            value: step,
            limit: limits.warn_boundary,
            sentence,
        });
    }
    found
}

fn row(r: &Ranged) -> Vector3<f64> {
    Vector3::new(1.0, r.u_px, r.v_px)
}

/// Fits a plane to the ranges: a, b and c of the inverse range.
pub fn plane(ranges: &[Ranged]) -> Option<Vector3<f64>> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for point in ranges {
        normal += row(point) * row(point).transpose();
        right += row(point) / point.range_m;
    }
    Some(normal.try_inverse()? * right)
}

/// The largest residual of the inverse range from a plane, times the distance.
pub fn departure(plane: &Vector3<f64>, ranges: &[Ranged], distance_m: f64) -> f64 {
    let residual = |r: &Ranged| (1.0 / r.range_m - plane.dot(&row(r))).abs() * distance_m;
    ranges.iter().map(residual).fold(0.0, f64::max)
}

/// The ranges of the target and of its neighbours in the window.
fn ranges(input: &StereoInput<'_>, range_m: f64, settings: &TemplateSettings) -> Vec<Ranged> {
    let middle = Ranged { u_px: 0.0, v_px: 0.0, range_m };
    let neighbours = relief::around(settings.template_size_px).into_iter().filter_map(|[u_px, v_px]| {
        let range_m = relief::range_at(input, input.left_pixel.offset(u_px, v_px), range_m, settings)?;
        Some(Ranged { u_px, v_px, range_m })
    });
    std::iter::once(middle).chain(neighbours).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nine ranges, `range_m(u, v)`.
    fn grid(range_m: impl Fn(f64, f64) -> f64) -> Vec<Ranged> {
        let offsets = [-10.0, 0.0, 10.0];
        offsets
            .iter()
            .flat_map(|&v| offsets.iter().map(move |&u| (u, v)))
            .map(|(u_px, v_px)| Ranged { u_px, v_px, range_m: range_m(u_px, v_px) })
            .collect()
    }

    fn kinds(ranges: &[Ranged]) -> Vec<WarningKind> {
        of_ranges(ranges, 5.0, 10.0, &Limits::default()).into_iter().map(|w| w.kind).collect()
    }

    #[test]
    fn a_plane_however_steep_is_no_boundary_and_a_step_is() {
        let steep = grid(|u, v| 1.0 / (0.2 + 0.001 * u - 0.0004 * v));
        assert_eq!(kinds(&steep), [WarningKind::DepthRange]);
        assert!(departure(&plane(&steep).unwrap(), &steep, 5.0) < 1e-12);
        let step = grid(|u, _| if u > 0.0 { 6.0 } else { 5.0 });
        assert_eq!(kinds(&step), [WarningKind::DepthRange, WarningKind::OccludingBoundary]);
        // A third of the step of the inverse range, 1/5 − 1/6.
        assert!((departure(&plane(&step).unwrap(), &step, 5.0) - 5.0 / 90.0).abs() < 1e-12);
        assert!(kinds(&grid(|u, v| 5.0 + 0.005 * u + 0.002 * v)).is_empty());
    }
}
