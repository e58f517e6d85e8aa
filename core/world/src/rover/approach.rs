//! The distances of an approach: where its stops are.
//!
//! Distances follow `D_i = D_0 (1 − step)^i`, i = 0 … n with n = ceil(ln(D_0/D_n)/ln(1/(1 − step)))
//! (R104, R106): 10 m to 2 m in steps of 10 % is 16 steps, 17 stops, the last at 1.853 m. D is measured from
//! the **centre of the left camera**, with the mast pointed, to the **targets' centre**.
//!
//! Units: m. Sources: papers.md R104, R106.

/// The distances of an approach's stops from the targets' centre, m, the first one included.
pub(crate) fn distances_m(start_m: f64, end_m: f64, step_fraction: f64) -> Vec<f64> {
    let keep = 1.0 - step_fraction;
    let ratio = (start_m / end_m).ln() / (1.0 / keep).ln();
    // A ratio that is an integer up to rounding must not add a step.
    let steps = (ratio - 1e-9).ceil().max(0.0) as i32;
    (0..=steps).map(|step| start_m * keep.powi(step)).collect()
}
