//! Limits of the terms at which a path is vetoed.
//!
//! ```text
//! goodness < goodness_min  ⟺  value > bad − goodness_min · (bad − ok)
//! ```
//! for each of tilt, roughness and step: the limits are those of the hazard map at the navigator's smallest goodness.

use crate::hazards::goodness::{CellBasis, GoodnessCell, HazardTerm};
use crate::hazards::settings::HazardSettings;

use super::settings::NavigatorSettings;

/// Largest allowed value of each term under a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct VetoLimits {
    /// deg.
    pub(super) tilt_deg: f64,
    /// m.
    pub(super) roughness_m: f64,
    /// m.
    pub(super) step_m: f64,
    /// Fraction of unknown cells.
    pub(super) unknown_share: f64,
}

/// The terms of a measured cell.
pub(super) const MEASURED: [HazardTerm; 3] = [HazardTerm::Tilt, HazardTerm::Roughness, HazardTerm::Step];

impl VetoLimits {
    pub(super) fn new(hazards: &HazardSettings, navigator: &NavigatorSettings) -> Self {
        let at = |ok: f64, bad: f64| bad - navigator.goodness_min * (bad - ok);
        Self {
            tilt_deg: at(hazards.tilt_ok_deg, hazards.tilt_bad_deg),
            roughness_m: at(hazards.roughness_ok_m, hazards.roughness_bad_m),
            step_m: at(hazards.step_ok_m, hazards.step_bad_m),
            unknown_share: navigator.unknown_share_max,
        }
    }

    /// The limit of a term.
    pub(super) fn of(&self, term: HazardTerm) -> f64 {
        match term {
            HazardTerm::Tilt => self.tilt_deg,
            HazardTerm::Roughness => self.roughness_m,
            HazardTerm::Step => self.step_m,
            HazardTerm::Unknown => self.unknown_share,
        }
    }

    /// The same limits with that of one term replaced.
    pub(super) fn with(mut self, term: HazardTerm, limit: f64) -> Self {
        let changed = match term {
            HazardTerm::Tilt => &mut self.tilt_deg,
            HazardTerm::Roughness => &mut self.roughness_m,
            HazardTerm::Step => &mut self.step_m,
            HazardTerm::Unknown => &mut self.unknown_share,
        };
        *changed = limit;
        self
    }

    /// The term of a measured cell that exceeds its limit most, relative to the limit; `None` for a cell within all
    /// limits, and for a cell that is not measured.
    pub(super) fn exceeded(&self, cell: &GoodnessCell) -> Option<HazardTerm> {
        if cell.basis != CellBasis::Measured {
            return None;
        }
        let ratio = |term: HazardTerm| cell.value(term) / self.of(term);
        MEASURED
            .into_iter()
            .filter(|term| cell.value(*term) > self.of(*term))
            .max_by(|a, b| ratio(*a).total_cmp(&ratio(*b)))
    }
}
