//! A recording of three small stops, and the folder for the files of parsers.

use std::path::Path;
use std::sync::OnceLock;

use sightline_geometry::camera::{Cahv, Camera, CameraModel};
use sightline_geometry::frames::{Point3, Pose, PoseRecord, Vector3};
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_recordings::{Existing, IndexFormat, Traverse};
use sightline_vision::image::{GrayImage, io};
use sightline_world::traverse::{CameraSource, FORMAT_VERSION, Stop, TraverseIndex, View};
use tempfile::TempDir;

/// Width and height of the images, px.
const SIZE: [u32; 2] = [96, 64];
/// Focal length, px.
const FOCAL_PX: f64 = 80.0;
/// Baseline of the cameras, m.
const BASELINE_M: f64 = 0.2;

/// A folder for files that exist during one input; in memory if the system has such a file system.
pub(crate) fn scratch() -> &'static Path {
    thread_local! {
        static FOLDER: &'static Path = Box::leak(Box::new(folder())).path();
    }
    FOLDER.with(|path| *path)
}

/// A folder that is removed when it is dropped.
pub(crate) fn folder() -> TempDir {
    let in_memory = Path::new("/dev/shm");
    let made = if in_memory.is_dir() { tempfile::tempdir_in(in_memory) } else { tempfile::tempdir() };
    made.expect("a temporary folder")
}

/// A recording of three stops 0.2 m apart, before a textured wall.
pub(crate) fn recording() -> Traverse {
    static FOLDER: OnceLock<TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = folder();
        let stops = (0..3).map(stop).collect::<Vec<_>>();
        for (step, stop) in stops.iter().enumerate() {
            for (view, eye_m) in [(&stop.left, 0.0), (&stop.right, BASELINE_M)] {
                let image = wall(3.0 - 0.2 * step as f64, eye_m);
                io::write_png_u8(folder.path().join(&view.image), &image).expect("an image");
            }
        }
        let index = TraverseIndex {
            format: FORMAT_VERSION,
            name: "before a wall".to_owned(),
            description: String::new(),
            full_scale_dn: None,
            stereo: StereoGeometry::Lateral,
            odometry_error: OdometryError::default(),
            pointing_error_deg: 0.0,
            mast: None,
            scenario: None,
            stops,
        };
        sightline_recordings::write(&index, folder.path(), IndexFormat::Toml, Existing::Refuse)
            .expect("an index");
        folder
    });
    Traverse::open(folder.path()).expect("the recording")
}

fn stop(step: usize) -> Stop {
    let view = |side: &str, y_m: f64| View {
        image: format!("{side}{step}.png"),
        camera: CameraSource::Inline(camera(y_m)),
    };
    let pose = Pose::new(Vector3::new(0.2 * step as f64, 0.0, 0.0), Vector3::zeros());
    Stop {
        time_s: step as f64,
        site_from_rover: PoseRecord::from(&pose),
        mast_angles: None,
        left: view("left", 0.0),
        right: view("right", BASELINE_M),
        light: None,
        metered_px: None,
        odometry: None,
        odometry_alone: false,
        mast_target: None,
        truth: None,
        cameras: Vec::new(),
    }
}

/// A camera that looks along x from (0, `y_m`, 0).
fn camera(y_m: f64) -> Camera {
    let [width, height] = SIZE;
    let centre = [width, height].map(|side| (f64::from(side) - 1.0) / 2.0);
    let linear = Cahv::as_printed(
        Point3::new(0.0, y_m, 0.0),
        Vector3::new(1.0, 0.0, 0.0),
        Vector3::new(centre[0], FOCAL_PX, 0.0),
        Vector3::new(centre[1], 0.0, FOCAL_PX),
    );
    Camera::new(CameraModel::Cahv(linear), width, height)
}

/// A textured wall at `range_m`, seen from `y_m`.
fn wall(range_m: f64, y_m: f64) -> GrayImage {
    let texture = |y: f64, z: f64| {
        let wave = |a: f64, b: f64| (a * y + b * z + (b * y).sin()).sin();
        0.5 + 0.12 * (wave(23.0, 7.0) + wave(-11.0, 31.0) + wave(57.0, -43.0))
    };
    GrayImage::from_fn(SIZE[0], SIZE[1], |column, row| {
        let [across, down] = [(column, SIZE[0]), (row, SIZE[1])]
            .map(|(at, side)| (f64::from(at) - (f64::from(side) - 1.0) / 2.0) / FOCAL_PX * range_m);
        image_value(texture(y_m + across, down))
    })
}

fn image_value(value: f64) -> image::Luma<f32> {
    image::Luma([value as f32])
}
