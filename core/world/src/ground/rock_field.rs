//! Positions and sizes of rocks: the size distribution of Golombek & Rapp, and dart throwing.
//!
//! The fraction of the area covered by rocks of diameter D or more is F(D) = k e^{−qD} with
//! q = 1.79 + 0.152/k; from −dF/dD = (π D²/4) n(D) follows their number per m² (domain.md 10.1):
//! `N(≥D) = (4 k q/π) [e^{−qD}/D − q E1(qD)]`. The number in an area is Poisson; diameters are drawn by inverting N. Rocks
//! are placed from the largest to the smallest. A position that overlaps an earlier rock is redrawn near by (elsewhere,
//! small rocks would crowd the bare tracks), and a rock without a free position after 60 draws is left out. A rock in the
//! rover's path is left out at once, so that the law holds beside the tracks. Rocks that the scenario places come first.
//!
//! Heights are `ratio · D + offset` on average (domain.md 10.3); the four kinds of rocks vary about it.
//!
//! Rocks are scattered over the wedge that the cameras see, in strips across the drive; the smallest diameter grows slowly
//! beyond the goal, where smaller rocks would span less than about four pixels. Around the goal a cluster follows the same
//! law with a larger smallest diameter. The wheel paths of the planned drive are kept free of all but pebbles, and between
//! them no rock is higher than the rover's belly, unless `rocks.off_planned_drive` is false: then the rocks do not depend
//! on the drive. `rocks.clear_path` removes further rocks after all are placed (`clear_path.rs`).
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | k | `area_fraction` | – |
//! | q | – | 1/m |
//! | D | `diameter_m` | m |
//! | N | `number_per_m2` | 1/m² |
//!
//! Frame: site. Sources: Golombek & Rapp 1997; domain.md 5.4 (wheels), 10.

use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, Poisson};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use crate::ground::around::Around;
use crate::ground::clear_path;
use crate::ground::rock_law::{draw_diameter_m, number_per_m2};
use crate::ground::rocks::{Rock, RockSeed};
use crate::ground::terrain::Terrain;
use crate::ground::texture::mix;
use crate::scenario::{RockSettings, RockShape};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;

/// Inner and outer edge of the wheel tracks, m from the centre line (domain.md 5.4, wheel 16 cm wide).
const TRACK_Y_M: [f64; 2] = [0.43, 0.70];
/// The highest rock that passes below the rover's belly, m (ours).
const BELLY_M: f64 = 0.20;
/// Start of the scattered rocks, m ahead of the first stop: nearer ground is never seen.
const NEAREST_M: f64 = 1.5;
/// Height of the highest stone left in the wheels' path, m: they roll over it (`footing.rs`; ours).
const ROLLED_OVER_M: f64 = 0.025;
/// Largest radius of a rock's outline over its diameter.
const REACH: f64 = 0.6;
/// Growth per draw of the square in which a free position is drawn, m.
const NUDGE_M: f64 = 0.02;
/// Number of draws of a position before a rock is left out.
const DRAWS: usize = 60;

/// Properties of the drive that the placement of rocks depends on, site frame.
#[derive(Clone, Debug)]
pub(crate) struct Approach {
    /// The point that the rover approaches, m.
    pub goal_m: [f64; 2],
    /// Largest x of the front wheels, m.
    pub wheels_reach_m: f64,
    /// View and wheel paths of a drive of moves; `None` for a straight approach along x.
    pub around: Option<Around>,
}

/// Diameter of the smallest rock worth placing this far beyond the goal, m: about four pixels as seen from the start.
fn smallest_m(settings: &RockSettings, beyond_goal_m: f64) -> f64 {
    settings.smallest_m.max(0.0045 * beyond_goal_m)
}

/// Half the width of the wedge that the cameras see at `x_m` ahead, with a margin for shadows, m.
fn half_width_m(x_m: f64) -> f64 {
    2.0 + 0.46 * x_m
}

/// A rock to be placed.
struct Candidate {
    diameter_m: f64,
    /// Strip, disc or ring to draw its position from.
    place: Place,
}

enum Place {
    Strip {
        from_m: f64,
        to_m: f64,
    },
    Disc {
        radius_m: f64,
    },
    /// Between two circles about the goal.
    Ring {
        from_m: f64,
        to_m: f64,
    },
}

