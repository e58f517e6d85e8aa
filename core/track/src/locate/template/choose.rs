//! Selects the template to match: the current one, or the best of several.
//!
//! * `reference_templates`: the current template and those it replaced, newest first. Conditional renewals are some
//!   distance apart, so that these templates differ in range and in line of sight.
//! * `surface_warp`: each of them warped by the slope of its surface, and also scaled and rolled by the geometry. If
//!   the window covers two surfaces, such as a rock and the ground in front of it, the measured slope fits neither,
//!   and the warped window matches beside the target, an error that accumulates with every renewal.
//! * `transform = search`: for each of them every pair of a scale and a roll from a grid, without the geometry
//!   (R224). Scales are spaced by a ratio and rolls by a step, symmetric about the identity.
//!
//! Each is matched by the first stage, and the highest score of the measure wins, the first among equals; a match
//! near the prediction wins over one far from it with a slightly higher score (`near`). Of matches at the same
//! position, the one with the higher focused score wins, if there is a focus, which weights the surroundings of the
//! target most. A match against an older appearance starts from that appearance's drift.

use super::failure::TemplateFailure;
use super::first_match::FirstMatch;
use super::match_template::{TriedTemplate, first_match, focused_score};
use super::memory::{Appearance, Kept, TemplateMemory};
use super::near;
use super::scale_roll::{Preparation, Prepared, ScaleRoll, scale_roll};
use super::settings::{TemplateSettings, Transform};
use crate::locate::tracker::LocateInput;
use sightline_geometry::estimate::drift::Drift;
use sightline_geometry::frames::Pose;

/// Matches are at the same position if their peaks are at most this far apart, px.
const SAME_PLACE_PX: f64 = 5.0;

/// The selected template with its match.
pub(super) struct Chosen<'a> {
    pub(super) prepared: Prepared<'a>,
    /// Maps the rover frame of its stop to the current one.
    pub(super) now_from_template: Pose,
    pub(super) first: FirstMatch,
    /// The error of the template's centre.
    pub(super) drift: Drift,
    /// All templates that were tried; empty if there was only one.
    pub(super) tried: Vec<TriedTemplate>,
    /// Number of positions compared, over all templates.
    pub(super) comparisons: u64,
}

/// Why there is no match, with the first template that failed.
pub(super) struct Unmatched {
    pub(super) scale_roll: Option<Box<ScaleRoll>>,
    pub(super) missing: TemplateFailure,
}

impl Unmatched {
    /// No template was tried.
    fn without_template() -> Self {
        Self { scale_roll: None, missing: TemplateFailure::NoTemplate }
    }
}

/// Maps the rover frame of the current template's stop to the current rover frame.
fn now_from_template(input: &LocateInput<'_>, memory: &TemplateMemory) -> Pose {
    input.site_from_rover.inverse() * memory.appearance.site_from_rover
}

/// Maps the rover frame of an older appearance to the current one.
pub(super) fn now_from_kept(input: &LocateInput<'_>, memory: &TemplateMemory, kept: &Kept) -> Pose {
    let template_from_kept = memory.appearance.site_from_rover.inverse() * kept.appearance.site_from_rover;
    now_from_template(input, memory) * template_from_kept
}

