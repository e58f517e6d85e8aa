//! Step `match_template`: the prepared template in the left image (K§4.3.2, R62–R68, R216–R222).
//!
//! **First stage.** By default normalised correlation at every position of the search window: the square image region in
//! which the whole template must lie, centred on the prediction. `measure` takes another likeness, `search` visits fewer
//! positions, `first_stage` descends along the gradient instead (`klt`). The match is the peak of the measure's own
//! surface, refined below the pixel by a quadratic fit (R67); with `ncc` it is then followed to the next maximum of
//! scores that count the window's centre most (`correlate::focus`); where there is none, the peak stands. The second
//! peak at least half a template away is reported (R68).
//!
//! **Second stage.** With `refine = affine` an affine descent starts there (`affine`).
//!
//! **Score.** Whatever found the place, `judge` is given the normalised correlation there, of the window as the last stage
//! saw it: sums of differences grow with the contrast of the scene and the change of its light, so that no limit
//! fits all, and the papers' 0.7 is one of correlation. The measure's own value stands beside it, in `peak`.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::affine::{self, AffineRefinement};
use super::height::WeighedPeak;
use super::klt::{self, Descent};
use super::match_noise::{affine_noise, match_noise};
use super::scale_roll::Prepared;
use super::settings::{FirstStage, Measure, Refine, Search, TemplateSettings};
use crate::correlate::coarse_to_fine::{CoarseSearch, coarse_to_fine};
use crate::correlate::lucas_kanade::Placed;
use crate::correlate::peak::{self, Peak, SecondPeak};
use crate::correlate::{Focus, Surface, zncc};
use crate::frames::Pixel;
use crate::image::patch::{self, Patch};
use crate::image::sample::Kernel;
use crate::image::{GrayImage, PixelRect};
use crate::locate::LocateInput;

/// A template that was tried: one of several appearances, or one pair of a brute-force search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TriedTemplate {
    /// The stop at which it was taken.
    pub template_step: usize,
    /// Scale that was applied.
    pub scale: f64,
    /// Roll that was applied, rad.
    pub roll_rad: f64,
    /// Its best score, of the measure.
    pub score: f64,
}

/// The match of the template in the left image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TemplateMatch {
    /// The region searched, cut to the image: the whole template lies in it.
    pub search_window: PixelRect,
    /// How many positions were compared with this template.
    pub positions: u32,
    /// How many with all templates that were tried.
    pub comparisons: u64,
    /// How many of the positions had no contrast.
    pub flat_positions: u32,
    /// The measure by which `surface`, `peak` and `second_peak` score.
    pub measure: Measure,
    /// The best match of the whole window by the measure.
    pub peak: Peak,
    /// Where the target is: the best match in focus or of the second stage, or `peak` where there is neither, px.
    pub pixel: Pixel,
    /// Normalised correlation there: what is judged.
    pub score: f64,
    /// The score in focus at `pixel`; null where the peak of the whole window stands.
    pub focused_score: Option<f64>,
    /// The next best, at least half a template away.
    pub second_peak: Option<SecondPeak>,
    /// What the coarse-to-fine search saw; null for an exhaustive one.
    pub coarse: Option<CoarseSearch>,
    /// The descent of a klt first stage.
    pub descent: Option<Descent>,
    /// The second stage.
    pub affine: Option<AffineRefinement>,
    /// Every template that was tried, where there was more than one.
    pub tried: Vec<TriedTemplate>,
    /// The maxima between which the height term decided, where it is on.
    pub weighed: Vec<WeighedPeak>,
    /// Covariance of this match alone, px².
    #[schema(value_type = Vec<f64>)]
    pub covariance_px2: Matrix2<f64>,
    /// What the surface's slope, which scale and roll leave out, adds to this match, px.
    #[schema(value_type = [f64; 2])]
    pub bias_px: Vector2<f64>,
    /// Scores of the positions; NaN where none was compared, empty after a descent.
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

impl TemplateMatch {
    /// From the best whole pixel to the rim of the positions compared, px; `None` where no window was searched.
    pub fn edge_distance_px(&self) -> Option<f64> {
        let (ix, iy) = self.surface.index_of(self.peak.integer[0], self.peak.integer[1])?;
        let distance = ix.min(self.surface.width - 1 - ix).min(iy).min(self.surface.height - 1 - iy);
        Some(f64::from(distance))
    }
}

/// What the first stage found.
#[derive(Clone, Debug)]
pub struct FirstMatch {
    pub(super) search_window: PixelRect,
    pub(super) positions: u64,
    pub(super) surface: Surface,
    pub(super) peak: Peak,
    pub(super) coarse: Option<CoarseSearch>,
    pub(super) descent: Option<(Descent, Placed)>,
    pub(super) weighed: Vec<WeighedPeak>,
}

