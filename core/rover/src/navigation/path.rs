//! A path over the ground: samples of its footprint, its veto and its hazard.
//!
//! Two discs of the rover's radius cover the rover, one at its origin and a leading one `reach_m` ahead of it, or behind
//! when it backs up. A turn has one on either side, and so has a tight arc: at its start the rear wheels swing outwards.
//! The goodness of a cell is that of the disc around it, so that each disc is one cell.
//!
//! ```text
//! veto    if a term of a sample exceeds its limit, or more than `unknown_share_max` of the samples are unknown   (driven part)
//!         backwards if any is unknown, or its certainty is below `back_certainty_min`
//! hazard  = ω min q + (1 − ω) Σ q c/(1 + s) / Σ 1/(1 + s)                                                 (evaluated part)
//! c       = certainty · ½^(age/age_half_life_m)
//! ```
//! | symbol | name | unit |
//! |---|---|---|
//! | s | distance along the path | m |
//! | q | lowest quality of the discs at s (`ground.rs`) | – |
//! | ω | `worst_weight`: ½ for GESTALT, 0 for Morphin | – |
//!
//! A rover on bad cells may leave them: within `escape_m` a disc that was bad at the start may remain so as long as it
//! gets no deeper into them and the motion brings it farther out. It may not turn there.
//!
//! Frame: site, horizontal. Source: domain.md 8.2.

use crate::driving::motion::Motion;
use crate::driving::path_choice::Veto;
use crate::hazards::goodness::{CellBasis, GoodnessCell, HazardTerm};
use sightline_geometry::frames::Pose;

use super::ground::{Ground, Part, Spot};
use super::settings::NavigatorSettings;

/// Sampling interval of a turn, rad.
const TURN_SAMPLE_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// Smallest curvature of a tight arc, 1/m: the rear corners then swing out by 8 cm and more.
const TIGHT_PER_M: f64 = 0.35;

/// Horizontal position and heading of the rover.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stance {
    /// x and y of the site frame, m.
    pub(super) at_m: [f64; 2],
    /// Heading, rad, positive to the right of the site's +x.
    pub(super) heading_rad: f64,
}

impl Stance {
    pub(super) fn of(site_from_rover: &Pose) -> Self {
        let origin = site_from_rover.translation.vector;
        Self { at_m: [origin.x, origin.y], heading_rad: site_from_rover.rotation.euler_angles().2 }
    }

    /// Converts a position ahead and to the right of the rover to the site frame, m.
    pub(super) fn place(&self, [ahead, right]: [f64; 2]) -> [f64; 2] {
        let (sine, cosine) = self.heading_rad.sin_cos();
        [self.at_m[0] + cosine * ahead - sine * right, self.at_m[1] + sine * ahead + cosine * right]
    }

    /// Converts a position of the site frame to one ahead and to the right of the rover, m.
    pub(super) fn seen(&self, at_m: [f64; 2]) -> [f64; 2] {
        let (sine, cosine) = self.heading_rad.sin_cos();
        let (dx, dy) = (at_m[0] - self.at_m[0], at_m[1] - self.at_m[1]);
        [cosine * dx + sine * dy, cosine * dy - sine * dx]
    }

    /// The stance after a fraction of a motion.
    pub(super) fn after(&self, motion: &Motion, part: f64) -> Self {
        let (moved, turned_rad) = motion.after(part);
        Self { at_m: self.place(moved), heading_rad: self.heading_rad + turned_rad }
    }

    /// The stance from which a motion leads here.
    pub(super) fn before(&self, motion: &Motion) -> Self {
        let (moved, turned_rad) = motion.after(1.0);
        let turned = Self { heading_rad: self.heading_rad - turned_rad, ..*self };
        Self { at_m: turned.place(moved.map(|along| -along)), ..turned }
    }
}

