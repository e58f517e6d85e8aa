//! The root cause of a rejected update, found without the truth.
//!
//! | order | cause | evidence |
//! |---|---|---|
//! | 1 | a jump of heading or position | `jump`: an unusual change that moves the target out of the search window |
//! | 2 | an earlier loss | consecutive bad updates, without a jump of the pose since |
//! | 3 | the target leaves an image | the template does not fit into the image at the prediction |
//! | 4 | nothing was matched | the reason that the tracker reports |
//! | 5 | slip measured by visual odometry | `odometry`: the pose used differs significantly |
//! | 6 | no contrast | nearly all positions are flat |
//! | 7 | a search window that is too small | a poor score that rises towards the edge of the window |
//! | 8 | a hidden or changed target | the score fell in one step, with consistent prediction and pose change |
//! | 9 | the right image | a good match, a poor stereo score |
//! | 10 | slip, or a match or range on another surface | a good match, range or site position beyond its tolerance |
//! | 11 | an ambiguous match | a good match, a second peak beyond its gate |

use sightline_track::locate::template::match_template::TemplateMatch;
use sightline_track::settings::TrackerKind;
use sightline_track::stages::judge::{Gate, Verdict};
use sightline_track::target::TrackingState;

use super::jump::{self, Jump, Jumped};
use super::sentence::AT_RIM_PX;
use super::template::edge_distance_px;
use super::words::{number, signed};
use super::{Book, leaving, odometry};
use crate::metrics::uncertainty::nis;

/// The headline if no cause is found.
pub(super) const NONE: &str = "No single cause is visible";

/// Minimum fall of the score in one step that is not gradual degradation.
const FALL: f64 = 0.15;
/// Maximum distance of a match from its prediction that counts as consistent, standard deviations.
const CONSISTENT_SIGMAS: f64 = 3.0;
/// Maximum range change that slip explains, as a multiple of the distance driven since the last update.
const SLIP_SHARE: f64 = 1.2;
/// Minimum relative change of the mean grey value that counts as a change of illumination.
const BRIGHTNESS: f64 = 0.25;
/// Minimum fraction of flat positions of a search window without contrast.
const FLAT: f64 = 0.9;
/// Fraction of saturated pixels above which the texture is hidden.
const SATURATED: f64 = 0.1;

/// The root cause of a rejected update.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Cause {
    /// The cause as a sentence without a full stop.
    pub(super) sentence: String,
    /// Additional evidence, as a clause.
    pub(super) evidence: Option<String>,
    /// Whether the rover may have slipped.
    pub(super) is_slip: bool,
}

impl Cause {
    fn new(sentence: String) -> Self {
        Self { sentence, evidence: None, is_slip: false }
    }

    fn slip(sentence: String) -> Self {
        Self { is_slip: true, ..Self::new(sentence) }
    }
}

/// Finds the cause of a rejected update; `None` if the evidence supports none.
pub(super) fn find(book: &Book<'_>, verdict: &Verdict) -> Option<Cause> {
    let rejected_before = match verdict.state_before {
        TrackingState::Lost { count } => count as usize,
        _ => 0,
    };
    if verdict.state_before == TrackingState::Failed {
        return Some(Cause::new(
            "Tracking had failed before; the target is not searched for until it is designated again"
                .to_owned(),
        ));
    }
    let by_template = book.settings.tracker == TrackerKind::Template;
    let found =
        by_template.then(|| jump::find(book, rejected_before)).flatten().map(|jump| of_jump(book, jump));
    let found = found.or_else(|| earlier(rejected_before));
    let found = found.or_else(|| leaving::sentence(book).map(Cause::new)).or_else(|| nothing_matched(book));
    let found = found.or_else(|| odometry::disagreement(book.trace).map(Cause::slip));
    found.or_else(|| of_match(book, verdict))
}

/// The cause that the target was lost at an earlier update; `None` if it was not.
fn earlier(rejected_before: usize) -> Option<Cause> {
    let words = match rejected_before {
        0 => return None,
        1 => "The target was lost at the update before; its cause is at that step".to_owned(),
        count => format!("The target was lost {count} updates ago; its cause is at that step"),
    };
    Some(Cause::new(words))
}

fn nothing_matched(book: &Book<'_>) -> Option<Cause> {
    let located = book.trace.located()?;
    let is_matched = book.trace.template().is_none_or(|evidence| evidence.match_template.is_some());
    let missing = located.missing.as_ref().filter(|_| !is_matched)?;
    Some(Cause::new(format!("Nothing was compared: {}", missing.trim_end_matches('.'))))
}

fn of_jump(book: &Book<'_>, jump: Jump) -> Cause {
    let at = if jump.stop == book.trace.step { String::new() } else { format!(" at step {}", jump.stop) };
    let side = if jump.by > 0.0 { "right" } else { "left" };
    let (what, usual) = match jump.jumped {
        Jumped::Heading => (
            format!(
                "The heading estimate jumped by {:.1}° to the {side}{at} while the rover drove straight",
                jump.by.abs()
            ),
            format!("at the steps before, the change of heading deviated by at most {:.1}°", jump.usual),
        ),
        Jumped::Position => (
            format!("The position estimate jumped by {} m to the {side}{at}", number(jump.by.abs())),
            format!("at the steps before, the position deviated by at most {} m", number(jump.usual)),
        ),
    };
    let effect = match jump.shift_px {
        Some(px) => format!("the prediction is {px:.0} px off and the target is outside the search window"),
        None => "the target is predicted out of the camera's view".to_owned(),
    };
    Cause { evidence: Some(usual), ..Cause::new(format!("{what}; {effect}")) }
}

