//! Small recordings made in the test, imported and opened again.

use std::cell::RefCell;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use super::*;
use crate::Traverse;
use sightline_geometry::camera::CameraModel;
use sightline_geometry::frames::{Pixel, Point3, Pose};
use sightline_geometry::stereo_geometry::StereoGeometry;
use sightline_vision::image::{GrayImage, io};
use sightline_world::traverse::CameraSource;

const FOCAL_PX: f64 = 40.0;
const BASELINE_M: f64 = 0.5;

/// A KITTI folder of four frames, 12 × 8 px, that drives 1 m forward and turns right by 0.1 rad a frame.
fn kitti() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let matrix = |shift: f64| format!("{FOCAL_PX} 0 5.5 {shift} 0 {FOCAL_PX} 3.5 0 0 0 1 0");
    let calib = format!("P0: {}\nP1: {}\n", matrix(0.0), matrix(-FOCAL_PX * BASELINE_M));
    std::fs::write(path("calib.txt"), calib).unwrap();
    let pose = |frame: u32| {
        let (sin, cos) = (0.1 * f64::from(frame)).sin_cos();
        // Camera axes: a turn to the right is one about y (down).
        format!("{cos} 0 {sin} 0 0 1 0 0 {} 0 {cos} {frame}\n", -sin)
    };
    std::fs::write(path("poses.txt"), (0..4).map(pose).collect::<String>()).unwrap();
    for side in ["image_0", "image_1"] {
        std::fs::create_dir(path(side)).unwrap();
        for frame in 0..4_u8 {
            let level = f32::from(frame + 1) / 10.0;
            let image = GrayImage::from_pixel(12, 8, image::Luma([level]));
            io::write_png_u8(path(&format!("{side}/{frame:06}.png")), &image).unwrap();
        }
    }
    folder
}

/// A PDS3 product of 5 × 4 px in `sample_type`, with the sample `100 · line + sample` and two prefix bytes.
fn pds3(folder: &Path, id: &str, eye: &str, azimuth_rad: f64, clock: &str) {
    let (sin, cos) = azimuth_rad.sin_cos();
    let vector = |x: f64, y: f64, z: f64| format!("({},{},\r\n   {z})", cos * x - sin * y, sin * x + cos * y);
    let c = if eye == "RIGHT" { vector(0.0, 0.2, -1.0) } else { vector(0.0, 0.0, -1.0) };
    let label = format!(
        "PDS_VERSION_ID = PDS3\r\nRECORD_BYTES = 512\r\n^IMAGE = 4\r\nPRODUCT_ID = \"{id}\"\r\n\
         INSTRUMENT_ID = NAVCAM_{eye}\r\nFRAME_ID = {eye}\r\nROVER_MOTION_COUNTER = (7,3,0,1,0)\r\n\
         SPACECRAFT_CLOCK_START_COUNT = \"1/{clock}\"\r\n\
         GROUP = GEOMETRIC_CAMERA_MODEL\r\n MODEL_TYPE = NONE\r\nEND_GROUP = GEOMETRIC_CAMERA_MODEL\r\n\
         GROUP = GEOMETRIC_CAMERA_MODEL_PARMS\r\n MODEL_TYPE = \"CAHV\"\r\n MODEL_COMPONENT_ID = (C,A,H,V)\r\n \
         MODEL_COMPONENT_1 = {c}\r\n MODEL_COMPONENT_2 = {}\r\n MODEL_COMPONENT_3 = {}\r\n \
         MODEL_COMPONENT_4 = {}\r\nEND_GROUP = GEOMETRIC_CAMERA_MODEL_PARMS\r\n\
         GROUP = ROVER_COORDINATE_SYSTEM\r\n ORIGIN_OFFSET_VECTOR = (1.5,-2.0,0.25)\r\n \
         ORIGIN_ROTATION_QUATERNION = (1.0,0.0,0.0,0.0)\r\n REFERENCE_COORD_SYSTEM_NAME = SITE_FRAME\r\n\
         END_GROUP = ROVER_COORDINATE_SYSTEM\r\n\
         OBJECT = IMAGE\r\n LINES = 4\r\n LINE_SAMPLES = 5\r\n SAMPLE_TYPE = MSB_INTEGER\r\n \
         SAMPLE_BITS = 16\r\n LINE_PREFIX_BYTES = 2\r\n SAMPLE_BIT_MASK = 0000111111111111\r\n\
         END_OBJECT = IMAGE\r\nEND\r\n",
        vector(1.0, 0.0, 0.0),
        vector(2.0, 4.0, 0.0),
        vector(1.5, 0.0, 4.0),
    );
    let mut bytes = label.into_bytes();
    assert!(bytes.len() <= 1536, "{}", bytes.len());
    bytes.resize(1536, b' ');
    for line in 0..4_i16 {
        bytes.extend([0xff, 0xff]);
        bytes.extend((0..5_i16).flat_map(|sample| (100 * line + sample).to_be_bytes()));
    }
    std::fs::write(folder.join(format!("{id}.IMG")), bytes).unwrap();
}

