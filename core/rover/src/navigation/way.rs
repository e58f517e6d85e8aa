//! A way to the goal: a sequence of motions that the rover can execute, while the route is only a line.
//!
//! The first part of a way ends before its first turn of more than `PART_TURN_DEG` or backward motion: arcs can follow it.
//!
//! Frame: site, horizontal.

use crate::driving::motion::Motion;

use super::path::Stance;

const PART_TURN_DEG: f64 = 10.0;
/// Spacing of the points of a way, m.
const POINT_M: f64 = 0.05;

/// A way from a stance to a goal.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Way {
    pub(super) motions: Vec<Motion>,
    /// Points of the line, site frame, m, every `POINT_M`.
    points: Vec<[f64; 2]>,
    /// Number of points of its first part, including the start.
    part: usize,
}

impl Way {
    /// The way of motions from a stance.
    pub(super) fn of(motions: Vec<Motion>, start: Stance) -> Self {
        let motions = joined(motions);
        let (mut points, mut stance, mut part) = (vec![start.at_m], start, None);
        for motion in &motions {
            if is_manoeuvre(motion) {
                part = part.or(Some(points.len()));
            }
            if let Motion::Arc { length_m, .. } = motion {
                let count = (length_m.abs() / POINT_M).ceil().max(1.0) as usize;
                points.extend((1..=count).map(|k| stance.after(motion, k as f64 / count as f64).at_m));
            }
            stance = stance.after(motion, 1.0);
        }
        Self { motions, part: part.unwrap_or(points.len()), points }
    }

    /// Points of the line, site frame, m.
    pub(super) fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// End of the first part, site frame, m.
    pub(super) fn part_end(&self) -> [f64; 2] {
        self.points[self.part - 1]
    }

    /// Length of the first part, m.
    pub(super) fn part_m(&self) -> f64 {
        self.points[..self.part].windows(2).map(|pair| distance_m(pair[0], pair[1])).sum()
    }

    /// End of the way, site frame, m.
    pub(super) fn end(&self) -> [f64; 2] {
        self.points[self.points.len() - 1]
    }

    /// Whether the way begins with a turn or a backward motion.
    pub(super) fn begins_with_manoeuvre(&self) -> bool {
        self.part == 1
    }

    /// The turn or backward motion, of at most `step_m`, at the start of the way; `None` if it begins ahead.
    pub(super) fn manoeuvre(&self, step_m: f64) -> Option<Motion> {
        let first = self.motions.first().filter(|_| self.part == 1)?;
        Some(match *first {
            Motion::Arc { length_m, curvature_per_m } => {
                Motion::Arc { length_m: length_m.clamp(-step_m, step_m), curvature_per_m }
            }
            turn @ Motion::Turn { .. } => turn,
        })
    }

    /// The point of the first part `length_m` after the one nearest to a position, or the end of that part.
    pub(super) fn ahead(&self, at_m: [f64; 2], length_m: f64) -> [f64; 2] {
        let part = &self.points[..self.part];
        let of = |index: &usize| distance_m(part[*index], at_m);
        let nearest = (0..part.len()).min_by(|a, b| of(a).total_cmp(&of(b))).unwrap_or(0);
        part[(nearest + (length_m / POINT_M).round() as usize).min(part.len() - 1)]
    }
}

fn is_manoeuvre(motion: &Motion) -> bool {
    match *motion {
        Motion::Arc { length_m, .. } => length_m < 0.0,
        Motion::Turn { angle_rad } => angle_rad.abs() > PART_TURN_DEG.to_radians(),
    }
}

pub(super) fn distance_m(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Joins consecutive motions of the same kind.
fn joined(motions: Vec<Motion>) -> Vec<Motion> {
    let mut all: Vec<Motion> = Vec::with_capacity(motions.len());
    for motion in motions {
        match (all.last_mut(), motion) {
            (Some(Motion::Turn { angle_rad: before }), Motion::Turn { angle_rad }) => *before += angle_rad,
            (
                Some(Motion::Arc { length_m: before_m, curvature_per_m: before }),
                Motion::Arc { length_m, curvature_per_m },
            ) if *before == curvature_per_m && *before_m * length_m > 0.0 => *before_m += length_m,
            _ => all.push(motion),
        }
    }
    all
}
