//! The optics: point spread, fall-off towards the corners, and the uneven flat field.
//!
//! ```text
//! point spread    Gaussian of σ = `blur_px`, cut at 4σ, sum 1
//! flat field      F(x, y) = [1 − v (1 − cos⁴ψ)] · [1 + ρ p(x, y)]
//! pattern         p = Σ c_k b_k(u, w),   b = √3 u, √3 w, 3 u w, √5 (3u² − 1)/2, √5 (3w² − 1)/2
//! ```
//!
//! The Gaussian is sampled at whole pixels, so its variance falls short of σ²: by 14 % at 0.5 px, 2.3 % at 0.6 px, 0.2 %
//! at 0.7 px. The point spread is part of the clean radiance; the flat field multiplies it during development. The
//! functions b are orthonormal over the image and Σ c² = 1, so ρ is the rms of the pattern; c is drawn once for each
//! camera of a scenario. ψ is the angle θ between the pixel's ray and A. A is used instead of O, which in a label may be
//! degrees away from the lens's own axis (domain.md 2.6). A CAHVORE lens maps θ to tan(Lθ)/L, so inside it the ray makes
//! an angle of about Lθ: ψ = Lθ there (ours; L = 1 gives cos⁴θ, and a hazcam's corner keeps half of its light instead of
//! none).
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | v | `vignetting` | – |
//! | ρ | `flat_field_residue` | – |
//! | u, w | position in the image, −1 to 1 along x and y | – |
//! | ψ, θ | angles off the axis | rad |
//! | L | linearity of a CAHVORE lens | – |
//!
//! Frame: pixels. Sources: domain.md 2.3, 5.1 (2.5 % relative), 5.3, 11.3; the pattern's form is ours.

use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use crate::camera::picture::Eye;
use crate::ground::texture::mix;
use crate::scenario::Scenario;
use sightline_geometry::camera::{Camera, CameraModel, Imaging};
use sightline_geometry::frames::Pixel;
use sightline_vision::image::GrayImage;

/// Relative sensitivity of each pixel of a camera.
#[derive(Clone, Debug)]
pub(crate) struct FlatField<'a> {
    camera: &'a Camera,
    vignetting: f64,
    residue: f64,
    coefficients: [f64; 5],
}

impl<'a> FlatField<'a> {
    /// The flat field of one camera of a scenario; the frame of the camera model does not matter.
    pub(crate) fn new(scenario: &Scenario, camera: &'a Camera, eye: Eye) -> Self {
        let key = mix(scenario.seed ^ mix(0xf1a7_0000 + eye.number()));
        let mut random = Pcg64::new(u128::from(key), 0xf1a7_f1e1_d000);
        let drawn: [f64; 5] = std::array::from_fn(|_| StandardNormal.sample(&mut random));
        let length = drawn.iter().map(|c| c * c).sum::<f64>().sqrt();
        Self {
            camera,
            vignetting: scenario.camera.vignetting,
            residue: scenario.camera.flat_field_residue,
            coefficients: drawn.map(|c| c / length),
        }
    }

    /// Relative sensitivity of a pixel; about 1 at the image's centre.
    pub(crate) fn at(&self, x: u32, y: u32) -> f64 {
        let place = |at: u32, side: u32| (2.0 * f64::from(at) + 1.0) / f64::from(side.max(1)) - 1.0;
        let (u, w) = (place(x, self.camera.width()), place(y, self.camera.height()));
        let curve = |t: f64| 5f64.sqrt() * 0.5 * (3.0 * t * t - 1.0);
        let basis = [3f64.sqrt() * u, 3f64.sqrt() * w, 3.0 * u * w, curve(u), curve(w)];
        let pattern: f64 = basis.iter().zip(&self.coefficients).map(|(b, c)| b * c).sum();
        let falloff = if self.vignetting > 0.0 {
            let lost = 1.0 - self.lean_cos(Pixel::new(f64::from(x), f64::from(y))).powi(4);
            1.0 - self.vignetting * lost
        } else {
            1.0
        };
        falloff * (1.0 + self.residue * pattern)
    }

    /// cos ψ of a pixel; 1 where it has no ray.
    fn lean_cos(&self, pixel: Pixel) -> f64 {
        let Some(ray) = self.camera.ray(pixel) else { return 1.0 };
        let cosine = ray.direction.dot(&self.camera.model.axis().normalize()).clamp(-1.0, 1.0);
        match &self.camera.model {
            CameraModel::Cahv(_) | CameraModel::Cahvor(_) => cosine,
            CameraModel::Cahvore(lens) => {
                let linearity = match lens.imaging {
                    Imaging::Perspective => 1.0,
                    Imaging::Fisheye => 0.0,
                    Imaging::General => lens.linearity_parameter,
                };
                (linearity * cosine.acos()).cos()
            }
        }
    }

    /// Multiplies a part of an image whose first pixel is `first` in the whole image.
    pub(crate) fn apply(&self, picture: &mut GrayImage, first: [u32; 2]) {
        let width = picture.width().max(1) as usize;
        picture.par_chunks_mut(width).enumerate().for_each(|(y, line)| {
            for (value, x) in line.iter_mut().zip(first[0]..) {
                *value *= self.at(x, first[1] + y as u32) as f32;
            }
        });
    }
}

