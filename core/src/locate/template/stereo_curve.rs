//! The epipolar curve of one left pixel in the right image, by arc length, and windows seen through it.
//!
//! The curve is sampled at equal steps of inverse range (which are nearly equal steps of disparity), far end
//! first, and parameterised by its arc length in the right image. `∂right/∂left` at a range is taken by central
//! differences of left ray → point at that range → right pixel: the local map between the two views of a
//! patch that faces the left camera.

use nalgebra::{Matrix2, Vector2};

use crate::camera::Camera;
use crate::frames::Pixel;
use crate::image::GrayImage;
use crate::image::patch::Patch;
use crate::image::sample::Kernel;

/// Samples of the curve; between them it is taken as straight, which errs by less than 1e-3 px.
const SAMPLES: usize = 256;

/// A sampled epipolar curve.
#[derive(Clone, Debug)]
pub struct Curve {
    pixels: Vec<Pixel>,
    inverse_ranges: Vec<f64>,
    arc_px: Vec<f64>,
}

impl Curve {
    /// The curve of `left_pixel` between two ranges (m); none when fewer than two samples are visible.
    pub fn new(
        left: &Camera,
        right: &Camera,
        left_pixel: Pixel,
        range_min_m: f64,
        range_max_m: f64,
    ) -> Option<Self> {
        let ray = left.ray(left_pixel)?;
        let (far, near) = (1.0 / range_max_m, 1.0 / range_min_m);
        let mut curve = Self { pixels: Vec::new(), inverse_ranges: Vec::new(), arc_px: Vec::new() };
        for i in 0..SAMPLES {
            let inverse = far + (near - far) * i as f64 / (SAMPLES - 1) as f64;
            let Some(pixel) = right.project(&ray.at(1.0 / inverse)) else { continue };
            let arc = match (curve.pixels.last(), curve.arc_px.last()) {
                (Some(last), Some(arc)) => arc + last.distance(pixel),
                _ => 0.0,
            };
            curve.pixels.push(pixel);
            curve.inverse_ranges.push(inverse);
            curve.arc_px.push(arc);
        }
        (curve.pixels.len() >= 2 && curve.length_px() > 0.0).then_some(curve)
    }

    /// Lays the curve on one image row: the literal reading of the paper (E38).
    pub fn flatten_to_row(&mut self, y: f64) {
        for pixel in &mut self.pixels {
            pixel.y = y;
        }
        for i in 1..self.pixels.len() {
            self.arc_px[i] = self.arc_px[i - 1] + self.pixels[i - 1].distance(self.pixels[i]);
        }
    }

    /// Its length, px.
    pub fn length_px(&self) -> f64 {
        self.arc_px.last().copied().unwrap_or(0.0)
    }

    /// The pixel and the range (m) at an arc length, moved across the curve by `across` px.
    pub fn at(&self, along: f64, across: f64) -> (Pixel, f64) {
        let (i, t) = self.segment(along);
        let (a, b) = (self.pixels[i], self.pixels[i + 1]);
        let tangent = self.tangent(along);
        let inverse = self.inverse_ranges[i] + (self.inverse_ranges[i + 1] - self.inverse_ranges[i]) * t;
        let on_curve = a.offset((b.x - a.x) * t, (b.y - a.y) * t);
        (on_curve.offset(-tangent.y * across, tangent.x * across), 1.0 / inverse)
    }

    /// Unit direction of the curve at an arc length, towards nearer ranges.
    pub fn tangent(&self, along: f64) -> Vector2<f64> {
        let (i, _) = self.segment(along);
        let (a, b) = (self.pixels[i], self.pixels[i + 1]);
        Vector2::new(b.x - a.x, b.y - a.y).try_normalize(1e-12).unwrap_or_else(Vector2::x)
    }

    /// The arc length of a range, px; ends of the curve for ranges beyond them.
    pub fn along_of_range(&self, range_m: f64) -> f64 {
        let inverse = 1.0 / range_m;
        let i = self.inverse_ranges.partition_point(|&v| v < inverse).clamp(1, self.pixels.len() - 1) - 1;
        let (a, b) = (self.inverse_ranges[i], self.inverse_ranges[i + 1]);
        let t = ((inverse - a) / (b - a)).clamp(0.0, 1.0);
        self.arc_px[i] + (self.arc_px[i + 1] - self.arc_px[i]) * t
    }

    /// `∂right/∂left` of a patch at `range_m` that faces the left camera, px per px.
    pub fn right_from_left(
        &self,
        left: &Camera,
        right: &Camera,
        left_pixel: Pixel,
        range_m: f64,
    ) -> Matrix2<f64> {
        let through = |dx: f64, dy: f64| -> Option<Pixel> {
            right.project(&left.ray(left_pixel.offset(dx, dy))?.at(range_m))
        };
        let column = |dx: f64, dy: f64| -> Option<Vector2<f64>> {
            let (a, b) = (through(-dx, -dy)?, through(dx, dy)?);
            Some(Vector2::new(b.x - a.x, b.y - a.y) / 2.0)
        };
        match (column(1.0, 0.0), column(0.0, 1.0)) {
            (Some(u), Some(v)) => Matrix2::from_columns(&[u, v]),
            _ => Matrix2::identity(),
        }
    }

    /// The segment that holds an arc length, and the fraction within it.
    fn segment(&self, along: f64) -> (usize, f64) {
        let i = self.arc_px.partition_point(|&v| v <= along).clamp(1, self.pixels.len() - 1) - 1;
        let length = self.arc_px[i + 1] - self.arc_px[i];
        (i, if length > 0.0 { (along - self.arc_px[i]) / length } else { 0.0 })
    }
}

/// The window of `image` around `centre` as seen through `right_from_left`: offset o takes `centre + A o`.
pub fn window_through(
    image: &GrayImage,
    centre: Pixel,
    right_from_left: &Matrix2<f64>,
    half: u32,
    kernel: Kernel,
) -> Patch {
    let size = 2 * half + 1;
    GrayImage::from_fn(size, size, |x, y| {
        let offset =
            right_from_left * Vector2::new(f64::from(x) - f64::from(half), f64::from(y) - f64::from(half));
        image::Luma([kernel.sample(image, centre.offset(offset.x, offset.y)).unwrap_or(f32::NAN)])
    })
    .into()
}
