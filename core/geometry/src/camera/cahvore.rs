//! CAHVORE: fisheye lenses whose entrance pupil moves with the angle of the ray (hazcams).
//!
//! The linearity L is 1 for T = 1 (perspective), 0 for T = 2 (fisheye) and P for T = 3 (general). The
//! imaging law χ(θ) is tan(Lθ)/L for L > 0, θ for L = 0, sin(Lθ)/L for L < 0, defined for |Lθ| < π/2.
//! (domain.md 2.3; Gennery 2006; VICAR `cmod_cahvore.c`)
//!
//! ```text
//! projection: d = P − C   ζ = d·O   λ = d − ζO   Λ = |λ|
//!   θ from  ζ sin θ − Λ cos θ − (θ − sin θ) ε = 0,  ε = e0 + e1 θ² + e2 θ⁴   (Newton from atan2(Λ, ζ))
//!   υ = its slope = ζ cos θ + Λ sin θ − (1 − cos θ) ε − (θ − sin θ) ε'
//!   χ = χ(θ)   ζ' = Λ/χ   μ = r0 + r1 χ² + r2 χ⁴   rp = ζ'O + (1 + μ) λ      for rp·A > 0
//!   pixel = CAHV of rp
//! derivative: ∂θ/∂ζ = −sin θ/υ   ∂θ/∂Λ = cos θ/υ   ∂ζ/∂P = O   ∂Λ/∂P = λ/Λ   ∂λ/∂P = I − O Oᵀ
//! ray: rp = CAHV direction   ζ' = rp·O   λ' = rp − ζ'O   χ' = |λ'|/ζ';  χ undoes μ;  θ from χ
//!   origin = C + sO,  s = (θ/sin θ − 1) ε   direction = sin θ unit(λ') + cos θ O
//! ```
//!
//! A ray does not start at C: s reaches 5.8 mm in a MER hazcam, 1.2 px at 1 m. Points with ζ < 0 may be visible,
//! since the field of view of such lenses extends beyond 90°. Departures: rays have unit direction even if O is not
//! unit; a χ beyond the fold of the polynomial is rejected (`distortion`), otherwise points behind a hazcam would
//! appear in its image. On the axis VICAR takes rp = d; its derivative there includes r0.

use nalgebra::{Matrix2x3, Matrix3};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::cahv::{Cahv, check_finite, check_unit};
use super::distortion::{Radial, made_unit, newton};
use crate::frames::{Pixel, Point3, Ray, Vector3};

/// Angle, rad, and radius below which a ray is taken as the optical axis.
const ON_AXIS: f64 = 1e-8;

/// The kind of imaging law, T in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub enum Imaging {
    /// T = 1: L = 1.
    Perspective,
    /// T = 2: L = 0.
    Fisheye,
    /// T = 3: L = P.
    General,
}

impl TryFrom<u8> for Imaging {
    type Error = String;

    fn try_from(number: u8) -> Result<Self, String> {
        match number {
            1 => Ok(Self::Perspective),
            2 => Ok(Self::Fisheye),
            3 => Ok(Self::General),
            _ => Err(format!("the CAHVORE type is {number}, but it must be 1, 2 or 3")),
        }
    }
}

impl From<Imaging> for u8 {
    fn from(imaging: Imaging) -> Self {
        match imaging {
            Imaging::Perspective => 1,
            Imaging::Fisheye => 2,
            Imaging::General => 3,
        }
    }
}

/// The fisheye camera model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Cahvore {
    /// C, A, H and V.
    #[serde(flatten)]
    pub linear: Cahv,
    /// O: optical axis, unit.
    #[serde(rename = "O")]
    #[schema(value_type = [f64; 3])]
    pub optical_axis: Vector3,
    /// R: radial distortion r0, r1, r2.
    #[serde(rename = "R")]
    pub radial: [f64; 3],
    /// E: movement of the entrance pupil e0, e1, e2, m.
    #[serde(rename = "E")]
    pub pupil: [f64; 3],
    /// T: kind of imaging law, 1, 2 or 3.
    #[serde(rename = "T")]
    #[schema(value_type = u8)]
    pub imaging: Imaging,
    /// P: linearity of the general law (T = 3), otherwise unused.
    #[serde(rename = "P", default)]
    pub linearity_parameter: f64,
}