/// A disc of the footprint at one point of a motion.
#[derive(Clone, Copy, Debug)]
pub(super) struct Disc {
    /// Index: 0 is the disc at the rover's origin.
    pub(super) number: usize,
    along_m: f64,
    is_driven: bool,
    /// Ahead and to the right of the start of the motion, m.
    pub(super) place_m: [f64; 2],
}

/// The footprint along a motion, independent of the start.
pub(super) struct Footprint {
    pub(super) motion: Motion,
    /// Pose after the motion: position ahead and to the right of its start, m, and rotation to the right, rad.
    pub(super) moved: ([f64; 2], f64),
    /// Distances of the discs ahead of the rover's origin, m.
    offsets_m: Vec<f64>,
    /// Discs in order of distance.
    pub(super) discs: Vec<Disc>,
    /// Length over which the hazard is evaluated, m; 0 for a turn.
    evaluated_m: f64,
}

/// The ground under a disc.
#[derive(Clone, Copy, Debug)]
struct Sample {
    disc: Disc,
    at_m: [f64; 2],
    spot: Spot,
}

/// A path over the ground.
pub(super) struct Path<'a> {
    settings: &'a NavigatorSettings,
    limits: super::limits::VetoLimits,
    ground: &'a Ground<'a>,
    /// Samples in order of distance.
    samples: Vec<Sample>,
    /// Clearance of each disc before the motion, m.
    start_m: [f64; 3],
    is_turn: bool,
    is_backwards: bool,
    /// Length over which the hazard is evaluated, m; 0 for a turn.
    pub(super) evaluated_m: f64,
}

impl Footprint {
    /// The footprint of a motion, evaluated over at least `evaluated_min_m` of an arc.
    pub(super) fn new(motion: &Motion, evaluated_min_m: f64, settings: &NavigatorSettings) -> Self {
        let offsets_m = offsets(motion, settings.reach_m);
        let (parts, evaluated_m) = parts(motion, evaluated_min_m, settings);
        let length_m = match motion {
            Motion::Arc { length_m, .. } => length_m.abs(),
            Motion::Turn { .. } => 0.0,
        };
        let start = Stance { at_m: [0.0; 2], heading_rad: 0.0 };
        let discs = parts
            .into_iter()
            .flat_map(|part| {
                let stance = start.after(motion, part);
                offsets_m.iter().enumerate().map(move |(number, ahead)| Disc {
                    number,
                    along_m: part * length_m,
                    is_driven: part <= 1.0,
                    place_m: stance.place([*ahead, 0.0]),
                })
            })
            .collect();
        Self { motion: *motion, moved: motion.after(1.0), offsets_m, discs, evaluated_m }
    }

    pub(super) fn is_backwards(&self) -> bool {
        matches!(self.motion, Motion::Arc { length_m, .. } if length_m < 0.0)
    }
}

impl<'a> Path<'a> {
    /// The path of a motion, evaluated over at least `evaluated_min_m` of an arc.
    pub(super) fn new(
        ground: &'a Ground<'a>,
        start: &Stance,
        motion: &Motion,
        evaluated_min_m: f64,
        settings: &'a NavigatorSettings,
    ) -> Self {
        Self::along(ground, start, &Footprint::new(motion, evaluated_min_m, settings), settings)
    }

    /// The path of a footprint.
    pub(super) fn along(
        ground: &'a Ground<'a>,
        start: &Stance,
        footprint: &Footprint,
        settings: &'a NavigatorSettings,
    ) -> Self {
        let mut start_m = [f64::INFINITY; 3];
        for (number, (clearance_m, ahead)) in start_m.iter_mut().zip(&footprint.offsets_m).enumerate() {
            *clearance_m = ground.spot(start.place([*ahead, 0.0]), Part::of(number)).clearance_m;
        }
        let samples = footprint.discs.iter().map(|disc| {
            let at_m = start.place(disc.place_m);
            Sample { disc: *disc, at_m, spot: ground.spot(at_m, Part::of(disc.number)) }
        });
        Self {
            settings,
            limits: ground.limits,
            ground,
            samples: samples.collect(),
            start_m,
            is_turn: matches!(footprint.motion, Motion::Turn { .. }),
            is_backwards: footprint.is_backwards(),
            evaluated_m: footprint.evaluated_m,
        }
    }

