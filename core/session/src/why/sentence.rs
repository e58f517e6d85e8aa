//! The verdict of a step as one sentence, made of its evidence.
//!
//! It names what failed, the worst first, with value, limit and by how much; then what the evidence adds: a peak at the rim
//! of the search window, a second peak as good, how far off the prediction was, whether the truth lay outside the window;
//! then what the truth says of the decision, and at the end the part that visual odometry had in a loss.

use super::gates::by_margin;
use super::odometry;
use super::template::edge_distance_px;
use super::words::{number, told_apart};
use crate::step::RunStep;
use sightline_geometry::frames::Pixel;
use sightline_track::locate::Evidence;
use sightline_track::settings::Settings;
use sightline_track::stages::judge::{Gate, Verdict};
use sightline_track::target::TrackingState;
use sightline_track::trace::ODOMETRY_ALONE;

/// A peak so near to the rim may belong to one beyond it, px.
pub(super) const AT_RIM_PX: f64 = 3.0;

/// A second peak of such a share of the best may as well be the right one.
const AMBIGUOUS: f64 = 0.95;

/// The verdict in words; `before` is the step before, where there is one.
pub fn verdict(trace: &RunStep, before: Option<&RunStep>, settings: &Settings) -> String {
    if let Some(fault) = trace.fault() {
        return format!("Nothing could be judged, since the files of this stop are at fault: {fault}.");
    }
    if let (Some(before), None) = (trace.paused_before(), trace.verdict()) {
        return format!("Nothing is decided yet, since the drive is paused before {}.", before.word());
    }
    if trace.is_odometry_alone() {
        return format!("Nothing is judged here, since {ODOMETRY_ALONE}.");
    }
    let Some(verdict) = trace.verdict() else {
        return "The target was picked here: nothing had to be found again, and nothing is judged."
            .to_owned();
    };
    let mut parts = vec![decision(verdict, trace)];
    parts.extend(peak_words(trace, settings, verdict.accepted));
    parts.extend(prediction_words(trace, settings, verdict.accepted));
    parts.extend(lost_before(verdict, before));
    let mut sentence = parts.join("; ");
    sentence.push('.');
    if let Some(words) = truth_words(trace, verdict) {
        sentence.push(' ');
        sentence.push_str(&words);
    }
    if let Some(words) = odometry::finding(trace, before, settings) {
        sentence.push(' ');
        sentence.push_str(&words);
    }
    sentence
}

/// What was decided, with the criteria that decided it.
fn decision(verdict: &Verdict, trace: &RunStep) -> String {
    let margins = by_margin(&verdict.gates);
    let failed: Vec<String> = margins
        .iter()
        .filter(|m| !m.gate.passed && m.gate.value.is_some())
        .map(|m| failed_words(m.gate))
        .collect();
    let missing = trace.located().and_then(|located| located.missing.clone());
    if !verdict.good {
        let reasons: Vec<String> = failed.into_iter().chain(missing).collect();
        let unjudged = || "nothing was found to judge".to_owned();
        return format!("Rejected: {}", if reasons.is_empty() { unjudged() } else { reasons.join("; ") });
    }
    let nearest = margins.first().and_then(|m| {
        let side = if m.gate.at_least { "above" } else { "below" };
        let margin = format!("{} {}", number(m.gate.margin?), m.gate.unit);
        Some(format!("{} is nearest to its limit, {} {side} it", m.gate.name, margin.trim_end()))
    });
    let all = format!("all {} criteria are met", verdict.gates.len());
    let words = nearest.map_or(all.clone(), |nearest| format!("{all}, {nearest}"));
    if verdict.accepted {
        format!("Accepted: {words}")
    } else {
        format!("Good, but not used, since the target had failed before: {words}")
    }
}

fn failed_words(gate: &Gate) -> String {
    let value = gate.value.unwrap_or(f64::NAN);
    let [shown, limit] = told_apart(value, gate.limit);
    let side = if gate.at_least { "below" } else { "above" };
    let unit = if gate.unit.is_empty() { String::new() } else { format!(" {}", gate.unit) };
    format!(
        "{} {shown}{unit} is {side} {limit}{unit} by {}{unit}",
        gate.name,
        number((value - gate.limit).abs())
    )
}

