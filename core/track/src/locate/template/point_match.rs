//! Point stereo without slope and noise, for maps that match many pixels.
//!
//! The search along the epipolar curve and the left–right check are those of `point_stereo` for a surface that faces the
//! left camera. It does not measure the surface slope or the covariance, so its score may be lower on a slope.

use nalgebra::RowVector2;

use super::failure::TemplateFailure;
use super::point_stereo::{Found, curve, left_again, search_interval};
use super::settings::TemplateSettings;
use super::stereo_input::StereoInput;
use super::stereo_search::{StereoTemplate, Windows};
use sightline_vision::correlate::Focus;
use sightline_vision::image::patch;

/// A match on the epipolar curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointMatch {
    /// Normalised correlation.
    pub score: f64,
    /// Range along the left ray, m.
    pub range_m: f64,
    /// Distance between the left pixel and the match of the right one in the left image, px; `None` without such a match.
    pub left_right_px: Option<f64>,
    /// Whether the match is at an end of the searched interval.
    pub at_end: bool,
}

/// Matches the left pixel in the right image.
///
/// # Errors
/// [`TemplateFailure`] if there is nothing to compare.
pub fn point_match(
    input: &StereoInput<'_>,
    settings: &TemplateSettings,
) -> Result<PointMatch, TemplateFailure> {
    let half = settings.template_size_px / 2;
    let patch = patch::extract(input.left_image, input.left_pixel, half, settings.kernel);
    let focus = Focus::new(settings.template_size_px, settings.focus_px);
    let template = StereoTemplate::new(patch, &focus).ok_or(TemplateFailure::StereoWindowOutside)?;
    let curve = curve(input, settings).ok_or(TemplateFailure::RayUnseen)?;
    let windows = Windows {
        curve: &curve,
        template: &template,
        input,
        slope: RowVector2::zeros(),
        tolerance_px: settings.epipolar_tolerance_px,
        settings,
    };
    let interval = search_interval(&curve, input, settings)?;
    let best = windows.place(interval).ok_or(TemplateFailure::NoStereoWindow)?;
    let (right_pixel, range_m) = curve.at(best.along, best.across);
    let found = Found { right_pixel, range_m, right_from_left: windows.right_from_left(best.along) };
    let left_right_px =
        left_again(input, &found, &focus, settings).map(|left| left.distance(input.left_pixel));
    Ok(PointMatch { score: best.score, range_m, left_right_px, at_end: best.at_end })
}
