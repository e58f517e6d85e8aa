//! The smallest change of one limit that opens vetoed paths.
//!
//! An arc opens if it passes every check with one limit raised and the others kept. The candidates for the limit of a term
//! are the largest values of that term under the vetoed paths, rounded up to a sensible number of digits; the vetoes are
//! checked again on the same map with each of them.
//!
//! ```text
//! limit = bad − g · (bad − ok)   ⟹   bad = (limit − g · ok)/(1 − g)      g: `goodness_min`
//! ```
//! Frame and units: those of the terms.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::driving::motion::Motion;
use crate::driving::path_choice::{Candidate, PathChoice};
use crate::driving::select_path::PathInput;
use crate::hazards::goodness::{GoodnessMap, HazardTerm};
use crate::hazards::settings::HazardSettings;
use sightline_track::limits::{Domain, SettingInfo};

use super::ground::Ground;
use super::limits::{MEASURED, VetoLimits};
use super::path::{Path, Stance};
use super::settings::NavigatorSettings;

/// A raised limit and the paths that it opens.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LimitChange {
    /// The term.
    pub term: HazardTerm,
    /// Its limit in the decision: deg, m, m, fraction.
    pub limit: f64,
    /// The raised limit.
    pub raised: f64,
    /// The setting that determines the limit.
    pub setting: String,
    /// Value of the setting for the raised limit.
    pub setting_value: f64,
    /// Indices of the candidates that it opens.
    pub opens: Vec<usize>,
}

impl LimitChange {
    /// Relative change of the limit.
    pub fn relative(&self) -> f64 {
        self.raised / self.limit - 1.0
    }

    /// Describes the change in a sentence.
    pub fn sentence(&self) -> String {
        let [raised, limit] = [self.raised, self.limit].map(|value| self.term.text(value));
        let name = self.term.word();
        let plural = if self.opens.len() == 1 { "" } else { "s" };
        format!("a {name} limit of {raised} instead of {limit} opens {} path{plural}", self.opens.len())
    }
}

/// For each term the smallest raised limit that opens a vetoed path of a decision, or (if given) that path; sorted by
/// relative change. Terms that open no path are left out.
pub fn counterfactual(
    choice: &PathChoice,
    input: &PathInput<'_>,
    settings: &NavigatorSettings,
    path: Option<usize>,
) -> Vec<LimitChange> {
    let Some(map) = input.map else { return Vec::new() };
    let limits = VetoLimits::new(&map.settings, settings);
    let case = Case { choice, map, start: Stance::of(input.site_from_rover), settings, limits, path };
    let terms = MEASURED.into_iter().chain([HazardTerm::Unknown]);
    let mut changes: Vec<LimitChange> = terms.filter_map(|term| case.smallest(term)).collect();
    changes.sort_by(|a, b| a.relative().total_cmp(&b.relative()));
    changes
}

/// A decision with the inputs to check its vetoes again.
struct Case<'a> {
    choice: &'a PathChoice,
    map: &'a GoodnessMap,
    start: Stance,
    settings: &'a NavigatorSettings,
    limits: VetoLimits,
    path: Option<usize>,
}

impl Case<'_> {
    /// Vetoed arcs; the veto of a turn may be that of an arc after it.
    fn vetoed(&self) -> impl Iterator<Item = (usize, &Candidate)> {
        let is_vetoed = |candidate: &Candidate| {
            candidate.veto.is_some() && matches!(candidate.motion, Motion::Arc { .. })
        };
        self.choice.candidates.iter().enumerate().filter(move |(_, candidate)| is_vetoed(candidate))
    }

    fn path_of<'b>(&'b self, ground: &'b Ground<'b>, candidate: &Candidate) -> Path<'b> {
        // The veto concerns the driven part only.
        Path::new(ground, &self.start, &candidate.motion, 0.0, self.settings)
    }

    fn smallest(&self, term: HazardTerm) -> Option<LimitChange> {
        let ground = Ground::new(self.map, self.limits);
        let limit = self.limits.of(term);
        let wanted = |(index, _): &(usize, &Candidate)| self.path.is_none_or(|path| path == *index);
        let mut raised: Vec<f64> = self
            .vetoed()
            .filter(wanted)
            .map(|(_, candidate)| rounded_up(self.path_of(&ground, candidate).largest(term), term))
            .filter(|value| *value > limit)
            .collect();
        raised.sort_by(f64::total_cmp);
        raised.dedup();
        raised.into_iter().find_map(|raised| self.opened(term, raised))
    }

    /// The change to a limit, if it opens a path.
    fn opened(&self, term: HazardTerm, raised: f64) -> Option<LimitChange> {
        let (setting, setting_value) = setting_of(term, raised, &self.map.settings, self.settings)?;
        let ground = Ground::new(self.map, self.limits.with(term, raised));
        let is_open =
            |(_, candidate): &(usize, &Candidate)| self.path_of(&ground, candidate).veto().is_none();
        let opens: Vec<usize> = self.vetoed().filter(is_open).map(|(index, _)| index).collect();
        let is_wanted = self.path.map_or(!opens.is_empty(), |path| opens.contains(&path));
        let limit = self.limits.of(term);
        is_wanted.then_some(LimitChange { term, limit, raised, setting, setting_value, opens })
    }
}

/// Rounds up to the resolution of the term: 0.1°, 1 mm, 1 %.
fn rounded_up(value: f64, term: HazardTerm) -> f64 {
    let per_unit = match term {
        HazardTerm::Tilt => 10.0,
        HazardTerm::Roughness | HazardTerm::Step => 1000.0,
        HazardTerm::Unknown => 100.0,
    };
    let rounded = (value * per_unit).ceil() / per_unit;
    if rounded < value { rounded + 1.0 / per_unit } else { rounded }
}

/// The setting that gives a limit, with its value; `None` if out of its range.
fn setting_of(
    term: HazardTerm,
    limit: f64,
    hazards: &HazardSettings,
    navigator: &NavigatorSettings,
) -> Option<(String, f64)> {
    let least = navigator.goodness_min;
    let bad = |ok: f64| (limit - least * ok) / (1.0 - least);
    let (key, value, table) = match term {
        HazardTerm::Tilt => ("tilt_bad_deg", bad(hazards.tilt_ok_deg), HazardSettings::table()),
        HazardTerm::Roughness => ("roughness_bad_m", bad(hazards.roughness_ok_m), HazardSettings::table()),
        HazardTerm::Step => ("step_bad_m", bad(hazards.step_ok_m), HazardSettings::table()),
        HazardTerm::Unknown => ("unknown_share_max", limit, NavigatorSettings::table()),
    };
    let is_in_range = |info: &SettingInfo| match info.domain {
        Domain::Between(low, high) => (low..=high).contains(&value),
        _ => false,
    };
    table.iter().find(|info| info.key == key).filter(|info| is_in_range(info))?;
    Some((key.to_owned(), value))
}