/// Scatters the rocks of a site on its ground.
pub(crate) fn scatter(
    settings: &RockSettings,
    approach: &Approach,
    terrain: &Terrain,
    seed: u64,
    cancel: Cancel<'_>,
) -> Result<Vec<Rock>> {
    let mut random = Pcg64::seed_from_u64(mix(seed ^ 0x20c5));
    let mut candidates = candidates(settings, approach, &mut random);
    candidates.sort_by(|a, b| b.diameter_m.total_cmp(&a.diameter_m));
    let mut taken = Taken::new();
    let mut seeds = placed_seeds(settings, approach, seed);
    let is_in_the_way = |place: [f64; 2], reach_m: f64, height_m: f64| {
        settings.off_planned_drive && is_in_the_way(approach, place, reach_m, height_m)
    };
    seeds.iter().for_each(|rock| taken.add(rock.x_m, rock.y_m, REACH * rock.diameter_m));
    for candidate in &candidates {
        cancel.check()?;
        let (shape, height_m) = draw_shape(settings, candidate.diameter_m, &mut random);
        let reach_m = REACH * candidate.diameter_m;
        let mut place = draw_place(&candidate.place, approach, &mut random);
        let scattered = !matches!(candidate.place, Place::Disc { .. });
        if approach.around.as_ref().is_some_and(|around| !around.sees(place[0], place[1])) {
            continue;
        }
        if scattered && is_in_the_way(place, reach_m, height_m) {
            // Redrawing would crowd the ground beside the tracks; a rock of the cluster must find a position.
            continue;
        }
        let first = place;
        for draw in 0..DRAWS {
            if draw > 0 {
                place = match candidate.place {
                    Place::Strip { .. } | Place::Ring { .. } => {
                        beside(first, reach_m + NUDGE_M * draw as f64, &mut random)
                    }
                    Place::Disc { .. } => draw_place(&candidate.place, approach, &mut random),
                };
            }
            let [x_m, y_m] = place;
            if is_in_the_way(place, reach_m, height_m) || taken.overlaps(x_m, y_m, reach_m) {
                continue;
            }
            taken.add(x_m, y_m, reach_m);
            let seed = mix(seed ^ mix(seeds.len() as u64 + 1));
            let diameter_m = candidate.diameter_m;
            seeds.push(RockSeed { x_m, y_m, diameter_m, height_m, shape, face_yaw_rad: None, seed });
            break;
        }
    }
    let seeds = off_clear_path(seeds, settings, approach);
    let grow = |rock: &RockSeed| {
        let up = terrain.mean_normal_at(rock.x_m, rock.y_m);
        cancel.check()?;
        Ok(Rock::grow(rock, terrain.z_at(rock.x_m, rock.y_m), &up))
    };
    seeds.par_iter().map(grow).collect()
}

/// The rocks without the scattered ones on the scenario's clear path; the placed rocks come first.
fn off_clear_path(seeds: Vec<RockSeed>, settings: &RockSettings, approach: &Approach) -> Vec<RockSeed> {
    let Some(path) = &settings.clear_path else { return seeds };
    let is_clear = |rock: &RockSeed| {
        let reach_m = REACH * rock.diameter_m;
        !clear_path::removes(path, approach.goal_m, [rock.x_m, rock.y_m], reach_m, rock.height_m)
    };
    let placed = settings.placed.len();
    let kept = seeds.into_iter().enumerate().filter(|(number, rock)| *number < placed || is_clear(rock));
    kept.map(|(_, rock)| rock).collect()
}

/// The rocks that the scenario places individually.
fn placed_seeds(settings: &RockSettings, approach: &Approach, seed: u64) -> Vec<RockSeed> {
    let grown = settings.placed.iter().enumerate().map(|(index, rock)| RockSeed {
        x_m: approach.goal_m[0] + rock.x_m,
        y_m: approach.goal_m[1] + rock.y_m,
        diameter_m: rock.diameter_m,
        height_m: rock.height_m,
        shape: rock.shape,
        face_yaw_rad: Some(rock.yaw_deg.to_radians()),
        seed: mix(seed ^ mix(index as u64 ^ 0x91ac_ed00)),
    });
    grown.collect()
}

/// Draws the kind of a rock and its visible height, m: the mean (ratio · D + offset), by kind and ± 25 % (ours).
fn draw_shape(settings: &RockSettings, diameter_m: f64, random: &mut Pcg64) -> (RockShape, f64) {
    let kind: f64 = random.random();
    // Fractions 0.40, 0.25, 0.15 and 0.20; the factors' mean is 1.
    let (shape, factor) = match kind {
        k if k < 0.40 => (RockShape::Angular, 1.05),
        k if k < 0.65 => (RockShape::Block, 1.10),
        k if k < 0.80 => (RockShape::Slab, 0.60),
        _ => (RockShape::Cobble, 1.075),
    };
    let mean_m = settings.height_ratio * diameter_m + settings.height_offset_m;
    (shape, mean_m * factor * random.random_range(0.75..1.25))
}

