//! Folders that can be opened, folders that cannot, and their messages.

use super::*;
use sightline_geometry::camera::{Cahv, Cahvor, CameraModel, text};
use sightline_geometry::frames::{Point3, PoseRecord, Vector3};
use sightline_geometry::odometry_error::OdometryError;
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_vision::image::{GrayImage, io};
use sightline_world::traverse::{CameraSource, FORMAT_VERSION, StopTruth, View};

#[path = "native_cameras_tests.rs"]
mod cameras;

const SIZE: [u32; 2] = [8, 6];

fn camera(seed: f64) -> Camera {
    let linear = Cahv::as_printed(
        Point3::new(0.1 + seed / 3.0, -0.061_163_5, 1.0 / 7.0),
        Vector3::new(1.0, 0.0, 0.0),
        Vector3::new(3.5, 1.0 / 3.0 + 9.0, 0.0),
        Vector3::new(2.5, 0.0, 9.1),
    );
    let optical_axis = Vector3::new(1.0, 1e-9, -0.0);
    let model = Cahvor::normalised(linear, optical_axis, [1e-3, -2e-3, 1.0 / 47.0]);
    Camera::new(CameraModel::Cahvor(model), SIZE[0], SIZE[1])
}

fn stop(step: usize) -> Stop {
    let view = |side: &str, seed: f64| View {
        image: format!("images/{step:04}_{side}.png"),
        camera: CameraSource::Inline(camera(seed)),
    };
    let pose =
        Pose::new(Vector3::new(step as f64 / 3.0, 0.1, -0.2), Vector3::new(0.1, -0.2, 0.3 * step as f64));
    Stop {
        time_s: step as f64 * 0.1,
        site_from_rover: PoseRecord::from(&pose),
        mast_angles: None,
        left: view("left", 0.0),
        right: view("right", 1.0),
        light: None,
        metered_px: None,
        odometry: None,
        odometry_alone: false,
        mast_target: None,
        truth: (step == 1).then(|| StopTruth {
            site_from_rover: PoseRecord::from(&pose.inverse()),
            left_camera: Some(camera(0.3)),
            right_camera: None,
            wheel_places_m: None,
        }),
        cameras: Vec::new(),
    }
}

fn index(stops: usize) -> TraverseIndex {
    TraverseIndex {
        format: FORMAT_VERSION,
        name: "made in a test".into(),
        description: String::new(),
        full_scale_dn: Some(4095.0),
        stereo: StereoGeometry::Convergent,
        odometry_error: OdometryError { along_fraction: 1.0 / 3.0, ..OdometryError::default() },
        pointing_error_deg: 0.05,
        mast: None,
        scenario: None,
        stops: (0..stops).map(stop).collect(),
    }
}

/// A folder with an index of three stops and all images.
fn folder(format: IndexFormat) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write(&index(3), folder.path(), format, Existing::Refuse).unwrap();
    std::fs::create_dir(folder.path().join("images")).unwrap();
    for view in index(3).stops.iter().flat_map(|stop| [&stop.left, &stop.right]) {
        let image = GrayImage::from_fn(SIZE[0], SIZE[1], |x, y| image::Luma([(x + 8 * y) as f32 / 4095.0]));
        io::write_png_u16(folder.path().join(&view.image), &image, Some(4095.0)).unwrap();
    }
    folder
}

