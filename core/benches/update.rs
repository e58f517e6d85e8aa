//! Speed of one tracking update without image decoding, and of its steps; the goal is 1 ms on one thread.
//!
//! **The bound.** With the default settings (window 21 × 21, search window 143 × 143, 80 px of disparity):
//!
//! | step | work | at what the processor can do |
//! |---|---|---|
//! | `match_template` | 6.7 M multiply-adds for the surface, then 30 windows of 441 pixels in focus | 0.05 ms |
//! | `point_stereo`, search | a strip of 101 × 27 and a template of 441 samples, 0.3 M multiply-adds, 9 windows | 0.03 ms |
//! | `point_stereo`, slope | four neighbours: strip of 31 × 23, two templates, 27 × 27 samples in focus | 0.05 ms |
//! | `point_stereo`, on the slope | strip of 31 × 27, a template, 9 windows, 30 windows in focus | 0.1 ms |
//! | `point_stereo`, left–right check | as the search | 0.03 ms |
//!
//! A bicubic sample has 16 taps and two sets of weights, about 60 instructions in double precision, 5 ns when three or
//! four go at once; an update takes about 35 000 of them. Memory is no limit: all that is read fits a cache of 1 MB.
//!
//! The pair is a textured plane before Spirit's navcams, 1024 × 1024 px, whose right eye sees it with a true disparity.
//! Run with `cargo bench -p sightline-core --profile dev --bench update` (the profile `dev` is optimised); measured times:
//! `docs/benchmarks.md`.

use std::sync::{Arc, OnceLock};

use divan::Bencher;
use image::Luma;
use sightline_geometry::camera::{Cahv, Cahvor, Camera, CameraModel, Mast, MastAngles};
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_rover::pipeline::{self, Stops};
use sightline_track::locate::template::point_stereo::{self, StereoInput};
use sightline_track::settings::Settings;
use sightline_track::stages::capture::StereoPair;
use sightline_track::stages::update::Updated;
use sightline_track::target::Designation;
use sightline_vision::image::GrayImage;

fn main() {
    divan::main();
}

/// Two stops before a plane across the line of sight, held in memory.
struct Plane {
    cameras: [Camera; 2],
    poses: [Pose; 2],
    pairs: Vec<StereoPair>,
}

/// Where the target is designated: near the middle of the left image.
const PIXEL: Pixel = Pixel::new(530.3, 498.6);

impl Plane {
    fn new() -> Self {
        let cameras = navcams();
        let middle = cameras[0].ray(PIXEL).expect("the pixel has a ray");
        let (point, normal) = (middle.at(5.0), middle.direction);
        let poses = [Pose::identity(), Pose::translation(normal.x * 0.4, normal.y * 0.4, normal.z * 0.4)];
        let picture = |pose: &Pose, camera: &Camera| {
            Arc::new(GrayImage::from_fn(camera.width(), camera.height(), |x, y| {
                let grey = camera.ray(Pixel::new(f64::from(x), f64::from(y))).map(|ray| {
                    let (origin, direction) = (pose * ray.origin, pose * ray.direction);
                    let range_m = (point - origin).dot(&normal) / direction.dot(&normal);
                    texture(&(origin + direction * range_m))
                });
                Luma([grey.unwrap_or(0.0) as f32])
            }))
        };
        let pairs = poses
            .iter()
            .map(|pose| StereoPair { left: picture(pose, &cameras[0]), right: picture(pose, &cameras[1]) })
            .collect();
        Self { cameras, poses, pairs }
    }
}

/// Waves of many lengths and directions, from half a metre down to two centimetres.
fn texture(point: &Point3) -> f64 {
    let waves = (0..14).map(|i| {
        let i = f64::from(i);
        let along = (point.x + point.y) * (i * 2.399_963).cos() + point.z * (i * 2.399_963).sin();
        0.03 * (std::f64::consts::TAU * along / (0.5 * 0.79_f64.powf(i)) + i * i).sin()
    });
    0.5 + waves.sum::<f64>()
}