/// All rocks to be placed: the cluster and the strips.
fn candidates(settings: &RockSettings, approach: &Approach, random: &mut Pcg64) -> Vec<Candidate> {
    let k = settings.area_fraction.max(0.01);
    let mut candidates = Vec::new();
    for _ in 0..settings.cluster_count {
        let diameter_m =
            draw_diameter_m(k, settings.cluster_smallest_m, settings.cluster_largest_m, random.random());
        candidates.push(Candidate { diameter_m, place: Place::Disc { radius_m: settings.cluster_radius_m } });
    }
    if settings.area_fraction <= 0.0 {
        return candidates;
    }
    let is_around = approach.around.is_some();
    let nearest_m = if is_around { 0.0 } else { NEAREST_M };
    let strips = (settings.farthest_m - nearest_m).max(0.0) as usize;
    for strip in 0..strips {
        let from_m = nearest_m + strip as f64;
        let to_m = from_m + 1.0;
        let beyond_goal_m = approach.around.as_ref().map_or(from_m - approach.goal_m[0], |around| {
            // Near the stops the smallest pebbles are those at the goal; from twice that distance the rule by distance
            // applies.
            from_m.min(2.0 * (from_m - around.reach_m()))
        });
        let smallest = smallest_m(settings, beyond_goal_m);
        if smallest >= settings.largest_m {
            break;
        }
        let per_m2 = number_per_m2(k, smallest) - number_per_m2(k, settings.largest_m);
        let area_m2 = if is_around {
            std::f64::consts::PI * (to_m * to_m - from_m * from_m)
        } else {
            2.0 * half_width_m(from_m)
        };
        let mean = per_m2 * area_m2;
        let count = Poisson::new(mean).map_or(0.0, |poisson| poisson.sample(random)) as usize;
        for _ in 0..count {
            let diameter_m = draw_diameter_m(k, smallest, settings.largest_m, random.random());
            let place = if is_around { Place::Ring { from_m, to_m } } else { Place::Strip { from_m, to_m } };
            candidates.push(Candidate { diameter_m, place });
        }
    }
    candidates
}

/// Draws a position uniformly over the strip, the disc or the ring.
fn draw_place(place: &Place, approach: &Approach, random: &mut Pcg64) -> [f64; 2] {
    match *place {
        Place::Strip { from_m, to_m } => {
            let half_m = half_width_m(from_m);
            [random.random_range(from_m..to_m), random.random_range(-half_m..half_m)]
        }
        Place::Disc { radius_m } => draw_in_ring(approach.goal_m, [0.0, radius_m], random),
        Place::Ring { from_m, to_m } => draw_in_ring(approach.goal_m, [from_m, to_m], random),
    }
}

/// Draws a position uniformly between two circles.
fn draw_in_ring(middle_m: [f64; 2], [from_m, to_m]: [f64; 2], random: &mut Pcg64) -> [f64; 2] {
    let part: f64 = random.random();
    let r = (from_m * from_m + part * (to_m * to_m - from_m * from_m)).sqrt();
    let angle = random.random_range(0.0..std::f64::consts::TAU);
    [middle_m[0] + r * angle.cos(), middle_m[1] + r * angle.sin()]
}

/// Draws a position within a square around a point.
fn beside([x_m, y_m]: [f64; 2], by_m: f64, random: &mut Pcg64) -> [f64; 2] {
    [x_m + random.random_range(-by_m..by_m), y_m + random.random_range(-by_m..by_m)]
}

/// Whether a rock would be in a wheel's track or touch the belly.
fn is_in_the_way(approach: &Approach, [x_m, y_m]: [f64; 2], reach_m: f64, height_m: f64) -> bool {
    if let Some(around) = &approach.around {
        return height_m > ROLLED_OVER_M && around.is_in_the_way(x_m, y_m, reach_m, height_m > BELLY_M);
    }
    let aside_m = (y_m - approach.goal_m[1]).abs();
    let beside = aside_m - reach_m > TRACK_Y_M[1];
    let between = aside_m + reach_m < TRACK_Y_M[0] && height_m < BELLY_M;
    x_m - reach_m < approach.wheels_reach_m && !beside && !between && height_m > ROLLED_OVER_M
}

/// The outlines of the placed rocks, in a coarse grid for short look-ups.
struct Taken {
    cells: std::collections::HashMap<(i32, i32), Vec<[f64; 3]>>,
}

impl Taken {
    /// Side of a cell, m: larger than the distance at which two of the largest allowed rocks (2 m) overlap.
    const CELL_M: f64 = 2.4;

    fn new() -> Self {
        Self { cells: std::collections::HashMap::new() }
    }

    fn cell(x_m: f64, y_m: f64) -> (i32, i32) {
        ((x_m / Self::CELL_M).floor() as i32, (y_m / Self::CELL_M).floor() as i32)
    }

    fn add(&mut self, x_m: f64, y_m: f64, reach_m: f64) {
        self.cells.entry(Self::cell(x_m, y_m)).or_default().push([x_m, y_m, reach_m]);
    }

    fn overlaps(&self, x_m: f64, y_m: f64, reach_m: f64) -> bool {
        let (cx, cy) = Self::cell(x_m, y_m);
        let near = |dx: i32, dy: i32| self.cells.get(&(cx + dx, cy + dy)).into_iter().flatten();
        (-1..=1)
            .flat_map(|dy| (-1..=1).flat_map(move |dx| near(dx, dy)))
            .any(|[x, y, r]| (x - x_m).hypot(y - y_m) < r + reach_m)
    }
}

#[cfg(test)]
#[path = "rock_field_tests.rs"]
mod tests;