/// Matches every template that the settings require, and selects the best.
pub(super) fn choose<'a>(
    input: &LocateInput<'a>,
    memory: &'a TemplateMemory,
    settings: &TemplateSettings,
) -> Result<Chosen<'a>, Unmatched> {
    let others = settings.reference_templates.saturating_sub(1) as usize;
    let current = (&memory.appearance, memory.drift, now_from_template(input, memory));
    let older = memory.replaced.newest().take(others);
    let appearances: Vec<(&Appearance, Drift, Pose)> = std::iter::once(current)
        .chain(older.map(|kept| (&kept.appearance, kept.drift, now_from_kept(input, memory, kept))))
        .collect();
    let preparations = preparations(settings);
    let mut best: Option<(Option<f64>, Chosen<'a>)> = None;
    let mut unmatched: Option<Unmatched> = None;
    let (mut tried, mut comparisons) = (Vec::new(), 0);
    for (appearance, drift, now_from_template) in appearances {
        let mut is_warped = false;
        for &preparation in &preparations {
            if input.cancel.is_requested() {
                return Err(Unmatched::without_template());
            }
            if preparation == Preparation::ScaleRoll && !is_warped {
                // The same window was just matched.
                continue;
            }
            let (prepared, first) =
                match attempt(appearance, &now_from_template, preparation, input, settings) {
                    Ok(matched) => matched,
                    Err(missing) => {
                        is_warped = missing.scale_roll.as_ref().is_some_and(|record| record.warped);
                        unmatched.get_or_insert(missing);
                        continue;
                    }
                };
            is_warped = prepared.record.warped;
            comparisons += first.positions;
            let focused = focused_score(&prepared, &first, input.capture.pair.left.as_ref(), settings);
            tried.push(describe(&prepared, &first, focused));
            let is_better = |(its_focused, best): &(Option<f64>, Chosen<'_>)| {
                let is_same_place = first.peak.pixel.distance(best.first.peak.pixel) <= SAME_PLACE_PX;
                match (focused, its_focused) {
                    (Some(focused), Some(its_focused)) if is_same_place => focused > *its_focused,
                    _ => near::is_better(&first, &best.first, input),
                }
            };
            if best.as_ref().is_none_or(is_better) {
                let (tried, comparisons) = (Vec::new(), 0);
                let chosen = Chosen { prepared, now_from_template, first, drift, tried, comparisons };
                best = Some((focused, chosen));
            }
        }
    }
    match (best, unmatched) {
        (Some((_, best)), _) => {
            let tried = if tried.len() > 1 { tried } else { Vec::new() };
            Ok(Chosen { tried, comparisons, ..best })
        }
        (None, unmatched) => Err(unmatched.unwrap_or_else(Unmatched::without_template)),
    }
}

/// Returns the first stage's match of one template.
fn attempt<'a>(
    appearance: &'a Appearance,
    now_from_template: &Pose,
    preparation: Preparation,
    input: &LocateInput<'a>,
    settings: &TemplateSettings,
) -> Result<(Prepared<'a>, FirstMatch), Unmatched> {
    let left = &input.pointing.left;
    let prepared = scale_roll(appearance, now_from_template, left, settings, preparation)
        .map_err(|missing| Unmatched { scale_roll: None, missing })?;
    match first_match(&prepared, input, settings) {
        Ok(mut first) => {
            near::prefer_near(&mut first, input);
            Ok((prepared, first))
        }
        Err(missing) => Err(Unmatched { scale_roll: Some(Box::new(prepared.record)), missing }),
    }
}

fn describe(prepared: &Prepared<'_>, first: &FirstMatch, focused_score: Option<f64>) -> TriedTemplate {
    TriedTemplate {
        template_step: prepared.record.template_step,
        warped: prepared.record.warped,
        scale: prepared.record.applied_scale,
        roll_rad: prepared.record.applied_roll_rad,
        score: first.peak.score,
        focused_score,
    }
}

/// How each appearance is prepared, in the order of matching.
fn preparations(settings: &TemplateSettings) -> Vec<Preparation> {
    if settings.transform == Transform::Geometry {
        return vec![Preparation::Surface, Preparation::ScaleRoll];
    }
    let [scales, rolls] = settings.search_steps();
    let given = |i: i32, j: i32| Preparation::Given {
        scale: settings.search_scale_ratio.powi(i),
        roll_rad: (settings.search_roll_step_deg * f64::from(j)).to_radians(),
    };
    (-scales..=scales).flat_map(|i| (-rolls..=rolls).map(move |j| given(i, j))).collect()
}
