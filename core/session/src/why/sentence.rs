//! The summary of a step: a headline with the root cause, and at most three bullets with evidence.
//!
//! | step | headline | bullets |
//! |---|---|---|
//! | rejected | the cause, found without the truth (`cause`) | failed gates; peak and prediction; truth and odometry |
//! | accepted | the gate with the smallest margin | false tracking, if the truth shows it |
//! | others | why nothing is judged | none |

use super::gates::{by_margin, label};
use super::template::edge_distance_px;
use super::words::{capitalised, number, told_apart};
use super::{Book, cause, jump, odometry};
use crate::step::RunStep;
use sightline_geometry::frames::Pixel;
use sightline_track::locate::Evidence;
use sightline_track::settings::Settings;
use sightline_track::stages::judge::{Gate, Verdict};
use sightline_track::target::TrackingState;
use sightline_vision::image::PixelRect;
use sightline_world::target_truth::TruthKind;

/// Maximum distance from the edge of the search window at which the true peak may be beyond it, px.
pub(super) const AT_RIM_PX: f64 = 3.0;

/// Minimum ratio of second to best peak at which either may be the right one.
const AMBIGUOUS: f64 = 0.95;

/// The outcome of a step and its cause, in sentences.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Summary {
    /// The root cause of a loss, else the verdict.
    pub headline: String,
    /// At most three further sentences of evidence.
    pub bullets: Vec<String>,
}

impl Summary {
    fn new(headline: impl Into<String>) -> Self {
        Self { headline: headline.into(), bullets: Vec::new() }
    }

    /// All sentences in one line.
    pub fn text(&self) -> String {
        let bullets = self.bullets.iter().map(|bullet| format!(" {bullet}"));
        std::iter::once(self.headline.clone()).chain(bullets).collect()
    }
}

impl Book<'_> {
    /// The summary of the step.
    pub fn summary(&self) -> Summary {
        let trace = self.trace;
        if let Some(fault) = trace.fault() {
            return Summary::new(format!(
                "Nothing could be judged: the files of this stop are damaged: {fault}."
            ));
        }
        if let (Some(before), None) = (trace.paused_before(), trace.verdict()) {
            return Summary::new(format!(
                "Nothing is decided yet: the drive is paused before {}.",
                before.word()
            ));
        }
        if let Some(why) = trace.why_not_searched() {
            return Summary::new(format!("Nothing is judged here: {why}."));
        }
        let Some(verdict) = trace.verdict() else {
            return Summary::new("Target designated here; no match yet.");
        };
        if verdict.good {
            let headline = format!("{}.", decision(verdict, trace));
            return Summary { headline, bullets: truth_words(trace, verdict).into_iter().collect() };
        }
        self.of_rejected(verdict)
    }

    fn of_rejected(&self, verdict: &Verdict) -> Summary {
        let trace = self.trace;
        let cause = cause::find(self, verdict);
        let headline = cause.as_ref().map_or(cause::NONE, |cause| &cause.sentence);
        let mut context = peak_words(trace, self.settings, verdict.accepted);
        context.extend(prediction_words(trace, self.settings, verdict.accepted));
        context.extend(cause.as_ref().and_then(|cause| cause.evidence.clone()));
        context.extend(lost_before(verdict, self.before));
        let context = (!context.is_empty()).then(|| format!("{}.", capitalised(&context.join("; "))));
        // Odometry is omitted if another cause is known.
        let is_open = cause.as_ref().is_none_or(|cause| cause.is_slip);
        let odometry = odometry::finding(trace, self.before, self.settings).filter(|finding| {
            (is_open || finding.is_refusal) && Some(&finding.sentence) != cause.as_ref().map(|c| &c.sentence)
        });
        let last: Vec<String> =
            truth_words(trace, verdict).into_iter().chain(odometry.map(|finding| finding.sentence)).collect();
        let last = (!last.is_empty()).then(|| last.join(" "));
        let bullets = [Some(format!("{}.", decision(verdict, trace))), context, last];
        Summary { headline: format!("{headline}."), bullets: bullets.into_iter().flatten().collect() }
    }
}

/// The decision, with the gates that caused it.
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
        Some(format!("{} is nearest to its limit, {} {side} it", label(&m.gate.name), margin.trim_end()))
    });
    let all = format!("all {} gates are met", verdict.gates.len());
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
        label(&gate.name),
        number((value - gate.limit).abs())
    )
}

