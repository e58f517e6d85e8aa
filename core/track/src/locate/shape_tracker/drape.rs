//! The last mast image, draped over the last mast surface as the other camera would see it, and matched in its image.
//!
//! A flat face does not constrain a shift along itself, and the half of a rock that both cameras of a wide pair see
//! from near by constrains it little; its texture does. At a hand-off both images have the same time and light, so
//! that only a small shift is left after the registration of the surfaces.
//! ```text
//! pixel u of the current camera → ray → the earlier surface, moved by T → pixel of the earlier left image
//! u*  = best normalised correlation of the draped image about the registered target
//! x   = intersection of the ray of u* with the plane of the surface under the target
//! Σ   = J Σ_u Jᵀ + d dᵀ (nᵀ Σ_reg n + σ²) / (n · d)²                J = ∂x/∂u
//! ```
//! Beyond the earlier mesh the plane under the target is used: the left image covers more than both cameras saw.
//!
//! | symbol | our name | unit, frame |
//! |---|---|---|
//! | T | `fixed_from_moving` | rigid motion |
//! | u*, Σ_u | [`Draped::pixel`], [`Draped::covariance_px2`] | px, px² |
//! | n, d | normal under the target, direction of the ray | –, current rover frame |
//!
//! Source: ours; D§4 hands off by the shape alone.

use nalgebra::{Matrix2, Matrix3, Matrix3x2, Vector2};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::carried_ray::normal_around;
use super::failure::DrapeFailure;
use super::view::View;
use crate::array_name::ArrayName;
use crate::locate::features::evidence::Table;
use crate::locate::template::match_noise::match_noise;
use sightline_geometry::camera::Camera;
use sightline_geometry::frames::{Pixel, Point3, Pose, Ray, Vector3};
use sightline_record::{ArrayKind, Declaration, Record, Unit, Unsent};
use sightline_vision::correlate::zncc::zncc_surface;
use sightline_vision::correlate::{Focus, peak};
use sightline_vision::image::patch::{self, Patch};
use sightline_vision::image::sample::Kernel;
use sightline_vision::image::{GrayImage, PixelRect};
use sightline_vision::registration::{RangeImage, RangeSensor};

/// Side of the sensor that renders the mesh, px.
const SENSOR_PX: usize = 160;
/// The normal of the plane is averaged within this distance, m.
const PLANE_M: f64 = 0.05;
/// Largest shift searched, px.
const SHIFT_MAX_PX: f64 = 40.0;
/// Smallest window that is matched, px.
const WINDOW_MIN_PX: u32 = 7;
/// Smallest accepted cosine between the ray and the plane's normal.
const GRAZING: f64 = 0.08;

/// The match of the draped image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Draped {
    /// Position of the target in the current left image, px.
    pub pixel: Pixel,
    /// Score of the match.
    pub score: f64,
    /// Distance from the registered target, px.
    pub correction_px: f64,
    /// Covariance of the match, px².
    #[schema(value_type = Vec<f64>)]
    pub covariance_px2: Matrix2<f64>,
    /// Share of the window on the earlier mesh; the rest is on the plane.
    pub on_mesh: f64,
    /// The draped image.
    #[serde(skip)]
    #[schema(ignore)]
    pub picture: Unsent<Table>,
    /// The current image at the match.
    #[serde(skip)]
    #[schema(ignore)]
    pub matched: Unsent<Table>,
}

/// The earlier view and the image in which it is searched for.
#[derive(Clone, Copy)]
pub struct DrapeInput<'a> {
    /// The earlier view.
    pub view: &'a View,
    /// The rigid motion T.
    pub fixed_from_moving: &'a Pose,
    /// The target by registration, m, current rover frame.
    pub registered: &'a Point3,
    /// Its covariance by the registration alone, m².
    pub covariance: &'a Matrix3<f64>,
    /// The current left camera.
    pub camera: &'a Camera,
    /// The current left image.
    pub image: &'a GrayImage,
    /// Side of the window, px; odd.
    pub window_px: u32,
    /// Smallest accepted score of a match.
    pub score_min: f64,
}

/// A target located by a draped image: position (m) and covariance (m²) in the current rover frame, and the match.
pub type Placed = (Point3, Matrix3<f64>, Draped);

/// Matches the draped image; if that fails, smaller windows are tried.
///
/// # Errors
/// The reason why the last window tried has no match.
pub fn drape(input: &DrapeInput<'_>) -> Result<Placed, DrapeFailure> {
    let smaller = [1.0, 0.7, 0.5].map(|share| (f64::from(input.window_px) * share) as u32 | 1);
    let sizes = smaller.into_iter().filter(|&size| size >= WINDOW_MIN_PX);
    let mut tried = Err(DrapeFailure::WindowTooSmall);
    for window_px in sizes {
        tried = drape_window(&DrapeInput { window_px, ..*input });
        if tried.is_ok() {
            break;
        }
    }
    tried
}

