//! Rendered radiance, compared with stored arrays: a faster renderer must compute the same light.
//!
//! Each scene is a strip of twelve squares of 16 × 16 px, spread over one image from the horizon to the wheels. The stored
//! strips are `core/tests/radiance/*.npy` (height 16, width 192, radiance). `SIGHTLINE_GOLDEN=update` writes them again
//! after a deliberate change of the world: `SIGHTLINE_GOLDEN=update cargo test -p sightline-core --test all rendering`.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use sightline_vision::image::{GrayImage, npy};
use sightline_world::moment::Moment;
use sightline_world::scenario::Reflectance;
use sightline_world::{Eye, Region, Scenario, World, clean_radiance, index, library, true_camera_in_site};

/// Largest difference of radiance that counts as equal; sunlit soil has a radiance of about 0.2.
const DIFFERENCE_MAX: f32 = 1e-5;

/// Side of a square, px.
const SIDE: u32 = 16;

/// Left corners of the squares, as fractions of the image's width and height.
const CORNERS: [[f64; 2]; 12] = [
    [0.50, 0.50],
    [0.46, 0.46],
    [0.10, 0.05],
    [0.85, 0.15],
    [0.35, 0.28],
    [0.70, 0.33],
    [0.05, 0.42],
    [0.60, 0.55],
    [0.90, 0.66],
    [0.25, 0.74],
    [0.55, 0.86],
    [0.02, 0.95],
];

/// A scenario, and the stop and camera of the image; negative stops count from the end.
struct Scene {
    name: &'static str,
    scenario: Scenario,
    stop: i64,
    eye: Eye,
}

fn scene(name: &'static str, stop: i64, eye: Eye, change: impl Fn(&mut Scenario)) -> Scene {
    let from = name.split_once(' ').map_or(name, |(from, _)| from);
    let mut scenario = library::scenario(from).unwrap();
    scenario.camera.image_size = 512;
    scenario.camera.samples_per_axis = 4;
    change(&mut scenario);
    Scene { name, scenario, stop, eye }
}

fn scenes() -> Vec<Scene> {
    vec![
        scene("approach-10 far", 0, Eye::Left, |_| {}),
        scene("approach-10 near", -1, Eye::Right, |_| {}),
        scene("slope-steep", 8, Eye::Left, |s| s.rover.tracks = true),
        scene("self-shadow", -1, Eye::Left, |_| {}),
        scene("moving-sun", -1, Eye::Left, |s| s.sun.elevation_deg = 14.0),
        scene("k9-5 body", -1, Eye::Left, |_| {}),
        scene("occlusion", 6, Eye::Left, |_| {}),
        scene("approach-5 rough", 3, Eye::Left, |s| {
            s.terrain.rms_at_1m_m = 0.06;
            s.terrain.ripple_height_m = 0.04;
            s.rocks.area_fraction = 0.2;
            s.sun.reflectance = Reflectance::Hapke;
            s.sun.elevation_deg = 20.0;
            s.camera.samples_per_axis = 3;
        }),
    ]
}

/// The squares of a scene side by side.
fn strip(scene: &Scene) -> GrayImage {
    let Scene { scenario, .. } = scene;
    let world = World::new(scenario);
    let index = index(scenario, &world).unwrap();
    let number = usize::try_from(scene.stop).unwrap_or_else(|_| index.stops.len() - 1);
    let stop = &index.stops[number];
    let camera = true_camera_in_site(stop, scene.eye).unwrap();
    let world = world.at(&Moment::of(number, &index.stops).unwrap(), scenario);
    let never = AtomicBool::new(false);
    let mut strip = GrayImage::new(SIDE * CORNERS.len() as u32, SIDE);
    for (k, [x, y]) in (0..).zip(CORNERS) {
        let at = |part: f64, side: u32| ((part * f64::from(side)) as u32).min(side - SIDE);
        let (x, y) = (at(x, camera.width()), at(y, camera.height()));
        let region = Region { x, y, width: SIDE, height: SIDE };
        let square = clean_radiance(&world, scenario, &camera, region, &never).unwrap();
        for (column, row, value) in square.enumerate_pixels() {
            strip.put_pixel(k * SIDE + column, row, *value);
        }
    }
    strip
}

fn file(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/radiance");
    folder.join(format!("{}.npy", name.replace(' ', "-")))
}

#[test]
fn rendered_radiance_equals_the_stored_arrays() {
    let is_update = std::env::var("SIGHTLINE_GOLDEN").is_ok_and(|word| word == "update");
    let mut wrong = Vec::new();
    for scene in scenes() {
        let (now, path) = (strip(&scene), file(scene.name));
        if is_update {
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, npy::encode(&now).unwrap()).unwrap();
            continue;
        }
        let kept = npy::decode(&std::fs::read(&path).unwrap(), &path).unwrap();
        assert_eq!(now.dimensions(), kept.dimensions(), "{}", scene.name);
        let differences = now.as_raw().iter().zip(kept.as_raw()).map(|(a, b)| (a - b).abs());
        let differing = differences.clone().filter(|d| *d > DIFFERENCE_MAX).count();
        let largest = differences.fold(0.0, f32::max);
        println!("{}: {differing} pixels differ, by {largest:.2e} at most", scene.name);
        if differing > 0 {
            wrong.push(format!("{}: {differing} pixels differ, by {largest:.2e} at most", scene.name));
        }
        // A strip without contrast would prove nothing.
        let mean = kept.as_raw().iter().sum::<f32>() / kept.as_raw().len() as f32;
        assert!(kept.as_raw().iter().any(|v| (v - mean).abs() > 0.1 * mean), "{}", scene.name);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
