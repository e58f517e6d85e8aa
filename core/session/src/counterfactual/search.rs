//! The search for the smallest change of one setting: doubling until the goal is reached, then bisection.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::trials::{Reach, Trials};
use crate::step::RunStep;
use crate::track::Drive;
use sightline_geometry::error::Result;
use sightline_track::limits::{Domain, SettingInfo};
use sightline_track::settings::Changes;

/// The first change of a real number, as a fraction of its value.
const FIRST_SHARE: f64 = 0.01;
/// The first change of a real number that is 0, as a fraction of its range.
const FIRST_OF_RANGE: f64 = 1e-4;
/// Number of doublings before the end of the range is tried.
const DOUBLINGS: u32 = 16;
/// The width of the bracket of a real number at which the bisection ends, as a fraction of the change.
const BRACKET: f64 = 0.02;

/// A value of a setting with the step that was computed with it.
pub(super) type Verified = (Value, RunStep);

/// The values that a numeric setting may take, relative to its current value.
#[derive(Clone, Copy, Debug)]
struct Grid {
    from: f64,
    low: f64,
    high: f64,
    /// Distance of neighbouring values; 0 for real numbers.
    pitch: f64,
}

impl Grid {
    fn of(info: &SettingInfo, from: &Value) -> Option<Self> {
        let from = from.as_f64()?;
        match info.domain {
            Domain::OddBetween(low, high) => {
                let odd_below = |v: u32| f64::from(if v.is_multiple_of(2) { v - 1 } else { v });
                let odd_above = |v: u32| f64::from(v | 1);
                Some(Self { from, low: odd_above(low), high: odd_below(high), pitch: 2.0 })
            }
            Domain::Between(low, high) => {
                let pitch = if info.default.is_u64() { 1.0 } else { 0.0 };
                Some(Self { from, low, high, pitch })
            }
            _ => None,
        }
    }

    /// The sizes of the changes to try in a direction (+1 or −1), ascending; the end of the range is last.
    fn changes(&self, direction: f64) -> Vec<f64> {
        let end = if direction > 0.0 { self.high - self.from } else { self.from - self.low };
        let first = match (self.pitch > 0.0, self.from == 0.0) {
            (true, _) => self.pitch,
            (false, true) => FIRST_OF_RANGE * (self.high - self.low),
            (false, false) => FIRST_SHARE * self.from.abs(),
        };
        let mut changes: Vec<f64> =
            (0..DOUBLINGS).map(|k| first * 2f64.powi(k as i32)).take_while(|change| *change < end).collect();
        if end > 0.0 {
            changes.push(end);
        }
        changes
    }

    fn value(&self, change: f64) -> Value {
        let value = (self.from + change).clamp(self.low, self.high);
        if self.pitch > 0.0 { json!(value.round() as i64) } else { json!(value) }
    }
}

/// The trials of one setting.
struct Probe<'p, 'a, D: Drive> {
    trials: &'p mut Trials<'a, D>,
    info: &'p SettingInfo,
    grid: Grid,
    /// The outcomes by the bits of the signed change.
    known: BTreeMap<u64, Reach>,
}

impl<D: Drive> Probe<'_, '_, D> {
    /// The outcome of a signed change; each is computed once.
    fn reach(&mut self, change: f64) -> Result<Reach> {
        let key = change.to_bits();
        if let Some(known) = self.known.get(&key) {
            return Ok(*known);
        }
        let value = self.grid.value(change);
        let changes = Changes::from([(self.info.key.clone(), value)]);
        let reach = match self.rejudged(&changes) {
            Some(reach) => reach,
            None => {
                let tried = self.trials.run(&changes, None)?;
                tried.map_or(Reach::Not, |trace| self.trials.reach(&trace))
            }
        };
        self.known.insert(key, reach);
        Ok(reach)
    }

    /// The outcome by repeating `judge` alone, for limits of the template tracker, which influence no other stage.
    /// `None` for other settings.
    fn rejudged(&self, changes: &Changes) -> Option<Reach> {
        let is_limit = self.info.group == "limits";
        let is_template = matches!(
            self.trials.base.recorded.located()?.evidence,
            sightline_track::locate::Evidence::Template(_)
        );
        let settings = self.trials.base.settings.with(changes).ok().filter(|_| is_limit && is_template)?;
        self.trials.rejudged(&settings.limits)
    }

