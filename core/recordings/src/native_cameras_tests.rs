//! Tests of stops with several cameras: writing, refusals, and the images of each camera.

use std::sync::atomic::AtomicBool;

use super::*;
use sightline_geometry::camera::CameraName;
use sightline_world::traverse::{FURTHER_CAMERAS_LIMIT, StopCamera};

fn name(text: &str) -> CameraName {
    text.parse().unwrap()
}

/// The index with hazcams at its first stop, one of them with a known error, and a single camera at its second.
fn with_cameras() -> TraverseIndex {
    let mut index = index(3);
    let camera_of = |name: &str, right: bool| StopCamera {
        name: name.parse().unwrap(),
        mast_angles: (!right).then_some(sightline_geometry::camera::MastAngles {
            azimuth_rad: 1.0 / 3.0,
            elevation_rad: -0.1,
        }),
        left: View {
            image: format!("images/{name}_left.png"),
            camera: CameraSource::File { file: "further.cahvor".into() },
        },
        right: right.then(|| View {
            image: format!("images/{name}_right.png"),
            camera: CameraSource::Inline(camera(0.2)),
        }),
        true_left_camera: right.then(|| camera(0.5)),
        true_right_camera: None,
    };
    index.stops[0].cameras = vec![camera_of("front_hazcam", true), camera_of("mono", false)];
    index.stops[1].cameras = vec![camera_of("mono", false)];
    index
}

#[test]
fn further_cameras_survive_both_forms_and_have_their_own_images() {
    for format in [IndexFormat::Toml, IndexFormat::Json] {
        let folder = folder(format);
        let with_cameras = with_cameras();
        write(&with_cameras, folder.path(), format, Existing::Replace).unwrap();
        std::fs::write(folder.path().join("further.cahvor"), text::write_text(&camera(0.4))).unwrap();
        let traverse = Traverse::open(folder.path()).unwrap();
        assert_eq!(*traverse.index(), with_cameras, "{format:?}");
        assert_eq!(traverse.warnings(), ["4 of 10 images are missing; their stops cannot be tracked"]);
        let image = GrayImage::from_pixel(SIZE[0], SIZE[1], image::Luma([0.5]));
        for eye in ["left", "right"] {
            let path = folder.path().join(format!("images/front_hazcam_{eye}.png"));
            io::write_png_u16(path, &image, Some(4095.0)).unwrap();
        }
        let never = AtomicBool::new(false);
        let capture = |step: usize, text: &str| traverse.capture_pair(step, Some(name(text)), &never);
        let pair = capture(0, "front_hazcam").unwrap();
        assert!((pair.right.get_pixel(3, 2)[0] - 0.5).abs() < 1e-3);
        assert_ne!(pair.left, traverse.capture(0).unwrap().left, "the main pair is another one");
        let [hazcam, mono] = traverse.further_cameras(0).collect::<Vec<_>>()[..] else { panic!("two") };
        assert_eq!((hazcam.left, hazcam.right), (&camera(0.4), Some(&camera(0.2))));
        assert!(hazcam.mast_angles.is_none() && mono.right.is_none() && mono.mast_angles.is_some());
        assert_eq!(traverse.stops().cameras[0].further[0].true_left(), &camera(0.5));
        let sentence = |step: usize, text: &str| capture(step, text).unwrap_err().to_string();
        assert_eq!(sentence(1, "front_hazcam"), "stop 1 has no pair `front_hazcam`");
        assert_eq!(sentence(0, "mono"), "stop 0 has only a single image of `mono`");
        let missing = traverse.capture_one(1, Some(name("mono")), true).unwrap_err().to_string();
        assert!(
            missing.starts_with("images/mono_left.png: the left image of mono at step 1 cannot be read"),
            "{missing}"
        );
    }
    // Nothing new is written without further cameras.
    let plain = std::fs::read_to_string(folder(IndexFormat::Toml).path().join("traverse.toml")).unwrap();
    assert!(!plain.contains("cameras") && !plain.contains("true_left_camera"));
}

#[test]
fn bad_further_cameras_are_refused_with_their_field() {
    let folder = folder(IndexFormat::Toml);
    std::fs::write(folder.path().join("further.cahvor"), text::write_text(&camera(0.4))).unwrap();
    write(&with_cameras(), folder.path(), IndexFormat::Toml, Existing::Replace).unwrap();
    let file = folder.path().join("traverse.toml");
    let good = std::fs::read_to_string(&file).unwrap();
    for (from, to, expected) in [
        (
            "\"front_hazcam\"",
            "\"Front hazcam\"",
            "stops[0].cameras[0].name: \"Front hazcam\" is no name of a camera",
        ),
        ("\"front_hazcam\"", "\"\"", "stops[0].cameras[0].name: \"\" is no name"),
        ("\"front_hazcam\"", "\"mono\"", "stops[0].cameras[1].name: mono is the name of another camera"),
        ("images/mono_left.png", "../mono.png", "stops[0].cameras[1].left.image: \"../mono.png\" must be"),
        ("images/front_hazcam_right.png", "/etc/passwd", "stops[0].cameras[0].right.image"),
        ("further.cahvor", "../x.cahvor", "stops[0].cameras[0].left.camera"),
        ("azimuth_rad = 0.3", "azimuth_rad = nan\n# 0.3", "stops[0].cameras[1].mast_angles: must be finite"),
        ("name = \"mono\"", "name = \"mono\"\ncolour = 1", "stops[0].cameras[1].colour: unknown field"),
        ("true_left_camera", "true_camera", "stops[0].cameras[0].true_camera: unknown field"),
    ] {
        let bad = good.replacen(from, to, 1);
        assert_ne!(bad, good, "{from}");
        std::fs::write(&file, &bad).unwrap();
        let message = refusal(folder.path());
        assert!(message.contains(expected) && !message.contains('\n'), "{from} → {to}: {message}");
    }
    let mut many = with_cameras();
    let one = many.stops[1].cameras[0].clone();
    let numbered = |k: usize| StopCamera { name: name(&format!("mono_{k}")), ..one.clone() };
    many.stops[1].cameras = (0..=FURTHER_CAMERAS_LIMIT).map(numbered).collect();
    let message = write(&many, folder.path(), IndexFormat::Toml, Existing::Replace).unwrap_err().to_string();
    assert!(message.contains("stops[1].cameras: there are 17, but a stop may have at most 16"), "{message}");
}
