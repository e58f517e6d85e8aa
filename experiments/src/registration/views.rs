//! Points as dense stereo would measure them, from exact geometry: no images, known noise.
//!
//! ```text
//! d = f B / Z                 disparity of what the ray of a pixel meets, exactly
//! d̃ = mean of d over the window, of those within a pixel of the middle's       a window smooths what it sees
//! d̂ = d̃ + σ_d ν                ν: white noise averaged over the window, of unit variance: neighbours err alike
//! P = o + (point − o) Z(d̂)/Z   σ_range = σ_d Z²/(f B) · range/Z
//! ```
//! Nothing is measured where the surface is seen at more than 80°, where the window has a jump of disparity in it, where
//! the right eye does not see the point, and in the sky. A share of the points is wrong, in patches as large as the
//! window, by up to 10 px of disparity.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | f, B | [`Stereo::focal_px`], [`Stereo::baseline_m`] | px, m |
//! | σ_d | [`Stereo::sigma_px`] | px |
//! | o | [`Eye::viewpoint_in_rover`] | m, rover |
//!
//! Source: domain.md 3.4 and 7; the form of the noise is ours.

use nalgebra::{Matrix3, Rotation3};
use rand::{RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use rayon::prelude::*;

use sightline_geometry::frames::{Point3, Pose, Ray, Vector3};
use sightline_vision::registration::PointGrid;

/// Where a ray meets a surface, and the surface's normal there.
pub type Cast<'a> = dyn Fn(&Ray) -> Option<(Point3, Vector3)> + Sync + 'a;

/// Cosine of the greatest angle at which stereo sees a surface: 80°.
const GRAZING: f64 = 0.1736;
/// Jump of disparity that a window does not bridge, px.
const JUMP_PX: f64 = 1.0;

/// A pair of cameras and what it measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stereo {
    /// f, px.
    pub focal_px: f64,
    /// B, m.
    pub baseline_m: f64,
    /// σ_d, px; 0: exact points, without a window.
    pub sigma_px: f64,
    /// Side of the window of correlation, px; odd.
    pub window_px: usize,
    /// Share of wrong points.
    pub wrong: f64,
}

impl Default for Stereo {
    /// A navcam pair at half its resolution, as dense stereo takes it (domain.md 7): f 612 px, 0.2 m, 7 × 7; 0.1 px and
    /// 1 % wrong (ours).
    fn default() -> Self {
        Self { focal_px: 612.0, baseline_m: 0.2, sigma_px: 0.1, window_px: 7, wrong: 0.01 }
    }
}

/// A rover somewhere, whose left camera looks at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// Where the rover is.
    pub site_from_rover: Pose,
    /// The left camera, m.
    pub viewpoint_in_rover: Point3,
    /// What it looks at, m.
    pub centre_in_site: Point3,
    /// Pixels of a side of the picture.
    pub side_px: usize,
}

/// One pixel before noise.
#[derive(Clone, Copy)]
struct Seen {
    /// Unit direction, rover frame, and the part of it along the axis.
    direction: Vector3,
    along: f64,
    /// None in the sky.
    disparity_px: Option<f64>,
    is_grazing: bool,
}

/// The points of one view, in its rover frame.
pub fn look(cast: &Cast<'_>, eye: &Eye, stereo: &Stereo, seed: u64) -> PointGrid {
    let side = eye.side_px;
    let pixels = exact(cast, eye, stereo);
    let reach = if stereo.sigma_px > 0.0 { stereo.window_px / 2 } else { 0 };
    let mut random = Pcg64::seed_from_u64(seed);
    let noise = noise(side, reach, &mut random);
    let wrong = wrong(side, reach, stereo.wrong, &mut random);
    let is_seen = seen_by_the_right_eye(&pixels, side);
    let strength = stereo.focal_px * stereo.baseline_m;
    let of = |i: usize| {
        let pixel = &pixels[i];
        if pixel.is_grazing || !is_seen[i] {
            return None;
        }
        let mean_px = window_mean(&pixels, side, reach, i)?;
        let disparity_px = mean_px + stereo.sigma_px * noise[i] + wrong[i];
        let depth_m = strength / disparity_px;
        let range_m = depth_m / pixel.along;
        // Beyond 30 m nothing is measured.
        (disparity_px > 0.0 && depth_m < 30.0).then(|| {
            let sigma_m = stereo.sigma_px * depth_m * depth_m / strength / pixel.along;
            (eye.viewpoint_in_rover + pixel.direction * range_m, sigma_m as f32)
        })
    };
    let measured: Vec<Option<(Point3, f32)>> = (0..side * side).into_par_iter().map(of).collect();
    PointGrid {
        width: side,
        height: side,
        points: measured.iter().map(|point| point.map(|(point, _)| point)).collect(),
        range_sigma_m: Some(measured.iter().map(|point| point.map_or(0.0, |(_, sigma_m)| sigma_m)).collect()),
    }
}