    fn driven(&self) -> impl Iterator<Item = &Sample> {
        self.samples.iter().filter(|sample| sample.disc.is_driven)
    }

    /// Bad samples of the driven part that the rover may not pass, in order of distance.
    fn failing(&self) -> impl Iterator<Item = &Sample> {
        let mut may_remain = [0, 1, 2].map(|disc| self.start_m[disc] < 0.0 && self.leaves_bad_ground(disc));
        self.driven().filter(move |sample| {
            let is_near = !self.is_turn && sample.disc.along_m <= self.settings.escape_m;
            let is_no_deeper = sample.spot.clearance_m >= self.start_m[sample.disc.number];
            let may_remain = &mut may_remain[sample.disc.number];
            *may_remain &= sample.spot.is_bad() && is_near && is_no_deeper;
            sample.spot.is_bad() && !*may_remain
        })
    }

    /// Whether a disc is less deep in bad cells after the motion than before it.
    fn leaves_bad_ground(&self, disc: usize) -> bool {
        let last = self.driven().filter(|sample| sample.disc.number == disc).last();
        last.is_some_and(|sample| sample.spot.clearance_m > self.start_m[disc])
    }

    /// Whether the driven part fails at a measured cell, or (backwards) at an unknown or uncertain one.
    pub(super) fn is_bad(&self) -> bool {
        self.failing().next().is_some() || (self.is_backwards && self.unknown_share() > 0.0)
    }

    /// The ground under the rover's origin along the path.
    pub(super) fn centres(&self) -> impl Iterator<Item = Spot> {
        self.samples.iter().filter(|sample| sample.disc.number == 0).map(|sample| sample.spot)
    }

    fn is_unknown(&self, sample: &Sample) -> bool {
        let cell = &sample.spot.cell;
        if self.is_backwards {
            is_unknown_behind(cell, self.settings)
        } else {
            cell.basis == CellBasis::Unknown
        }
    }

    /// Fraction of unknown samples of the driven part, 0 to 1.
    pub(super) fn unknown_share(&self) -> f64 {
        let count = self.driven().count().max(1);
        let unknown = self.driven().filter(|sample| self.is_unknown(sample)).count();
        unknown as f64 / count as f64
    }

    /// Largest allowed fraction of unknown samples; 0 backwards, because no camera looks there.
    fn unknown_limit(&self) -> f64 {
        if self.is_backwards { 0.0 } else { self.limits.unknown_share }
    }

    /// The first failing cell; `None` if the path passes.
    pub(super) fn veto(&self) -> Option<Veto> {
        let measured = self.failing().find_map(|sample| {
            let term = self.limits.exceeded(&sample.spot.cell)?;
            Some((sample, term, sample.spot.cell.value(term)))
        });
        let unknown_share = self.unknown_share();
        let (sample, term, value) = measured.or_else(|| {
            let is_unknown = |sample: &&Sample| self.is_unknown(sample);
            let first = self.driven().find(is_unknown).filter(|_| unknown_share > self.unknown_limit())?;
            Some((first, HazardTerm::Unknown, unknown_share))
        })?;
        // A sample outside the window has no cell.
        let in_site_m = sample.spot.index.map_or(sample.at_m, |index| self.ground.map.grid.centre_m(index));
        let limit = if term == HazardTerm::Unknown { self.unknown_limit() } else { self.limits.of(term) };
        Some(Veto { in_site_m, along_m: sample.disc.along_m, term, value, limit })
    }

    /// The largest value of a term among the failing cells; for `unknown`, the fraction of unknown samples.
    pub(super) fn largest(&self, term: HazardTerm) -> f64 {
        match term {
            HazardTerm::Unknown => self.unknown_share(),
            _ => self.failing().map(|sample| sample.spot.cell.value(term)).fold(0.0, f64::max),
        }
    }

