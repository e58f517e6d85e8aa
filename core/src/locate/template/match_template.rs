//! Step `match_template`: the prepared template over the search window of the left image (K§4.3.2, R62–R68).
//!
//! The search window is the square image region in which the whole template must lie, centred on the
//! prediction; its surface of scores is exhaustive. The match is the peak, refined below the pixel by a
//! quadratic fit (R67), and then followed to the next maximum of scores that count the window's centre most
//! (`correlate::focus`); where there is none, the peak stands. The second peak at least half a template away is reported as a warning (R68).

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::match_noise::match_noise;
use super::scale_roll::ScaleRoll;
use super::settings::TemplateSettings;
use crate::correlate::Focus;
use crate::correlate::peak::{self, Peak, SecondPeak};
use crate::correlate::zncc::{self, Surface};
use crate::frames::Pixel;
use crate::image::patch::{self, Patch};
use crate::image::sample::Kernel;
use crate::image::{GrayImage, PixelRect};
use crate::locate::LocateInput;

/// The match of the template in the left image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TemplateMatch {
    /// The region searched, cut to the image: the whole template lies in it.
    pub search_window: PixelRect,
    /// How many positions were compared.
    pub positions: u32,
    /// How many of them had no contrast.
    pub flat_positions: u32,
    /// The best match of the whole window.
    pub peak: Peak,
    /// Where the target is: the best match in focus, or `peak` where there is no focus, px.
    pub pixel: Pixel,
    /// The score in focus at `pixel`; null where the peak of the whole window stands.
    pub focused_score: Option<f64>,
    /// The next best, at least half a template away.
    pub second_peak: Option<SecondPeak>,
    /// Covariance of this match alone, px².
    #[schema(value_type = Vec<f64>)]
    pub covariance_px2: Matrix2<f64>,
    /// What the surface's slope, which scale and roll leave out, adds to this match, px.
    #[schema(value_type = [f64; 2])]
    pub bias_px: Vector2<f64>,
    /// Scores of all positions.
    #[serde(skip)]
    #[schema(ignore)]
    pub surface: Surface,
    /// The image at the match.
    #[serde(skip)]
    #[schema(ignore)]
    pub matched: Patch,
    /// Matched patch minus template, both normalised to zero mean and unit deviation.
    #[serde(skip)]
    #[schema(ignore)]
    pub difference: Patch,
}

/// Finds the prepared template around the prediction.
///
/// # Errors
/// A sentence saying why no position could be compared.
pub fn match_template(
    prepared: &ScaleRoll,
    input: &LocateInput<'_>,
    settings: &TemplateSettings,
) -> Result<TemplateMatch, String> {
    let image = input.capture.pair.left.as_ref();
    let predicted =
        input.pointing.predicted_left.ok_or("the predicted target lies behind the left camera")?;
    let growth = settings.lost_search_growth.powi(input.lost_count as i32);
    let side = (f64::from(settings.search_window_px) * growth).round() as u32 | 1;
    let search_window = PixelRect::centred(predicted, side)
        .intersect(&PixelRect::whole(image.width(), image.height()))
        .ok_or("the predicted target lies outside the left image")?;
    let surface = zncc::zncc_surface(&prepared.rolled, image, search_window).ok_or(
        "no position of the search window can hold the template: it reaches over the border of an image",
    )?;
    let peak = peak::find_peak(&surface, settings.sub_pixel).ok_or("no valid score in the search window")?;
    let second_peak = peak::second_peak(&surface, &peak, f64::from(settings.template_size_px) / 2.0);
    let focus = Focus::new(settings.template_size_px, settings.focus_px);
    let focused = refine(&focus, &prepared.rolled, image, &peak, settings);
    let pixel = focused.map_or(peak.pixel, |(pixel, _)| pixel);
    let matched = patch::extract(image, pixel, settings.template_size_px / 2, settings.kernel);
    let noise = match_noise(&prepared.rolled, &matched, &prepared.misfit(), &focus);
    let difference = patch::normalised_difference(&matched, &prepared.rolled);
    Ok(TemplateMatch {
        search_window,
        positions: surface.width * surface.height,
        flat_positions: surface.flat_positions,
        covariance_px2: noise.covariance_px2,
        bias_px: noise.bias_px,
        peak,
        pixel,
        focused_score: focused.map(|(_, score)| score),
        second_peak,
        surface,
        matched,
        difference,
    })
}

/// The maximum in focus beside the peak of the whole window, with its score.
fn refine(
    focus: &Focus,
    template: &Patch,
    image: &GrayImage,
    peak: &Peak,
    settings: &TemplateSettings,
) -> Option<(Pixel, f64)> {
    if focus.is_even() {
        return None;
    }
    let [x, y] = peak.integer.map(f64::from);
    let whole = Pixel::new(x, y);
    let half = settings.template_size_px / 2;
    let window_at = |dx: i32, dy: i32| {
        // At whole pixels every kernel gives the pixels themselves.
        let centre = whole.offset(f64::from(dx), f64::from(dy));
        Some(patch::extract(image, centre, half, Kernel::Bilinear))
    };
    let found = focus.climb(template, settings.sub_pixel, window_at)?;
    Some((whole.offset(found.offset_px.x, found.offset_px.y), found.score))
}