fn run(path: &Path, options: &ImportOptions, folder: &Path) -> Result<Imported> {
    import(path, options, folder, &mut |_, _| {}, &AtomicBool::new(false))
}

fn refusal(path: &Path, options: &ImportOptions) -> String {
    let folder = tempfile::tempdir().unwrap();
    let message = run(path, options, folder.path()).unwrap_err().to_string();
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "{message}");
    message
}

#[test]
fn a_kitti_sequence_becomes_a_traverse_in_rover_axes() {
    let (source, folder) = (kitti(), tempfile::tempdir().unwrap());
    let steps = RefCell::new(Vec::new());
    let mut progress = |done, all| steps.borrow_mut().push((done, all));
    let cancel = AtomicBool::new(false);
    let imported =
        import(source.path(), &ImportOptions::default(), folder.path(), &mut progress, &cancel).unwrap();
    assert_eq!((imported.images_written, steps.borrow().last()), (8, Some(&(8, 8))));
    let traverse = Traverse::open(folder.path()).unwrap();
    assert_eq!(traverse.stop_count(), 4);
    let truth = traverse.true_site_from_rover(3).unwrap();
    assert!((truth * Point3::origin() - Point3::new(3.0, 0.0, 0.0)).norm() < 1e-12);
    let (_, _, yaw) = truth.rotation.euler_angles();
    assert!((yaw - 0.3).abs() < 1e-12, "{yaw}");
    // A point 2 m ahead, 0.1 m to the right and 0.05 m down.
    let point = Point3::new(2.0, 0.1, 0.05);
    let left = traverse.left_camera(0).project(&point).unwrap();
    let right = traverse.right_camera(0).project(&point).unwrap();
    assert!(left.distance(Pixel::new(7.5, 4.5)) < 1e-12, "{left:?}");
    assert!((left.x - right.x - FOCAL_PX * BASELINE_M / 2.0).abs() < 1e-12);
    assert!((traverse.right_camera(0).model.centre() - Point3::new(0.0, BASELINE_M, 0.0)).norm() < 1e-12);
    assert!((traverse.index().stops[3].time_s - 0.3).abs() < 1e-12);
    let copied = std::fs::read(folder.path().join("image_1/000002.png")).unwrap();
    assert_eq!(copied, std::fs::read(source.path().join("image_1/000002.png")).unwrap());
    assert!((traverse.capture(2).unwrap().right.get_pixel(0, 0)[0] - 77.0 / 255.0).abs() < 1e-6);
}

#[test]
fn frames_of_a_sequence_can_be_chosen_and_start_a_site_of_their_own() {
    let (source, folder) = (kitti(), tempfile::tempdir().unwrap());
    let options = ImportOptions { first_frame: 1, every: 2, max_stops: 2, ..ImportOptions::default() };
    std::fs::write(source.path().join("times.txt"), "0\n0.5\n1.5\n3\n").unwrap();
    run(source.path(), &options, folder.path()).unwrap();
    let traverse = Traverse::open(folder.path()).unwrap();
    assert_eq!(traverse.stop_count(), 2);
    assert_eq!(traverse.index().stops[1].time_s, 2.5);
    assert_eq!(traverse.index().stops[1].left.image, "image_0/000003.png");
    let site_from_rover = traverse.true_site_from_rover(1).unwrap();
    // Frame 1 points 0.1 rad to the right of the driven direction, so the motion of 2 m is to its left.
    let expected = Point3::new(2.0 * 0.1_f64.cos(), -2.0 * 0.1_f64.sin(), 0.0);
    assert!((site_from_rover * Point3::origin() - expected).norm() < 1e-12);
}