/// Anomalies of the peak.
fn peak_words(trace: &RunStep, settings: &Settings, accepted: bool) -> Vec<String> {
    let located = trace.located().map(|located| &located.evidence);
    let Some(Evidence::Template(evidence)) = located else { return Vec::new() };
    let Some(matched) = evidence.match_template.as_ref().filter(|_| !accepted) else { return Vec::new() };
    let mut words = Vec::new();
    if matched.descent.is_none() {
        let rim_px = edge_distance_px(matched, settings.template.template_size_px);
        if rim_px <= AT_RIM_PX {
            words.push(match rim_px as i64 {
                0 => "the peak is on the rim of the search window".to_owned(),
                1 => "the peak is 1 px from the rim of the search window".to_owned(),
                px => format!("the peak is {px} px from the rim of the search window"),
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

/// The error of the prediction, relative to the truth if known, else to the match.
fn prediction_words(trace: &RunStep, settings: &Settings, accepted: bool) -> Option<String> {
    let predicted = trace.point_mast.predicted_left.filter(|_| !accepted && trace.prediction().is_some())?;
    let template = trace.located().and_then(|located| match &located.evidence {
        Evidence::Template(evidence) => evidence.match_template.as_ref(),
        _ => None,
    });
    if let Some(truth) = trace.truth.as_ref().and_then(|truth| truth.left_pixel) {
        let off = format!("the prediction is {} px from the truth", number(predicted.distance(truth)));
        let is_outside = jump::is_outside(trace, settings.template.template_size_px, truth);
        let is_cut = template.is_some_and(|matched| is_cut(trace, matched.search_window));
        let cut = if is_cut { ", which the edge of the image cuts off" } else { "" };
        let beyond = format!("which is outside the search window{cut}");
        return Some(if is_outside == Some(true) { format!("{off}, {beyond}") } else { off });
    }
    let matched: Pixel = template?.pixel;
    Some(format!("the match is {} px from the prediction", number(predicted.distance(matched))))
}

/// Whether a search window ends at an edge of the left image.
fn is_cut(trace: &RunStep, window: PixelRect) -> bool {
    let [width, height] = trace.point_mast.left.size;
    let end = |from: i32, length: u32| i64::from(from) + i64::from(length);
    window.x <= 0
        || window.y <= 0
        || end(window.x, window.width) >= i64::from(width)
        || end(window.y, window.height) >= i64::from(height)
}

/// The clause for a target that was already lost or failed.
fn lost_before(verdict: &Verdict, before: Option<&RunStep>) -> Option<String> {
    match (verdict.state_before, verdict.good) {
        (TrackingState::Lost { count: 1 }, false) => Some("the update before was bad, too".to_owned()),
        (TrackingState::Lost { count }, false) => Some(format!("the {count} updates before were bad, too")),
        (TrackingState::Failed, _) => {
            let step =
                before.map_or_else(String::new, |before| format!(" at step {} or before", before.step));
            Some(format!("the target had failed{step}, and stays so until it is picked again"))
        }
        _ => None,
    }
}

/// The correctness of the decision by the truth.
fn truth_words(trace: &RunStep, verdict: &Verdict) -> Option<String> {
    let truth = trace.truth.as_ref()?;
    let (err_px, tolerance_px) = (truth.err_px?, truth.tolerance_px);
    let [err, tolerance] = told_apart(err_px, tolerance_px);
    let from = match truth.kind {
        TruthKind::Surface => "the truth",
        TruthKind::Carried => "the first estimate carried by the true poses",
    };
    match (verdict.accepted, err_px <= tolerance_px) {
        (true, false) => {
            // An error of the designation itself is propagated.
            let claim = match truth.kind {
                TruthKind::Surface => "FALSE tracking",
                TruthKind::Carried => "FALSE tracking, or an inaccurate first estimate",
            };
            Some(format!("{claim}: the match is {err} px from {from} (tolerance {tolerance} px)."))
        }
        (false, true) => Some(format!("False loss: the match is right, {err} px from {from}.")),
        (false, false) => Some(format!("Correct rejection: the match is {err} px from {from}.")),
        (true, true) => None,
    }
}
