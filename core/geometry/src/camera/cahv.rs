//! CAHV, the linear camera model.
//!
//! With d = P − C and ζ = d·A (domain.md 2.1; Yakimovsky & Cunningham 1978; VICAR `cmod_cahv.c`):
//!
//! ```text
//! x = d·H/ζ      y = d·V/ζ                        for ζ > 0
//! ∂x/∂P = (H − xA)/ζ      ∂y/∂P = (V − yA)/ζ      px/m
//! ray of (x, y): from C along (f × g)/(A·(V × H)),  f = V − yA,  g = H − xA
//! hc = A·H   hs = |A × H|   H' = (H − hc A)/hs    and vc, vs likewise from V
//! θ = atan2((V × H)·A, (A × V)·(A × H))
//! ```
//!
//! C in metres, A unit, H and V in pixels, all in the frame the model was given in. The product
//! A·(f × g) equals A·(V × H), so the quotient always points forward, whichever way the axes turn.

use nalgebra::Matrix2x3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::frames::{Pixel, Point3, Ray, Vector3};

/// The linear camera model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Cahv {
    /// C: projection centre, m.
    #[serde(rename = "C")]
    #[schema(value_type = [f64; 3])]
    pub centre: Point3,
    /// A: normal of the image plane, unit.
    #[serde(rename = "A")]
    #[schema(value_type = [f64; 3])]
    pub axis: Vector3,
    /// H: horizontal vector, px.
    #[serde(rename = "H")]
    #[schema(value_type = [f64; 3])]
    pub horizontal: Vector3,
    /// V: vertical vector, px.
    #[serde(rename = "V")]
    #[schema(value_type = [f64; 3])]
    pub vertical: Vector3,
}

/// The image plane that A, H and V define.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ImagePlane {
    /// Horizontal scale |A × H|, px.
    pub hs: f64,
    /// Column where A meets the image, A·H, px.
    pub hc: f64,
    /// Vertical scale |A × V|, px.
    pub vs: f64,
    /// Row where A meets the image, A·V, px.
    pub vc: f64,
    /// Angle from V' to H', rad; about −π/2.
    pub theta: f64,
}

impl Cahv {
    /// The model with its vectors untouched.
    pub fn as_printed(centre: Point3, axis: Vector3, horizontal: Vector3, vertical: Vector3) -> Self {
        Self { centre, axis, horizontal, vertical }
    }

    /// The same as [`Cahv::as_printed`]: there is no O, and scaling A alone would change hc and vc.
    pub fn normalised(centre: Point3, axis: Vector3, horizontal: Vector3, vertical: Vector3) -> Self {
        Self::as_printed(centre, axis, horizontal, vertical)
    }

    /// The pixel of a point (m); `None` behind the camera.
    pub fn project(&self, point: &Point3) -> Option<Pixel> {
        self.project_vector(&(point - self.centre))
    }

    /// The pixel of a point (m) and its derivative with respect to the point, px/m.
    pub fn project_with_jacobian(&self, point: &Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        let from_centre = point - self.centre;
        let pixel = self.project_vector(&from_centre)?;
        Some((pixel, self.pixel_by_vector(&from_centre, pixel)))
    }

    /// The ray of a pixel: it starts at C.
    pub fn ray(&self, pixel: Pixel) -> Option<Ray> {
        let direction = self.forward(pixel)?.normalize();
        Some(Ray { origin: self.centre, direction })
    }

    /// The pixel of a vector from C; only its direction counts.
    pub(super) fn project_vector(&self, from_centre: &Vector3) -> Option<Pixel> {
        let depth = from_centre.dot(&self.axis);
        let pixel =
            Pixel::new(from_centre.dot(&self.horizontal) / depth, from_centre.dot(&self.vertical) / depth);
        (depth > 0.0 && pixel.x.is_finite() && pixel.y.is_finite()).then_some(pixel)
    }

    /// Derivative of the pixel with respect to the vector from C that projects to it.
    pub(super) fn pixel_by_vector(&self, from_centre: &Vector3, pixel: Pixel) -> Matrix2x3<f64> {
        let depth = from_centre.dot(&self.axis);
        let by_x = (self.horizontal - self.axis * pixel.x) / depth;
        let by_y = (self.vertical - self.axis * pixel.y) / depth;
        Matrix2x3::from_rows(&[by_x.transpose(), by_y.transpose()])
    }

    /// The direction of a pixel without distortion, of length about 1/(its cosine to A).
    pub(super) fn forward(&self, pixel: Pixel) -> Option<Vector3> {
        let f = self.vertical - self.axis * pixel.y;
        let g = self.horizontal - self.axis * pixel.x;
        let direction = f.cross(&g) / self.axis.dot(&self.vertical.cross(&self.horizontal));
        direction.iter().all(|v| v.is_finite()).then_some(direction)
    }

    /// Scales, principal point and angle of the image axes.
    pub fn image_plane(&self) -> ImagePlane {
        let (a, h, v) = (&self.axis, &self.horizontal, &self.vertical);
        ImagePlane {
            hs: a.cross(h).norm(),
            hc: a.dot(h),
            vs: a.cross(v).norm(),
            vc: a.dot(v),
            theta: v.cross(h).dot(a).atan2(a.cross(v).dot(&a.cross(h))),
        }
    }

    /// H' = (H − hc A)/hs.
    pub fn horizontal_axis(&self) -> Vector3 {
        let plane = self.image_plane();
        (self.horizontal - self.axis * plane.hc) / plane.hs
    }

    /// Checks that the numbers describe a camera; the error is a sentence that names the invalid vector.
    pub(super) fn validate(&self) -> Result<(), String> {
        let vectors =
            [("C", &self.centre.coords), ("A", &self.axis), ("H", &self.horizontal), ("V", &self.vertical)];
        for (name, vector) in vectors {
            check_finite(name, vector.as_slice())?;
        }
        check_unit("A", &self.axis)?;
        let plane = self.image_plane();
        if plane.hs <= 0.0 || plane.vs <= 0.0 || plane.theta.sin().abs() < 1e-9 {
            return Err(format!(
                "H and V must span an image with A, but hs is {}, vs is {} and the angle between them {} rad",
                plane.hs, plane.vs, plane.theta
            ));
        }
        Ok(())
    }
}

/// Returns an error that names the vector unless all its numbers are finite.
pub(super) fn check_finite(name: &str, numbers: &[f64]) -> Result<(), String> {
    match numbers.iter().find(|v| !v.is_finite()) {
        None => Ok(()),
        Some(bad) => Err(format!("vector {name} has the number {bad}, but all numbers must be finite")),
    }
}

/// Returns an error that names the vector unless its length is within 0.1 of 1.
pub(super) fn check_unit(name: &str, vector: &Vector3) -> Result<(), String> {
    let length = vector.norm();
    if (length - 1.0).abs() < 0.1 {
        Ok(())
    } else {
        Err(format!("vector {name} has length {length}, but it must be a unit vector"))
    }
}