/// The vector d, decomposed about the optical axis, with the angle of its ray.
struct Parts {
    /// ζ: along O, m.
    zeta: f64,
    /// λ: across O, m.
    lambda: Vector3,
    /// Angle between the ray and O, rad.
    theta: f64,
}

impl Cahvore {
    /// The model with its vectors untouched; `law` is T and P.
    pub fn as_printed(
        linear: Cahv,
        optical_axis: Vector3,
        radial: [f64; 3],
        pupil: [f64; 3],
        law: (Imaging, f64),
    ) -> Self {
        Self { linear, optical_axis, radial, pupil, imaging: law.0, linearity_parameter: law.1 }
    }

    /// The model with O made unit; `law` is T and P.
    pub fn normalised(
        linear: Cahv,
        optical_axis: Vector3,
        radial: [f64; 3],
        pupil: [f64; 3],
        law: (Imaging, f64),
    ) -> Self {
        Self::as_printed(linear, made_unit(optical_axis), radial, pupil, law)
    }

    /// L: 1 for perspective, 0 for fisheye, P for the general law.
    pub fn linearity(&self) -> f64 {
        match self.imaging {
            Imaging::Perspective => 1.0,
            Imaging::Fisheye => 0.0,
            Imaging::General => self.linearity_parameter,
        }
    }

    /// The pixel of a point (m); `None` outside the model's domain.
    pub fn project(&self, point: &Point3) -> Option<Pixel> {
        let d = point - self.linear.centre;
        let Parts { lambda, theta, .. } = self.take_apart(&d)?;
        if theta < ON_AXIS {
            return self.linear.project_vector(&d);
        }
        let (chi, _) = self.imaging_law(theta)?;
        let mu = self.distortion_within_fold(chi)?;
        self.linear.project_vector(&(self.optical_axis * (lambda.norm() / chi) + lambda * (1.0 + mu)))
    }

    /// The pixel of a point (m) and its derivative with respect to the point, px/m.
    pub fn project_with_jacobian(&self, point: &Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        let d = point - self.linear.centre;
        let Parts { zeta, lambda, theta } = self.take_apart(&d)?;
        let o = self.optical_axis;
        let across = Matrix3::identity() - o * o.transpose();
        if theta < ON_AXIS {
            let pixel = self.linear.project_vector(&d)?;
            let bent_by_point = Matrix3::identity() + across * self.radial[0];
            return Some((pixel, self.linear.pixel_by_vector(&d, pixel) * bent_by_point));
        }
        let (chi, chi_slope) = self.imaging_law(theta)?;
        let mu = self.distortion_within_fold(chi)?;
        let radius = lambda.norm();
        let bent = o * (radius / chi) + lambda * (1.0 + mu);
        let pixel = self.linear.project_vector(&bent)?;

        let (_, upsilon) = self.angle_equation(theta, zeta, radius);
        let radius_by_point = across * (lambda / radius);
        let theta_by_point = (radius_by_point * theta.cos() - o * theta.sin()) / upsilon;
        let depth_by_point = radius_by_point / chi - theta_by_point * (radius * chi_slope / (chi * chi));
        let mu_slope = Radial::new(self.radial).factor_slope(chi * chi) * 2.0 * chi * chi_slope;
        let bent_by_point = o * depth_by_point.transpose()
            + across * (1.0 + mu)
            + lambda * (theta_by_point * mu_slope).transpose();
        Some((pixel, self.linear.pixel_by_vector(&bent, pixel) * bent_by_point))
    }

