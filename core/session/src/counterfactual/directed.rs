//! Changes that need no search: a failed gate passes if its limit is the value that failed.
//!
//! The limits of criteria 3 and 4 are proportional to `tolerance_factor`, so that with the value v, the limit l and the
//! factor g the answer is `g v / l`. All are rounded to the loose side, by at most a tenth of the change.

use serde_json::{Value, json};

use super::search::{relative, round_outward};
use super::trials::{Reach, Trials};
use super::{Finding, Goal, SettingChange, changes_of};
use crate::track::Drive;
use sightline_geometry::error::Result;
use sightline_track::limits::{Domain, SettingInfo};
use sightline_track::settings::Settings;
use sightline_track::stages::judge::Gate;

/// The value of a limit with which its own failed gates pass; `None` if it must be searched for.
pub(super) fn exact_limit<D: Drive>(
    trials: &Trials<'_, D>,
    info: &SettingInfo,
    from: &Value,
) -> Option<Value> {
    let from = from.as_f64()?;
    if trials.goal == Goal::NotFalse {
        return switched_on(trials, info, from);
    }
    let verdict = trials.base.recorded.verdict()?;
    let failed: Vec<&Gate> = verdict.gates.iter().filter(|gate| !gate.passed).collect();
    let own = |gate: &&&Gate| gate.setting.as_deref() == Some(info.key.as_str());
    // If a gate of another setting failed, no value of this limit helps; the search reports that.
    let all_own = !failed.is_empty() && failed.iter().filter(own).count() == failed.len();
    let wanted = all_own.then(|| failed.iter().map(|gate| wanted(gate, from)));
    let wanted: Vec<f64> = wanted?.collect::<Option<_>>()?;
    let farthest = wanted.into_iter().max_by(|a, b| (a - from).abs().total_cmp(&(b - from).abs()))?;
    in_domain(info, round_outward(from, from, farthest))
}

/// The value of the setting at which a failed gate just passes: the limit is the setting, or proportional to it.
fn wanted(gate: &Gate, from: f64) -> Option<f64> {
    let value = gate.value?;
    Some(if gate.limit == from { value } else { from * value / gate.limit })
}

/// The loosest limit with which a gate that is off rejects the step: just below the value that it would judge.
fn switched_on<D: Drive>(trials: &Trials<'_, D>, info: &SettingInfo, from: f64) -> Option<Value> {
    let evidence = trials.base.recorded.template()?;
    let value = match info.key.as_str() {
        "left_right_max_px" if from == 0.0 => evidence.point_stereo.as_ref()?.left_right_px?,
        "match_sigma_max_px" if from == 0.0 => {
            let covariance = evidence.match_template.as_ref()?.covariance_px2;
            covariance.symmetric_eigenvalues().max().max(0.0).sqrt()
        }
        _ => return None,
    };
    // Three digits, strictly below.
    let unit = 10f64.powf(value.max(1e-6).log10().floor() - 2.0);
    in_domain(info, (value / unit - 1e-6).floor() * unit)
}

fn in_domain(info: &SettingInfo, value: f64) -> Option<Value> {
    match info.domain {
        Domain::Between(low, high) if (low..=high).contains(&value) => Some(json!(value)),
        _ => None,
    }
}

/// Changes of the limits of all failed gates; `None` unless they belong to several settings.
pub(super) fn combined<D: Drive>(trials: &Trials<'_, D>) -> Option<Vec<SettingChange>> {
    if trials.goal != Goal::Accepted {
        return None;
    }
    let verdict = trials.base.recorded.verdict()?;
    let table = Settings::table();
    let mut changes: Vec<SettingChange> = Vec::new();
    for gate in verdict.gates.iter().filter(|gate| !gate.passed) {
        let key = gate.setting.as_deref()?;
        let info = table.iter().find(|info| info.key == key)?;
        let from = trials.base.settings.value(&info.group, &info.key)?.as_f64()?;
        let to = round_outward(from, from, wanted(gate, from)?);
        let known = changes.iter_mut().find(|change| change.setting == key);
        match known {
            Some(change)
                if change.to.as_f64().is_some_and(|other| (other - from).abs() >= (to - from).abs()) => {}
            Some(change) => change.to = in_domain(info, to)?,
            None => changes.push(SettingChange {
                setting: key.to_owned(),
                from: json!(from),
                to: in_domain(info, to)?,
                unit: info.unit.clone(),
            }),
        }
    }
    (changes.len() > 1).then_some(changes)
}

/// The finding with several changed limits; `None` if the goal is not reached.
pub(super) fn together<D: Drive>(
    trials: &mut Trials<'_, D>,
    changes: &[SettingChange],
) -> Result<Option<Finding>> {
    let before = trials.runs;
    let tried = trials.run(&changes_of(changes), None)?;
    let Some(trace) = tried.filter(|trace| trials.reach(trace) > Reach::Not) else { return Ok(None) };
    let table = Settings::table();
    let size = |change: &SettingChange| {
        let info = table.iter().find(|info| info.key == change.setting);
        info.map_or(1.0, |info| relative(info, &change.from, &change.to))
    };
    // The size of several changes is the sum of their sizes.
    let total = changes.iter().map(size).sum();
    let runs = trials.runs - before;
    Ok(Some(trials.finding(changes.to_vec(), None, total, (&trace, runs))))
}