/// Finds the prepared template around the prediction by the first stage.
///
/// # Errors
/// A sentence saying why no position could be compared.
pub fn first_match(
    prepared: &Prepared<'_>,
    input: &LocateInput<'_>,
    settings: &TemplateSettings,
) -> Result<FirstMatch, String> {
    let image = input.capture.pair.left.as_ref();
    let predicted =
        input.pointing.predicted_left.ok_or("the predicted target lies behind the left camera")?;
    let growth = settings.lost_search_growth.powi(input.lost_count as i32);
    let side = (f64::from(settings.search_window_px) * growth).round() as u32 | 1;
    let search_window = PixelRect::centred(predicted, side)
        .intersect(&PixelRect::whole(image.width(), image.height()))
        .ok_or("the predicted target lies outside the left image: no part of search_window_px around it is in it")?;
    if !prepared.record.rolled.is_complete() {
        return Err(
            "the template reaches over the border of the image from which it was taken: template_size_px is too \
             large for a target so near it"
                .to_owned(),
        );
    }
    if settings.first_stage != FirstStage::Correlation {
        return klt::first_match(prepared, image, search_window, predicted, settings);
    }
    let (surface, coarse) = correlate(prepared, image, search_window, settings).ok_or(
        "no position of search_window_px can hold the template of template_size_px: too little of the window lies \
         in the left image",
    )?;
    let peak = peak::find_peak(&surface, settings.sub_pixel).ok_or("no valid score in the search window")?;
    let positions =
        coarse.as_ref().map_or(u64::from(surface.width) * u64::from(surface.height), |c| c.comparisons);
    Ok(FirstMatch { search_window, positions, surface, peak, coarse, descent: None, weighed: Vec::new() })
}

/// The scores of the measure over the positions that the search visits.
fn correlate(
    prepared: &Prepared<'_>,
    image: &GrayImage,
    search_window: PixelRect,
    settings: &TemplateSettings,
) -> Option<(Surface, Option<CoarseSearch>)> {
    let (similarity, size) = (settings.similarity(), settings.template_size_px);
    match settings.search {
        Search::Exhaustive => {
            let wide = prepared.window(size + 2 * similarity.margin_px());
            Some((similarity.surface(&wide, size, image, search_window)?, None))
        }
        Search::CoarseToFine => {
            let descent = settings.descent();
            let wide = prepared.window(size + 2 * descent.margin_px(&similarity, size));
            let (surface, search) = coarse_to_fine(&similarity, &wide, size, image, search_window, &descent)?;
            Some((surface, Some(search)))
        }
    }
}

/// The match that the first stage's begins: refined, scored, and with its error.
pub fn finish(
    prepared: &Prepared<'_>,
    first: FirstMatch,
    tried: Vec<TriedTemplate>,
    comparisons: u64,
    image: &GrayImage,
    settings: &TemplateSettings,
) -> TemplateMatch {
    let (size, template) = (settings.template_size_px, &prepared.record.rolled);
    let mut peak = first.peak;
    let second_peak = peak::second_peak(&first.surface, &peak, f64::from(size) / 2.0);
    let is_correlated = first.descent.is_none() && settings.measure == Measure::Ncc;
    let focus = Focus::new(size, if is_correlated { settings.focus_px } else { 0.0 });
    let focused = refine(&focus, template, image, &peak, settings);
    let correlated = Placed::at(focused.map_or(peak.pixel, |(pixel, _)| pixel));
    let start = first.descent.map_or(correlated, |(_, placed)| placed);
    let affine =
        (settings.refine == Refine::Affine).then(|| affine::refine(prepared, start, image, settings));
    let refined = affine.as_ref().filter(|record| record.accepted).map(AffineRefinement::placed);
    let placed = refined.unwrap_or(start);
    let is_straight = placed.map == Matrix2::identity();
    let matched = window_at(&placed, image, settings);
    let score = match is_correlated && is_straight {
        true => peak.score,
        false => zncc(template, &matched).map_or(0.0, f64::from),
    };
    // A map that was measured leaves no stretch to be corrected for.
    let noise = match is_straight {
        true => match_noise(template, &matched, &prepared.record.misfit(), &focus),
        false => affine_noise(template, &matched),
    };
    let covariance_px2 = placed.map * noise.covariance_px2 * placed.map.transpose();
    if !is_correlated {
        peak.covariance_px2 = covariance_px2;
    }
    TemplateMatch {
        search_window: first.search_window,
        positions: first.positions as u32,
        comparisons,
        flat_positions: first.surface.flat_positions,
        measure: settings.measure,
        peak,
        pixel: placed.centre,
        score,
        focused_score: focused.map(|(_, score)| score).filter(|_| refined.is_none()),
        second_peak,
        coarse: first.coarse,
        descent: first.descent.map(|(record, _)| record),
        affine,
        tried,
        weighed: first.weighed,
        covariance_px2,
        bias_px: noise.bias_px,
        surface: first.surface,
        difference: patch::normalised_difference(&matched, template),
        matched,
    }
}

/// The window of the image at a match; where it is only shifted, its pixels are those of the image's grid.
fn window_at(placed: &Placed, image: &GrayImage, settings: &TemplateSettings) -> Patch {
    let size = settings.template_size_px;
    match placed.map == Matrix2::identity() {
        true => patch::extract(image, placed.centre, size / 2, settings.kernel),
        false => placed.window(image, size, settings.kernel),
    }
}

/// The maximum in focus beside the peak of the whole window, with its score.
pub(super) fn refine(
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