    /// The hazard term, 0 (worst) to 1.
    pub(super) fn hazard(&self) -> f64 {
        let (mut worst, mut sum, mut weights) = (f64::INFINITY, 0.0, 0.0);
        for discs in self.samples.chunk_by(|before, after| before.disc.number < after.disc.number) {
            let weight = 1.0 / (1.0 + discs[0].disc.along_m);
            weights += weight;
            let known = discs.iter().filter(|sample| sample.spot.cell.basis != CellBasis::Unknown);
            let qualities = known.map(|sample| (sample.spot.quality(self.settings), &sample.spot));
            if let Some((quality, spot)) = qualities.min_by(|a, b| a.0.total_cmp(&b.0)) {
                worst = worst.min(quality);
                sum += weight * quality * self.certainty(spot);
            }
        }
        if !worst.is_finite() {
            return 0.0;
        }
        let worst_weight = self.settings.worst_weight;
        worst_weight * worst + (1.0 - worst_weight) * sum / weights
    }

    /// Certainty of a cell, discounted by the age of its observations; for assumed and exempt cells at least the smallest
    /// one.
    fn certainty(&self, spot: &Spot) -> f64 {
        let certainty = f64::from(spot.cell.certainty);
        let half_life_m = self.settings.age_half_life_m;
        let age = if half_life_m > 0.0 { f64::from(spot.cell.age_m).max(0.0) / half_life_m } else { 0.0 };
        let discounted = certainty * 0.5_f64.powf(age);
        match spot.cell.basis {
            CellBasis::Measured | CellBasis::Unknown => discounted,
            CellBasis::Assumed | CellBasis::Exempt => discounted.max(self.ground.map.settings.certainty_min),
        }
    }
}

/// Whether ground counts as unknown for a rover that backs up: also if only a small part of the disc was seen.
pub(super) fn is_unknown_behind(cell: &GoodnessCell, settings: &NavigatorSettings) -> bool {
    let is_uncertain = f64::from(cell.certainty) < settings.back_certainty_min;
    cell.basis == CellBasis::Unknown || (cell.basis == CellBasis::Measured && is_uncertain)
}

/// Distances of the discs ahead of the rover's origin, m.
fn offsets(motion: &Motion, reach_m: f64) -> Vec<f64> {
    match *motion {
        Motion::Turn { .. } => vec![0.0, reach_m, -reach_m],
        Motion::Arc { length_m, curvature_per_m } => {
            let leading_m = reach_m.copysign(length_m);
            let is_tight = curvature_per_m.abs() >= TIGHT_PER_M;
            if is_tight { vec![0.0, leading_m, -leading_m] } else { vec![0.0, leading_m] }
        }
    }
}

/// Fractions of a motion at which it is sampled, beyond 1 if more than the driven part is evaluated, and the evaluated
/// length, m.
fn parts(motion: &Motion, evaluated_min_m: f64, settings: &NavigatorSettings) -> (Vec<f64>, f64) {
    let length_m = match *motion {
        Motion::Turn { angle_rad } => {
            let count = (angle_rad.abs() / TURN_SAMPLE_RAD).ceil().max(1.0);
            return ((1..=count as usize).map(|k| k as f64 / count).collect(), 0.0);
        }
        Motion::Arc { length_m, .. } => length_m.abs(),
    };
    let driven_m = length_m.max(1e-6);
    let count = |length_m: f64| (length_m / settings.sample_m - 1e-9).ceil().max(0.0) as usize;
    let (driven, beyond_m) = (count(driven_m).max(1), (evaluated_min_m - driven_m).max(0.0));
    let beyond = count(beyond_m);
    let mut parts: Vec<f64> = (1..=driven).map(|k| k as f64 / driven as f64).collect();
    parts.extend((1..=beyond).map(|k| 1.0 + beyond_m / driven_m * k as f64 / beyond as f64));
    (parts, driven_m + beyond_m)
}