    /// The brackets of the smallest changes with at least this outcome, in both directions at once; empty if there are none.
    fn brackets(&mut self, wanted: Reach) -> Result<Vec<[f64; 2]>> {
        let ways = [1.0, -1.0].map(|direction| (direction, self.grid.changes(direction)));
        let rounds = ways.iter().map(|(_, changes)| changes.len()).max().unwrap_or(0);
        for round in 0..rounds {
            let mut found = Vec::new();
            for (direction, changes) in &ways {
                let Some(change) = changes.get(round) else { continue };
                if self.reach(direction * change)? >= wanted {
                    let before = round.checked_sub(1).map_or(0.0, |k| changes[k]);
                    found.push([direction * before, direction * change]);
                }
            }
            if !found.is_empty() {
                return Ok(found);
            }
        }
        Ok(Vec::new())
    }

    /// Bisects a bracket between a change without the wanted outcome and one with it.
    fn halved(&mut self, [mut not, mut does]: [f64; 2], wanted: Reach) -> Result<[f64; 2]> {
        let pitch = self.grid.pitch;
        loop {
            let width = (does - not).abs();
            let is_done = if pitch > 0.0 { width <= pitch * 1.5 } else { width <= BRACKET * does.abs() };
            if is_done {
                return Ok([not, does]);
            }
            let middle = (not + does) / 2.0;
            let middle = if pitch > 0.0 { not + ((middle - not) / pitch).round() * pitch } else { middle };
            if self.reach(middle)? >= wanted { does = middle } else { not = middle }
        }
    }
}

/// Finds the smallest change of a setting that reaches the goal.
pub(super) fn smallest<D: Drive>(
    trials: &mut Trials<'_, D>,
    info: &SettingInfo,
    from: &Value,
) -> Result<Option<Verified>> {
    if let Some(grid) = Grid::of(info, from) {
        let mut probe = Probe { trials, info, grid, known: BTreeMap::new() };
        // A false acceptance counts only if no change leads to a right one.
        for wanted in [Reach::Yes, Reach::ButFalse] {
            let brackets = probe.brackets(wanted)?;
            let halved: Vec<[f64; 2]> =
                brackets.into_iter().map(|bracket| probe.halved(bracket, wanted)).collect::<Result<_>>()?;
            let nearest = halved.into_iter().min_by(|a, b| a[1].abs().total_cmp(&b[1].abs()));
            let Some([not, does]) = nearest else { continue };
            return settle(&mut probe, not, does, wanted);
        }
        return Ok(None);
    }
    let values: Vec<Value> = match &info.domain {
        Domain::Switch => vec![json!(!from.as_bool().unwrap_or_default())],
        Domain::Choice(words) => words.iter().map(|word| json!(word)).filter(|word| word != from).collect(),
        _ => Vec::new(),
    };
    let mut best: Option<(Reach, Verified)> = None;
    for value in values {
        let tried = trials.run(&Changes::from([(info.key.clone(), value.clone())]), None)?;
        let Some(trace) = tried else { continue };
        let reach = trials.reach(&trace);
        if reach > best.as_ref().map_or(Reach::Not, |(known, _)| *known) {
            best = Some((reach, (value, trace)));
        }
    }
    Ok(best.map(|(_, verified)| verified))
}

/// The roundest number of a bracket, verified; else its outer end.
fn settle<D: Drive>(
    probe: &mut Probe<'_, '_, D>,
    not: f64,
    does: f64,
    wanted: Reach,
) -> Result<Option<Verified>> {
    let grid = probe.grid;
    let round = round_outward(grid.from, grid.from + not, grid.from + does).clamp(grid.low, grid.high);
    let exact = grid.value(does);
    let values = if grid.pitch > 0.0 { vec![exact] } else { vec![json!(round), exact] };
    for value in values {
        let verified = verified(probe.trials, probe.info, value)?;
        if let Some(found) = verified.filter(|(_, trace)| probe.trials.reach(trace) >= wanted) {
            return Ok(Some(found));
        }
    }
    Ok(None)
}

