//! Epipolar alignment: two linear cameras in whose images a point has the same row.
//!
//! ```text
//! x̂ = unit(C2 − C1), along H1'     ŷ = unit of the part of V1' + V2' orthogonal to x̂     n̂ = x̂ × ŷ, along A1
//! t = ± (axis · u)/(n̂ · u) of the rays u at the corners and the middle of each side, at most tan(field_max)
//! t_L, t_R, t_T, t_B: the least of both cameras and three rays of a side            the common field of view
//! hs = (W − 1)/(t_R + t_L)   hc = hs t_L   H = hs x̂ + hc n̂   A = n̂                  V likewise from ŷ
//! depth along A = hs B/(x_L − x_R)                                                  B = |C2 − C1|
//! ```
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | C, A, H, V | [`Alignment::left`], [`Alignment::right`] | m, –, px, px; frame of the cameras |
//! | W, H | [`AlignSettings::size`], without it the left camera's | px |
//! | field_max | [`AlignSettings::field_max_deg`] | deg |
//! | B | [`Alignment::baseline_m`] | m |
//!
//! **About a plane** m·P = h (the ground). Its disparity is linear in the pixel; the right camera is sheared so that it
//! is d₀ in every pixel. A window then covers ground of a single disparity. On unsheared images the disparity changes by
//! a pixel and more from the upper to the lower rows of a window, and the result depends on where in the window the
//! texture is.
//!
//! ```text
//! d(x, y) = a x + b y + c      of the plane:  hs B/(h − m·C1) · m·u,   u: the ray of (x, y) with n̂·u = 1
//! H_R = (H + b V + c A)/(1 − a) − d₀ A      d₀: half the largest d, so that ground twice as far below the camera has d ≥ 0
//! ```
//!
//! **Resampling.** A pixel of an aligned image takes the value that the real camera sees along its ray. Its position in
//! the real image is computed exactly at every eighth pixel and interpolated by cubics (Lagrange), with an error below
//! 1e-4 px for lenses such as the hazcams'. Rays of a CAHVORE model do not start at C: its pixels are those of points at
//! [`AlignSettings::range_m`]. Nearer or farther points are off their row by little (the pupil moves by 6 mm at the
//! edge). Ranges are not affected, since they are computed from the pixels of the real images and the true cameras
//! (`ranges`).
//!
//! Sources: domain.md 3.3, the five steps of JPL's `cmod_cahvor_warp_models`, which limits the field to 75°. Departure:
//! hazcams are aligned like any other pair, within a configurable field.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::image::GrayImage;
use crate::image::resample::at_places;
use crate::image::sample::Kernel;
use sightline_geometry::camera::{Cahv, Camera, CameraModel};
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Point3, Vector3};

/// Spacing of the exact nodes of a warp, px.
const STEP: usize = 8;
/// Range at which rays of a camera with one centre are projected, m; any value gives the same pixel.
const REMOTE_M: f64 = 1e4;

/// Settings of the epipolar alignment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AlignSettings {
    /// Width and height of the aligned images, px; by default those of the left camera.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<[u32; 2]>,
    /// Largest angle between the aligned axis and a side of the image, degrees, 5 to 80 (60: domain.md 3.3). Wider:
    /// fewer pixels for the middle of a fisheye; narrower: its sides are cut off.
    pub field_max_deg: f64,
    /// Range at which the rows of a fisheye pair agree exactly, m, 0.1 to 1000 (2: ours, an arm's work space and more).
    pub range_m: f64,
}

impl Default for AlignSettings {
    fn default() -> Self {
        Self { size: None, field_max_deg: 60.0, range_m: 2.0 }
    }
}

/// A plane: the points P with `normal`·P = `distance_m`, in the frame of the cameras.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Unit normal.
    pub normal: Vector3,
    /// Distance from the origin along the normal, m.
    pub distance_m: f64,
}

