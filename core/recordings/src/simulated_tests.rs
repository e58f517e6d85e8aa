//! A small world whose images are rendered on first use.

use std::sync::Arc;

use super::*;
use crate::render_cache;
use crate::simulated::{camera_in_site, stop_key};
use sightline_geometry::frames::{Pixel, Vector3};
use sightline_vision::image::GrayImage;
use sightline_world::moment::Moment;
use sightline_world::scenario::{ExposureMode, PlacedRock, Quantisation, RockShape};
use sightline_world::target_truth::TruthSource;
use sightline_world::traverse::TraverseIndex;
use sightline_world::{Eye, NoiseSeed, Region, clean_radiance, develop};

/// Two stops, 128 × 128 px, one sample a pixel.
fn scenario() -> Scenario {
    let mut scenario = Scenario::demo();
    scenario.camera.image_size = 128;
    scenario.camera.samples_per_axis = 1;
    scenario.drive.start_distance_m = 3.0;
    scenario.drive.end_distance_m = 2.5;
    scenario.drive.step_fraction = 0.2;
    scenario.drive.pointing_error_deg = 0.05;
    scenario.rocks.area_fraction = 0.02;
    scenario.rocks.farthest_m = 6.0;
    scenario
}

fn files(folder: &Path) -> usize {
    std::fs::read_dir(folder.join("images")).map_or(0, Iterator::count)
}

#[test]
fn a_simulated_traverse_renders_what_is_asked_for_and_only_that() {
    let folder = tempfile::tempdir().unwrap();
    let traverse = create_simulated(&scenario(), folder.path()).unwrap();
    assert_eq!(traverse.stop_count(), 2);
    assert!(traverse.warnings().is_empty());
    assert!(!traverse.is_ready(0) && !traverse.is_ready(1));
    let pair = traverse.capture(1).unwrap();
    assert!(!traverse.is_ready(0) && traverse.is_ready(1));
    assert_eq!(files(folder.path()), 2);
    assert!(traverse.world().is_some());

    // The same bits as the simulator renders from the true camera.
    let stop = &traverse.index().stops[1];
    let camera = sightline_world::true_camera_in_site(stop, Eye::Right).unwrap();
    let seed = NoiseSeed { step: 1, eye: Eye::Right };
    let expected: GrayImage = sightline_world::render(traverse.world().unwrap(), &scenario(), &camera, seed);
    assert_eq!(*pair.right, expected);
    assert_ne!(traverse.true_left_camera(1), traverse.left_camera(1));
}

#[test]
fn a_block_in_the_way_hides_a_point_at_its_own_stops_only() {
    let folder = tempfile::tempdir().unwrap();
    let mut blocked = scenario();
    blocked.events.occluders = vec![sightline_world::scenario::Occluder {
        from_stop: 1,
        to_stop: 1,
        width_m: 1.0,
        height_m: 1.0,
        at: 0.5,
        aside_m: 0.0,
    }];
    let traverse = create_simulated(&blocked, folder.path()).unwrap();
    let point = traverse.surface_point_in_site(0, None, Pixel::new(63.5, 63.5)).unwrap();
    assert!(traverse.is_visible(0, None, &point));
    assert!(!traverse.is_visible(1, None, &point));
}

#[test]
fn the_shadow_on_a_window_is_that_of_its_points_and_is_warned_of() {
    let folder = tempfile::tempdir().unwrap();
    let traverse = create_simulated(&scenario(), folder.path()).unwrap();
    let (world, stop) = (traverse.world().unwrap(), &traverse.index().stops[0]);
    let camera = sightline_world::true_camera_in_site(stop, Eye::Left).unwrap();
    let is_dark = |x: u32, y: u32| {
        let point = sightline_world::surface_point(world, &camera, Pixel::new(f64::from(x), f64::from(y)));
        point.is_some_and(|point| world.in_shadow(&point))
    };
    let dark: Vec<(u32, u32)> =
        (30..98).flat_map(|y| (30..98).map(move |x| (x, y))).filter(|(x, y)| is_dark(*x, *y)).collect();
    // Deep in a shadow, and ten pixels away from any.
    let count =
        |x: u32, y: u32| dark.iter().filter(|d| d.0.abs_diff(x) <= 10 && d.1.abs_diff(y) <= 10).count();
    let places = || (40..88).flat_map(|y| (40..88).map(move |x| (x, y)));
    let darkest = places().max_by_key(|(x, y)| count(*x, *y)).unwrap();
    let lit = places().min_by_key(|(x, y)| count(*x, *y)).unwrap();
    let share = |(x, y): (u32, u32)| {
        traverse.shadow_share(0, None, Pixel::new(f64::from(x), f64::from(y)), 21).unwrap()
    };
    for place in [darkest, lit] {
        let truth = count(place.0, place.1) as f64 / 441.0;
        assert!((share(place) - truth).abs() < 0.1, "{place:?}: {} of {truth}", share(place));
    }
    assert!(share(darkest) > share(lit) + 0.1, "{darkest:?} {lit:?}");
}

