//! The Nelder–Mead simplex method: minimisation without derivatives (R201).
//!
//! ```text
//! order f_1 ≤ … ≤ f_{n+1},  c = centroid of the best n,  d = c − x_{n+1}
//! reflect   x_r = c + d                 f_1 ≤ f_r < f_n: accept
//! expand    x_e = c + χ d               f_r < f_1: the better of the two
//! contract  outside  c + ψ d            f_n ≤ f_r < f_{n+1}: accept if not above f_r
//!           inside   c − ψ d            else: accept if below f_{n+1}
//! shrink    x_i = x_1 + σ (x_i − x_1)   otherwise
//! classic   χ = 2, ψ = σ = ½            adaptive, n = 6:  χ = 1 + 2/n, ψ = ¾ − 1/(2n), σ = 1 − 1/n  (Gao & Han 2012)
//! stop      max |f_i − f_1| < 1e-6 m and every edge below 0.1 mm, 0.01°, or 600 evaluations; then twice again with a
//!           fresh simplex around the best
//! ```
//! Parameters are in units of the first simplex's edges, 2 cm and 1°, so that metres and radians are comparable.
//!
//! **Why ours**: the crate `argmin` runs its solvers inside an executor that reads the clock, has neither this stopping
//! rule nor the adaptive coefficients, and does not record the path.
//!
//! | symbol | our name | unit |
//! |---|---|---|
//! | x | `Vertex::at` | edges of the first simplex |
//! | f | `Vertex::value` | m: mean difference of depth |
//!
//! Source: R201; domain.md 13.5.

use nalgebra::Vector6;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::objective::Offset;

/// Number of parameters.
const N: usize = 6;

/// Coefficients and stopping rule of the simplex.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SimplexSettings {
    /// Edges of the first simplex along the three axes, m.
    pub edge_m: f64,
    /// Edges of the first simplex along the three rotations, rad.
    pub edge_rad: f64,
    /// Number of restarts around the best point.
    pub restarts: u32,
    /// Largest number of evaluations of one run.
    pub evaluations_max: u32,
    /// Stops when the spread of values is below this, m …
    pub spread_m: f64,
    /// … and the size of the simplex is below this, m …
    pub size_m: f64,
    /// … and rad.
    pub size_rad: f64,
    /// Whether the coefficients depend on the number of parameters (Gao & Han 2012).
    pub adaptive: bool,
}

impl Default for SimplexSettings {
    /// R201 and domain.md 13.5: 2 cm and 1°, two restarts, 600 evaluations; classic coefficients.
    fn default() -> Self {
        Self {
            edge_m: 0.02,
            edge_rad: 1f64.to_radians(),
            restarts: 2,
            evaluations_max: 600,
            spread_m: 1e-6,
            size_m: 1e-4,
            size_rad: 0.01f64.to_radians(),
            adaptive: false,
        }
    }
}

/// The best point after an iteration of the simplex.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathStep {
    /// Number of evaluations of the objective so far.
    pub evaluations: u32,
    /// Index of the run: 0, then one more with each restart.
    pub run: u32,
    /// Objective at the best point, m.
    pub value_m: f64,
    /// The best point: translation (m) and rotation vector (rad) from the start, axes of the sensor.
    pub offset: [f64; N],
}

#[derive(Clone, Copy, Debug)]
struct Vertex {
    at: Vector6<f64>,
    value: f64,
}

/// Minimises from `start`; returns the point, its value and the path.
pub fn minimise(
    mut objective: impl FnMut(&Offset) -> f64,
    start: &Offset,
    settings: &SimplexSettings,
) -> (Offset, f64, Vec<PathStep>) {
    let (m, rad) = (settings.edge_m, settings.edge_rad);
    let edges = Vector6::new(m, m, m, rad, rad, rad);
    let mut evaluations = 0;
    let mut scaled = |at: &Vector6<f64>| {
        evaluations += 1;
        (objective(&(start + at.component_mul(&edges))), evaluations)
    };
    let mut best = Vertex { at: Vector6::zeros(), value: scaled(&Vector6::zeros()).0 };
    let mut path = Vec::new();
    for run in 0..=settings.restarts {
        best = descend(&mut scaled, best, settings, |best, evaluations| {
            let offset = start + best.at.component_mul(&edges);
            path.push(PathStep { evaluations, run, value_m: best.value, offset: offset.into() });
        });
    }
    (start + best.at.component_mul(&edges), best.value, path)
}

