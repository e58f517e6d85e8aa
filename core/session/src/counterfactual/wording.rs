//! A finding as one sentence.

use serde_json::Value;

use super::{Finding, Outcome, SettingChange};
use crate::step::RunStep;
use crate::why::gates::label;
use crate::why::words::{number, setting_name, signed};

/// States the changes, the outcome, and the margin of the worst gate.
pub(super) fn sentence(finding: &Finding, trace: &RunStep) -> String {
    let mut what: Vec<String> = finding
        .changes
        .iter()
        .map(|change| format!("{} {}", setting_name(&change.setting), change.words()))
        .collect();
    if let Some(moved) = &finding.moved {
        let (dx, dy) = (moved.to.x - moved.from.x, moved.to.y - moved.from.y);
        let way = number(moved.from.distance(moved.to));
        what.push(format!(
            "the prediction moved by ({}, {}) px, {way} px ({})",
            signed(dx),
            signed(dy),
            moved.because
        ));
    }
    let truth = trace.truth.as_ref().and_then(|truth| truth.err_px);
    let off = truth.map_or_else(String::new, |err_px| format!(", {} px from the truth", number(err_px)));
    let outcome = match finding.outcome {
        Outcome::Right => format!("accepted, correct{off}"),
        Outcome::Rejected => "rejected, correct".to_owned(),
        Outcome::Unknown => "accepted (truth unknown)".to_owned(),
        Outcome::False => format!("accepted, but FALSE tracking{off}"),
    };
    let margin =
        finding.gate.as_ref().zip(finding.margin_after).map_or_else(String::new, |(gate, margin)| {
            format!("; {} margin {} {}", label(gate), signed(margin), finding.gate_unit).trim_end().to_owned()
        });
    format!("{}: {outcome}{margin}.", what.join(" and "))
}

impl SettingChange {
    /// The value before and after, with the unit.
    pub fn words(&self) -> String {
        format!("{} → {} {}", plain(&self.from), plain(&self.to), self.unit).trim_end().to_owned()
    }
}

/// A value of a setting without quotation marks.
fn plain(value: &Value) -> String {
    match (value.as_f64(), value.as_str()) {
        (Some(number), _) => format!("{number}"),
        (None, Some(word)) => word.to_owned(),
        (None, None) => value.to_string(),
    }
}
