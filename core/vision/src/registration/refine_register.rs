//! Refinement of all six parameters: the paper's method (R201), and a modern one for comparison.
//!
//! | method | objective | solver |
//! |---|---|---|
//! | [`Method::SimplexL1`] | mean absolute difference of depth, D-Eq 12 | Nelder–Mead with two restarts |
//! | [`Method::PointToPlane`] | Σ ρ(r_i / s σ_i), distances along the normal | Gauss–Newton, reweighted |
//!
//! **Point to plane.** The partner of a pixel is the point of the moving mesh on the same ray ("projective
//! association"): no search among neighbours; holes and occlusion are those of the sensor. The scale s is measured at
//! every step (median), so that it falls as the surfaces converge: first all pixels count, then outliers lose weight.
//! Steps are bounded, and damped in unconstrained directions.
//!
//! ```text
//! (H + Λ' + λ diag) δ = −Σ w r ∂r/∂p − Λ' p     H = Σ w ∂r/∂p ∂r/∂pᵀ,   Λ' of `held`,   w = ρ'(r/(s σ)) / σ²,   λ = 1e-4
//! T ← T_δ T                              until |δt| < 10 µm and |δω| < 10 µrad, or 40 steps
//! ```
//! **Culling.** Facets farther than 15 cm from the image at the start of the refinement are left out.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | p = (t, ω) | [`Offset`] | m, rad; sensor |
//! | s | `scale` | – |
//!
//! Source: R195, R196, R201; point to plane: Chen & Medioni 1992; projective: Blais & Levine 1995; `small_gicp` for its
//! form.

use nalgebra::{Matrix6, Vector6};

use super::held::Held;
use super::nelder_mead::{PathStep, minimise};
use super::objective::{Objective, Offset, motion, offset};
use super::pairs::{Moving, Pair, Template, robust_scale};
use super::settings::{Method, ShapeSettings};
use sightline_geometry::cancel::Cancel;
use sightline_geometry::estimate::weighted_motion::Loss;

/// Facets within this distance of the image are kept, m.
const REACH_M: f64 = 0.15;
/// Longest translation of a step, m.
const STEP_MAX_M: f64 = 0.05;
/// Largest rotation of a step, rad.
const TURN_MAX_RAD: f64 = 0.1;
/// λ.
const DAMPING: f64 = 1e-4;
/// Lower bound of the scale: this fraction of the predicted noise.
const SCALE_MIN: f64 = 0.1;

/// Settings and cancellation of a refinement.
pub(super) struct Refinement<'a> {
    pub(super) settings: &'a ShapeSettings,
    /// Once requested, the refinement ends soon and its result is discarded.
    pub(super) cancel: Cancel<'a>,
}

/// The part of the moving surface that can enter the sensor's image during a refinement from `start`.
pub(super) fn near(template: &Template, moving: &Moving, start: &Offset) -> Moving {
    let reach_px = (REACH_M / template.sensor.pixel_m(template.pivot.z)).ceil() as usize;
    moving.near(&template.sensor, &motion(start, &template.pivot), reach_px)
}

/// Refines the motion from `start` by the selected method; returns its end and its steps.
pub(super) fn refine_register(
    template: &Template,
    moving: &Moving,
    start: &Offset,
    how: &Refinement<'_>,
    held: &Held,
) -> (Offset, Vec<PathStep>) {
    let &Refinement { settings, cancel } = how;
    match settings.method {
        Method::SimplexL1 => {
            let fixed_m = &template.image.depth_m;
            let facets = &moving.facets;
            let mut objective =
                Objective::new(&template.sensor, fixed_m, facets, template.pivot, settings.overlap_min);
            let value_m = |p: &Offset| if cancel.is_requested() { 0.0 } else { objective.at(p).mean_m };
            let (end, _, path) = minimise(value_m, start, &settings.simplex);
            (end, path)
        }
        Method::PointToPlane => point_to_plane(template, moving, start, how, held),
    }
}

/// Iteratively reweighted Gauss–Newton.
fn point_to_plane(
    template: &Template,
    moving: &Moving,
    start: &Offset,
    how: &Refinement<'_>,
    held: &Held,
) -> (Offset, Vec<PathStep>) {
    let settings = &how.settings.plane;
    let mut at = *start;
    let mut path = Vec::new();
    for step in 0..settings.steps_max {
        if how.cancel.is_requested() {
            break;
        }
        let (_, pairs) = template.pairs(moving, &at);
        path.push(PathStep {
            evaluations: step + 1,
            run: 0,
            value_m: mean_depth_m(&pairs),
            offset: at.into(),
        });
        let Some(change) = gauss_newton_step(&pairs, settings.loss, &at, held) else { break };
        let moved = motion(&change, &template.pivot) * motion(&at, &template.pivot);
        at = offset(&moved, &template.pivot);
        if change.amax() < settings.small {
            break;
        }
    }
    (at, path)
}

/// J over pairs, m; infinite without pairs.
fn mean_depth_m(pairs: &[Pair]) -> f64 {
    let sum: f64 = pairs.iter().map(|pair| (pair.residual_m / pair.slant).abs()).sum();
    if pairs.is_empty() { f64::INFINITY } else { sum / pairs.len() as f64 }
}

/// δ; `None` if the normal matrix is not positive definite.
fn gauss_newton_step(pairs: &[Pair], loss: Loss, at: &Offset, held: &Held) -> Option<Offset> {
    let scale =
        robust_scale(pairs).max(if pairs.iter().all(|pair| pair.sigma_m == 1.0) { 1e-9 } else { SCALE_MIN });
    let (mut information, mut pull) = (Matrix6::zeros(), Vector6::zeros());
    for pair in pairs {
        let gradient = pair.gradient(&pair.normal);
        let weight = loss.weight((pair.distance() / scale).powi(2)) / (pair.sigma_m * pair.sigma_m);
        information += gradient * gradient.transpose() * weight;
        pull -= gradient * (weight * pair.residual_m);
    }
    let (known, back) = held.pull(at, scale);
    information += known;
    pull += back;
    for k in 0..6 {
        information[(k, k)] *= 1.0 + DAMPING;
    }
    let change = information.cholesky()?.solve(&pull);
    let (shift_m, turn_rad) = (change.fixed_rows::<3>(0).norm(), change.fixed_rows::<3>(3).norm());
    let part = (STEP_MAX_M / shift_m).min(TURN_MAX_RAD / turn_rad).min(1.0);
    Some(change * part)
}