#[test]
fn the_surface_under_a_pixel_is_seen_there_again_from_the_next_stop() {
    let folder = tempfile::tempdir().unwrap();
    let traverse = create_simulated(&scenario(), folder.path()).unwrap();
    let point = traverse.surface_point_in_site(0, None, Pixel::new(63.5, 63.5)).unwrap();
    for step in 0..2 {
        let rover_from_site = traverse.true_site_from_rover(step).unwrap().inverse();
        let pixel = traverse.true_left_camera(step).project(&(rover_from_site * point)).unwrap();
        assert!(traverse.is_visible(step, None, &point));
        let again = traverse.surface_point_in_site(step, None, pixel).unwrap();
        assert!((again - point).norm() < 1e-6, "step {step}: {again} {point}");
    }
    let below_ground = point + Vector3::z();
    assert!(!traverse.is_visible(0, None, &below_ground));
}

#[test]
fn what_was_rendered_is_read_again_and_what_is_lost_is_rendered_alike() {
    let folder = tempfile::tempdir().unwrap();
    let first = create_simulated(&scenario(), folder.path()).unwrap().capture(0).unwrap();
    let again = create_simulated(&scenario(), folder.path()).unwrap();
    assert!(again.is_ready(0));
    assert_eq!(again.capture(0).unwrap().left, first.left);
    std::fs::remove_file(folder.path().join(&again.index().stops[0].left.image)).unwrap();
    let reopened = Traverse::open(folder.path()).unwrap();
    assert!(!reopened.is_ready(0));
    assert_eq!(reopened.capture(0).unwrap().left, first.left);
}

#[test]
fn eight_bits_are_kept_as_eight_bits() {
    let folder = tempfile::tempdir().unwrap();
    let mut eight = scenario();
    eight.camera.bit_depth = 8;
    let traverse = create_simulated(&eight, folder.path()).unwrap();
    let pair = traverse.capture(0).unwrap();
    assert!(pair.left.pixels().all(|p| ((p[0] * 255.0).round() - p[0] * 255.0).abs() < 1e-4));
}

#[test]
fn a_cancelled_rendering_leaves_no_image() {
    let folder = tempfile::tempdir().unwrap();
    let traverse = create_simulated(&scenario(), folder.path()).unwrap();
    let error = traverse.render_step(0, &AtomicBool::new(true)).unwrap_err();
    assert!(matches!(error, Error::Cancelled));
    assert_eq!(files(folder.path()), 0);
    traverse.render_step(0, &AtomicBool::new(false)).unwrap();
    assert!(traverse.is_ready(0));
}

#[test]
fn many_who_ask_for_the_same_stop_get_the_same_pair() {
    use rayon::prelude::*;
    let folder = tempfile::tempdir().unwrap();
    let traverse = create_simulated(&scenario(), folder.path()).unwrap();
    let pairs: Vec<_> = (0..16).into_par_iter().map(|k| (k % 2, traverse.capture(k % 2).unwrap())).collect();
    for (step, pair) in pairs {
        assert_eq!(Arc::as_ref(&pair.left), Arc::as_ref(&traverse.capture(step).unwrap().left));
    }
    assert_eq!(files(folder.path()), 4);
}