#[test]
fn the_estimate_is_the_truth_with_the_error_that_was_asked_for() {
    let source = kitti();
    let estimates = |odometry_fraction: f64, attitude_deg: f64, seed: u64| {
        let folder = tempfile::tempdir().unwrap();
        let options = ImportOptions { odometry_fraction, attitude_deg, seed, ..ImportOptions::default() };
        run(source.path(), &options, folder.path()).unwrap();
        let traverse = Traverse::open(folder.path()).unwrap();
        let difference =
            |step| traverse.true_site_from_rover(step).unwrap().inverse() * traverse.site_from_rover(step);
        (0..4).map(difference).collect::<Vec<Pose>>()
    };
    let way = |pose: &Pose| pose.translation.vector.norm();
    for pose in estimates(0.0, 0.0, 1) {
        assert!(way(&pose) < 1e-12 && pose.rotation.angle() < 1e-12, "{pose:?}");
    }
    let first = estimates(0.02, 0.2, 1);
    assert_eq!(first, estimates(0.02, 0.2, 1));
    assert_ne!(first, estimates(0.02, 0.2, 2));
    assert!(way(&first[0]) < 1e-12);
    // Three steps of 1 m: 0.02 m in each of three directions and 0.2° about each of three axes, thrice.
    let (mut position, mut attitude) = (0.0, 0.0);
    for seed in 0..20 {
        position += way(&estimates(0.02, 0.0, seed)[3]).powi(2) / 20.0;
        attitude += estimates(0.0, 0.2, seed)[3].rotation.angle().to_degrees().powi(2) / 20.0;
    }
    let expected = (0.02 * 3.0, 0.2 * 3.0);
    // 180 squares of normal numbers have a relative spread of 11 %, so their root one of 5 %.
    assert!((position.sqrt() / expected.0 - 1.0).abs() < 0.15, "{}", position.sqrt());
    assert!((attitude.sqrt() / expected.1 - 1.0).abs() < 0.15, "{}", attitude.sqrt());
}

#[test]
fn a_damaged_kitti_sequence_names_the_file_and_line() {
    let options = ImportOptions::default();
    for (file, content, expected) in [
        ("calib.txt", "P0: 1 2 3\n", "calib.txt: needs a line \"P0: …\""),
        ("calib.txt", "P0: 0 0 0 0 0 0 0 0 0 0 0 0\n", "calib.txt: P0 has no inverse"),
        (
            "calib.txt",
            "P0: 40 0 5 0 0 40 3 0 0 0 1 0\nP1: 40 0 5 0 0 40 3 0 0 0 1 0\n",
            "calib.txt: P0 and P1 have the same centre",
        ),
        ("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0\n", "poses.txt: line 2: a pose must have 12"),
        (
            "poses.txt",
            "2 0 0 0 0 1 0 0 0 0 1 0\n",
            "poses.txt: line 1: the first three columns are no rotation",
        ),
        (
            "poses.txt",
            "1 0 0 0 0 1 0 0 0 0 1 0\n",
            "poses.txt: has 1 poses, but image_0/000003.png needs line 4",
        ),
        ("times.txt", "0\nsoon\n", "times.txt: must have one time"),
        ("image_0/000000.png", "no image", "image_0/000000.png: "),
    ] {
        let source = kitti();
        std::fs::write(source.path().join(file), content).unwrap();
        let message = refusal(source.path(), &options);
        assert!(message.contains(expected), "{message}");
    }
    let source = kitti();
    std::fs::remove_file(source.path().join("image_1/000002.png")).unwrap();
    assert!(refusal(source.path(), &options).contains("image_1/000002.png"));
}

