//! The goodness map: tilt, roughness, step, certainty and goodness of every cell, from the sums of the hazard map.
//!
//! ```text
//! g(v; ok, bad) = clamp((bad − v)/(bad − ok), 0, 1)
//! goodness  = min(g(tilt), g(roughness), g(step))
//! certainty = min(1, n/points_full) · (known cells in the disc)/(cells in the disc)
//! age       = s − Σ w s_seen / Σ w
//! ```
//! | symbol | meaning | unit |
//! |---|---|---|
//! | n | decayed number of points in the disc of the rover's radius | – |
//! | s, s_seen | distance driven, and that at the observation of a point | m |
//!
//! A cell is unknown if its certainty is below `certainty_min` or its points are on a line. Cells within
//! `exemption_radius_m` of the target are exempt (R100). Unknown cells near the start of the drive are assumed to be good
//! until the rover is `start_distance_m` from it (R102).
//!
//! Frame: site. Source: domain.md 8.2.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::deck::deck_steps;
use super::disc_sums::{DiscSums, disc_sums};
use super::grid::{Disc, Grid};
use super::map::HazardMap;
use super::settings::HazardSettings;
use super::steps::steps;

/// A term that limits the goodness of a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum HazardTerm {
    /// Angle between the normal of the plane and the vertical, deg.
    Tilt,
    /// RMS residual of the plane, m.
    Roughness,
    /// Largest height difference of two nearby cells relative to the slope of the ground, m.
    Step,
    /// Certainty below its limit; for a path, the fraction of unknown cells.
    Unknown,
}

/// Source of a cell's goodness.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum CellBasis {
    /// Range data.
    Measured,
    /// Too few data: no goodness.
    #[default]
    Unknown,
    /// Too few data, but near the start: counts as good.
    Assumed,
    /// Near the target: counts as good regardless of the data.
    Exempt,
}

/// One cell of the goodness map. Terms are 0 without data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GoodnessCell {
    /// Tilt of the plane, deg.
    pub tilt_deg: f32,
    /// RMS residual of the plane, m.
    pub roughness_m: f32,
    /// Largest step in the disc, m.
    pub step_m: f32,
    /// Largest step that reaches the deck of a rover whose origin is here, m; 0 without one.
    #[serde(default)]
    pub deck_step_m: f32,
    /// 0 (no data) to 1.
    pub certainty: f32,
    /// Mean distance driven since the observations, m.
    pub age_m: f32,
    /// Mean height of the cell's own points, z of the site frame, m; `None` with too few.
    pub height_m: Option<f32>,
    /// Height of the cell's upper edge, z of the site frame, m: that of a face if its points are on one, otherwise the
    /// mean.
    #[serde(default)]
    pub top_m: Option<f32>,
    /// 0 (bad) to 1; 0 if unknown.
    pub goodness: f32,
    /// Source of the goodness.
    pub basis: CellBasis,
}

/// Goodness of all cells around the rover at one stop.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GoodnessMap {
    /// The window of cells.
    pub grid: Grid,
    /// The cells, row by row.
    pub cells: Vec<GoodnessCell>,
    /// The settings of the assessment.
    pub settings: HazardSettings,
}

/// A circle, site frame, m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Circle {
    /// Centre.
    pub centre_m: [f64; 2],
    /// Radius.
    pub radius_m: f64,
}

/// Circles in which cells count as good regardless of the data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MapRules {
    /// All cells near the target (R100).
    pub exemption: Option<Circle>,
    /// Unknown cells near the start (R102).
    pub start: Option<Circle>,
}

impl MapRules {
    /// The rules at a stop: `target_m` and `start_m` are positions in the site frame, m; the former is `None` without a
    /// target.
    pub fn at(
        rover_m: [f64; 2],
        start_m: [f64; 2],
        target_m: Option<[f64; 2]>,
        settings: &HazardSettings,
    ) -> Self {
        let circle = |centre_m: [f64; 2], radius_m: f64| Circle { centre_m, radius_m };
        let is_near = (rover_m[0] - start_m[0]).hypot(rover_m[1] - start_m[1]) < settings.start_distance_m;
        Self {
            exemption: target_m
                .filter(|_| settings.exemption_radius_m > 0.0)
                .map(|target_m| circle(target_m, settings.exemption_radius_m)),
            start: is_near.then(|| circle(start_m, settings.start_radius_m)),
        }
    }
}

impl Circle {
    fn contains(&self, at_m: [f64; 2]) -> bool {
        (at_m[0] - self.centre_m[0]).hypot(at_m[1] - self.centre_m[1]) <= self.radius_m
    }
}

impl HazardTerm {
    /// Name in a sentence.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Tilt => "tilt",
            Self::Roughness => "roughness",
            Self::Step => "step",
            Self::Unknown => "unknown share",
        }
    }

    /// Formats a value of the term with its unit.
    pub fn text(self, value: f64) -> String {
        match self {
            Self::Tilt => format!("{value:.1}°"),
            Self::Roughness | Self::Step => format!("{value:.3} m"),
            Self::Unknown => format!("{:.0} %", 100.0 * value),
        }
    }

    /// Goodness of a value of this term, 0 to 1; for the certainty, 1 from its limit on.
    fn goodness(self, value: f64, settings: &HazardSettings) -> f64 {
        let [ok, bad] = match self {
            Self::Tilt => [settings.tilt_ok_deg, settings.tilt_bad_deg],
            Self::Roughness => [settings.roughness_ok_m, settings.roughness_bad_m],
            Self::Step => [settings.step_ok_m, settings.step_bad_m],
            Self::Unknown => return if value >= settings.certainty_min { 1.0 } else { 0.0 },
        };
        ((bad - value) / (bad - ok)).clamp(0.0, 1.0)
    }
}

