//! A change with a margin: the smallest change that reaches the goal leaves the peak or value at the limit.
//!
//! | setting | with margin |
//! |---|---|
//! | `search_window_px` | the peak is half a template, or an eighth of the window, farther from the edge |
//! | other numbers | a quarter more than the smallest change |
//!
//! Both are clamped to the range of the setting, and verified: the outcome with the margin must be at least as good.

use serde_json::{Value, json};

use super::search::{round_outward, verified};
use super::trials::Trials;
use super::{Goal, SettingChange};
use crate::step::RunStep;
use crate::track::Drive;
use sightline_geometry::error::Result;
use sightline_track::limits::{Domain, SettingInfo};

/// The fraction by which a change grows.
const GROWTH: f64 = 0.25;

/// The change with a margin; `None` if its outcome is worse than that of `trace`.
pub(super) fn of<D: Drive>(
    trials: &mut Trials<'_, D>,
    info: &SettingInfo,
    change: &SettingChange,
    trace: &RunStep,
) -> Result<Option<SettingChange>> {
    if trials.goal != Goal::Accepted {
        return Ok(None);
    }
    let template_px = f64::from(trials.base.settings.template.template_size_px);
    let Some(to) = wider(info, &change.from, &change.to, template_px) else { return Ok(None) };
    let least = trials.reach(trace);
    let found = verified(trials, info, to)?.filter(|(_, with)| trials.reach(with) >= least);
    Ok(found.map(|(to, _)| SettingChange { to, ..change.clone() }))
}

/// The value with the margin; `None` for words, switches, and at the end of the range.
fn wider(info: &SettingInfo, from: &Value, to: &Value, template_px: f64) -> Option<Value> {
    let (from, to) = (from.as_f64()?, to.as_f64()?);
    match info.domain {
        Domain::OddBetween(low, high) => {
            let is_window = info.key == "search_window_px" && to > from;
            let more = if is_window { template_px.max(GROWTH * to) } else { GROWTH * (to - from) };
            let odd = (to + more).clamp(f64::from(low), f64::from(high)).round() as i64 | 1;
            let odd = if odd > i64::from(high) { odd - 2 } else { odd };
            (odd as f64 != to).then(|| json!(odd))
        }
        Domain::Between(low, high) if info.default.is_u64() => {
            let whole = (to + GROWTH * (to - from)).round().clamp(low, high);
            (whole != to).then(|| json!(whole as i64))
        }
        Domain::Between(low, high) => {
            let more = round_outward(to, to, to + GROWTH * (to - from)).clamp(low, high);
            (more != to).then(|| json!(more))
        }
        Domain::Switch | Domain::Choice(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_track::settings::Settings;

    #[test]
    fn a_margin_is_half_a_template_of_the_window_or_a_quarter_of_the_change() {
        let table = Settings::table();
        let wider = |key: &str, from: Value, to: Value| {
            wider(table.iter().find(|info| info.key == key).unwrap(), &from, &to, 21.0)
        };
        assert_eq!(wider("search_window_px", json!(61), json!(71)), Some(json!(93)));
        assert_eq!(wider("search_window_px", json!(143), json!(181)), Some(json!(227)));
        assert_eq!(wider("search_window_px", json!(143), json!(1023)), None);
        assert_eq!(wider("ncc_min", json!(0.7), json!(0.6)), Some(json!(0.575)));
        assert_eq!(wider("roll", json!(true), json!(false)), None);
    }
}
