//! Tries a displaced prediction: on the line towards the truth, or, without success there, towards the best match in the
//! whole image. The smallest displacement on that line that reaches the goal is the finding.

use super::trials::{Reach, Trials};
use super::{Finding, Moved};
use crate::step::RunStep;
use crate::track::Drive;
use sightline_geometry::error::Result;
use sightline_geometry::frames::Pixel;
use sightline_track::limits::Domain;
use sightline_track::locate::Evidence;
use sightline_track::settings::{Changes, Settings};

/// The width of the bracket at which the bisection ends, px.
const BRACKET_PX: f64 = 0.25;

/// Finds the smallest displacement that reaches the goal.
pub(super) fn look<D: Drive>(trials: &mut Trials<'_, D>) -> Result<Option<Finding>> {
    let recorded = trials.base.recorded;
    let Some(from) = recorded.point_mast.predicted_left else {
        return Ok(None);
    };
    let before = trials.runs;
    let truth = recorded.truth.as_ref().and_then(|truth| truth.left_pixel);
    let mut found = match truth {
        Some(place) => on_the_way(trials, from, place)?.map(|way| (way, "towards the truth".to_owned())),
        None => None,
    };
    if found.as_ref().is_none_or(|(way, _)| way.0 < Reach::Yes)
        && let Some((place, because)) = found_far(trials)?
    {
        let other = on_the_way(trials, from, place)?.map(|way| (way, because));
        let reach = |found: &Option<(Way, String)>| found.as_ref().map(|(way, _)| way.0);
        if reach(&other) > reach(&found) {
            found = other;
        }
    }
    let runs = trials.runs - before;
    Ok(found.map(|((_, to, trace), because)| {
        let moved = Moved { from, to, because };
        let half_px = f64::from(trials.base.settings.template.search_window_px) / 2.0;
        let relative = moved.from.distance(moved.to) / half_px;
        trials.finding(Vec::new(), Some(moved), relative, (&trace, runs))
    }))
}

/// The best match in the whole image, and its source as a clause.
fn found_far<D: Drive>(trials: &mut Trials<'_, D>) -> Result<Option<(Pixel, String)>> {
    let recorded = trials.base.recorded;
    let is_template = recorded.located().is_some_and(|l| matches!(l.evidence, Evidence::Template(_)));
    let Some(widest) = widest_window(trials.base.settings, recorded).filter(|_| is_template) else {
        return Ok(None);
    };
    let changes = Changes::from([("search_window_px".to_owned(), widest.into())]);
    let wide = trials.run(&changes, None)?;
    let matched = wide.as_ref().and_then(|trace| trace.template()).and_then(|e| e.match_template.as_ref());
    let because = || format!("towards the best match in a search window of {widest} px");
    Ok(matched.map(|matched| (matched.pixel, because())))
}

/// The side of a search window that contains the whole left image, limited by the range of the setting, px. `None` if the
/// window is not larger than the current one.
fn widest_window(settings: &Settings, recorded: &RunStep) -> Option<u32> {
    let [width, height] = recorded.capture()?.left_size;
    let table = Settings::table();
    let info = table.iter().find(|info| info.key == "search_window_px")?;
    let Domain::OddBetween(_, high) = info.domain else { return None };
    let side = (2 * width.max(height) + 1).min(high);
    (side > settings.template.search_window_px).then_some(side)
}

/// The outcome of a displacement, the displaced prediction, and the step computed with it.
type Way = (Reach, Pixel, RunStep);

/// Bisects `from → to` for the smallest displacement with the outcome of `to`; `None` if `to` does not reach the goal.
fn on_the_way<D: Drive>(trials: &mut Trials<'_, D>, from: Pixel, to: Pixel) -> Result<Option<Way>> {
    let way_px = from.distance(to);
    let at = |share: f64| from.offset((to.x - from.x) * share, (to.y - from.y) * share);
    let Some(end) = trials.run(&Changes::new(), Some(to))? else { return Ok(None) };
    let wanted = trials.reach(&end);
    if wanted == Reach::Not || way_px < BRACKET_PX {
        return Ok(None);
    }
    let (mut not, mut does, mut found) = (0.0, 1.0, (to, end));
    while (does - not) * way_px > BRACKET_PX {
        let middle = (not + does) / 2.0;
        let place = rounded(at(middle));
        match trials.run(&Changes::new(), Some(place))? {
            Some(trace) if trials.reach(&trace) >= wanted => (does, found) = (middle, (place, trace)),
            _ => not = middle,
        }
    }
    Ok(Some((wanted, found.0, found.1)))
}

/// Rounds to 0.1 px, the precision at which a person sets a prediction.
fn rounded(pixel: Pixel) -> Pixel {
    Pixel::new((pixel.x * 10.0).round() / 10.0, (pixel.y * 10.0).round() / 10.0)
}
