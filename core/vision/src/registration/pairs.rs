//! Point-to-plane residuals of the pixels that both surfaces cover, with their noise.
//!
//! ```text
//! r_i = n_i · (m_i − f_i) = (n_i · a_i)(h_i − z_i)      both points on the ray of pixel i, m_i = f_i + (h_i − z_i) a_i
//! σ_i² = Σ over both surfaces  σ_range² max( (n_i · u_i)², 0.2² ) + σ_model²
//! ∂r_i/∂(t, ω) = ( n_i, (m_i − c) × n_i )
//! ```
//! An error of range moves a point along its line of sight u; only its component along the normal counts. A surface seen
//! edge-on still has an error, so that component is bounded below by a fifth (ours). σ_model is the error of a surface
//! beyond the noise of its points: chords of facets, and the smoothing by the stereo window. Without a noise model σ_i
//! is 1 m, and the scale is measured from the residuals alone.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | n | [`Pair::normal`], of the fixed surface | –, sensor |
//! | a | (x, y, 1) along the ray of the pixel | –, sensor |
//! | u | line of sight of the instrument that measured the point | –, sensor |
//! | σ_model | `Template::model_m` | m |
//! | c | `Template::pivot` | m, sensor |
//!
//! Source: ours; point-to-plane distances are those of Chen & Medioni (1992).

use std::f64::consts::SQRT_2;

use nalgebra::Vector6;

use super::mesh::Mesh;
use super::objective::{Offset, motion};
use super::range_sensor::{RangeImage, RangeSensor};
use super::rasterise::Facets;
use super::settings::ShapeSettings;
use super::slopes::Slopes;
use sightline_geometry::frames::{Point3, Pose, Vector3};

/// Lower bound of |n · u|.
const EDGE_ON: f64 = 0.2;

/// The fixed surface in the sensor's image: everything that is constant during a registration.
pub(super) struct Template {
    pub(super) sensor: RangeSensor,
    pub(super) image: RangeImage,
    pub(super) slopes: Slopes,
    pub(super) pivot: Point3,
    pub(super) normal_radius_px: usize,
    pub(super) model_m: f64,
    /// 1σ of each pixel along its line of sight, m.
    sigma_m: Vec<f32>,
    viewpoint: Point3,
}

/// The moving surface in the sensor's frame at the start.
pub(super) struct Moving {
    pub(super) facets: Facets,
    sigma_m: Vec<f32>,
    viewpoint: Point3,
}

/// A pixel that both surfaces cover and where the fixed one has a normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) pixel: usize,
    /// m_i − c: the moved point, m, sensor.
    pub(super) arm: Vector3,
    pub(super) normal: Vector3,
    /// n_i · a_i.
    pub(super) slant: f64,
    /// r_i, m.
    pub(super) residual_m: f64,
    /// σ_i, m; 1 where unknown.
    pub(super) sigma_m: f64,
}

impl Pair {
    /// ∂r/∂(t, ω) with a normal of one or the other surface.
    pub(super) fn gradient(&self, normal: &Vector3) -> Vector6<f64> {
        let turn = self.arm.cross(normal);
        Vector6::new(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z)
    }

    /// r/σ.
    pub(super) fn distance(&self) -> f64 {
        self.residual_m / self.sigma_m
    }
}

impl Template {
    pub(super) fn new(sensor: RangeSensor, fixed: &Mesh, pivot: Point3, settings: &ShapeSettings) -> Self {
        let image = sensor.see(fixed, &sensor.sensor_from_fixed);
        let sigma_m = (0..image.depth_m.len())
            .map(|pixel| image.interpolate(pixel, &fixed.triangles, &fixed.range_sigma_m))
            .collect();
        Self {
            slopes: Slopes::of(&sensor, &image, settings.normal_radius_px),
            viewpoint: sensor.sensor_from_fixed * fixed.viewpoint,
            sensor,
            image,
            pivot,
            normal_radius_px: settings.normal_radius_px,
            model_m: settings.model_sigma_m,
            sigma_m,
        }
    }

    /// Renders the moving surface at an offset; returns the depth map and the pixels that can be compared.
    pub(super) fn pairs(&self, moving: &Moving, offset: &Offset) -> (RangeImage, Vec<Pair>) {
        let motion = motion(offset, &self.pivot);
        let image = self.sensor.see_facets(&moving.facets, &motion);
        let from = motion * moving.viewpoint;
        let pairs =
            (0..image.depth_m.len()).filter_map(|pixel| self.pair(&image, moving, &from, pixel)).collect();
        (image, pairs)
    }

    fn pair(&self, image: &RangeImage, moving: &Moving, from: &Point3, pixel: usize) -> Option<Pair> {
        let (z, h) = (self.image.depth_m[pixel], image.depth_m[pixel]);
        let normal = self.slopes.normals[pixel].filter(|_| z.is_finite() && h.is_finite())?;
        let (x, y) = (pixel % self.sensor.width, pixel / self.sensor.width);
        let slant = normal.dot(&self.sensor.along(x, y));
        let point = self.sensor.point(x, y, f64::from(h));
        let sigma = |sigma_m: f32, viewpoint: &Point3| {
            let sight = (point - viewpoint).normalize();
            f64::from(sigma_m) * normal.dot(&sight).abs().max(EDGE_ON)
        };
        let moving_m = image.interpolate(pixel, &moving.facets.triangles, &moving.sigma_m);
        let sigma_m = sigma(self.sigma_m[pixel], &self.viewpoint).hypot(sigma(moving_m, from));
        Some(Pair {
            pixel,
            arm: point - self.pivot,
            normal,
            slant,
            residual_m: slant * (f64::from(h) - f64::from(z)),
            sigma_m: if sigma_m > 0.0 { sigma_m.hypot(self.model_m * SQRT_2) } else { 1.0 },
        })
    }
}

impl Moving {
    pub(super) fn new(mesh: &Mesh, sensor_from_mesh: &Pose) -> Self {
        Self {
            facets: Facets::new(mesh, sensor_from_mesh),
            sigma_m: mesh.range_sigma_m.clone(),
            viewpoint: sensor_from_mesh * mesh.viewpoint,
        }
    }

    /// The part of the surface within `reach_px` of the sensor's image after a motion.
    pub(super) fn near(&self, sensor: &RangeSensor, motion: &Pose, reach_px: usize) -> Self {
        let (facets, old_numbers) = self.facets.near(sensor, motion, reach_px);
        let sigma_m = old_numbers.iter().map(|&vertex| self.sigma_m[vertex as usize]).collect();
        Self { facets, sigma_m, viewpoint: self.viewpoint }
    }
}

/// Scale of the residuals over their predicted σ, from the median absolute value: insensitive to outliers.
pub(super) fn robust_scale(pairs: &[Pair]) -> f64 {
    let mut sizes: Vec<f64> = pairs.iter().map(|pair| pair.distance().abs()).collect();
    if sizes.is_empty() {
        return 0.0;
    }
    let middle = sizes.len() / 2;
    1.4826 * *sizes.select_nth_unstable_by(middle, f64::total_cmp).1
}
