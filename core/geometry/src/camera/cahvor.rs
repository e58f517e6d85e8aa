//! CAHVOR: CAHV with radial distortion about its own optical axis.
//!
//! With d = P − C (domain.md 2.2; Gennery 2006; VICAR `cmod_cahvor.c`):
//!
//! ```text
//! ω = d·O   λ = d − ωO   τ = λ·λ/ω²   μ = r0 + r1 τ + r2 τ²   d' = d + μλ      for ω > 0, d'·A > 0
//! pixel = CAHV of d'
//! ∂d'/∂P = I + μ (I − O Oᵀ) + λ [(r1 + 2 r2 τ)((2/ω²) λ − (2τ/ω) O)]ᵀ
//! ray: CAHV direction rr; ω, λ, τ of rr; u undoes the distortion; from C along unit(rr − (1 − u) λ)
//! ```
//!
//! O is unit and its angle to A may be several degrees (7.5° in Spirit's left navcam); R = (r0, r1, r2) has no unit.
//! Departure: a τ beyond the fold of the polynomial is rejected (`distortion`).

use nalgebra::{Matrix2x3, Matrix3};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::cahv::{Cahv, check_finite, check_unit};
use super::distortion::{Radial, made_unit};
use crate::frames::{Pixel, Point3, Ray, Vector3};

/// The camera model with radial distortion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Cahvor {
    /// C, A, H and V.
    #[serde(flatten)]
    pub linear: Cahv,
    /// O: axis of the distortion, unit.
    #[serde(rename = "O")]
    #[schema(value_type = [f64; 3])]
    pub optical_axis: Vector3,
    /// R: radial distortion r0, r1, r2.
    #[serde(rename = "R")]
    pub radial: [f64; 3],
}

/// The vector d, decomposed about the optical axis.
struct Parts {
    /// Along O, m.
    omega: f64,
    /// Across O, m.
    lambda: Vector3,
    /// Squared tangent of the angle to O.
    tau: f64,
}

impl Cahvor {
    /// The model with its vectors untouched.
    pub fn as_printed(linear: Cahv, optical_axis: Vector3, radial: [f64; 3]) -> Self {
        Self { linear, optical_axis, radial }
    }

    /// The model with O made unit.
    pub fn normalised(linear: Cahv, optical_axis: Vector3, radial: [f64; 3]) -> Self {
        Self::as_printed(linear, made_unit(optical_axis), radial)
    }

    /// The pixel of a point (m); `None` behind the camera or beyond the fold of the distortion.
    pub fn project(&self, point: &Point3) -> Option<Pixel> {
        let d = point - self.linear.centre;
        let parts = self.take_apart(&d)?;
        self.linear.project_vector(&(d + parts.lambda * self.polynomial().factor(parts.tau)))
    }

    /// The pixel of a point (m) and its derivative with respect to the point, px/m.
    pub fn project_with_jacobian(&self, point: &Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        let d = point - self.linear.centre;
        let Parts { omega, lambda, tau } = self.take_apart(&d)?;
        let (o, mu) = (self.optical_axis, self.polynomial().factor(tau));
        let distorted = d + lambda * mu;
        let pixel = self.linear.project_vector(&distorted)?;

        let across = Matrix3::identity() - o * o.transpose();
        let tau_by_point = lambda * (2.0 / (omega * omega)) - o * (2.0 * tau / omega);
        let distorted_by_point = Matrix3::identity()
            + across * mu
            + lambda * (tau_by_point * self.polynomial().factor_slope(tau)).transpose();
        Some((pixel, self.linear.pixel_by_vector(&distorted, pixel) * distorted_by_point))
    }

    /// The ray of a pixel: it starts at C; `None` if the distortion has no inverse there.
    pub fn ray(&self, pixel: Pixel) -> Option<Ray> {
        let seen = self.linear.forward(pixel)?;
        let omega = seen.dot(&self.optical_axis);
        if omega <= 0.0 {
            return None;
        }
        let lambda = seen - self.optical_axis * omega;
        let ratio = self.polynomial().undo(lambda.norm_squared() / (omega * omega))?;
        let direction = (seen - lambda * (1.0 - ratio)).normalize();
        Some(Ray { origin: self.linear.centre, direction })
    }

    fn polynomial(&self) -> Radial {
        Radial::new(self.radial)
    }

    fn take_apart(&self, d: &Vector3) -> Option<Parts> {
        let omega = d.dot(&self.optical_axis);
        let lambda = d - self.optical_axis * omega;
        let tau = lambda.norm_squared() / (omega * omega);
        (omega > 0.0 && self.polynomial().is_one_to_one(tau)).then_some(Parts { omega, lambda, tau })
    }

    /// Checks that O and R describe a camera; the linear part is checked separately.
    pub(super) fn validate(&self) -> Result<(), String> {
        check_finite("O", self.optical_axis.as_slice())?;
        check_finite("R", &self.radial)?;
        check_unit("O", &self.optical_axis)
    }
}