#[test]
fn cancelled_traverse_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    // Without the flag the rays of the exposure and the wheels would meet a thousand rocks each, for many seconds.
    let mut crowded = scenario();
    let (diameter_m, height_m, shape) = (0.5, 0.4, RockShape::Block);
    crowded.rocks.placed =
        vec![PlacedRock { x_m: 0.0, y_m: 0.0, diameter_m, height_m, yaw_deg: 0.0, shape }; 1000];
    let cancel = AtomicBool::new(true);
    let made = create_simulated_until(&crowded, folder.path(), (&cancel).into());
    assert!(matches!(made, Err(Error::Cancelled)));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn a_folder_with_something_else_in_it_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let traverse = create_simulated(&scenario(), folder.path()).unwrap();
    let mut other = scenario();
    other.seed += 1;
    let refusal = |scenario: &Scenario, folder: &Path| match create_simulated(scenario, folder) {
        Ok(_) => panic!("made"),
        Err(error) => error.to_string(),
    };
    assert!(refusal(&other, folder.path()).contains("holds another traverse already"));
    other.sun.elevation_deg = -3.0;
    assert!(refusal(&other, folder.path()).contains("sun.elevation_deg"));

    traverse.capture(0).unwrap();
    std::fs::remove_file(folder.path().join("traverse.toml")).unwrap();
    let message = refusal(&scenario(), folder.path());
    assert!(message.contains(".png: is there without a traverse"), "{message}");
}

#[test]
fn an_index_that_cannot_be_rendered_names_the_field() {
    let folder = tempfile::tempdir().unwrap();
    let good = create_simulated(&scenario(), folder.path()).unwrap().index().clone();
    let refusal = |index: &TraverseIndex| {
        write(index, folder.path(), IndexFormat::Toml, Existing::Replace).unwrap();
        Traverse::open(folder.path()).map(|_| ()).unwrap_err().to_string()
    };
    let mut index = good.clone();
    index.stops[1].truth = None;
    assert!(refusal(&index).contains("traverse.toml: stops[1].truth: is missing"));
    let mut index = good.clone();
    index.stops[1].left.image = index.stops[0].right.image.clone();
    assert!(
        refusal(&index).contains("stops[1].left.image: images/right_0000.png is the image of another view")
    );
    let mut index = good.clone();
    index.stops[0].left.image = "traverse.toml".into();
    assert!(refusal(&index).contains("stops[0].left.image: must end in .png"));
    let mut index = good.clone();
    index.scenario = Some("../scenario.toml".into());
    assert!(refusal(&index).contains("traverse.toml: scenario: "));
    std::fs::write(folder.path().join("scenario.toml"), "[sun]\nelevation_deg = -3.0\n").unwrap();
    let message = refusal(&good);
    assert!(message.contains("scenario.toml: setting sun.elevation_deg"), "{message}");
}

/// A traverse of a scenario in a new folder below `folder`, with its radiance in the shared folder `renders`.
fn sharing(scenario: &Scenario, folder: &Path, name: &str) -> Traverse {
    let shared = RenderCache::new(folder.join("renders"), 1 << 24);
    create_simulated(scenario, &folder.join(name)).unwrap().with_render_cache(shared)
}

/// The same traverse with nothing stored.
fn alone(scenario: &Scenario, folder: &Path) -> Traverse {
    create_simulated(scenario, folder).unwrap().with_render_cache(RenderCache::new(folder, 0))
}

#[test]
fn another_noise_or_exposure_renders_nothing_and_gives_the_bits_of_rendering() {
    let folder = tempfile::tempdir().unwrap();
    let first = sharing(&scenario(), folder.path(), "first");
    let pairs = [0, 1].map(|step| first.capture(step).unwrap());
    assert_eq!(first.rendered_count(), 4);
    type Change = fn(&mut Scenario);
    let changes: [(&str, Change); 4] = [
        ("noise", |scenario| scenario.camera.noise_seed = Some(77)),
        ("level", |scenario| (scenario.camera.mean_level, scenario.camera.vignetting) = (0.2, 1.0)),
        ("full", |scenario| scenario.camera.exposure = ExposureMode::FullFrame),
        ("eight", |scenario| {
            scenario.camera.exposure = ExposureMode::Subframe;
            (scenario.camera.bit_depth, scenario.camera.quantisation) = (8, Quantisation::SquareRoot);
        }),
    ];
    for (name, change) in changes {
        let mut other = scenario();
        change(&mut other);
        let kept = sharing(&other, folder.path(), name);
        let anew = alone(&other, &folder.path().join(format!("{name} anew")));
        for step in [1, 0] {
            let (kept, anew) = (kept.capture(step).unwrap(), anew.capture(step).unwrap());
            assert_eq!((&kept.left, &kept.right), (&anew.left, &anew.right), "{name} {step}");
            assert_ne!(kept.left, pairs[step].left, "{name} {step}");
        }
        assert_eq!(kept.rendered_count(), 0, "{name}");
        assert!(anew.rendered_count() >= 4, "{name}");
    }
    let again = sharing(&scenario(), folder.path(), "again");
    assert_eq!(again.capture(1).unwrap().right, pairs[1].right);
    assert_eq!(again.rendered_count(), 0);
}