/// Two aligned cameras, and the positions of their pixels in the images of the real ones.
#[derive(Clone, Debug)]
pub struct Alignment {
    /// The aligned left camera, in the frame of the real ones.
    pub left: Camera,
    /// The aligned right camera: equal to the left one except for its centre, and sheared about a plane.
    pub right: Camera,
    /// Disparity of that plane, px; 0 without one.
    pub plane_px: f64,
    warps: [Warp; 2],
}

impl Alignment {
    /// Aligns two cameras whose models are in one frame.
    ///
    /// # Errors
    /// [`Error::Request`] if their centres coincide, they point along the baseline, or their fields of view do not
    /// overlap.
    pub fn new(left: &Camera, right: &Camera, settings: &AlignSettings) -> Result<Self> {
        Self::about(left, right, None, settings)
    }

    /// Aligns two cameras so that all points of a plane have one disparity.
    ///
    /// # Errors
    /// As [`Self::new`], and for a plane that is not in front of the left camera.
    pub fn about(
        left: &Camera,
        right: &Camera,
        plane: Option<&Plane>,
        settings: &AlignSettings,
    ) -> Result<Self> {
        let size = settings.size.unwrap_or(left.size);
        if !(5.0..=80.0).contains(&settings.field_max_deg) || !(0.1..=1000.0).contains(&settings.range_m) {
            return Err(Error::setting(
                "field_max_deg",
                "must be from 5 to 80, and range_m from 0.1 to 1000",
            ));
        }
        if size.iter().any(|side| !(16..=8192).contains(side)) {
            return Err(Error::setting("size", "must be from 16 to 8192 px"));
        }
        let cannot = |why: &str| Error::Request(format!("the pair cannot be aligned: {why}"));
        let axes = Axes::of(left, right).ok_or_else(|| cannot("its cameras are not side by side"))?;
        let at_most = settings.field_max_deg.to_radians().tan();
        let [x, y] = [[-axes.x, axes.x], [-axes.y, axes.y]]
            .map(|sides| sides.map(|side| axes.extent(&[left, right], &side, at_most)));
        let (Some(t_left), Some(t_right), Some(t_top), Some(t_bottom)) = (x[0], x[1], y[0], y[1]) else {
            return Err(cannot("the border of an image has pixels without a ray"));
        };
        if !(t_left + t_right > 1e-3 && t_top + t_bottom > 1e-3) {
            return Err(cannot("the fields of view of its cameras do not overlap"));
        }
        let [hs, vs] = [(size[0], t_left + t_right), (size[1], t_top + t_bottom)]
            .map(|(side, extent)| (f64::from(side) - 1.0) / extent);
        let horizontal = axes.x * hs + axes.n * (hs * t_left);
        let vertical = axes.y * vs + axes.n * (vs * t_top);
        let aligned = |real: &Camera, horizontal: Vector3| {
            let model = Cahv::as_printed(real.model.centre(), axes.n, horizontal, vertical);
            Camera { model: CameraModel::Cahv(model), size }
        };
        let aligned_left = aligned(left, horizontal);
        let (sheared, plane_px) = match plane {
            Some(plane) => shear(&aligned_left, right.model.centre(), plane)
                .ok_or_else(|| cannot("the plane does not lie in front of its left camera"))?,
            None => (horizontal, 0.0),
        };
        let aligned_right = aligned(right, sheared);
        let warps = [
            Warp::new(&aligned_left, left, settings.range_m),
            Warp::new(&aligned_right, right, settings.range_m),
        ];
        Ok(Self { left: aligned_left, right: aligned_right, plane_px, warps })
    }

    /// B, m.
    pub fn baseline_m(&self) -> f64 {
        (self.right.model.centre() - self.left.model.centre()).norm()
    }

    /// Disparity at a depth along A (m), px; without the shear of a plane.
    pub fn disparity_px(&self, depth_m: f64) -> f64 {
        self.left.model.image_plane().hs * self.baseline_m() / depth_m
    }

    /// Resamples both images to the aligned cameras; NaN outside the real images.
    pub fn images(&self, left: &GrayImage, right: &GrayImage) -> [GrayImage; 2] {
        let (left, right) = rayon::join(|| self.warps[0].image(left), || self.warps[1].image(right));
        [left, right]
    }