/// What every pixel's ray meets.
fn exact(cast: &Cast<'_>, eye: &Eye, stereo: &Stereo) -> Vec<Seen> {
    let rover_from_site = eye.site_from_rover.inverse();
    let away = (rover_from_site * eye.centre_in_site - eye.viewpoint_in_rover).normalize();
    let right = Vector3::z().cross(&away).normalize();
    let axes = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, away.cross(&right), away]));
    let middle = (eye.side_px as f64 - 1.0) / 2.0;
    let origin = eye.site_from_rover * eye.viewpoint_in_rover;
    let pixel = |i: usize| {
        let [x, y] =
            [i % eye.side_px, i / eye.side_px].map(|place| (place as f64 - middle) / stereo.focal_px);
        let direction = (axes * Vector3::new(x, y, 1.0)).normalize();
        let ray = Ray { origin, direction: eye.site_from_rover.rotation * direction };
        let along = direction.dot(&away);
        let hit = cast(&ray);
        let disparity_px = hit.map(|(point, _)| {
            stereo.focal_px * stereo.baseline_m / ((point - origin).dot(&ray.direction) * along)
        });
        let is_grazing = hit.is_some_and(|(_, normal)| normal.dot(&ray.direction).abs() < GRAZING);
        Seen { direction, along, disparity_px, is_grazing }
    };
    (0..eye.side_px * eye.side_px).into_par_iter().map(pixel).collect()
}

/// White noise averaged over windows, of unit variance.
fn noise(side: usize, reach: usize, random: &mut Pcg64) -> Vec<f64> {
    let wide = side + 2 * reach;
    let white: Vec<f64> = (0..wide * wide).map(|_| StandardNormal.sample(random)).collect();
    let window = 2 * reach + 1;
    let rows: Vec<f64> = (0..wide * side)
        .map(|i| (0..window).map(|k| white[i / side * wide + i % side + k]).sum::<f64>())
        .collect();
    (0..side * side)
        .map(|i| (0..window).map(|k| rows[(i / side + k) * side + i % side]).sum::<f64>() / window as f64)
        .collect()
}

/// Disparities to add, px, 0 for most: patches that are wrong as a whole.
fn wrong(side: usize, reach: usize, share: f64, random: &mut Pcg64) -> Vec<f64> {
    let mut wrong = vec![0.0; side * side];
    let window = 2 * reach + 1;
    let patches = (share * (side * side) as f64 / (window * window) as f64).round() as usize;
    for _ in 0..patches {
        let [x, y] = [(); 2].map(|()| random.random_range(0..side));
        let by_px = random.random_range(-10.0..10.0);
        for row in y..(y + window).min(side) {
            wrong[row * side + x..row * side + (x + window).min(side)].fill(by_px);
        }
    }
    wrong
}

/// Which pixels the right eye sees: no pixel farther right in the row appears at the same place or left of it.
fn seen_by_the_right_eye(pixels: &[Seen], side: usize) -> Vec<bool> {
    let mut is_seen = vec![true; pixels.len()];
    for (row, is_seen) in pixels.chunks(side).zip(is_seen.chunks_mut(side)) {
        // Where the right eye sees a pixel: its column less its disparity. What comes later in the row must stay right.
        let mut leftmost = f64::INFINITY;
        for x in (0..side).rev() {
            let place = x as f64 - row[x].disparity_px.unwrap_or(0.0);
            is_seen[x] = place < leftmost;
            leftmost = leftmost.min(place);
        }
    }
    is_seen
}

/// The mean disparity of a window, px; none where it has a jump or a part of the sky in it.
fn window_mean(pixels: &[Seen], side: usize, reach: usize, i: usize) -> Option<f64> {
    let (x, y) = (i % side, i / side);
    let middle = pixels[i].disparity_px?;
    let (mut sum, mut count) = (0.0, 0);
    for row in y.saturating_sub(reach)..=(y + reach).min(side - 1) {
        for pixel in &pixels[row * side + x.saturating_sub(reach)..=row * side + (x + reach).min(side - 1)] {
            let disparity = pixel.disparity_px?;
            // A slope changes the disparity over the window too; a jump does so by more than a pixel a column.
            if (disparity - middle).abs() > JUMP_PX * (1.0 + reach as f64) {
                return None;
            }
            sum += disparity;
            count += 1;
        }
    }
    Some(sum / f64::from(count))
}
