//! Step `match_template`: matches the prepared template in the left image (K§4.3.2, R62–R68, R216–R222).
//!
//! **First stage.** By default normalised correlation at every position of the search window: the square image region
//! that contains the whole template, centred on the prediction. `measure` selects another similarity measure,
//! `search` visits fewer positions, `first_stage` descends along the gradient instead (`klt`). The match is the peak
//! of the measure's own score map, refined to sub-pixel accuracy by a quadratic fit (R67). With `ncc` it is then
//! moved to the next maximum of scores that weight the window's centre most (`correlate::focus`); if there is none,
//! the peak is kept. The second peak at least half a template away is reported (R68).
//!
//! **Second stage.** With `refine = affine` an affine descent starts at that match (`affine`).
//!
//! **Score.** With any measure, `judge` uses the normalised correlation at the match, of the window of the last
//! stage: sums of differences grow with the contrast of the scene and the change of its light, so that no limit fits
//! all, and the papers' 0.7 is a correlation. The measure's own value is in `peak`.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::affine::{self, AffineRefinement};
use super::failure::TemplateFailure;
use super::first_match::{Descent, FirstMatch, WeighedPeak};
use super::klt;
use super::match_noise::{affine_noise, match_noise};
use super::scale_roll::Prepared;
use super::settings::{FirstStage, Measure, Refine, Search, TemplateSettings};
use crate::array_name::ArrayName;
use crate::locate::tracker::LocateInput;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::frames::Pixel;
use sightline_record::{ArrayKind, Declaration, Record, Unit, Unsent};
use sightline_vision::correlate::coarse_to_fine::{CoarseSearch, coarse_to_fine};
use sightline_vision::correlate::lucas_kanade::Placed;
use sightline_vision::correlate::peak::{self, Peak, SecondPeak};
use sightline_vision::correlate::{Focus, Surface, zncc};
use sightline_vision::image::patch::{self, Patch};
use sightline_vision::image::sample::Kernel;
use sightline_vision::image::{GrayImage, PixelRect};

/// A template that was tried: one of several appearances, warped or not, or one pair of a brute-force search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TriedTemplate {
    /// The step at which it was taken.
    pub template_step: usize,
    /// Whether it was warped by the slope of the surface instead of scaled and rolled.
    #[serde(default)]
    pub warped: bool,
    /// Scale that was applied.
    pub scale: f64,
    /// Roll that was applied, rad.
    pub roll_rad: f64,
    /// Its best score by the measure.
    pub score: f64,
    /// The focused score at that match; null without a focus.
    #[serde(default)]
    pub focused_score: Option<f64>,
}

/// The match of the template in the left image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TemplateMatch {
    /// The searched region, clipped to the image; it contains the whole template.
    pub search_window: PixelRect,
    /// Number of positions compared with this template.
    pub positions: u32,
    /// Number of positions compared with all templates tried.
    pub comparisons: u64,
    /// Number of positions without contrast.
    pub flat_positions: u32,
    /// The measure by which `surface`, `peak` and `second_peak` score.
    pub measure: Measure,
    /// The best match of the whole window by the measure, or the best near the prediction (`near`).
    pub peak: Peak,
    /// Position of the target, px: the best match in focus or of the second stage, or `peak` without either.
    pub pixel: Pixel,
    /// Normalised correlation at `pixel`; the judged score.
    pub score: f64,
    /// The focused score at `pixel`; null if the peak of the whole window is used.
    pub focused_score: Option<f64>,
    /// The next best peak, at least half a template away; its ratio is above 1 if a better match far from the
    /// prediction was rejected.
    pub second_peak: Option<SecondPeak>,
    /// The coarse levels of the search; null for an exhaustive one.
    pub coarse: Option<CoarseSearch>,
    /// The descent of a KLT first stage; null for a correlation.
    pub descent: Option<Descent>,
    /// The second stage; null if it is off.
    pub affine: Option<AffineRefinement>,
    /// All templates that were tried; empty if there was only one.
    pub tried: Vec<TriedTemplate>,
    /// The maxima compared by the height term; empty if it is off.
    pub weighed: Vec<WeighedPeak>,
    /// Covariance of this match alone, px².
    #[schema(value_type = Vec<f64>)]
    pub covariance_px2: Matrix2<f64>,
    /// Bias of this match by the surface's slope, which scale and roll ignore, px.
    #[schema(value_type = [f64; 2])]
    pub bias_px: Vector2<f64>,
    /// Distance from the best whole pixel to the border of the compared positions, px; `None` after a descent.
    #[serde(default)]
    pub edge_distance_px: Option<f64>,
    /// Scores of the positions; NaN where none was compared, empty after a descent.
    #[serde(skip)]
    #[schema(ignore)]
    pub surface: Unsent<Surface>,
    /// The image at the match.
    #[serde(skip)]
    #[schema(ignore)]
    pub matched: Unsent<Patch>,
    /// Matched patch minus template, both normalised to zero mean and unit deviation.
    #[serde(skip)]
    #[schema(ignore)]
    pub difference: Unsent<Patch>,
}