    /// Positions of a row of the aligned left image in the real one.
    pub fn left_row(&self, y: f64) -> WarpRow {
        self.warps[0].row(y)
    }

    /// Positions of a row of the aligned right image in the real one.
    pub fn right_row(&self, y: f64) -> WarpRow {
        self.warps[1].row(y)
    }
}

/// H of the right camera in whose image all points of a plane have one disparity, and that disparity, px; `None` if the
/// plane is not in front of the left camera or is seen edge-on.
fn shear(left: &Camera, right_centre: Point3, plane: &Plane) -> Option<(Vector3, f64)> {
    let (linear, image) = (left.model.linear(), left.model.image_plane());
    let centre = left.model.centre();
    let baseline_m = (right_centre - centre).norm();
    let height_m = plane.distance_m - plane.normal.dot(&centre.coords);
    let (x, y) = (
        (linear.horizontal - linear.axis * image.hc) / image.hs,
        (linear.vertical - linear.axis * image.vc) / image.vs,
    );
    let slope = image.hs * baseline_m / height_m;
    let a = slope * plane.normal.dot(&x) / image.hs;
    let b = slope * plane.normal.dot(&y) / image.vs;
    let c = slope * plane.normal.dot(&linear.axis) - a * image.hc - b * image.vc;
    let [last_x, last_y] = left.size.map(|side| f64::from(side) - 1.0);
    let corners = [[0.0, 0.0], [last_x, 0.0], [0.0, last_y], [last_x, last_y]];
    let largest_px = corners.into_iter().map(|[x, y]| a * x + b * y + c).fold(f64::MIN, f64::max);
    if !(largest_px.is_finite() && largest_px > 0.0 && a < 0.5) {
        return None;
    }
    let plane_px = (0.5 * largest_px).ceil();
    let horizontal =
        (linear.horizontal + linear.vertical * b + linear.axis * c) / (1.0 - a) - linear.axis * plane_px;
    Some((horizontal, plane_px))
}

/// The axes of the aligned pair.
struct Axes {
    x: Vector3,
    y: Vector3,
    n: Vector3,
}

impl Axes {
    fn of(left: &Camera, right: &Camera) -> Option<Self> {
        let along = |vector: Vector3, like: Vector3| if vector.dot(&like) < 0.0 { -vector } else { vector };
        let vertical = |camera: &Camera| {
            let (plane, linear) = (camera.model.image_plane(), camera.model.linear());
            (linear.vertical - linear.axis * plane.vc) / plane.vs
        };
        let x = (right.model.centre() - left.model.centre()).try_normalize(1e-6)?;
        let x = along(x, left.model.horizontal_axis());
        let down = vertical(left) + vertical(right);
        let y = (down - x * x.dot(&down)).try_normalize(1e-3)?;
        let n = along(x.cross(&y), left.model.axis());
        // A camera that points along the baseline measures no depth.
        (n.dot(&left.model.axis()) > 0.2).then_some(Self { x, y, n })
    }

    /// Tangent of the angle to which both cameras see towards `side`, at most `at_most`; `None` if a ray is missing.
    fn extent(&self, cameras: &[&Camera; 2], side: &Vector3, at_most: f64) -> Option<f64> {
        let mut least = at_most;
        for camera in cameras {
            let (plane, linear) = (camera.model.image_plane(), camera.model.linear());
            let [last_x, last_y] = camera.size.map(|side| f64::from(side) - 1.0);
            let is_across = side.dot(&self.x).abs() > 0.5;
            let axis = if is_across { linear.horizontal } else { linear.vertical };
            let is_last =
                axis.dot(side) - linear.axis.dot(side) * if is_across { plane.hc } else { plane.vc } > 0.0;
            let pixels = if is_across {
                let x = if is_last { last_x } else { 0.0 };
                [0.0, plane.vc.clamp(0.0, last_y), last_y].map(|y| Pixel::new(x, y))
            } else {
                let y = if is_last { last_y } else { 0.0 };
                [0.0, plane.hc.clamp(0.0, last_x), last_x].map(|x| Pixel::new(x, y))
            };
            for pixel in pixels {
                let direction = camera.ray(pixel)?.direction;
                let forward = self.n.dot(&direction);
                let tangent = if forward > 0.0 { side.dot(&direction) / forward } else { f64::INFINITY };
                least = least.min(tangent);
            }
        }
        Some(least)
    }
}

