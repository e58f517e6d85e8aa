//! What is known of the motion before the surfaces are compared, as a pull towards the start.
//!
//! ```text
//! minimise   Σ ρ(r_i / s σ_i) / (s² κ)  +  pᵀ Λ p         Λ = diag( (R Σ_target Rᵀ)⁻¹, I / σ_a² )
//! ```
//! A flat face lets a rock slide and a round one lets it roll; where features or a rover that did not move say how it
//! lies, the surfaces need only tell the rest. κ pixels err together, so that so many of them count as one: without it
//! the surfaces would overrule everything.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | p = (t, ω) | [`Offset`] from the start | m, rad; sensor, about the pivot |
//! | Σ_target, σ_a | [`super::Prior`] | m², rad |
//! | R | `sensor_from_moving` at the start | – |
//! | κ | `alike_px` | px |
//!
//! Source: ours; R197 gives the start without saying how well it is known.

use nalgebra::Matrix6;

use super::RegistrationInput;
use super::objective::Offset;
use super::range_sensor::RangeSensor;

/// Pixels that err together, before that is measured.
const ALIKE_PX: f64 = 20.0;
/// The least variance of a coordinate of the target, m²: 0.1 mm.
const VARIANCE_MIN_M2: f64 = 1e-8;

/// The pull towards the start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    /// Λ; 0 where nothing is known.
    pub(super) information: Matrix6<f64>,
    /// κ.
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

    /// Whether nothing is known.
    pub(super) fn is_free(&self) -> bool {
        self.information == Matrix6::zeros()
    }

    /// What it adds to the normal equations of residuals whose scale is s: the matrix, and the pull at an offset.
    pub(super) fn pull(&self, at: &Offset, scale: f64) -> (Matrix6<f64>, Offset) {
        let information = self.information * (scale * scale * self.alike_px);
        (information, -(information * at))
    }
}