/// Matches the draped image for one window size.
fn drape_window(input: &DrapeInput<'_>) -> Result<Placed, DrapeFailure> {
    let camera = input.camera;
    let start = camera.project(input.registered).ok_or(DrapeFailure::TargetOutside)?;
    let surface = Surface::new(input, start).ok_or(DrapeFailure::EdgeOn)?;
    let (picture, on_mesh) = surface.picture(input, start)?;
    let plane = surface.plane;
    let spread = |direction: [f64; 2]| -> Option<f64> {
        let [along, back] = [1.0, -1.0]
            .map(|sign| plane.meet(camera, start.offset(sign * direction[0], sign * direction[1])));
        Some((along? - back?).norm() / 2.0)
    };
    let pixel_m = spread([1.0, 0.0]).zip(spread([0.0, 1.0])).map(|(x, y)| x.min(y));
    let pixel_m = pixel_m.ok_or(DrapeFailure::EdgeOn)?;
    let sigma_m = input.covariance.symmetric_eigenvalues().max().max(0.0).sqrt();
    let reach_px = (3.0 * sigma_m / pixel_m + 2.0).clamp(3.0, SHIFT_MAX_PX).ceil() as u32;
    let region = PixelRect::centred(start, input.window_px + 2 * reach_px);
    let scores = zncc_surface(&picture, input.image, region).ok_or(DrapeFailure::NothingToCompare)?;
    let best = peak::find_peak(&scores, true).ok_or(DrapeFailure::NoScore)?;
    if best.score < input.score_min {
        return Err(DrapeFailure::LowScore { score: best.score, limit: input.score_min });
    }
    if best.at_edge {
        return Err(DrapeFailure::AtSearchEdge);
    }
    // The draped image is centred on the whole pixel nearest to the registered target; both shift by the same amount.
    let centre = whole(start);
    let pixel = start.offset(best.pixel.x - centre.x, best.pixel.y - centre.y);
    let matched = patch::extract(input.image, best.pixel, input.window_px / 2, Kernel::Bicubic);
    let noise = match_noise(&picture, &matched, &Matrix2::zeros(), &Focus::new(input.window_px, 0.0));
    let place = |at: Pixel| plane.meet(camera, at);
    let (position, by_pixel) =
        place(pixel).zip(derivative(&place, pixel)).ok_or(DrapeFailure::RayMissesSurface)?;
    let ray = camera.ray(pixel).ok_or(DrapeFailure::NoRay)?;
    let across = plane.normal.dot(&ray.direction);
    let depth_m2 = plane.normal.dot(&(input.covariance * plane.normal)) / (across * across);
    let covariance = by_pixel * noise.covariance_px2 * by_pixel.transpose()
        + ray.direction * ray.direction.transpose() * depth_m2;
    let draped = Draped {
        pixel,
        score: best.score,
        correction_px: pixel.distance(start),
        covariance_px2: noise.covariance_px2,
        on_mesh,
        picture: table(&picture).into(),
        matched: table(&matched).into(),
    };
    Ok((position, covariance, draped))
}

/// Rounds to the nearest whole pixel.
fn whole(pixel: Pixel) -> Pixel {
    Pixel::new(pixel.x.round(), pixel.y.round())
}

fn table(patch: &Patch) -> Table {
    Table { columns: patch.width(), values: patch.as_raw().clone() }
}

/// ∂x/∂u, m per px.
fn derivative(place: &impl Fn(Pixel) -> Option<Point3>, at: Pixel) -> Option<Matrix3x2<f64>> {
    let along = place(at.offset(0.5, 0.0))? - place(at.offset(-0.5, 0.0))?;
    let down = place(at.offset(0.0, 0.5))? - place(at.offset(0.0, -0.5))?;
    Some(Matrix3x2::from_columns(&[along, down]))
}

/// The plane of the surface under the target, current rover frame.
#[derive(Clone, Copy)]
struct Plane {
    point: Point3,
    normal: Vector3,
}

impl Plane {
    fn meet(&self, camera: &Camera, pixel: Pixel) -> Option<Point3> {
        self.cross(&camera.ray(pixel)?)
    }

    fn cross(&self, ray: &Ray) -> Option<Point3> {
        let along = self.normal.dot(&ray.direction);
        let distance_m = self.normal.dot(&(self.point - ray.origin)) / along;
        (along.abs() > GRAZING && distance_m > 0.0).then(|| ray.at(distance_m))
    }
}

/// The earlier surface, rendered from the current camera.
struct Surface {
    plane: Plane,
    sensor: RangeSensor,
    sensor_from_moving: Pose,
    image: RangeImage,
}

impl Surface {
    fn new(input: &DrapeInput<'_>, start: Pixel) -> Option<Self> {
        let moving_from_fixed = input.fixed_from_moving.inverse();
        let normal =
            moving_from_fixed * normal_around(&input.view.mesh, &input.view.position_in_rover, PLANE_M)?;
        let plane = Plane { point: *input.registered, normal };
        let centre = input.camera.ray(start)?;
        plane.cross(&centre)?;
        // Wide enough for the corners of the window under any lens distortion.
        let half = f64::from(input.window_px) / 2.0 + 2.0;
        let corner = input.camera.ray(start.offset(half, half))?;
        let half_angle_rad = 1.2 * centre.direction.angle(&corner.direction);
        let sensor =
            RangeSensor::pinhole(&centre.origin, &centre.direction, half_angle_rad, [SENSOR_PX, SENSOR_PX]);
        // The sensor's "fixed" frame is the current rover frame here.
        let sensor_from_moving = sensor.sensor_from_fixed;
        let image = sensor.see(&input.view.mesh, &(sensor_from_moving * moving_from_fixed));
        Some(Self { plane, sensor, sensor_from_moving, image })
    }

