//! Cameras with radial and tangential distortion, and their images as a pinhole camera would have them (domain.md 14.2).
//!
//! ```text
//! (x, y) = ((u − cu)/fu, (v − cv)/fv),   r² = x² + y²
//! x_d = x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)
//! y_d = y (1 + k1 r² + k2 r⁴ + k3 r⁶) + p1 (r² + 2 y²) + 2 p2 x y
//! ```
//! The pinhole camera has the same focal lengths and centre; as a CAHV model, with unit vectors of the camera's axes,
//! A = z, H = fu x + cu z, V = fv y + cv z (domain.md 14.1).
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | fu, fv; cu, cv | `focal_px`, `centre` | px |
//! | k1, k2, p1, p2, k3 | `distortion` | – |

use nalgebra::Matrix3;

use sightline_geometry::camera::{Cahv, Camera, CameraModel};
use sightline_geometry::frames::{Pixel, Point3, Pose, Vector3};
use sightline_vision::image::GrayImage;
use sightline_vision::image::resample::at_places;
use sightline_vision::image::sample::Kernel;

/// Steps from a distorted pixel to the straight one; each gains more than a digit inside these images.
const STEPS: usize = 30;

/// A distorting camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lens {
    /// In both directions.
    pub(super) focal_px: [f64; 2],
    /// Where the optical axis meets the image.
    pub(super) centre: Pixel,
    /// k1, k2, p1, p2, k3.
    pub(super) distortion: [f64; 5],
}

impl Lens {
    /// From the camera matrix.
    pub(super) fn from_matrix(k: &Matrix3<f64>, distortion: [f64; 5]) -> Self {
        Self { focal_px: [k.m11, k.m22], centre: Pixel::new(k.m13, k.m23), distortion }
    }

    /// The pixel of the distorted image that shows what a pinhole camera has at `straight`.
    pub(super) fn distorted(&self, straight: Pixel) -> Pixel {
        let [fu, fv] = self.focal_px;
        let (x, y) = ((straight.x - self.centre.x) / fu, (straight.y - self.centre.y) / fv);
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let x_d = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let y_d = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        self.centre.offset(fu * x_d, fv * y_d)
    }

    /// Where a pinhole camera has what the distorted image shows at `distorted`.
    pub(super) fn straight(&self, distorted: Pixel) -> Pixel {
        let mut straight = distorted;
        for _ in 0..STEPS {
            let back = self.distorted(straight);
            straight = straight.offset(distorted.x - back.x, distorted.y - back.y);
        }
        straight
    }

    /// The image as the pinhole camera would have it; invalid where the distorted image ends.
    pub(super) fn straighten(&self, image: &GrayImage) -> GrayImage {
        let place = |u, v| self.distorted(Pixel::new(f64::from(u), f64::from(v)));
        at_places(image, image.dimensions().into(), Kernel::Bicubic, place)
    }

    /// The pinhole camera at a pose in the frame of the rig.
    pub(super) fn camera(&self, rig_from_camera: &Pose, size: [u32; 2]) -> Camera {
        let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| rig_from_camera * axis);
        let [fu, fv] = self.focal_px;
        let (horizontal, vertical) = (x * fu + z * self.centre.x, y * fv + z * self.centre.y);
        let centre = Point3::from(rig_from_camera.translation.vector);
        Camera { model: CameraModel::Cahv(Cahv::as_printed(centre, z, horizontal, vertical)), size }
    }
}
