//! The epipolar curve of one left pixel in the right image, by arc length.
//!
//! The curve is sampled at equal steps of inverse range (which are nearly equal steps of disparity), far end first,
//! and parameterised by its arc length in the right image. `∂right/∂left` at a range is computed by central
//! differences of left ray → point at that range → right pixel: the local map between the two views of a patch that
//! faces the left camera.

use nalgebra::{Matrix2, Vector2};

use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Ray};

/// A range whose disparity is that of infinity, m.
const INFINITY_M: f64 = 1e9;

/// Number of samples of the curve; linear interpolation between them errs by less than 1e-3 px.
const SAMPLES: usize = 256;

/// A sampled epipolar curve.
#[derive(Clone, Debug)]
pub struct Curve {
    pixels: Vec<Pixel>,
    inverse_ranges: Vec<f64>,
    arc_px: Vec<f64>,
    /// Pixel of a point at infinity, px; `None` if not visible.
    infinity: Option<Pixel>,
    /// Rays of the four neighbours of the left pixel, a pixel away: left, right, above, below.
    around: Option<[Ray; 4]>,
}

/// The input of a curve.
#[derive(Clone, Copy, Debug)]
pub struct CurveInput<'a> {
    /// The camera of the pixel.
    pub left: &'a Camera,
    /// The camera whose image contains the curve, same frame.
    pub right: &'a Camera,
    /// The pixel, px.
    pub left_pixel: Pixel,
    /// Nearest and farthest range, m.
    pub ranges_m: [f64; 2],
}

impl CurveInput<'_> {
    fn inverse_range(&self, sample: usize) -> f64 {
        let (far, near) = (1.0 / self.ranges_m[1], 1.0 / self.ranges_m[0]);
        far + (near - far) * sample as f64 / (SAMPLES - 1) as f64
    }

    /// Inverse range and pixel of a sample; `None` if not visible.
    fn sample(&self, ray: &Ray, sample: usize) -> Option<(f64, Pixel)> {
        let inverse = self.inverse_range(sample);
        Some((inverse, self.right.project(&ray.at(1.0 / inverse))?))
    }
}

impl Curve {
    /// The curve of a left pixel between two ranges; `None` if fewer than two samples are visible.
    pub fn new(input: &CurveInput<'_>) -> Option<Self> {
        let ray = input.left.ray(input.left_pixel)?;
        Self::through(input, &ray, (0..SAMPLES).filter_map(|sample| input.sample(&ray, sample)))
    }

    /// The part of the curve around one range, at least `reach_px` to either side if the curve is that long; `None`
    /// if that range is not visible.
    pub fn near(input: &CurveInput<'_>, range_m: f64, reach_px: f64) -> Option<Self> {
        let ray = input.left.ray(input.left_pixel)?;
        let (far, step) = (input.inverse_range(0), input.inverse_range(1) - input.inverse_range(0));
        let middle = (((1.0 / range_m - far) / step) as usize).min(SAMPLES - 2);
        let (_, before) = input.sample(&ray, middle)?;
        let (_, after) = input.sample(&ray, middle + 1)?;
        let reach = |from: Pixel, samples: &mut dyn Iterator<Item = usize>| -> Vec<(f64, Pixel)> {
            let (mut last, mut length, mut found) = (from, 0.0, Vec::new());
            for sample in samples {
                let Some((inverse, pixel)) = input.sample(&ray, sample).filter(|_| length < reach_px) else {
                    break;
                };
                length += last.distance(pixel);
                last = pixel;
                found.push((inverse, pixel));
            }
            found
        };
        let (farther, nearer) =
            (reach(before, &mut (0..=middle).rev()), reach(after, &mut (middle + 1..SAMPLES)));
        Self::through(input, &ray, farther.into_iter().rev().chain(nearer))
    }

    /// The curve through visible samples, far end first.
    fn through(
        input: &CurveInput<'_>,
        ray: &Ray,
        samples: impl Iterator<Item = (f64, Pixel)>,
    ) -> Option<Self> {
        let around = [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)]
            .map(|(dx, dy)| input.left.ray(input.left_pixel.offset(dx, dy)));
        let around = match around {
            [Some(a), Some(b), Some(c), Some(d)] => Some([a, b, c, d]),
            _ => None,
        };
        let mut curve = Self {
            pixels: Vec::new(),
            inverse_ranges: Vec::new(),
            arc_px: Vec::new(),
            infinity: input.right.project(&ray.at(INFINITY_M)),
            around,
        };
        for (inverse, pixel) in samples {
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

    /// Replaces the curve by one image row: the literal reading of the paper (E38).
    pub fn flatten_to_row(&mut self, y: f64) {
        for pixel in self.pixels.iter_mut().chain(&mut self.infinity) {
            pixel.y = y;
        }
        for i in 1..self.pixels.len() {
            self.arc_px[i] = self.arc_px[i - 1] + self.pixels[i - 1].distance(self.pixels[i]);
        }
    }

    /// Length of the curve, px.
    pub fn length_px(&self) -> f64 {
        self.arc_px.last().copied().unwrap_or(0.0)
    }

    /// Arc length of disparity zero, px: negative, because it is beyond the far end; `None` if not visible.
    pub fn along_of_infinity(&self) -> Option<f64> {
        Some(-self.infinity?.distance(*self.pixels.first()?))
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

    /// The arc length of a range, px, clamped to the ends of the curve.
    pub fn along_of_range(&self, range_m: f64) -> f64 {
        let inverse = 1.0 / range_m;
        let i = self.inverse_ranges.partition_point(|&v| v < inverse).clamp(1, self.pixels.len() - 1) - 1;
        let (a, b) = (self.inverse_ranges[i], self.inverse_ranges[i + 1]);
        let t = ((inverse - a) / (b - a)).clamp(0.0, 1.0);
        self.arc_px[i] + (self.arc_px[i + 1] - self.arc_px[i]) * t
    }

    /// `∂right/∂left` of a patch at `range_m` that faces the left camera, px per px.
    pub fn right_from_left(&self, right: &Camera, range_m: f64) -> Matrix2<f64> {
        let column = |a: &Ray, b: &Ray| -> Option<Vector2<f64>> {
            let (a, b) = (right.project(&a.at(range_m))?, right.project(&b.at(range_m))?);
            Some(Vector2::new(b.x - a.x, b.y - a.y) / 2.0)
        };
        let columns = self.around.as_ref().and_then(|[a, b, c, d]| Some([column(a, b)?, column(c, d)?]));
        columns.map_or_else(Matrix2::identity, |columns| Matrix2::from_columns(&columns))
    }

    /// The segment that contains an arc length, and the fraction within it.
    fn segment(&self, along: f64) -> (usize, f64) {
        let i = self.arc_px.partition_point(|&v| v <= along).clamp(1, self.pixels.len() - 1) - 1;
        let length = self.arc_px[i + 1] - self.arc_px[i];
        (i, if length > 0.0 { (along - self.arc_px[i]) / length } else { 0.0 })
    }
}