fn refusal(folder: &Path) -> String {
    match Traverse::open(folder) {
        Ok(_) => panic!("opened"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn an_index_is_read_back_bit_for_bit_in_both_forms() {
    for format in [IndexFormat::Toml, IndexFormat::Json] {
        let folder = folder(format);
        for path in [folder.path().to_owned(), folder.path().join(format.file_name())] {
            let traverse = Traverse::open(&path).unwrap();
            assert_eq!(*traverse.index(), index(3), "{format:?}");
            assert!(traverse.warnings().is_empty());
            assert_eq!(traverse.folder(), folder.path());
        }
    }
}

#[test]
fn the_truth_of_a_stop_is_told_apart_from_its_estimate() {
    let folder = folder(IndexFormat::Toml);
    let traverse = Traverse::open(folder.path()).unwrap();
    assert_eq!(
        (traverse.true_site_from_rover(0), traverse.true_left_camera(0)),
        (None, traverse.left_camera(0))
    );
    let both = traverse.true_site_from_rover(1).unwrap() * traverse.site_from_rover(1);
    assert!((both.to_homogeneous() - nalgebra::Matrix4::identity()).amax() < 1e-14);
    assert_eq!(traverse.true_left_camera(1), &camera(0.3));
    assert_eq!(traverse.stops().cameras[1].true_right(), traverse.right_camera(1));
    assert_eq!(traverse.left_camera(1), &camera(0.0));
}

#[test]
fn a_camera_file_is_the_same_as_the_camera_in_the_index() {
    let folder = folder(IndexFormat::Toml);
    let mut with_file = index(3);
    with_file.stops[2].left.camera = CameraSource::File { file: "left.cahvor".into() };
    write(&with_file, folder.path(), IndexFormat::Toml, Existing::Replace).unwrap();
    assert!(
        refusal(folder.path()).contains("traverse.toml: stops[2].left.camera: left.cahvor cannot be read")
    );
    std::fs::write(folder.path().join("left.cahvor"), text::write_text(&camera(0.0))).unwrap();
    let traverse = Traverse::open(folder.path()).unwrap();
    assert_eq!(traverse.left_camera(2), &camera(0.0));
    std::fs::write(folder.path().join("left.cahvor"), "Model = CAHVOR\n").unwrap();
    let message = refusal(folder.path());
    assert!(message.contains("stops[2].left.camera: left.cahvor: "), "{message}");
}

#[test]
fn a_pair_is_read_in_fractions_of_full_scale_and_kept() {
    let folder = folder(IndexFormat::Toml);
    let traverse = Traverse::open(folder.path()).unwrap();
    let pair = traverse.capture(2).unwrap();
    assert_eq!(pair.left.get_pixel(3, 2)[0], (3.0 + 16.0) / 4095.0);
    std::fs::remove_file(folder.path().join("images/0002_left.png")).unwrap();
    assert!(Arc::ptr_eq(&pair.left, &traverse.capture(2).unwrap().left));
    assert!(traverse.capture(3).unwrap_err().to_string().contains("no step 3"));
}

#[test]
fn a_missing_image_names_itself_and_other_stops_still_open() {
    let folder = folder(IndexFormat::Toml);
    std::fs::remove_file(folder.path().join("images/0001_right.png")).unwrap();
    let traverse = Traverse::open(folder.path()).unwrap();
    assert!(traverse.warnings()[0].contains("1 of 6 images are missing"));
    let message = traverse.capture(1).unwrap_err().to_string();
    assert!(message.contains("images/0001_right.png: the right image of step 1 cannot be read"), "{message}");
    assert!(traverse.capture(0).is_ok() && traverse.capture(2).is_ok());
}

#[test]
fn a_damaged_or_wrong_sized_image_names_itself_and_its_step() {
    let folder = folder(IndexFormat::Toml);
    let path = |name: &str| folder.path().join(name);
    io::write_png_u8(path("images/0000_left.png"), &GrayImage::new(9, 6)).unwrap();
    let whole = std::fs::read(path("images/0001_left.png")).unwrap();
    std::fs::write(path("images/0001_left.png"), &whole[..whole.len() - 30]).unwrap();
    std::fs::write(path("images/0002_left.png"), "no image").unwrap();
    let traverse = Traverse::open(folder.path()).unwrap();
    let message = |step| traverse.capture(step).unwrap_err().to_string();
    assert!(
        message(0).contains("0000_left.png: the left image of step 0 has 9 × 6 pixels"),
        "{}",
        message(0)
    );
    assert!(message(1).contains("0001_left.png: the left image of step 1: "), "{}", message(1));
    assert!(message(2).contains("0002_left.png: the left image of step 2: "), "{}", message(2));
}

#[test]
fn image_of_another_size_is_refused_by_its_header() {
    let folder = folder(IndexFormat::Toml);
    let path = folder.path().join("images/0000_left.png");
    let mut file = std::fs::read(&path).unwrap();
    // No such image could be decoded: the checksum of the header is wrong now, and nearly all pixels are missing.
    file[16..24].copy_from_slice(&[0, 0, 0x1f, 0x40, 0, 0, 0x1e, 0xdc]);
    std::fs::write(&path, file).unwrap();
    let traverse = Traverse::open(folder.path()).unwrap();
    for message in [traverse.capture(0).unwrap_err(), traverse.capture_one(0, None, true).unwrap_err()] {
        let message = message.to_string();
        assert!(
            message.contains("0000_left.png: the left image of step 0 has 8000 × 7900 pixels"),
            "{message}"
        );
    }
    assert!(traverse.capture_one(0, None, false).is_ok());
}

#[test]
fn one_image_brings_the_pair_unless_the_other_is_damaged() {
    let folder = folder(IndexFormat::Toml);
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("images/0001_right.png"), "no image").unwrap();
    let traverse = Traverse::open(folder.path()).unwrap();
    let right = traverse.capture_one(0, None, false).unwrap();
    let left = traverse.capture_one(1, None, true).unwrap();
    for name in ["images/0000_left.png", "images/0000_right.png"] {
        std::fs::remove_file(path(name)).unwrap();
    }
    let pair = traverse.capture(0).unwrap();
    assert!(Arc::ptr_eq(&pair.right, &right) && pair.left.dimensions() == left.dimensions());
    assert!(
        traverse
            .capture_one(1, None, false)
            .unwrap_err()
            .to_string()
            .contains("0001_right.png: the right image")
    );
}

#[cfg(unix)]
#[test]
fn named_pipe_in_place_of_an_image_or_a_camera_is_refused() {
    let folder = folder(IndexFormat::Toml);
    let pipe = |name: &str| {
        let made = std::process::Command::new("mkfifo").arg(folder.path().join(name)).status();
        assert!(made.unwrap().success());
    };
    std::fs::remove_file(folder.path().join("images/0001_left.png")).unwrap();
    pipe("images/0001_left.png");
    pipe("left.cahvor");
    let mut with_file = index(3);
    with_file.stops[2].left.camera = CameraSource::File { file: "left.cahvor".into() };
    // No program writes into the pipes: opening one for reading would block for ever.
    let path = folder.path();
    let image = Traverse::open(path).unwrap().capture(1).unwrap_err().to_string();
    write(&with_file, path, IndexFormat::Toml, Existing::Replace).unwrap();
    let camera = refusal(path);
    assert!(image.contains("the left image of step 1 cannot be read (not a regular file)"), "{image}");
    assert!(camera.contains("left.cahvor cannot be read (not a regular file)"), "{camera}");
}

#[test]
fn an_index_that_is_malformed_names_the_file_the_line_and_the_field() {
    let folder = folder(IndexFormat::Toml);
    let file = folder.path().join("traverse.toml");
    let good = std::fs::read_to_string(&file).unwrap();
    for (from, to, expected) in [
        ("format = 1", "format = 7", "format: version 7 is unknown"),
        ("format = 1", "format = 1\nspeed = 3", "line 2: speed: unknown field `speed`"),
        ("format = 1", "format = ", "line 1: "),
        ("stereo = \"convergent\"", "stereo = \"sideways\"", "stereo: unknown variant `sideways`"),
        ("time_s = 0.1", "time_s = 0.1\ncolour = 1", "stops[1]"),
        ("time_s = 0.1", "time_s = nan", "stops[1].time_s: is NaN"),
        ("time_s = 0.1", "time_s = \"soon\"", "stops[1].time_s"),
        ("model = \"CAHVOR\"", "model = \"PINHOLE\"", "stops[0].left.camera: the model is `PINHOLE`"),
        ("model = \"CAHVOR\"", "model = \"CAHV\"", "stops[0].left.camera: unknown field `O`"),
        ("A = [1.0, 0.0, 0.0]", "A = [1.0, 0.0]", "stops[0].left.camera: A: must be three finite numbers"),
        ("A = [1.0, 0.0, 0.0]", "A = [3.0, 0.0, 0.0]", "stops[0].left.camera: "),
        ("A = [1.0, 0.0, 0.0]", "", "stops[0].left.camera: missing field `A`"),
        (
            "A = [1.0, 0.0, 0.0]",
            "A = [1.0, nan, 0.0]",
            "stops[0].left.camera: A: must be three finite numbers",
        ),
        ("size = [8, 6]", "size = [8, 6, 3]", "stops[0].left.camera: "),
        ("size = [8, 6]", "size = [8, 60000]", "stops[0].left.camera: size is 8 × 60000"),
        (
            "position_m = [0.0, 0.1, -0.2]",
            "position_m = [0.0, nan, -0.2]",
            "stops[0].site_from_rover: must have",
        ),
        (
            "position_m = [0.0, 0.1, -0.2]",
            "position_m = [0.0, 1e308, -0.2]",
            "stops[0].site_from_rover: must have a position_m",
        ),
        (
            "position_m = [0.0, 0.1, -0.2]",
            "position_m = [0.0, 0.1, -0.2, 7.0]",
            "stops[0].site_from_rover.position_m: has 4 values, but takes 3",
        ),
        ("images/0002_left.png", "../0002_left.png", "stops[2].left.image: \"../0002_left.png\" must be"),
        ("images/0002_left.png", "/etc/passwd", "stops[2].left.image"),
        ("images/0002_left.png", "", "stops[2].left.image: the file name is empty"),
        ("full_scale_dn = 4095.0", "full_scale_dn = 0.0", "full_scale_dn: is 0"),
        ("attitude_deg = 0.2", "attitude_deg = -1.0", "odometry_error.attitude_deg: is -1"),
    ] {
        let bad = good.replacen(from, to, 1);
        assert_ne!(bad, good, "{from}");
        std::fs::write(&file, &bad).unwrap();
        let message = refusal(folder.path());
        assert!(
            message.contains("traverse.toml: ") && message.contains(expected),
            "{from} → {to}: {message}"
        );
        assert!(!message.contains('\n'), "{message}");
    }
}

#[test]
fn a_malformed_json_index_names_its_line_and_field_too() {
    let folder = folder(IndexFormat::Json);
    let file = folder.path().join("traverse.json");
    let good = std::fs::read_to_string(&file).unwrap();
    for (from, to, expected) in [
        ("\"time_s\": 0.1", "\"time_s\": 0.1, \"colour\": 1", "stops[1].colour: unknown field `colour`"),
        ("\"name\"", "\"name\" \"x\"", "line 3: "),
        ("\"model\": \"CAHVOR\"", "\"model\": \"PINHOLE\"", "stops[0].left.camera: the model is `PINHOLE`"),
    ] {
        std::fs::write(&file, good.replacen(from, to, 1)).unwrap();
        let message = refusal(folder.path());
        assert!(message.contains("traverse.json: line ") && message.contains(expected), "{message}");
    }
    std::fs::write(&file, format!("{good} more")).unwrap();
    assert!(refusal(folder.path()).contains("text after the end"));
}

#[test]
fn what_is_no_traverse_is_told_so() {
    let empty = tempfile::tempdir().unwrap();
    assert!(refusal(empty.path()).contains("neither traverse.toml nor traverse.json"));
    assert!(refusal(&empty.path().join("none.toml")).contains("cannot read"));
    assert!(refusal(&empty.path().join("none.txt")).contains("neither a folder nor an index"));
    let both = folder(IndexFormat::Toml);
    std::fs::write(both.path().join("traverse.json"), "{}").unwrap();
    assert!(refusal(both.path()).contains("name one of them"));
    std::fs::write(both.path().join("traverse.json"), [0xff, 0xfe]).unwrap();
    assert!(refusal(&both.path().join("traverse.json")).contains("cannot read"));
    let none = index(0);
    let message = write(&none, both.path(), IndexFormat::Toml, Existing::Replace).unwrap_err().to_string();
    assert!(message.contains("stops: there is none"), "{message}");
}

#[test]
fn an_index_is_not_overwritten_unasked() {
    let folder = folder(IndexFormat::Toml);
    for format in [IndexFormat::Toml, IndexFormat::Json] {
        let message = write(&index(1), folder.path(), format, Existing::Refuse).unwrap_err().to_string();
        assert!(message.contains("traverse.toml: is already there"), "{message}");
    }
    write(&index(1), folder.path(), IndexFormat::Toml, Existing::Replace).unwrap();
    assert_eq!(Traverse::open(folder.path()).unwrap().stop_count(), 1);
}

#[test]
fn a_traverse_can_be_shared_between_threads() {
    fn shared<T: Send + Sync>() {}
    shared::<Traverse>();
}