/// The causes 6 to 11, from the match itself.
fn of_match(book: &Book<'_>, verdict: &Verdict) -> Option<Cause> {
    let matched = book.trace.template()?.match_template.as_ref()?;
    let failed = |name: &str| verdict.gates.iter().find(|gate| gate.name == name && !gate.passed);
    let poor = without_contrast(matched).or_else(|| failed("ncc").and_then(|_| at_rim(book)));
    if let Some(cause) = poor.or_else(|| fallen(book)) {
        return Some(cause);
    }
    // `far_ncc` is checked after the gates of the position, whose failures cause it.
    if failed("ncc").is_some() {
        return None;
    }
    if let Some(score) = failed("stereo_ncc").and_then(|gate| gate.value) {
        return Some(Cause::new(format!(
            "Only the right image disagrees: the match is good (match score {}), the stereo score is {}; a depth edge or an \
             occlusion in one of the eyes",
            number(matched.score),
            number(score)
        )));
    }
    if let Some(gate) = failed("distance_correction_m") {
        return of_range(book, gate);
    }
    if let Some(gate) = failed("position_correction_m") {
        return Some(Cause::slip(format!(
            "The match is good, but {} m from the designated position in the site frame: the pose estimate drifted (slip), or \
             a similar place was matched",
            number(gate.value?)
        )));
    }
    if let Some(gate) = failed("far_ncc") {
        let px = matched.pixel.distance(book.trace.point_mast.predicted_left?);
        return Some(Cause::slip(format!(
            "The match is {px:.0} px from the prediction, where a score of {} is required, and has {}: the pose estimate is off \
             (slip), or a similar place was matched",
            number(gate.limit),
            number(gate.value?)
        )));
    }
    let second = matched.second_peak.as_ref().filter(|_| failed("second_peak_ratio").is_some());
    let second = second.map(|second| {
        Cause::new(format!(
            "The match is ambiguous: the second peak, {} px away, has {} of the best score",
            number(second.distance_px),
            number(second.ratio)
        ))
    });
    second.or_else(|| at_rim(book))
}

/// A good match at an unexpected range.
fn of_range(book: &Book<'_>, gate: &Gate) -> Option<Cause> {
    let change_m = book.range_located_m()? - book.predicted_range_m()?;
    let way_m = book.trace.prediction()?.travelled_since_update_m;
    let side = if change_m > 0.0 { "farther" } else { "nearer" };
    let what = format!(
        "The match is good, but {} m {side} than predicted (limit {} m)",
        number(change_m.abs()),
        number(gate.limit)
    );
    Some(if change_m.abs() > SLIP_SHARE * way_m {
        let why = "more than slip explains after";
        Cause::new(format!(
            "{what}, {why} {} m: the match, or its stereo range, is on another surface",
            number(way_m)
        ))
    } else {
        let how = if change_m > 0.0 { "less" } else { "farther" };
        let why = format!("the rover moved {how} than the {} m of its pose estimate (slip)", number(way_m));
        Cause::slip(format!("{what}: {why}"))
    })
}

/// A search window without contrast, in which nearly no position can be compared.
fn without_contrast(matched: &TemplateMatch) -> Option<Cause> {
    let share = f64::from(matched.flat_positions) / f64::from(matched.positions.max(1));
    (share >= FLAT).then(|| {
        Cause::new(format!(
            "The search window has no contrast: {:.0} % of its positions are flat (covered, saturated, or in deep shadow)",
            100.0 * share
        ))
    })
}

/// A peak at the edge of the compared positions.
fn at_rim(book: &Book<'_>) -> Option<Cause> {
    let matched = book.trace.template()?.match_template.as_ref()?;
    let rim_px = edge_distance_px(matched, book.settings.template.template_size_px);
    let predicted = book.trace.point_mast.predicted_left?;
    // A poor peak at the edge may be due to chance: its score must exceed half the required one.
    let is_rising = matched.score > 0.5 * book.settings.limits.ncc_min;
    (matched.descent.is_none() && rim_px <= AT_RIM_PX && is_rising).then(|| {
        Cause::slip(format!(
            "The prediction is at least {:.0} px off: the scores rise towards the rim of the search window",
            predicted.distance(matched.pixel)
        ))
    })
}

/// A score that fell in one step although pose and prediction are consistent.
fn fallen(book: &Book<'_>) -> Option<Cause> {
    let before = book.before?;
    let score = |step: &crate::step::RunStep| Some(step.template()?.match_template.as_ref()?.score);
    let (then, now) = (score(before)?, score(book.trace)?);
    let is_consistent = nis(before).is_none_or(|nis| nis.sqrt() <= CONSISTENT_SIGMAS);
    if then - now < FALL || !is_consistent || !jump::is_usual(book) {
        return None;
    }
    let fell = format!("The match score fell from {} to {} in one step", number(then), number(now));
    Some(Cause::new(match brightness(book) {
        Some(words) => format!("{fell}: {words}"),
        None => format!(
            "{fell} although the pose changed as usual: the target is hidden, or its appearance changed"
        ),
    }))
}

/// A change of illumination of the subframe, as a clause.
fn brightness(book: &Book<'_>) -> Option<String> {
    let now = book.trace.capture()?;
    if let Some(share) = now.subframe_saturated.map(f64::from).filter(|share| *share > SATURATED) {
        return Some(format!("{:.0} % of the subframe is saturated", 100.0 * share));
    }
    let change = f64::from(now.subframe_mean? / book.before?.capture()?.subframe_mean?) - 1.0;
    (change.abs() > BRIGHTNESS).then(|| {
        let percent = signed((100.0 * change).round());
        format!("the mean grey value around the target changed by {percent} %: a shadow, or another exposure")
    })
}
