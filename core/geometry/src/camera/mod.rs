//! Camera models: from a point to its pixel and back to the ray.
//!
//! Three models of the CAHV family, each in its own file: [`Cahv`] (linear), [`Cahvor`] (with radial
//! distortion) and [`Cahvore`] (fisheye, whose entrance pupil moves). [`CameraModel`] is any of them and
//! [`Camera`] is a model with its image size.
//!
//! | symbol | our name | unit | meaning |
//! |---|---|---|---|
//! | C | `centre` | m | projection centre |
//! | A | `axis` | – | normal of the image plane, unit up to the label's precision |
//! | H, V | `horizontal`, `vertical` | px | x and y of a point are d·H and d·V over d·A, with d = P − C |
//! | O | `optical_axis` | – | axis of symmetry of the lens; several degrees from A in real cameras |
//! | R | `radial` | – | radial distortion r0, r1, r2 |
//! | E | `pupil` | m | movement of the entrance pupil e0, e1, e2 |
//! | T, P | `imaging`, `linearity_parameter` | – | imaging law of a CAHVORE lens |
//! | x, y | `Pixel` | px | x right, y down, the centre of the first pixel is (0, 0) |
//! | hs, hc, vs, vc, θ | [`ImagePlane`] | px, rad | scales, principal point and angle of the image axes |
//! | H' (K's H_x) | `horizontal_axis()` | – | unit x axis of the image plane |
//!
//! All vectors of one model are in the frame in which the model was given; [`CameraModel::moved`] transforms it to
//! another. A model describes one image: subframes and reduced images have their own H and V (`motion`).
//!
//! **O is made unit on reading** (`normalised`), because labels have six digits and with O as printed a projected ray
//! misses its pixel by up to 2e-4 px; C, A, H and V stay as printed. Deserialising keeps all numbers as printed: call
//! [`CameraModel::normalised`] after it. Rays always have unit direction.
//!
//! Sources: Yakimovsky & Cunningham 1978 (CAHV); Gennery 2006 (CAHVOR, CAHVORE); NASA-AMMOS/VICAR
//! `cmod_cahv*.c`; Kim et al. Eq. 7–9 (H'). Formulas: domain.md section 2.

mod cahv;
mod cahvor;
mod cahvore;
mod distortion;
mod motion;
pub mod mast;
mod name;
pub mod text;
#[cfg(test)]
mod tests;

use nalgebra::Matrix2x3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

pub use cahv::{Cahv, ImagePlane};
pub use cahvor::Cahvor;
pub use cahvore::{Cahvore, Imaging};
pub use mast::{Mast, MastAngles};
pub use name::CameraName;

use crate::frames::{Pixel, Point3, Ray, Vector3};

/// Distance at which the effective focal length is measured, m: the movement of the pupil is negligible there.
const REMOTE_M: f64 = 1e4;

/// One camera model of the CAHV family; its vectors are in the frame in which it was given.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "model")]
pub enum CameraModel {
    /// Linear: a pinhole whose image axes may be skewed.
    #[serde(rename = "CAHV")]
    Cahv(Cahv),
    /// With radial distortion about its own optical axis.
    #[serde(rename = "CAHVOR")]
    Cahvor(Cahvor),
    /// Fisheye with a moving entrance pupil.
    #[serde(rename = "CAHVORE")]
    Cahvore(Cahvore),
}

impl CameraModel {
    /// The pixel of a point (m, in the model's frame), inside the image or not.
    ///
    /// `None` if the point is behind the camera or outside the model's domain.
    pub fn project(&self, point: &Point3) -> Option<Pixel> {
        match self {
            Self::Cahv(model) => model.project(point),
            Self::Cahvor(model) => model.project(point),
            Self::Cahvore(model) => model.project(point),
        }
    }

    /// The pixel of a point (m) and the derivative of (x, y) with respect to the point, px/m; analytic.
    pub fn project_with_jacobian(&self, point: &Point3) -> Option<(Pixel, Matrix2x3<f64>)> {
        match self {
            Self::Cahv(model) => model.project_with_jacobian(point),
            Self::Cahvor(model) => model.project_with_jacobian(point),
            Self::Cahvore(model) => model.project_with_jacobian(point),
        }
    }

    /// The ray of a pixel in the model's frame; `None` if the distortion has no inverse there.
    pub fn ray(&self, pixel: Pixel) -> Option<Ray> {
        match self {
            Self::Cahv(model) => model.ray(pixel),
            Self::Cahvor(model) => model.ray(pixel),
            Self::Cahvore(model) => model.ray(pixel),
        }
    }