/// Spirit's navcams of sol 767 (domain.md, TV3).
fn navcams() -> [Camera; 2] {
    let camera = |[c, a, h, v, o]: [[f64; 3]; 5], radial: [f64; 3]| {
        let linear = Cahv::as_printed(Point3::from(c), a.into(), h.into(), v.into());
        Camera::new(CameraModel::Cahvor(Cahvor::normalised(linear, o.into(), radial)), 1024, 1024)
    };
    [
        camera(
            [
                [0.394318, -0.0582843, -1.23826],
                [0.276192, -0.889336, 0.364419],
                [1262.81, -60.1316, 185.71],
                [0.196974, -50.5533, 1294.91],
                [0.156295, -0.929704, 0.3335],
            ],
            [0.019876, -0.014281, 0.020876],
        ),
        camera(
            [
                [0.584061, 0.00602352, -1.2389],
                [0.311825, -0.875514, 0.369109],
                [1301.08, -49.1938, 190.743],
                [15.1976, -38.3493, 1318.0],
                [0.30304, -0.87994, 0.365886],
            ],
            [0.0003, -0.004874, 0.018766],
        ),
    ]
}

impl Stops for Plane {
    fn stop_count(&self) -> usize {
        self.poses.len()
    }
    fn time_s(&self, step: usize) -> f64 {
        step as f64
    }
    fn site_from_rover(&self, step: usize) -> Pose {
        self.poses[step]
    }
    fn cameras(&self, _step: usize) -> (&Camera, &Camera) {
        (&self.cameras[0], &self.cameras[1])
    }
    fn mast(&self) -> Option<&Mast> {
        None
    }
    fn mast_angles(&self, _step: usize) -> Option<MastAngles> {
        None
    }
    fn odometry_error(&self) -> OdometryError {
        OdometryError::default()
    }
    fn pointing_error_deg(&self) -> f64 {
        0.0
    }
    fn stereo(&self) -> StereoGeometry {
        StereoGeometry::Lateral
    }
    fn capture(
        &self,
        step: usize,
        _: sightline_geometry::cancel::Cancel<'_>,
    ) -> sightline_geometry::error::Result<StereoPair> {
        Ok(self.pairs[step].clone())
    }
}

fn scene() -> &'static (Plane, Updated) {
    static SCENE: OnceLock<(Plane, Updated)> = OnceLock::new();
    SCENE.get_or_init(|| {
        let plane = Plane::new();
        let designation = Designation::new(0, PIXEL);
        let first = pipeline::designate(&plane, designation, &Settings::default());
        let updated = first.expect("the target can be designated").update;
        (plane, updated)
    })
}

/// On this one thread.
fn on_one_thread<T>(bencher: Bencher<'_, '_>, work: impl Fn(&Plane, &Updated) -> T) {
    let (plane, first) = scene();
    let _pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    bencher.bench_local(|| work(plane, first));
}

/// The first 3-D position of a designated pixel: stereo along the whole curve.
#[divan::bench]
fn designate(bencher: Bencher<'_, '_>) {
    on_one_thread(bencher, |plane, first| {
        pipeline::designate(plane, first.target.designation, &Settings::default())
    });
}

/// A whole update, from the prediction to the renewed target.
#[divan::bench]
fn run_step(bencher: Bencher<'_, '_>) {
    on_one_thread(bencher, |plane, first| pipeline::run_step(plane, first, &Settings::default()));
}

/// The step `point_stereo` of it.
#[divan::bench]
fn stereo(bencher: Bencher<'_, '_>) {
    let settings = Settings::default().template;
    on_one_thread(bencher, |plane, _| {
        let input = StereoInput {
            left_pixel: PIXEL,
            left_image: &plane.pairs[0].left,
            right_image: &plane.pairs[0].right,
            left: &plane.cameras[0],
            right: &plane.cameras[1],
            geometry: StereoGeometry::Lateral,
            predicted_range_m: Some(5.1),
            surface_by_pixel: None,
        };
        point_stereo::point_stereo(&input, &settings)
    });
}