#[test]
fn radiance_that_is_damaged_or_of_another_renderer_is_rendered_anew() {
    let folder = tempfile::tempdir().unwrap();
    let first = create_simulated(&scenario(), folder.path()).unwrap().capture(0).unwrap();
    let reopened = || {
        std::fs::remove_dir_all(folder.path().join("images")).unwrap();
        Traverse::open(folder.path()).unwrap()
    };
    let from_own_cache = reopened();
    assert_eq!(from_own_cache.capture(0).unwrap().left, first.left);
    assert_eq!(from_own_cache.rendered_count(), 0);

    let cache = RenderCache::new(folder.path().join("cache"), 1 << 24);
    let stops = &from_own_cache.index().stops;
    let moment = Moment::of(0, stops).unwrap();
    let camera = camera_in_site(&from_own_cache.stops(), 0, (None, Eye::Left)).unwrap();
    let key = render_cache::key(&scenario(), &stop_key(&moment, &stops[0]), &camera);
    let mut brighter = cache.load(&key, &camera).unwrap();
    brighter.iter_mut().for_each(|value| *value *= 1.01);
    cache.store(&key, &brighter);
    let doubting = reopened();
    assert_eq!(doubting.capture(0).unwrap().left, first.left);
    assert_eq!(doubting.rendered_count(), 1);

    std::fs::write(folder.path().join(format!("cache/{key}.npy")), b"half").unwrap();
    let mending = reopened();
    assert_eq!(mending.capture(0).unwrap().left, first.left);
    assert_eq!(mending.rendered_count(), 1);
}

#[test]
fn both_eyes_share_an_exposure_that_does_not_depend_on_the_order_of_asking() {
    let folder = tempfile::tempdir().unwrap();
    let mut auto = scenario();
    auto.camera.exposure = ExposureMode::FullFrame;
    (auto.camera.auto_exposure.start_s, auto.camera.auto_exposure.change_percent) = (5.0, 30.0);
    let never = AtomicBool::new(false);
    let forward = sharing(&auto, folder.path(), "forward");
    let times = [0, 1].map(|step| forward.exposure_s(step, &never).unwrap().unwrap());
    let backward = sharing(&auto, folder.path(), "backward");
    let last = backward.capture(1).unwrap();
    assert_eq!(backward.exposure_s(0, &never).unwrap(), Some(times[0]));
    assert!(times[0] < 2.0, "{times:?}");
    for (eye, picture) in [(Eye::Left, &last.left), (Eye::Right, &last.right)] {
        let camera = camera_in_site(&forward.stops(), 1, (None, eye)).unwrap();
        let whole = Region::whole(&camera);
        let radiance = clean_radiance(forward.world().unwrap(), &auto, &camera, whole, &never).unwrap();
        let seed = NoiseSeed { step: 1, eye };
        assert_eq!(**picture, develop(&radiance, &auto, &camera, times[1], seed));
    }
    assert!(forward.exposure_s(2, &never).is_err());
}

#[test]
fn a_cancelled_capture_builds_no_world_and_writes_no_image() {
    let folder = tempfile::tempdir().unwrap();
    create_simulated(&scenario(), folder.path()).unwrap();
    let traverse = Traverse::open(folder.path()).unwrap();
    let is_cancelled = |outcome: Result<sightline_track::stages::capture::StereoPair>| {
        matches!(outcome, Err(Error::Cancelled))
    };
    assert!(is_cancelled(traverse.capture_until(0, &AtomicBool::new(true))));
    assert!(traverse.simulated.as_ref().unwrap().world.get().is_none());
    assert!(!folder.path().join("images").join("left_0000.png").exists());
    // The stop can still be captured.
    assert!(traverse.capture(0).is_ok());
    assert!(folder.path().join("images").join("left_0000.png").exists());
}
