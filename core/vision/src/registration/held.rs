//! Prior of a registration's motion, as a quadratic penalty on the offset from the start.
//!
//! ```text
//! minimise   Σ ρ(r_i / s σ_i) / (s² κ)  +  pᵀ Λ p         Λ = diag( (R Σ_target Rᵀ)⁻¹, I / σ_a² )
//! ```
//! A flat face lets a mesh slide and a round one lets it rotate; a prior from features or from a rover at rest
//! constrains those directions. Residuals are correlated over κ pixels, so the information of the surfaces is divided by
//! κ; without that it would dominate the prior.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | p = (t, ω) | [`Offset`] from the start | m, rad; sensor, about the pivot |
//! | Σ_target, σ_a | [`super::Prior`] | m², rad |
//! | R | `sensor_from_moving` at the start | – |
//! | κ | `alike_px` | px |
//!
//! Source: ours; R197 gives the start without its uncertainty.

use nalgebra::Matrix6;

use super::RegistrationInput;
use super::objective::Offset;
use super::range_sensor::RangeSensor;

/// κ before it is measured, px.
const ALIKE_PX: f64 = 20.0;
/// Least variance of a coordinate of the target, m²; 1σ = 0.1 mm.
const VARIANCE_MIN_M2: f64 = 1e-8;

/// Prior of the offset from the start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    /// Λ; 0 without a prior.
    pub(super) information: Matrix6<f64>,
    /// κ: number of pixels over which residuals are correlated.
    pub(super) alike_px: f64,
}

impl Held {
    pub(super) fn new(input: &RegistrationInput<'_>, sensor: &RangeSensor) -> Self {
        let mut held = Self { information: Matrix6::zeros(), alike_px: ALIKE_PX };
        let Some(prior) = &input.prior else { return held };
        let turn = (sensor.sensor_from_fixed * input.start_fixed_from_moving).rotation.to_rotation_matrix();
        let mut target = turn.matrix() * prior.target_m2 * turn.matrix().transpose();
        for axis in 0..3 {
            target[(axis, axis)] += VARIANCE_MIN_M2;
        }
        if let Some(inverse) = target.try_inverse() {
            held.information.fixed_view_mut::<3, 3>(0, 0).copy_from(&inverse);
        }
        for axis in 3..6 {
            held.information[(axis, axis)] = prior.attitude_rad.powi(-2);
        }
        held
    }

    /// Returns whether there is no prior.
    pub(super) fn is_free(&self) -> bool {
        self.information == Matrix6::zeros()
    }

    /// Returns the terms that the prior adds to the normal equations of residuals with scale s: matrix and right-hand
    /// side.
    pub(super) fn pull(&self, at: &Offset, scale: f64) -> (Matrix6<f64>, Offset) {
        let information = self.information * (scale * scale * self.alike_px);
        (information, -(information * at))
    }
}