impl GoodnessCell {
    /// Value of a term: deg, m, m, or the certainty.
    pub fn value(&self, term: HazardTerm) -> f64 {
        f64::from(match term {
            HazardTerm::Tilt => self.tilt_deg,
            HazardTerm::Roughness => self.roughness_m,
            HazardTerm::Step => self.step_m,
            HazardTerm::Unknown => self.certainty,
        })
    }

    /// The term that limits the goodness, with its value; `None` for a cell of full goodness.
    pub fn limiting(&self, settings: &HazardSettings) -> Option<(HazardTerm, f64)> {
        if self.basis == CellBasis::Unknown {
            return Some((HazardTerm::Unknown, self.value(HazardTerm::Unknown)));
        }
        if self.basis != CellBasis::Measured {
            return None;
        }
        let worst = |worst: (HazardTerm, f64), term: HazardTerm| {
            let goodness = term.goodness(self.value(term), settings);
            if goodness < worst.1 { (term, goodness) } else { worst }
        };
        let (term, goodness) = [HazardTerm::Tilt, HazardTerm::Roughness, HazardTerm::Step]
            .into_iter()
            .fold((HazardTerm::Unknown, 1.0), worst);
        (goodness < 1.0).then(|| (term, self.value(term)))
    }

    fn new(
        sums: &DiscSums,
        ([step_m, deck_step_m], heights_m): ([f32; 2], Option<[f32; 2]>),
        disc: &Disc,
        driven_m: f64,
        settings: &HazardSettings,
    ) -> Self {
        let count = sums.moments.count();
        // Sums of cells without points are not exactly 0.
        if count < settings.weight_min {
            return Self::default();
        }
        let known = sums.known / disc.count() as f64;
        let certainty = (count / settings.points_full).min(1.0) * known;
        let age_m = driven_m - sums.moments.odometer_m() / count;
        let [height_m, top_m] = [0, 1].map(|k| heights_m.map(|heights_m| heights_m[k]));
        let (certainty_f32, age_m) = (certainty as f32, age_m as f32);
        let steps = Self { step_m, deck_step_m, ..Self::default() };
        let cell = Self { certainty: certainty_f32, age_m, height_m, top_m, ..steps };
        let Some(plane) = sums.moments.plane() else { return cell };
        let mut cell = Self {
            tilt_deg: plane.tilt_rad.to_degrees() as f32,
            roughness_m: plane.roughness_m as f32,
            ..cell
        };
        if certainty >= settings.certainty_min {
            cell.basis = CellBasis::Measured;
            let goodness = [HazardTerm::Tilt, HazardTerm::Roughness, HazardTerm::Step]
                .map(|term| term.goodness(cell.value(term), settings));
            cell.goodness = goodness.into_iter().fold(1.0, f64::min) as f32;
        }
        cell
    }

    fn with_rules(self, at_m: [f64; 2], rules: &MapRules) -> Self {
        let basis = if rules.exemption.is_some_and(|circle| circle.contains(at_m)) {
            CellBasis::Exempt
        } else if self.basis == CellBasis::Unknown && rules.start.is_some_and(|circle| circle.contains(at_m))
        {
            CellBasis::Assumed
        } else {
            return self;
        };
        Self { basis, goodness: 1.0, ..self }
    }
}

/// Assesses every cell of a hazard map.
pub fn assess(map: &HazardMap, rules: &MapRules, settings: &HazardSettings) -> GoodnessMap {
    let [disc, reach, overhang] = [settings.rover_radius_m, settings.step_reach_m, settings.deck_overhang_m]
        .map(|radius_m| Disc::new(radius_m / map.grid.cell_m));
    let (sums, steps) =
        rayon::join(|| disc_sums(map, &disc, settings.weight_min), || steps(map, &disc, &reach, settings));
    let deck_steps = deck_steps(&steps, map.grid.side, &overhang, settings.deck_clearance_m as f32);
    let cells = sums
        .par_iter()
        .zip(steps.par_iter().zip(&deck_steps))
        .enumerate()
        .map(|(index, (sums, (step_m, deck_step_m)))| {
            let (row, column) = (index / map.grid.side, index % map.grid.side);
            let own = map.cell(row, column);
            let heights_m = (own.count() >= settings.weight_min).then(|| {
                let mean_m = own.mean_height_m();
                let top_m = map.upper_edge_m(row, column, settings.face_spread_m).unwrap_or(mean_m);
                [mean_m, top_m].map(|relative_m| (map.height_m + relative_m) as f32)
            });
            let cell =
                GoodnessCell::new(sums, ([*step_m, *deck_step_m], heights_m), &disc, map.driven_m, settings);
            cell.with_rules(map.grid.centre_m(index), rules)
        })
        .collect();
    GoodnessMap { grid: map.grid, cells, settings: settings.clone() }
}

impl GoodnessMap {
    /// The cell at a position, site frame, m; `None` outside the window.
    pub fn cell_at(&self, at_m: [f64; 2]) -> Option<&GoodnessCell> {
        self.cells.get(self.grid.index_at(at_m)?)
    }
}