/// Computes the step with a value; `None` if the goal is not reached.
pub(super) fn verified<D: Drive>(
    trials: &mut Trials<'_, D>,
    info: &SettingInfo,
    value: Value,
) -> Result<Option<Verified>> {
    let tried = trials.run(&Changes::from([(info.key.clone(), value.clone())]), None)?;
    Ok(tried.filter(|trace| trials.reach(trace) > Reach::Not).map(|trace| (value, trace)))
}

/// The number with the fewest digits between `not` (excluded) and `does`, the end farther from `from`, or beyond `does` by
/// at most a tenth of the change. If `not` equals `from`, only numbers from `does` outward count.
pub(super) fn round_outward(from: f64, not: f64, does: f64) -> f64 {
    let change = (does - from).abs();
    if change == 0.0 || !change.is_finite() {
        return does;
    }
    let outward = (does - from).signum();
    for digits in -6..=12 {
        let unit = 10f64.powi(-digits);
        let multiple = if outward > 0.0 { (does / unit).ceil() } else { (does / unit).floor() };
        // Dividing by a power of ten gives the float nearest to the decimal number.
        let rounded = if digits > 0 { multiple / 10f64.powi(digits) } else { multiple * unit };
        let inward = if outward > 0.0 { (does / unit).floor() } else { (does / unit).ceil() };
        let inward = if digits > 0 { inward / 10f64.powi(digits) } else { inward * unit };
        if not != from && (inward - not) * outward > 0.0 {
            return inward;
        }
        if (rounded - does).abs() <= 0.1 * change {
            return rounded;
        }
    }
    does
}

/// The size of a change over the current value; over the range if that is 0; 1 for switches and words.
pub(super) fn relative(info: &SettingInfo, from: &Value, to: &Value) -> f64 {
    let (Some(from), Some(to)) = (from.as_f64(), to.as_f64()) else { return 1.0 };
    let range = match info.domain {
        Domain::Between(low, high) => high - low,
        Domain::OddBetween(low, high) => f64::from(high - low),
        Domain::Switch | Domain::Choice(_) => 1.0,
    };
    (to - from).abs() / if from == 0.0 { range } else { from.abs() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_track::settings::Settings;

    #[test]
    fn a_limit_is_rounded_away_from_its_present_value_to_a_sensible_digit() {
        assert_eq!(round_outward(0.7, 0.7, 0.643_712), 0.64);
        assert_eq!(round_outward(0.7, 0.7, 0.699_871), 0.69987);
        assert_eq!(round_outward(1.5, 1.5, 2.313), 2.32);
        assert_eq!(round_outward(3.0, 3.0, 3.0), 3.0);
        let loose = round_outward(0.7, 0.7, 0.412_9);
        assert!(loose <= 0.412_9 && loose > 0.412_9 - 0.1 * (0.7 - 0.412_9));
    }

    #[test]
    fn a_bracket_gives_its_roundest_number() {
        assert_eq!(round_outward(10.0, 12.4, 12.61), 12.6);
        assert_eq!(round_outward(0.7, 0.652, 0.643), 0.65);
        assert_eq!(round_outward(-1.0, -1.77, -1.81), -1.8);
    }

    #[test]
    fn the_grid_of_an_odd_setting_ends_at_odd_numbers_and_doubles_its_changes() {
        let table = Settings::table();
        let info = table.iter().find(|info| info.key == "search_window_px").unwrap();
        let grid = Grid::of(info, &json!(41)).unwrap();
        let values: Vec<i64> =
            grid.changes(1.0).iter().map(|change| grid.value(*change).as_i64().unwrap()).collect();
        assert_eq!(values, [43, 45, 49, 57, 73, 105, 169, 297, 553, 1023]);
        assert_eq!(grid.changes(-1.0), [2.0, 4.0, 8.0, 16.0, 20.0]);
        assert!((relative(info, &json!(41), &json!(61)) - 20.0 / 41.0).abs() < 1e-15);
    }
}