    /// Returns the surface point at a pixel of the current camera, and whether it is on the mesh.
    fn point(&self, camera: &Camera, pixel: Pixel) -> Option<(Point3, bool)> {
        let ray = camera.ray(pixel)?;
        let on_plane = self.plane.cross(&ray)?;
        let in_sensor = self.sensor_from_moving * on_plane;
        let [x, y] = self.sensor.pixel(&in_sensor)?.map(f64::round);
        let side = SENSOR_PX as f64;
        if x < 0.0 || y < 0.0 || x >= side || y >= side {
            return Some((on_plane, false));
        }
        let depth_m = f64::from(self.image.depth_m[y as usize * SENSOR_PX + x as usize]);
        if !depth_m.is_finite() {
            return Some((on_plane, false));
        }
        let axis = self.sensor_from_moving * ray.direction;
        let from = self.sensor_from_moving * ray.origin;
        Some((ray.at((depth_m - from.z) / axis.z), true))
    }

    /// Renders the draped image about the whole pixel nearest to `start`; also returns its share on the mesh.
    fn picture(&self, input: &DrapeInput<'_>, start: Pixel) -> Result<(Patch, f64), DrapeFailure> {
        let (view, camera, size) = (input.view, input.camera, input.window_px);
        let centre = whole(start);
        let source = |offset: Vector2<f64>| -> Option<Pixel> {
            let (point, _) = self.point(camera, centre.offset(offset.x, offset.y))?;
            view.left.project(&(input.fixed_from_moving * point))
        };
        let flat = |x: f64, y: f64| -> Option<Pixel> {
            let point = self.plane.meet(camera, centre.offset(x, y))?;
            view.left.project(&(input.fixed_from_moving * point))
        };
        let wide = flat(1.0, 0.0).zip(flat(-1.0, 0.0)).zip(flat(0.0, 1.0).zip(flat(0.0, -1.0)));
        let ((right, left), (down, up)) = wide.ok_or(DrapeFailure::TargetUnseen)?;
        // Area of a current pixel in the earlier image, px².
        let area = ((right.x - left.x) * (down.y - up.y) - (right.y - left.y) * (down.x - up.x)).abs() / 4.0;
        let scale = 1.0 / area.sqrt().max(1e-6);
        let picture = patch::warp_by(&view.image, scale, size, Kernel::Bicubic, source);
        if !picture.is_complete() {
            let half = f64::from(size) / 2.0;
            let corners = [(-half, -half), (half, -half), (-half, half), (half, half)];
            let reached = corners.map(|(x, y)| source(Vector2::new(x, y)));
            let [width, height] = [view.left.width(), view.left.height()];
            let beyond = reached.iter().flatten().find(|pixel| !pixel.is_inside(width, height));
            return Err(DrapeFailure::WindowUnseen { reached_px: beyond.map(|pixel| [pixel.x, pixel.y]) });
        }
        let half = (f64::from(size) - 1.0) / 2.0;
        let places =
            (0..size * size).map(|i| centre.offset(f64::from(i % size) - half, f64::from(i / size) - half));
        let on_mesh = places.filter(|&at| self.point(camera, at).is_some_and(|(_, is_mesh)| is_mesh)).count();
        Ok((picture, on_mesh as f64 / f64::from(size * size)))
    }
}

impl Record for Draped {
    fn declare(r: &mut Declaration<Self>) {
        r.quantity("pixel", Unit::Pixel, |d| d.pixel).describe("The target in the present left image.");
        r.quantity("score", Unit::One, |d| d.score).describe("Score of the match.");
        r.quantity("correction_px", Unit::Pixel, |d| d.correction_px)
            .describe("Distance from the registered target.");
        r.quantity("covariance_px2", Unit::SquarePixel, |d| d.covariance_px2)
            .describe("Covariance of the match.");
        r.quantity("on_mesh", Unit::One, |d| d.on_mesh)
            .describe("Share of the window on the earlier mesh; the rest is the plane.");
        r.array("draped", ArrayKind::Patch, "The earlier image as the present camera would see it", |d| {
            d.picture.view()
        });
        r.array("draped_match", ArrayKind::Patch, "The present image where that was found", |d| {
            d.matched.view()
        });
    }
}

/// Names of the arrays of this stage that a panel draws individually.
impl ArrayName {
    /// At a hand-off, the earlier image draped over the surface as the current camera would see it.
    pub const DRAPED: Self = Self::new("draped");
    /// The current image at its match.
    pub const DRAPED_MATCH: Self = Self::new("draped_match");
}
