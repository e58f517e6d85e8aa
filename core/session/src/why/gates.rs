//! The gates of a step in explanations: value, limit and margin.

use std::sync::LazyLock;

use super::Book;
use super::node::Draft;
use sightline_rover::visual_odometry;
use sightline_track::gate::GateKind;
use sightline_track::locate::gate_kinds;
use sightline_track::stages::judge::Gate;

/// The display name of a gate: the label of its declaration; for an unknown gate its name.
pub fn label(name: &str) -> &str {
    static KINDS: LazyLock<Vec<GateKind>> = LazyLock::new(gate_kinds);
    let mut all = KINDS.iter().chain(visual_odometry::gate_kinds());
    all.find(|kind| kind.name == name).map_or(name, |kind| kind.label)
}

/// A gate with its relative margin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margin<'a> {
    /// The gate.
    pub gate: &'a Gate,
    /// Its margin over the magnitude of its limit, which makes gates of different units comparable; −∞ if there was nothing
    /// to judge.
    pub relative: f64,
}

/// The gates, worst margin first; equal ones in the order of the paper.
pub fn by_margin(gates: &[Gate]) -> Vec<Margin<'_>> {
    let margin = |gate| Margin { gate, relative: relative_margin(gate) };
    let mut margins: Vec<Margin<'_>> = gates.iter().map(margin).collect();
    margins.sort_by(|a, b| a.relative.total_cmp(&b.relative));
    margins
}

fn relative_margin(gate: &Gate) -> f64 {
    let size = if gate.limit.abs() > 1e-12 { gate.limit.abs() } else { 1.0 };
    gate.margin.map_or(f64::NEG_INFINITY, |margin| margin / size)
}

/// The name of the value that a gate judges.
pub(super) fn judged(gate: &str) -> &str {
    match gate {
        "stereo_ncc" => "stereo_score",
        "far_ncc" => "ncc",
        other => other,
    }
}

impl Book<'_> {
    pub(super) fn find_gate(&self, name: &str) -> Option<&Gate> {
        let mut judged = self.trace.verdict().into_iter().flat_map(|verdict| &verdict.gates);
        judged.find(|gate| gate.name == name).or_else(|| self.odometry_gate(name))
    }

    /// The margin of a gate.
    pub(super) fn gate(&self, name: &str) -> Option<Draft> {
        let gate = self.find_gate(name)?;
        let word = if gate.passed { "pass" } else { "FAIL" };
        let (relation, formula) =
            if gate.at_least { ("≥", "value − limit") } else { ("≤", "limit − value") };
        let inputs = [format!("value.{name}"), format!("limit.{name}")];
        let words = format!("margin of gate {} ({} {relation} limit): {word}", gate.criterion, label(name));
        let draft = Draft::numbers(self.judge_of(gate), &words, &gate.unit, gate.margin);
        let draft = Draft { text: Some(word.to_owned()), ..draft };
        let inputs: Vec<&str> = inputs.iter().map(String::as_str).collect();
        Some(match gate.margin {
            Some(_) => draft.exactly(formula, &inputs),
            None => draft.roughly("nothing was found to judge", &inputs),
        })
    }

    /// The value of a gate at the time of judgement.
    pub(super) fn gate_value(&self, name: &str) -> Option<Draft> {
        let gate = self.find_gate(name)?;
        let Some(value) = gate.value else {
            let judge = self.judge_of(gate);
            let missing = match &self.trace.odometry {
                Some(measured) if judge != "judge" => measured.update.missing.clone(),
                _ => self.trace.located().and_then(|located| located.missing.clone()),
            };
            let why = missing.unwrap_or_else(|| "nothing was found to judge".to_owned());
            return Some(Draft::text(judge, name, "none").roughly(&why, &[judged(name)]));
        };
        // The explanation of the same value under its own name, if it has one.
        let own = self
            .odometry_value(gate)
            .or_else(|| self.of_template(judged(name)))
            .or_else(|| self.of_stereo(judged(name)))
            .or_else(|| self.of_position(judged(name)))
            .or_else(|| self.of_others(judged(name)))
            .or_else(|| self.of_check(name))?;
        Some(Draft { numbers: vec![value], ..own })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_margin_comes_first_whatever_its_unit_and_what_was_not_found_before_all() {
        let gate = |name: &str, value: Option<f64>, limit: f64, at_least: bool| {
            let margin = value.map(|v| if at_least { v - limit } else { limit - v });
            let passed = margin.is_some_and(|m| m >= 0.0);
            Gate {
                criterion: 1,
                name: name.to_owned(),
                unit: String::new(),
                value,
                limit,
                at_least,
                margin,
                passed,
                setting: None,
            }
        };
        let gates = [
            gate("ncc", Some(0.9), 0.7, true),
            gate("distance", Some(0.05), 0.01, false),
            gate("stereo", None, 0.7, true),
            gate("position", Some(0.2), 0.3, false),
        ];
        let order: Vec<&str> = by_margin(&gates).iter().map(|margin| margin.gate.name.as_str()).collect();
        assert_eq!(order, ["stereo", "distance", "ncc", "position"]);
    }

    #[test]
    fn a_quantity_that_a_gate_judges_is_named_like_the_gate() {
        for (gate, quantities) in [
            ("ncc", ["step.ncc", "match_template.score"]),
            ("stereo_ncc", ["step.stereo_score", "point_stereo.score"]),
            ("distance_correction_m", ["step.distance_correction_m"; 2]),
            ("position_correction_m", ["step.position_correction_m"; 2]),
        ] {
            for name in quantities {
                let quantity = crate::records::StageQuantity::named(name).unwrap();
                assert_eq!(quantity.declared().label, label(gate), "{name}");
            }
        }
    }

    #[test]
    fn expressions_name_every_gate() {
        let gates = crate::expression::catalogue::gates();
        let named: std::collections::BTreeSet<&str> = gates.iter().map(|gate| gate.name.as_ref()).collect();
        let declared = sightline_track::locate::gate_kinds().into_iter().map(|kind| kind.name).collect();
        assert_eq!(named, declared);
    }
}
