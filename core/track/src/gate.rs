//! Gates: a value of the evidence compared with a limit, and the setting behind that limit.
//!
//! A [`GateKind`] is declared once, in the file of the tracker whose evidence it judges; it fixes number, name, unit, side
//! and setting. Numbers are stable: a number is never given to another gate, and never reused. Numbers 1 to 4 are the
//! criteria of K§4.6, from 5 on ours; `locate::gate_kinds` lists all.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use sightline_record::GateRecord;
pub use sightline_record::{Side, Unit};

/// The declaration of a gate, without value and limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GateKind {
    /// The number, unique over all trackers.
    pub number: u8,
    /// The name, unique over all trackers.
    pub name: &'static str,
    /// The name in words, unique over all trackers.
    pub label: &'static str,
    /// The unit of value, limit and margin.
    pub unit: Unit,
    /// The side on which a value passes.
    pub side: Side,
    /// The setting that the limit equals or is proportional to; `None` for a limit that no setting gives.
    pub setting: Option<&'static str>,
}

impl GateKind {
    /// Compares `value` with `limit`; a missing value fails.
    pub fn judge(&self, value: Option<f64>, limit: f64) -> Gate {
        let at_least = self.side == Side::AtLeast;
        let margin = value.map(|v| if at_least { v - limit } else { limit - v });
        Gate {
            criterion: self.number,
            name: self.name.to_owned(),
            unit: self.unit.symbol().to_owned(),
            value,
            limit,
            at_least,
            margin,
            passed: margin.is_some_and(|m| m >= 0.0),
            setting: self.setting.map(str::to_owned),
        }
    }
}

/// Correction of the distance against the prediction, which `judge` computes for every tracker (R83).
pub const DISTANCE_CORRECTION: GateKind = GateKind {
    number: 3,
    name: "distance_correction_m",
    label: "range change",
    unit: Unit::Metre,
    side: Side::AtMost,
    setting: Some("tolerance_factor"),
};

/// Correction of the position since the designation, which `judge` computes for every tracker (R84).
pub const POSITION_CORRECTION: GateKind = GateKind {
    number: 4,
    name: "position_correction_m",
    label: "site position",
    unit: Unit::Metre,
    side: Side::AtMost,
    setting: Some("tolerance_factor"),
};

impl From<&Gate> for GateRecord {
    fn from(gate: &Gate) -> Self {
        Self { name: gate.name.clone(), value: gate.value, limit: gate.limit }
    }
}

/// One gate with its value and limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Gate {
    /// The gate's number: 1 to 4 as in K§4.6, from 5 on ours.
    pub criterion: u8,
    /// The name, unique over all trackers.
    pub name: String,
    /// The unit of value, limit and margin; empty for scores.
    pub unit: String,
    /// The value; null if the stop gave none.
    pub value: Option<f64>,
    /// The limit.
    pub limit: f64,
    /// Whether the value must be at least the limit; otherwise at most.
    pub at_least: bool,
    /// Distance of the value from the limit, in its unit: positive on the passing side, null without a value.
    pub margin: Option<f64>,
    /// Whether the gate is passed.
    pub passed: bool,
    /// The setting that the limit equals or is proportional to; null for a limit that no setting gives.
    #[serde(default)]
    pub setting: Option<String>,
}

impl Gate {
    /// Replaces the name of the setting that gives the limit.
    #[must_use]
    pub(crate) fn with_setting(self, setting: &str) -> Self {
        Self { setting: Some(setting.to_owned()), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KIND: GateKind = GateKind {
        number: 1,
        name: "score",
        label: "score",
        unit: Unit::One,
        side: Side::AtLeast,
        setting: Some("score_min"),
    };

    #[test]
    fn a_gate_reports_its_margin_and_fails_without_a_value() {
        let gate = KIND.judge(Some(0.75), 0.7);
        assert!(gate.passed && (gate.margin.unwrap() - 0.05).abs() < 1e-12);
        assert_eq!(gate.setting.as_deref(), Some("score_min"));
        assert!(!GateKind { side: Side::AtMost, ..KIND }.judge(Some(0.4), 0.3).passed);
        assert!(!KIND.judge(None, 0.7).passed);
    }
}