#[test]
fn a_left_and_a_right_picture_of_one_moment_are_a_lateral_stop() {
    let (source, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    pds3(source.path(), "R0", "RIGHT", 0.0, "100.000");
    pds3(source.path(), "L0", "LEFT", 0.0, "101.500");
    pds3(source.path(), "L1", "LEFT", 0.2, "160.000");
    let imported = run(source.path(), &ImportOptions::default(), folder.path()).unwrap();
    assert_eq!(imported.index.stereo, StereoGeometry::Lateral);
    assert!(imported.notes.iter().any(|note| note == "left out: L1 (NAVCAM_LEFT)"), "{:?}", imported.notes);
    let traverse = Traverse::open(folder.path()).unwrap();
    assert_eq!(traverse.stop_count(), 1);
    let stop = &traverse.index().stops[0];
    assert_eq!((stop.left.image.as_str(), stop.right.image.as_str()), ("L0.png", "R0.png"));
    assert_eq!(stop.site_from_rover.position_m, [1.5, -2.0, 0.25]);
    assert_eq!(traverse.index().full_scale_dn, Some(4095.0));
    let pair = traverse.capture(0).unwrap();
    assert_eq!(pair.left.get_pixel(4, 3)[0], 304.0 / 4095.0);
    let CameraSource::Inline(camera) = &stop.right.camera else { panic!("{stop:?}") };
    let CameraModel::Cahv(model) = &camera.model else { panic!("{camera:?}") };
    assert_eq!(model.centre, Point3::new(0.0, 0.2, -1.0));
}

#[test]
fn two_views_of_one_camera_that_overlap_are_a_convergent_stop() {
    let (source, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    pds3(source.path(), "A", "LEFT", 0.0, "100");
    pds3(source.path(), "B", "LEFT", 3.1, "150");
    pds3(source.path(), "C", "LEFT", 0.3, "200");
    // A product of another camera family, and a file that is damaged, are left out with a note.
    std::fs::write(source.path().join("D.IMG"), "PDS_VERSION_ID = PDS3\r\nEND\r\n").unwrap();
    let imported = run(source.path(), &ImportOptions::default(), folder.path()).unwrap();
    assert_eq!(imported.index.stereo, StereoGeometry::Convergent);
    let stop = &imported.index.stops[0];
    assert_eq!((stop.left.image.as_str(), stop.right.image.as_str()), ("A.png", "C.png"));
    assert_eq!(imported.notes.len(), 2, "{:?}", imported.notes);
    assert!(
        imported.notes[0].contains("D.IMG: the label has no GEOMETRIC_CAMERA_MODEL"),
        "{:?}",
        imported.notes
    );

    let by_file =
        run(&source.path().join("C.IMG"), &ImportOptions::default(), &folder.path().join("by file"));
    assert_eq!(by_file.unwrap().index.stops, imported.index.stops);
    let files = vec!["B.IMG".into(), "A.IMG".into()];
    let by_hand = ImportOptions { files, name: Some("mine".into()), ..ImportOptions::default() };
    let by_hand = run(source.path(), &by_hand, &folder.path().join("by hand")).unwrap().index;
    assert_eq!((by_hand.stops[0].left.image.as_str(), by_hand.name.as_str()), ("B.png", "mine"));
}

#[test]
fn a_damaged_product_names_itself_and_what_is_wrong() {
    let by_hand = ImportOptions { files: vec!["A.IMG".into(), "C.IMG".into()], ..ImportOptions::default() };
    for (from, to, expected) in [
        ("LINES = 4", "LINES = 0", "LINES is 0, but it must be 1 to 16384"),
        ("LINES = 4", "LINES = 99999", "LINES is 99999"),
        ("LINES = 4", "LINES = 9", "but the file has"),
        ("^IMAGE = 4", "^IMAGE = 99", "but the file has"),
        ("^IMAGE = 4", "^IMAGE = -", "^IMAGE names -"),
        ("RECORD_BYTES = 512", "RECORD_BYTES = 0", "RECORD_BYTES is 0, but it must be a whole number"),
        ("RECORD_BYTES = 512", "RECORD_BYTES = 512.5", "RECORD_BYTES is 512.5, but it must be"),
        ("RECORD_BYTES = 512", "RECORD_BYTES = -512", "RECORD_BYTES is -512, but it must be"),
        ("RECORD_BYTES = 512\r\n", "", "RECORD_BYTES is missing"),
        (
            "RECORD_BYTES = 512",
            "RECORD_BYTES = 256\r\nFILE_RECORDS = 4",
            "4 FILE_RECORDS of 256 RECORD_BYTES are 1024 bytes, but the file has ",
        ),
        ("^IMAGE = 4", "^IMAGE = (\"../A.IMG\",4)", "^IMAGE names ../A.IMG, which is not in the same folder"),
        ("MODEL_TYPE = \"CAHV\"", "MODEL_TYPE = PSPH", "MODEL_TYPE PSPH is not one of"),
        ("(C,A,H,V)", "(C,A,H)", "MODEL_COMPONENT_ID lists no V"),
        ("SAMPLE_BITS = 16", "SAMPLE_BITS = 12", "SAMPLE_BITS = 12 is not understood"),
        ("(1.0,0.0,0.0,0.0)", "(0.1,0.0,0.0,0.0)", "ORIGIN_ROTATION_QUATERNION is not of unit length"),
        ("(7,3,0,1,0)", "(8,3,0,1,0)", "is of another site"),
        ("SITE_FRAME", "LOCAL_LEVEL", "is given in LOCAL_LEVEL"),
        ("END_OBJECT = IMAGE", "END_OBJECT = TABLE", "END_OBJECT = TABLE closes IMAGE"),
    ] {
        let source = tempfile::tempdir().unwrap();
        pds3(source.path(), "A", "LEFT", 0.0, "100");
        pds3(source.path(), "C", "LEFT", 0.3, "200");
        let file = source.path().join("A.IMG");
        let bytes = std::fs::read(&file).unwrap();
        let place = bytes.windows(from.len()).position(|window| window == from.as_bytes()).unwrap();
        let mut bad = bytes[..place].to_vec();
        bad.extend(to.as_bytes());
        bad.extend(&bytes[place + from.len()..]);
        std::fs::write(&file, bad).unwrap();
        let message = refusal(source.path(), &by_hand);
        assert!(message.contains(".IMG: ") && message.contains(expected), "{from} → {to}: {message}");
    }
    let source = tempfile::tempdir().unwrap();
    pds3(source.path(), "A", "LEFT", 0.0, "100");
    let alone = refusal(&source.path().join("A.IMG"), &ImportOptions::default());
    assert!(alone.contains("has no two pictures that make a stereo stop"), "{alone}");
    let odd = ImportOptions { files: vec!["A.IMG".into()], ..ImportOptions::default() };
    assert!(refusal(source.path(), &odd).contains("names 1 files"));
}

#[test]
fn what_is_of_no_known_format_is_told_which_are_known() {
    let folder = tempfile::tempdir().unwrap();
    let message = refusal(folder.path(), &ImportOptions::default());
    assert!(message.contains("KITTI odometry (") && message.contains("PDS3 ("), "{message}");
    let gone = refusal(&folder.path().join("gone"), &ImportOptions::default());
    assert!(gone.contains("does not exist"), "{gone}");
    let (source, native) = (kitti(), tempfile::tempdir().unwrap());
    run(source.path(), &ImportOptions::default(), native.path()).unwrap();
    assert!(refusal(native.path(), &ImportOptions::default()).contains("native traverse already"));
}

#[test]
fn nothing_is_overwritten_and_a_cancelled_import_leaves_nothing() {
    let (source, folder) = (kitti(), tempfile::tempdir().unwrap());
    let cancel = AtomicBool::new(false);
    let mut stop_at_three = |done, _| cancel.store(done == 3, Ordering::Relaxed);
    let options = ImportOptions::default();
    let error = import(source.path(), &options, folder.path(), &mut stop_at_three, &cancel).unwrap_err();
    assert!(matches!(error, Error::Cancelled));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);

    std::fs::create_dir(folder.path().join("image_0")).unwrap();
    std::fs::write(folder.path().join("image_0/000001.png"), "mine").unwrap();
    let message = run(source.path(), &options, folder.path()).unwrap_err().to_string();
    assert!(message.contains("000001.png: is already there"), "{message}");
    assert_eq!(std::fs::read(folder.path().join("image_0/000001.png")).unwrap(), b"mine");
    let replace = ImportOptions { existing: Existing::Replace, ..options.clone() };
    run(source.path(), &replace, folder.path()).unwrap();
    let message = run(source.path(), &options, folder.path()).unwrap_err().to_string();
    assert!(message.contains("traverse.toml: is already there"), "{message}");
    let message = run(source.path(), &replace, source.path()).unwrap_err().to_string();
    assert!(message.contains("is the recording's own folder"), "{message}");
}

#[test]
fn an_option_out_of_range_is_named() {
    let source = kitti();
    for (options, key) in [
        (ImportOptions { odometry_fraction: f64::NAN, ..ImportOptions::default() }, "odometry_fraction"),
        (ImportOptions { attitude_deg: -1.0, ..ImportOptions::default() }, "attitude_deg"),
        (ImportOptions { every: 0, ..ImportOptions::default() }, "every"),
    ] {
        assert!(refusal(source.path(), &options).starts_with(&format!("setting {key}: ")));
    }
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig::with_cases(200))]
    #[test]
    fn a_damaged_product_is_answered_and_never_panics(
        cut in 0..1700_usize,
        at in 0..1536_usize,
        bytes in proptest::collection::vec(proptest::prelude::any::<u8>(), 0..12),
    ) {
        let source = tempfile::tempdir().unwrap();
        pds3(source.path(), "A", "LEFT", 0.0, "100");
        let file = source.path().join("A.IMG");
        let mut content = std::fs::read(&file).unwrap();
        content.splice(at..at + bytes.len().min(1536 - at), bytes);
        content.truncate(if cut < 1590 { cut } else { usize::MAX });
        std::fs::write(&file, content).unwrap();
        if let Ok(product) = pds3::Product::read(&file) {
            let _ = (product.camera(), product.site_from_rover(), product.read_raster(), product.clock_s());
            let _ = (product.motion_counter(), product.id());
        }
    }
}