/// A Gaussian of σ `sigma_px`, cut at 4σ, with sum 1.
pub(crate) fn gaussian(sigma_px: f64) -> Vec<f32> {
    let reach = (4.0 * sigma_px).ceil() as i32;
    let value = |k: i32| if sigma_px > 0.0 { (-0.5 * (f64::from(k) / sigma_px).powi(2)).exp() } else { 1.0 };
    let values: Vec<f64> = (-reach..=reach).map(value).collect();
    let sum: f64 = values.iter().sum();
    values.into_iter().map(|v| (v / sum) as f32).collect()
}

/// Convolves rows, then columns, keeping only where the whole kernel fits.
pub(crate) fn blur(values: &[f32], [width, height]: [usize; 2], kernel: &[f32]) -> Vec<f32> {
    let lost = kernel.len() - 1;
    let (inner_width, inner_height) = (width - lost, height - lost);
    let mut along_rows = vec![0.0f32; inner_width * height];
    for (line, out) in values.chunks(width).zip(along_rows.chunks_mut(inner_width)) {
        for (k, weight) in kernel.iter().enumerate() {
            out.iter_mut().zip(&line[k..]).for_each(|(sum, value)| *sum += weight * value);
        }
    }
    let mut blurred = vec![0.0f32; inner_width * inner_height];
    for (y, out) in blurred.chunks_mut(inner_width).enumerate() {
        for (k, weight) in kernel.iter().enumerate() {
            let line = &along_rows[(y + k) * inner_width..(y + k + 1) * inner_width];
            out.iter_mut().zip(line).for_each(|(sum, value)| *sum += weight * value);
        }
    }
    blurred
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::rig::Rig;
    use crate::scenario::CameraRig;

    fn scenario(rig: CameraRig, vignetting: f64, residue: f64) -> Scenario {
        let mut scenario = Scenario::demo();
        (scenario.camera.rig, scenario.camera.image_size) = (rig, 128);
        (scenario.camera.vignetting, scenario.camera.flat_field_residue) = (vignetting, residue);
        scenario
    }

    fn left(scenario: &Scenario) -> Camera {
        Rig::new(&scenario.camera).cameras_in_rover(None).0
    }

    #[test]
    fn a_corner_of_a_linear_camera_gets_cos_to_the_fourth() {
        let whole = scenario(CameraRig::Table1Navcam, 1.0, 0.0);
        let camera = left(&whole);
        // The first pixel's centre is 63.5 and 47.5 px from the image's centre, with 160 px per unit of tangent.
        let cos_squared = 1.0 / (1.0 + (63.5f64.powi(2) + 47.5f64.powi(2)) / 160f64.powi(2));
        let corner = FlatField::new(&whole, &camera, Eye::Left).at(0, 0);
        assert!((corner - cos_squared.powi(2)).abs() < 1e-9, "{corner}");
        let half = scenario(CameraRig::Table1Navcam, 0.5, 0.0);
        let corner_of_half = FlatField::new(&half, &camera, Eye::Left).at(0, 0);
        assert!((corner_of_half - 0.5 * (1.0 + corner)).abs() < 1e-9);
    }

    #[test]
    fn a_hazcams_corner_keeps_about_half_of_its_light() {
        let scenario = scenario(CameraRig::MerFrontHazcam, 1.0, 0.0);
        let camera = left(&scenario);
        let corner = FlatField::new(&scenario, &camera, Eye::Left).at(0, 0);
        // The corner is 88° off the axis (domain.md 2.6): cos⁴(0.37 · 88°) = 0.50.
        assert!((corner - 0.50).abs() < 0.02, "{corner}");
    }

    #[test]
    fn the_residue_has_its_stated_rms_and_differs_between_the_eyes() {
        let scenario = scenario(CameraRig::MerNavcam, 0.0, 0.025);
        let camera = left(&scenario);
        let pattern = |eye: Eye| -> Vec<f64> {
            let flat = FlatField::new(&scenario, &camera, eye);
            (0..128 * 128).map(|k| flat.at(k % 128, k / 128) - 1.0).collect()
        };
        let (a, b) = (pattern(Eye::Left), pattern(Eye::Right));
        let mean_of_product =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(p, q)| p * q).sum::<f64>() / a.len() as f64;
        let rms = mean_of_product(&a, &a).sqrt();
        assert!((rms / 0.025 - 1.0).abs() < 1e-3, "{rms}");
        assert!(a.iter().sum::<f64>().abs() / 16_384.0 < 1e-5);
        assert!(mean_of_product(&a, &b) < 0.99 * 0.025 * 0.025);
    }

    #[test]
    fn the_point_spread_keeps_light_and_has_its_stated_width() {
        for sigma_px in [0.0, 0.5, 0.7, 2.0] {
            let kernel = gaussian(sigma_px);
            let middle = (kernel.len() / 2) as f64;
            let moment = |power: i32| -> f64 {
                let terms = kernel.iter().enumerate();
                terms.map(|(k, weight)| f64::from(*weight) * (k as f64 - middle).powi(power)).sum()
            };
            assert!((moment(0) - 1.0).abs() < 1e-6);
            // Fraction of the variance that sampling at whole pixels leaves (header).
            let part = if sigma_px == 0.5 {
                0.860
            } else if sigma_px == 0.7 {
                0.9976
            } else {
                1.0
            };
            assert!(
                (moment(2) - part * sigma_px * sigma_px).abs() <= 2e-3 * sigma_px * sigma_px,
                "{sigma_px}"
            );
        }
        let mut spot = vec![0.0f32; 81];
        spot[40] = 1.0;
        let spread = blur(&spot, [9, 9], &gaussian(0.5));
        assert_eq!(spread.len(), 25);
        assert!((spread.iter().sum::<f32>() - 1.0).abs() < 1e-3 && spread[12] > spread[11]);
    }
}
