//! The one gate of the feature tracker, on its confidence (D§2, R185).
//!
//! It uses neither scores nor the prediction, whose errors may be large (R156). The combined tracker uses it as well.
//!
//! | gate | value | limit |
//! |---|---|---|
//! | 10 `confidence` | confidence of the motion, from its number of inliers | ≥ `confidence_min`; once lost ≥ `confidence_return` |

use crate::gate::{Gate, GateKind, Side, Unit};
use crate::locate::tracker::GateInput;

pub(in crate::locate) const CONFIDENCE: GateKind = GateKind {
    number: 10,
    name: "confidence",
    label: "confidence",
    unit: Unit::One,
    side: Side::AtLeast,
    setting: Some("confidence_min"),
};

/// The gate on the confidence. A lost target must reach `confidence_return` to be tracked again (R185).
pub(in crate::locate) fn confidence(input: &GateInput<'_>) -> Gate {
    let value = input.is_located.then_some(input.confidence);
    match input.was_lost {
        true => CONFIDENCE.judge(value, input.limits.confidence_return).with_setting("confidence_return"),
        false => CONFIDENCE.judge(value, input.limits.confidence_min),
    }
}