/// Distance from a whole pixel to the border of the compared positions, px; `None` outside them.
fn edge_distance_px(surface: &Surface, [x, y]: [i32; 2]) -> Option<f64> {
    let (ix, iy) = surface.index_of(x, y)?;
    let distance = ix.min(surface.width - 1 - ix).min(iy).min(surface.height - 1 - iy);
    Some(f64::from(distance))
}

/// Matches the prepared template around the prediction by the first stage.
///
/// # Errors
/// Why no position could be compared.
pub fn first_match(
    prepared: &Prepared<'_>,
    input: &LocateInput<'_>,
    settings: &TemplateSettings,
) -> Result<FirstMatch, TemplateFailure> {
    let image = input.capture.pair.left.as_ref();
    let predicted = input.pointing.predicted_left.ok_or(TemplateFailure::PredictionBehind)?;
    let growth = settings.lost_search_growth.powi(input.lost_count as i32);
    let side = (f64::from(settings.search_window_px) * growth).round() as u32 | 1;
    let search_window = PixelRect::centred(predicted, side)
        .intersect(&PixelRect::whole(image.width(), image.height()))
        .ok_or(TemplateFailure::WindowOutside)?;
    if !prepared.rolled.is_complete() {
        return Err(TemplateFailure::TemplateIncomplete);
    }
    if settings.first_stage != FirstStage::Correlation {
        return klt::first_match(prepared, image, search_window, predicted, settings);
    }
    let (surface, coarse) = correlate(prepared, image, search_window, settings, input.cancel)
        .ok_or(TemplateFailure::WindowTooSmall)?;
    let peak = peak::find_peak(&surface, settings.sub_pixel).ok_or(TemplateFailure::NoScore)?;
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
    cancel: Cancel<'_>,
) -> Option<(Surface, Option<CoarseSearch>)> {
    let (similarity, size) = (settings.similarity(), settings.template_size_px);
    match settings.search {
        Search::Exhaustive => {
            let wide = prepared.window(size + 2 * similarity.margin_px());
            Some((similarity.surface_until(&wide, size, image, search_window, cancel)?, None))
        }
        Search::CoarseToFine => {
            let descent = settings.descent();
            let wide = prepared.window(size + 2 * descent.margin_px(&similarity, size));
            let (surface, search) = coarse_to_fine(&similarity, &wide, size, image, search_window, &descent)?;
            Some((surface, Some(search)))
        }
    }
}

/// The focused score at the first stage's match; `None` without a focus.
pub(super) fn focused_score(
    prepared: &Prepared<'_>,
    first: &FirstMatch,
    image: &GrayImage,
    settings: &TemplateSettings,
) -> Option<f64> {
    let focus = focus_of(is_correlated(first, settings), settings);
    let (_, score) = refine(&focus, &prepared.rolled, image, &first.peak, settings)?;
    Some(score)
}

fn is_correlated(first: &FirstMatch, settings: &TemplateSettings) -> bool {
    first.descent.is_none() && settings.measure == Measure::Ncc
}

/// The weights of the focus; uniform if the match is not a correlation.
fn focus_of(is_correlated: bool, settings: &TemplateSettings) -> Focus {
    Focus::new(settings.template_size_px, if is_correlated { settings.focus_px } else { 0.0 })
}

/// Completes the first stage's match: refines and scores it, and estimates its error.
pub fn finish(
    prepared: &Prepared<'_>,
    first: FirstMatch,
    tried: Vec<TriedTemplate>,
    comparisons: u64,
    image: &GrayImage,
    settings: &TemplateSettings,
) -> TemplateMatch {
    let (size, template) = (settings.template_size_px, &prepared.rolled);
    let is_correlated = is_correlated(&first, settings);
    let focus = focus_of(is_correlated, settings);
    let mut peak = first.peak;
    let second_peak = peak::second_peak(&first.surface, &peak, f64::from(size) / 2.0);
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
    // A fitted map leaves no stretch to correct for.
    let noise = match is_straight {
        true => match_noise(template, &matched, &prepared.record.misfit(), &focus),
        false => affine_noise(template, &matched),
    };
    let covariance_px2 = placed.map * noise.covariance_px2 * placed.map.transpose();
    if !is_correlated {
        peak.covariance_px2 = covariance_px2;
    }
    let edge_distance_px = edge_distance_px(&first.surface, peak.integer);
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
        edge_distance_px,
        surface: first.surface.into(),
        difference: patch::normalised_difference(&matched, template).into(),
        matched: matched.into(),
    }
}