/// Positions of the pixels of an aligned image in the real one: exact at every eighth pixel, NaN outside.
#[derive(Clone, Debug)]
struct Warp {
    size: [usize; 2],
    columns: usize,
    /// Row by row; the first node is `STEP` before pixel (0, 0) in both directions.
    nodes: Vec<[f64; 2]>,
}

impl Warp {
    fn new(aligned: &Camera, real: &Camera, range_m: f64) -> Self {
        let size = aligned.size.map(|side| side as usize);
        let [columns, rows] = size.map(|side| side.div_ceil(STEP) + 3);
        let range_m = if matches!(real.model, CameraModel::Cahvore(_)) { range_m } else { REMOTE_M };
        let place = |node: usize| (node as f64 - 1.0) * STEP as f64;
        let node = |at: usize| {
            let ray = aligned.ray(Pixel::new(place(at % columns), place(at / columns)));
            let pixel = ray.and_then(|ray| real.project(&ray.at(range_m)));
            pixel.map_or([f64::NAN; 2], |pixel| [pixel.x, pixel.y])
        };
        Self { size, columns, nodes: (0..columns * rows).into_par_iter().map(node).collect() }
    }

    /// Positions of row `y`, from 0 to the height less 1.
    fn row(&self, y: f64) -> WarpRow {
        let (first, weights) = taps(y);
        let rows = &self.nodes[first * self.columns..][..4 * self.columns];
        let node = |x: usize| {
            let mut sum = [0.0; 2];
            for (k, weight) in weights.iter().enumerate() {
                let node = rows[k * self.columns + x];
                sum = [sum[0] + weight * node[0], sum[1] + weight * node[1]];
            }
            sum
        };
        WarpRow { nodes: (0..self.columns).map(node).collect() }
    }

    fn image(&self, real: &GrayImage) -> GrayImage {
        let [width, height] = self.size;
        let rows: Vec<Vec<f32>> = (0..height)
            .into_par_iter()
            .map(|y| {
                let row = self.row(y as f64);
                at_places(real, [width as u32, 1], Kernel::Bicubic, |x, _| row.at(f64::from(x))).into_raw()
            })
            .collect();
        GrayImage::from_raw(width as u32, height as u32, rows.concat()).unwrap_or_default()
    }
}

/// Positions of a row of an aligned image in the real one.
#[derive(Clone, Debug)]
pub struct WarpRow {
    nodes: Vec<[f64; 2]>,
}

impl WarpRow {
    /// Position of column `x`, from 0 to the width less 1, px; NaN outside the real image.
    #[inline]
    pub fn at(&self, x: f64) -> Pixel {
        let (first, weights) = taps(x);
        let Some(nodes) = self.nodes.get(first..).and_then(|nodes| nodes.first_chunk::<4>()) else {
            return Pixel::new(f64::NAN, f64::NAN);
        };
        let sum = |axis: usize| {
            (weights[0] * nodes[0][axis] + weights[1] * nodes[1][axis])
                + (weights[2] * nodes[2][axis] + weights[3] * nodes[3][axis])
        };
        Pixel::new(sum(0), sum(1))
    }
}

/// The first of four nodes around a position, and their weights (Lagrange).
#[inline(always)]
fn taps(place: f64) -> (usize, [f64; 4]) {
    let cell = (place / STEP as f64).max(0.0) as usize;
    let t = place / STEP as f64 - cell as f64;
    let (a, b, c) = (t + 1.0, t - 1.0, t - 2.0);
    (cell, [-t * b * c / 6.0, a * b * c / 2.0, -a * t * c / 2.0, a * t * b / 6.0])
}

#[cfg(test)]
#[path = "align_tests.rs"]
mod tests;