/// One run from a fresh simplex around `first`.
fn descend(
    scaled: &mut impl FnMut(&Vector6<f64>) -> (f64, u32),
    first: Vertex,
    settings: &SimplexSettings,
    mut seen: impl FnMut(&Vertex, u32),
) -> Vertex {
    let (expand, contract, shrink) = if settings.adaptive {
        let n = N as f64;
        (1.0 + 2.0 / n, 0.75 - 0.5 / n, 1.0 - 1.0 / n)
    } else {
        (2.0, 0.5, 0.5)
    };
    let mut used = 0;
    let mut vertex = |at: Vector6<f64>| {
        let (value, evaluations) = scaled(&at);
        used += 1;
        (Vertex { at, value }, evaluations, used)
    };
    let mut simplex = [first; N + 1];
    for (axis, corner) in simplex[1..].iter_mut().enumerate() {
        let mut at = first.at;
        at[axis] += 1.0;
        *corner = vertex(at).0;
    }
    let (mut evaluations, mut count) = (0, N as u32);
    while count < settings.evaluations_max && !is_small(&mut simplex, settings) {
        let [best, next_worst, worst] = [simplex[0], simplex[N - 1], simplex[N]];
        let centroid = simplex[..N].iter().map(|corner| corner.at).sum::<Vector6<f64>>() / N as f64;
        let away = centroid - worst.at;
        let mut probe = |factor: f64| {
            let (corner, total, own) = vertex(centroid + away * factor);
            (evaluations, count) = (total, own);
            corner
        };
        let reflected = probe(1.0);
        let taken = if reflected.value < best.value {
            let expanded = probe(expand);
            Some(if expanded.value < reflected.value { expanded } else { reflected })
        } else if reflected.value < next_worst.value {
            Some(reflected)
        } else if reflected.value < worst.value {
            Some(probe(contract)).filter(|corner| corner.value <= reflected.value)
        } else {
            Some(probe(-contract)).filter(|corner| corner.value < worst.value)
        };
        if let Some(taken) = taken {
            simplex[N] = taken;
        } else {
            for corner in &mut simplex[1..] {
                (*corner, evaluations, count) = vertex(best.at + (corner.at - best.at) * shrink);
            }
        }
        let lowest = simplex.iter().min_by(|a, b| a.value.total_cmp(&b.value)).unwrap_or(&best);
        seen(lowest, evaluations);
    }
    is_small(&mut simplex, settings);
    simplex[0]
}

/// Sorts the corners by value; returns whether the spread of values and the edges are below the limits.
fn is_small(simplex: &mut [Vertex; N + 1], settings: &SimplexSettings) -> bool {
    simplex.sort_by(|a, b| a.value.total_cmp(&b.value));
    let best = simplex[0];
    let spread = simplex[N].value - best.value;
    let limits = [settings.size_m / settings.edge_m, settings.size_rad / settings.edge_rad];
    spread < settings.spread_m
        && simplex[1..].iter().all(|corner| (0..N).all(|k| (corner.at[k] - best.at[k]).abs() < limits[k / 3]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A curved valley of absolute values, with a different scale in every direction.
    fn valley(p: &Offset) -> f64 {
        let d = p - Offset::new(0.013, -0.021, 0.034, 0.01, -0.02, 0.015);
        (d[0] - 3.0 * d[4]).abs()
            + d[0].abs()
            + 2.0 * d[1].abs()
            + d[2].abs()
            + d[3].abs()
            + (d[4] + d[5]).abs()
            + d[5].abs()
    }

    #[test]
    fn the_minimum_of_absolute_values_is_found_and_restarts_help() {
        let settings = SimplexSettings::default();
        let (at, value, path) = minimise(valley, &Offset::zeros(), &settings);
        assert!(value < 5e-5, "{value} {at}");
        assert!(path.windows(2).all(|pair| pair[1].value_m <= pair[0].value_m));
        assert!(path.windows(2).all(|pair| pair[1].evaluations > pair[0].evaluations));
        assert_eq!(path.last().map(|step| step.run), Some(2));
        let once = SimplexSettings { restarts: 0, ..settings };
        assert!(minimise(valley, &Offset::zeros(), &once).1 > 3.0 * value);
    }

    #[test]
    fn a_smooth_minimum_is_found_to_the_size_at_which_it_stops() {
        let target = Offset::new(0.03, -0.01, 0.02, -0.03, 0.02, 0.01);
        let scale = Offset::new(1.0, 2.0, 1.0, 0.5, 0.3, 0.4);
        let bowl = |p: &Offset| (p - target).component_mul(&scale).norm_squared() * 10.0;
        for adaptive in [false, true] {
            let settings = SimplexSettings { adaptive, ..SimplexSettings::default() };
            let (at, ..) = minimise(bowl, &Offset::zeros(), &settings);
            assert!((at - target).amax() < 5e-4, "{}", at - target);
        }
    }

    #[test]
    fn where_nothing_is_finite_the_start_stays() {
        let (at, value, _) = minimise(|_| f64::INFINITY, &Offset::zeros(), &SimplexSettings::default());
        assert_eq!((at, value), (Offset::zeros(), f64::INFINITY));
    }
}