/// The window of the image at a match; for a pure shift, its pixels are on the image's grid.
fn window_at(placed: &Placed, image: &GrayImage, settings: &TemplateSettings) -> Patch {
    let size = settings.template_size_px;
    match placed.map == Matrix2::identity() {
        true => patch::extract(image, placed.centre, size / 2, settings.kernel),
        false => placed.window(image, size, settings.kernel),
    }
}

/// The maximum of the focused scores next to the peak of the whole window, with its score.
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
        // At whole pixels every kernel returns the pixels themselves.
        let centre = whole.offset(f64::from(dx), f64::from(dy));
        Some(patch::extract(image, centre, half, Kernel::Bilinear))
    };
    let found = focus.climb(template, settings.sub_pixel, window_at)?;
    Some((whole.offset(found.offset_px.x, found.offset_px.y), found.score))
}

impl Record for TemplateMatch {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("positions", Unit::One, |m| m.positions)
            .describe("Number of positions that were compared with this template.");
        r.quantity("comparisons", Unit::One, |m| m.comparisons)
            .describe("Number of positions that were compared with all templates.");
        r.quantity("flat_positions", Unit::One, |m| m.flat_positions)
            .describe("Number of positions without contrast.");
        r.quantity("score", Unit::One, |m| m.score)
            .label("match score")
            .describe("Normalised correlation at the match: what is judged.")
            .formula(
                "Σ (I − Ī)(T − T̄) / √(Σ (I − Ī)² Σ (T − T̄)²) [Kim09 Eq. 11]",
                &["pixel", "scale_roll.scale"],
            );
        r.quantity("focused_score", Unit::One, |m| m.focused_score)
            .describe("Score in focus at the match; missing where the peak of the whole window is used.");
        r.quantity("pixel", Unit::Pixel, |m| m.pixel).describe("The match in the left image.");
        r.quantity("covariance_px2", Unit::SquarePixel, |m| m.covariance_px2)
            .describe("Covariance of this match alone.");
        r.quantity("match_sigma_px", Unit::Pixel, |m| {
            m.covariance_px2.symmetric_eigenvalues().max().max(0.0).sqrt()
        })
        .describe("Largest 1σ axis of the match's own covariance.")
        .formula("√λ_max(Σ)", &["covariance_px2"]);
        r.quantity("bias_px", Unit::Pixel, |m| m.bias_px)
            .describe("Error that the slope of the surface adds to this match.");
        r.quantity("peak.pixel", Unit::Pixel, |m| m.peak.pixel)
            .describe("The best match of the whole window.");
        r.field("peak.integer", Unit::Pixel);
        r.quantity("peak.score", Unit::One, |m| m.peak.score).describe("Score there, by the measure.");
        r.quantity("peak.at_edge", Unit::One, |m| m.peak.at_edge)
            .describe("Whether the peak touches the border of the search window.");
        r.quantity("second_peak.pixel", Unit::Pixel, |m| Some(m.second_peak.as_ref()?.pixel))
            .describe("The second-best match; missing without one.");
        r.quantity("second_peak.score", Unit::One, |m| Some(m.second_peak.as_ref()?.score))
            .describe("Score of the second peak.");
        r.quantity("second_peak.ratio", Unit::One, |m| Some(m.second_peak.as_ref()?.ratio))
            .describe(
                "Second peak over the first: near 1 the match is ambiguous; missing without a second one.",
            )
            .formula("second_peak.score / peak.score", &["second_peak.score", "peak.score"]);
        r.quantity("second_peak.distance_px", Unit::Pixel, |m| Some(m.second_peak.as_ref()?.distance_px))
            .describe("Distance of the second peak from the first.");
        r.array("matched", ArrayKind::Patch, "The left image at the match", |m| m.matched.view());
        r.array(
            "difference",
            ArrayKind::Difference,
            "Match less template, both normalised; grey is no difference",
            |m| m.difference.view(),
        );
        r.array(
            "surface",
            ArrayKind::ScoreMap,
            "The score of every position of the search window; bright is a better match",
            |m| m.surface.view(),
        );
    }
}

/// Names of the arrays of this stage that a panel draws individually.
impl ArrayName {
    /// The image at the match.
    pub const MATCHED: Self = Self::new("matched");
    /// Matched minus rolled, both normalised.
    pub const DIFFERENCE: Self = Self::new("difference");
    /// The scores of all positions of the search window.
    pub const SURFACE: Self = Self::new("surface");
}