    /// The ray of a pixel, from the entrance pupil of its angle; `None` if the distortion has no inverse there.
    pub fn ray(&self, pixel: Pixel) -> Option<Ray> {
        let seen = self.linear.forward(pixel)?;
        let o = self.optical_axis;
        let depth = seen.dot(&o);
        let lambda = seen - o * depth;
        let chi_seen = lambda.norm() / depth;
        if depth <= 0.0 {
            return None;
        }
        if chi_seen < ON_AXIS {
            return Some(Ray { origin: self.linear.centre, direction: o.normalize() });
        }
        let chi = chi_seen * Radial::new(self.radial).undo(chi_seen * chi_seen)?;
        let theta = self.angle_of(chi)?;
        let shift = (theta / theta.sin() - 1.0) * self.pupil_polynomial(theta).0;
        let direction = (lambda.normalize() * theta.sin() + o * theta.cos()).normalize();
        Some(Ray { origin: self.linear.centre + o * shift, direction })
    }

    fn take_apart(&self, d: &Vector3) -> Option<Parts> {
        let zeta = d.dot(&self.optical_axis);
        let lambda = d - self.optical_axis * zeta;
        let radius = lambda.norm();
        let theta = newton(radius.atan2(zeta), |theta| self.angle_equation(theta, zeta, radius))?;
        Some(Parts { zeta, lambda, theta })
    }

    /// The equation whose zero is the angle of the ray through (ζ, Λ), and its slope υ; both in m.
    fn angle_equation(&self, theta: f64, zeta: f64, radius: f64) -> (f64, f64) {
        let (sin, cos) = theta.sin_cos();
        let (epsilon, epsilon_slope) = self.pupil_polynomial(theta);
        let value = zeta * sin - radius * cos - (theta - sin) * epsilon;
        let slope = zeta * cos + radius * sin - (1.0 - cos) * epsilon - (theta - sin) * epsilon_slope;
        (value, slope)
    }

    /// ε = e0 + e1 θ² + e2 θ⁴ (m) and dε/dθ (m/rad).
    fn pupil_polynomial(&self, theta: f64) -> (f64, f64) {
        let [e0, e1, e2] = self.pupil;
        let t = theta * theta;
        (e0 + t * (e1 + t * e2), theta * (2.0 * e1 + 4.0 * e2 * t))
    }

    /// χ(θ) and dχ/dθ.
    fn imaging_law(&self, theta: f64) -> Option<(f64, f64)> {
        let linearity = self.linearity();
        let scaled = linearity * theta;
        if scaled.abs() >= std::f64::consts::FRAC_PI_2 {
            return None;
        }
        Some(if linearity > 0.0 {
            (scaled.tan() / linearity, 1.0 / scaled.cos().powi(2))
        } else if linearity < 0.0 {
            (scaled.sin() / linearity, scaled.cos())
        } else {
            (theta, 1.0)
        })
    }

    /// θ of χ; `None` outside the image of the law.
    fn angle_of(&self, chi: f64) -> Option<f64> {
        let linearity = self.linearity();
        let theta = if linearity > 0.0 {
            (linearity * chi).atan() / linearity
        } else if linearity < 0.0 {
            (linearity * chi).asin() / linearity
        } else {
            chi
        };
        (theta < std::f64::consts::PI).then_some(theta)
    }

    /// μ of χ; `None` beyond the fold of the polynomial.
    fn distortion_within_fold(&self, chi: f64) -> Option<f64> {
        let polynomial = Radial::new(self.radial);
        let t = chi * chi;
        polynomial.is_one_to_one(t).then(|| polynomial.factor(t))
    }

    /// Checks that O, R, E and P describe a camera; the linear part is checked separately.
    pub(super) fn validate(&self) -> Result<(), String> {
        check_finite("O", self.optical_axis.as_slice())?;
        check_finite("R", &self.radial)?;
        check_finite("E", &self.pupil)?;
        check_finite("P", &[self.linearity_parameter])?;
        check_unit("O", &self.optical_axis)
    }
}