/// What is odd about the peak.
fn peak_words(trace: &RunStep, settings: &Settings, accepted: bool) -> Vec<String> {
    let located = trace.located().map(|located| &located.evidence);
    let Some(Evidence::Template(evidence)) = located else { return Vec::new() };
    let Some(matched) = evidence.match_template.as_ref().filter(|_| !accepted) else { return Vec::new() };
    let mut words = Vec::new();
    if matched.descent.is_none() {
        let rim_px = edge_distance_px(matched, settings.template.template_size_px);
        if rim_px <= AT_RIM_PX {
            words.push(match rim_px as i64 {
                0 => "the peak lies on the rim of the search window".to_owned(),
                1 => "the peak lies 1 px from the rim of the search window".to_owned(),
                px => format!("the peak lies {px} px from the rim of the search window"),
            });
        }
    }
    if let Some(second) = matched.second_peak.as_ref().filter(|second| second.ratio >= AMBIGUOUS) {
        words.push(format!(
            "a second peak {} px away scores {} of the best",
            number(second.distance_px),
            number(second.ratio)
        ));
    }
    words
}

/// How far off the prediction was, by the truth where that is known, else by the match.
fn prediction_words(trace: &RunStep, settings: &Settings, accepted: bool) -> Option<String> {
    let predicted = trace.point_mast.predicted_left.filter(|_| !accepted && trace.prediction().is_some())?;
    let template = trace.located().and_then(|located| match &located.evidence {
        Evidence::Template(evidence) => evidence.match_template.as_ref(),
        _ => None,
    });
    if let Some(truth) = trace.truth.as_ref().and_then(|truth| truth.left_pixel) {
        let off = format!("prediction off by {} px", number(predicted.distance(truth)));
        let half = f64::from(settings.template.template_size_px / 2);
        let is_outside = template.is_some_and(|matched| {
            let window = matched.search_window;
            let out = |at: f64, start: i32, length: u32| {
                at < f64::from(start) + half || at > f64::from(start) + f64::from(length) - 1.0 - half
            };
            out(truth.x, window.x, window.width) || out(truth.y, window.y, window.height)
        });
        let beyond = "the truth lies outside the positions searched";
        return Some(if is_outside { format!("{off}, so that {beyond}") } else { off });
    }
    let matched: Pixel = template?.pixel;
    Some(format!("the match lies {} px from the prediction", number(predicted.distance(matched))))
}

/// That it was lost before already.
fn lost_before(verdict: &Verdict, before: Option<&RunStep>) -> Option<String> {
    match (verdict.state_before, verdict.good) {
        (TrackingState::Lost { count: 1 }, false) => Some("the update before was bad already".to_owned()),
        (TrackingState::Lost { count }, false) => {
            Some(format!("the {count} updates before were bad already"))
        }
        (TrackingState::Failed, _) => {
            let step =
                before.map_or_else(String::new, |before| format!(" at step {} or before", before.step));
            Some(format!("the target had failed{step}, and stays so until it is picked again"))
        }
        _ => None,
    }
}

/// What the truth says of the decision.
fn truth_words(trace: &RunStep, verdict: &Verdict) -> Option<String> {
    let truth = trace.truth.as_ref()?;
    let (err_px, tolerance_px) = (truth.err_px?, truth.tolerance_px);
    let [err, tolerance] = told_apart(err_px, tolerance_px);
    match (verdict.accepted, err_px <= tolerance_px) {
        (true, false) => Some(format!(
            "That is FALSE: what was found lies {err} px from the truth, {tolerance} px are allowed."
        )),
        (false, true) => Some(format!("Yet what was found was right: {err} px from the truth.")),
        (false, false) => Some(format!("And rightly so: what was found lies {err} px from the truth.")),
        (true, true) => None,
    }
}
