//! Which template is matched: the one there is, or the best of several.
//!
//! * `reference_templates`: the template and the appearances that it replaced, newest first. Renewals on condition are some
//!   way apart, so that these differ in distance and in the line of sight.
//! * `transform = search`: for each of them every pair of a scale and a roll from a grid, without the geometry (R224).
//!   Scales are spaced by a ratio and rolls by a step, both about none.
//!
//! Each is matched by the first stage, and the highest score of the measure wins, the first among equals. A match against
//! an older appearance starts from that appearance's drift.

use super::failure::TemplateFailure;
use super::first_match::FirstMatch;
use super::match_template::{TriedTemplate, first_match};
use super::memory::{Appearance, Kept, TemplateMemory};
use super::scale_roll::{Prepared, ScaleRoll, scale_roll};
use super::settings::{TemplateSettings, Transform};
use crate::locate::tracker::LocateInput;
use sightline_geometry::estimate::drift::Drift;
use sightline_geometry::frames::Pose;

/// The template whose match stands.
pub(super) struct Chosen<'a> {
    pub(super) prepared: Prepared<'a>,
    /// Takes points of the rover frame of its stop into the present one.
    pub(super) now_from_template: Pose,
    pub(super) first: FirstMatch,
    /// The error of its centre.
    pub(super) drift: Drift,
    /// Every template that was tried, where there was more than one.
    pub(super) tried: Vec<TriedTemplate>,
    /// Positions compared, all templates together.
    pub(super) comparisons: u64,
}

/// Why there is no match, with the template that came nearest to one.
pub(super) struct Unmatched {
    pub(super) scale_roll: Option<Box<ScaleRoll>>,
    pub(super) missing: TemplateFailure,
}

/// Takes points of the rover frame in which the current template was taken into the current rover frame.
fn now_from_template(input: &LocateInput<'_>, memory: &TemplateMemory) -> Pose {
    input.site_from_rover.inverse() * memory.appearance.site_from_rover
}

/// Takes points of the rover frame of an older appearance into the current one.
pub(super) fn now_from_kept(input: &LocateInput<'_>, memory: &TemplateMemory, kept: &Kept) -> Pose {
    let template_from_kept = memory.appearance.site_from_rover.inverse() * kept.appearance.site_from_rover;
    now_from_template(input, memory) * template_from_kept
}

/// Matches every template that the settings ask for.
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
    let pairs = transforms(settings);
    let mut best: Option<Chosen<'a>> = None;
    let mut unmatched: Option<Unmatched> = None;
    let (mut tried, mut comparisons) = (Vec::new(), 0);
    let left = &input.pointing.left;
    for (appearance, drift, now_from_then) in &appearances {
        for pair in &pairs {
            if input.cancel.is_requested() {
                return Err(Unmatched { scale_roll: None, missing: TemplateFailure::NoTemplate });
            }
            let prepared = match scale_roll(appearance, now_from_then, left, settings, *pair) {
                Ok(prepared) => prepared,
                Err(missing) => {
                    unmatched.get_or_insert(Unmatched { scale_roll: None, missing });
                    continue;
                }
            };
            let first = match first_match(&prepared, input, settings) {
                Ok(first) => first,
                Err(missing) => {
                    unmatched
                        .get_or_insert(Unmatched { scale_roll: Some(Box::new(prepared.record)), missing });
                    continue;
                }
            };
            comparisons += first.positions;
            tried.push(describe(&prepared, &first));
            if best.as_ref().is_none_or(|best| first.peak.score > best.first.peak.score) {
                let (tried, comparisons) = (Vec::new(), 0);
                best = Some(Chosen {
                    prepared,
                    now_from_template: *now_from_then,
                    first,
                    drift: *drift,
                    tried,
                    comparisons,
                });
            }
        }
    }
    match (best, unmatched) {
        (Some(best), _) => {
            let tried = if tried.len() > 1 { tried } else { Vec::new() };
            Ok(Chosen { tried, comparisons, ..best })
        }
        (None, Some(unmatched)) => Err(unmatched),
        (None, None) => Err(Unmatched { scale_roll: None, missing: TemplateFailure::NoTemplate }),
    }
}

fn describe(prepared: &Prepared<'_>, first: &FirstMatch) -> TriedTemplate {
    TriedTemplate {
        template_step: prepared.record.template_step,
        scale: prepared.record.applied_scale,
        roll_rad: prepared.record.applied_roll_rad,
        score: first.peak.score,
    }
}

/// The pairs of scale and roll (rad) to try; none stands for what the geometry says.
fn transforms(settings: &TemplateSettings) -> Vec<Option<(f64, f64)>> {
    if settings.transform == Transform::Geometry {
        return vec![None];
    }
    let [scales, rolls] = settings.search_steps();
    let pair = |i: i32, j: i32| {
        let roll_rad = (settings.search_roll_step_deg * f64::from(j)).to_radians();
        Some((settings.search_scale_ratio.powi(i), roll_rad))
    };
    (-scales..=scales).flat_map(|i| (-rolls..=rolls).map(move |j| pair(i, j))).collect()
}