    /// The linear part: C, A, H and V.
    pub fn linear(&self) -> &Cahv {
        match self {
            Self::Cahv(model) => model,
            Self::Cahvor(model) => &model.linear,
            Self::Cahvore(model) => &model.linear,
        }
    }

    /// The linear part, mutable.
    fn linear_mut(&mut self) -> &mut Cahv {
        match self {
            Self::Cahv(model) => model,
            Self::Cahvor(model) => &mut model.linear,
            Self::Cahvore(model) => &mut model.linear,
        }
    }

    /// C, m.
    pub fn centre(&self) -> Point3 {
        self.linear().centre
    }

    /// A, as printed: unit up to the label's precision.
    pub fn axis(&self) -> Vector3 {
        self.linear().axis
    }

    /// O; A for the linear model.
    pub fn optical_axis(&self) -> Vector3 {
        match self {
            Self::Cahv(model) => model.axis,
            Self::Cahvor(model) => model.optical_axis,
            Self::Cahvore(model) => model.optical_axis,
        }
    }

    /// H' = (H − hc A)/hs, the x axis of the image plane (Kim et al. Eq. 7–9).
    pub fn horizontal_axis(&self) -> Vector3 {
        self.linear().horizontal_axis()
    }

    /// Scales, principal point and angle of the image axes.
    pub fn image_plane(&self) -> ImagePlane {
        self.linear().image_plane()
    }

    /// Effective pixels per radian at a pixel, the mean of the x and y directions (domain.md 2.6).
    ///
    /// Not hs: with a distortion whose r0 is not zero, H and V alone do not determine the scale.
    pub fn focal_length_px(&self, pixel: Pixel) -> Option<f64> {
        let ray = self.ray(pixel)?;
        let (_, jacobian) = self.project_with_jacobian(&ray.at(REMOTE_M))?;
        let across = |row: usize| {
            let gradient = jacobian.row(row).transpose();
            (gradient - ray.direction * gradient.dot(&ray.direction)).norm() * REMOTE_M
        };
        Some((across(0) + across(1)) / 2.0)
    }

    /// The same model with O made unit; everything else stays as printed.
    pub fn normalised(self) -> Self {
        match self {
            Self::Cahv(model) => Self::Cahv(model),
            Self::Cahvor(m) => Self::Cahvor(Cahvor::normalised(m.linear, m.optical_axis, m.radial)),
            Self::Cahvore(mut model) => {
                model.optical_axis = distortion::made_unit(model.optical_axis);
                Self::Cahvore(model)
            }
        }
    }

    /// Checks that the numbers describe a camera: finite, |A| and |O| within 0.1 of 1, hs and vs positive.
    ///
    /// The error is a sentence that names the invalid vector.
    pub fn validate(&self) -> Result<(), String> {
        self.linear().validate()?;
        match self {
            Self::Cahv(_) => Ok(()),
            Self::Cahvor(model) => model.validate(),
            Self::Cahvore(model) => model.validate(),
        }
    }
}

/// A camera model with the size of its image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Camera {
    /// The model of an image of exactly this size.
    #[serde(flatten)]
    pub model: CameraModel,
    /// Width and height, px.
    pub size: [u32; 2],
}

impl Camera {
    /// A model with its image of `width` × `height` px.
    pub fn new(model: CameraModel, width: u32, height: u32) -> Self {
        Self { model, size: [width, height] }
    }

    /// Width of the image, px.
    pub fn width(&self) -> u32 {
        self.size[0]
    }

    /// Height of the image, px.
    pub fn height(&self) -> u32 {
        self.size[1]
    }

    /// The middle of the image, ((W − 1)/2, (H − 1)/2).
    pub fn centre_pixel(&self) -> Pixel {
        Pixel::new((f64::from(self.width()) - 1.0) / 2.0, (f64::from(self.height()) - 1.0) / 2.0)
    }

    /// The pixel of a point (m), inside the image or not; `None` only outside the model's domain.
    pub fn project(&self, point: &Point3) -> Option<Pixel> {
        self.model.project(point)
    }

    /// Whether the point (m) is in front of the camera and falls on its image.
    pub fn sees(&self, point: &Point3) -> bool {
        self.project(point).is_some_and(|pixel| pixel.is_inside(self.width(), self.height()))
    }

    /// The ray of a pixel in the model's frame.
    pub fn ray(&self, pixel: Pixel) -> Option<Ray> {
        self.model.ray(pixel)
    }

    /// The same camera with O made unit (see [`CameraModel::normalised`]).
    pub fn normalised(self) -> Self {
        Self { model: self.model.normalised(), size: self.size }
    }
}
