//! Relief: the ranges of the target's neighbours, each by point stereo (R21, R220).
//!
//! The neighbours form a grid of three by three. Each is matched with a window of half the template's side that is
//! wholly inside the template's, so that it contains nothing beside the target. A neighbour without a reliable match
//! has no range.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::point_stereo::{StereoInput, point_stereo};
use super::settings::TemplateSettings;
use sightline_geometry::frames::{Pixel, Point3};

/// Smallest score of a neighbour with a range.
const SCORE_MIN: f64 = 0.6;

/// The surface around a target.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Relief {
    /// The target in the rover frame of its stop, m.
    #[schema(value_type = [f64; 3])]
    pub middle: Point3,
    /// Its neighbours in the window with a reliable match, m.
    #[schema(value_type = Vec<[f64; 3]>)]
    pub neighbours: Vec<Point3>,
}

/// Half the side of a neighbour's window, px.
fn half_window(size: u32) -> u32 {
    ((size / 2) | 1) / 2
}

/// The offsets of the eight neighbours in a template of `size` px, row by row, px.
pub(super) fn around(size: u32) -> Vec<[f64; 2]> {
    let reach_px = f64::from(size / 2 - half_window(size));
    let offsets = [-reach_px, 0.0, reach_px];
    let all = offsets.iter().flat_map(|v| offsets.iter().map(move |u| [*u, *v]));
    all.filter(|offset| *offset != [0.0, 0.0]).collect()
}

/// The range at a pixel of the left image, m, near `range_m`; `None` without a reliable match.
pub(super) fn range_at(
    input: &StereoInput<'_>,
    left_pixel: Pixel,
    range_m: f64,
    settings: &TemplateSettings,
) -> Option<f64> {
    let narrow = TemplateSettings {
        template_size_px: 2 * half_window(settings.template_size_px) + 1,
        surface_warp: false,
        focus_px: 0.0,
        ..settings.clone()
    };
    let near = StereoInput { left_pixel, predicted_range_m: Some(range_m), ..*input };
    let found = point_stereo(&near, &narrow).ok()?;
    (found.score >= SCORE_MIN && !found.at_end).then_some(found.range_m)
}
