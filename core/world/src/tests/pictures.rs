//! Rendered images depend on the geometry, on their seed, and on nothing else.

use std::sync::atomic::AtomicBool;

use super::*;
use crate::camera::exposure::{Rates, automatic, fixed_s};
use crate::camera::noise;
use crate::scenario::{CameraRig, ExposureMode};
use sightline_geometry::camera::Camera;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Error;
use sightline_geometry::frames::Pixel;
use sightline_vision::image::GrayImage;
use sightline_vision::image::sample::bicubic;

fn region(world: &World, scenario: &Scenario, camera: &Camera, region: Region) -> GrayImage {
    clean_radiance(world, scenario, camera, region, &AtomicBool::new(false)).unwrap()
}

/// The recorded region of an image under the fixed exposure.
fn recorded(
    world: &World,
    scenario: &Scenario,
    camera: &Camera,
    window: Region,
    seed: NoiseSeed,
) -> (GrayImage, GrayImage) {
    let clean = region(world, scenario, camera, window);
    let first = [window.x, window.y];
    let rates = Rates::new(&clean, scenario, camera, seed.eye, first);
    let time_s = fixed_s(world, scenario);
    let noisy = noise::record(&rates, scenario, time_s, seed, first, Cancel::default()).unwrap();
    (clean, noisy)
}

fn camera(index: &TraverseIndex, stop: usize, eye: Eye) -> Camera {
    true_camera_in_site(&index.stops[stop], eye).unwrap()
}

/// The square region of `side` px around a pixel.
fn around(pixel: Pixel, side: u32) -> Region {
    let first = |v: f64| (v.round() - f64::from(side / 2)).max(0.0) as u32;
    Region { x: first(pixel.x), y: first(pixel.y), width: side, height: side }
}

/// Normalised correlation of two lists of the same length.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(p, q)| f(p - ma, q - mb)).sum::<f64>();
    sum(&|p, q| p * q) / (sum(&|p, _| p * p) * sum(&|_, q| q * q)).sqrt()
}

/// Position of the maximum of a parabola through three values one step apart, in steps.
fn top(low: f64, middle: f64, high: f64) -> f64 {
    0.5 * (low - high) / (low - 2.0 * middle + high)
}

/// The shift (px) of the right image relative to the projected left patch, by best correlation.
fn stereo_shift(demo: &Demo, stop: usize, pixel: Pixel) -> Option<[f64; 2]> {
    let (left, right) = (camera(&demo.index, stop, Eye::Left), camera(&demo.index, stop, Eye::Right));
    let half = 10i32;
    let patch = around(pixel, 21);
    let left_image = region(&demo.world, &demo.scenario, &left, patch);
    let mut places = Vec::new();
    let mut values = Vec::new();
    let middle = demo.world.cast(&left.ray(pixel)?)?;
    for dy in -half..=half {
        for dx in -half..=half {
            let at = pixel.offset(f64::from(dx), f64::from(dy));
            let hit = demo.world.cast(&left.ray(at)?)?;
            // Points that only one camera sees, or on two rocks, would test something else.
            let seen_by_both = demo.world.is_visible(&right.model.centre(), &hit.point);
            if hit.surface != middle.surface || !seen_by_both {
                return None;
            }
            places.push(right.project(&hit.point)?);
            values.push(f64::from(left_image.get_pixel((dx + half) as u32, (dy + half) as u32).0[0]));
        }
    }
    let mean_of = |f: &dyn Fn(&Pixel) -> f64| places.iter().map(f).sum::<f64>() / places.len() as f64;
    let window = around(Pixel::new(mean_of(&|p| p.x), mean_of(&|p| p.y)), 41);
    let right_image = region(&demo.world, &demo.scenario, &right, window);
    let score = |dx: f64, dy: f64| {
        let moved: Option<Vec<f64>> = places
            .iter()
            .map(|p| bicubic(&right_image, p.offset(dx - f64::from(window.x), dy - f64::from(window.y))))
            .map(|value| value.map(f64::from))
            .collect();
        moved.map(|moved| correlation(&values, &moved))
    };
    let (step, peak) = (0.25, score(0.0, 0.0)?);
    (peak > 0.9).then_some(())?;
    Some([
        step * top(score(-step, 0.0)?, peak, score(step, 0.0)?),
        step * top(score(0.0, -step)?, peak, score(0.0, step)?),
    ])
}

#[test]
fn a_patch_of_the_left_picture_correlates_best_where_geometry_puts_it_in_the_right() {
    let demo = demo();
    let mut shifts = Vec::new();
    for k in 0..60 {
        let stop = [10, 13, 16][(k % 3) as usize];
        let pixel = Pixel::new((200.0 + 600.0 * unit(k, 0)).round(), (300.0 + 500.0 * unit(k, 1)).round());
        shifts.extend(stereo_shift(demo, stop, pixel));
    }
    assert!(shifts.len() > 15, "{}", shifts.len());
    for axis in 0..2 {
        let mut along: Vec<f64> = shifts.iter().map(|shift| shift[axis]).collect();
        along.sort_by(f64::total_cmp);
        let bias = along[along.len() / 2];
        along.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        // One patch in ten may show an edge of a rock, whose faces differ in brightness between the cameras.
        let (median, most) = (along[along.len() / 2].abs(), along[along.len() * 9 / 10].abs());
        assert!(bias.abs() < 0.005 && median < 0.02 && most < 0.05, "{bias} {median} {most}: {shifts:?}");
    }
}

/// The demonstration's rocks, nearly black under a uniform sky on nearly white ground: pure silhouettes.
fn silhouettes() -> (Scenario, World) {
    let mut scenario = demo().scenario.clone();
    (scenario.texture.soil_albedo, scenario.texture.rock_albedo) = (0.9, 0.02);
    (scenario.texture.albedo_std, scenario.texture.soil_slope_std, scenario.texture.rock_slope_std) =
        (0.0, 0.0, 0.0);
    (scenario.texture.grain_cover, scenario.texture.drift_cover) = (0.0, 0.0);
    (scenario.texture.dust, scenario.sun.diffuse_fraction, scenario.sun.aureole) = (0.0, 1.0, 0.0);
    (scenario.camera.blur_px, scenario.camera.samples_per_axis) = (0.0, 8);
    let mut world = World::new(&scenario);
    // Without contact shadows, which are beside the silhouettes.
    std::sync::Arc::make_mut(&mut world.scenery).openness =
        crate::light::openness::Openness::new(&[], [0.0, 1.0], [0.0, 1.0]);
    (scenario, world)
}

/// The fraction of a pixel that shows rock, from 16 × 16 exact rays.
fn rock_part(world: &World, camera: &Camera, x: f64, y: f64) -> f64 {
    let rays = (0..256).filter_map(|k| {
        let (u, v) = ((f64::from(k % 16) + 0.5) / 16.0 - 0.5, (f64::from(k / 16) + 0.5) / 16.0 - 0.5);
        world.cast(&camera.ray(Pixel::new(x + u, y + v))?)
    });
    let hits: Vec<bool> = rays.map(|hit| hit.surface != SurfaceId::Ground).collect();
    hits.iter().filter(|rock| **rock).count() as f64 / hits.len().max(1) as f64
}

/// Offset (px) of the silhouettes in rendered windows from those of exact rays of their cameras.
///
/// Least squares: radiance = a + b part + c ∂part/∂x + d ∂part/∂y; a shift of s px gives c = −b s.
fn silhouette_shift((scenario, world): &(Scenario, World), windows: &[(Camera, Region)]) -> [f64; 2] {
    let (mut matrix, mut right_side) = (nalgebra::Matrix4::zeros(), nalgebra::Vector4::zeros());
    for (camera, window) in windows {
        let (w, h) = (window.width as usize, window.height as usize);
        let image = region(world, scenario, camera, *window);
        let place = |k: usize| (f64::from(window.x) + (k % w) as f64, f64::from(window.y) + (k / w) as f64);
        let parts: Vec<f64> = (0..w * h).map(place).map(|(x, y)| rock_part(world, camera, x, y)).collect();
        let at = |x: usize, y: usize| parts[y * w + x];
        for y in 1..h - 1 {
            for x in 1..w - 1 {
                let slope = [0.5 * (at(x + 1, y) - at(x - 1, y)), 0.5 * (at(x, y + 1) - at(x, y - 1))];
                let row = nalgebra::Vector4::new(1.0, at(x, y), slope[0], slope[1]);
                matrix += row * row.transpose();
                right_side += row * f64::from(image.get_pixel(x as u32, y as u32).0[0]);
            }
        }
    }
    let fit = matrix.try_inverse().unwrap() * right_side;
    assert!(fit[1] < -0.1, "rocks are dark: {fit:?}");
    [-fit[2] / fit[1], -fit[3] / fit[1]]
}

#[test]
fn silhouettes_lie_where_exact_rays_of_the_camera_model_put_them() {
    let window = |x: u32| Region { x, y: 470, width: 72, height: 72 };
    let windows = [(2, Eye::Left, 480), (10, Eye::Right, 420), (14, Eye::Left, 480)]
        .map(|(stop, eye, x)| (camera(&demo().index, stop, eye), window(x)));
    let shift = silhouette_shift(&silhouettes(), &windows);
    assert!(shift.iter().all(|s| s.abs() < 0.005), "{shift:?}");
}

/// The cameras of a rig in the site frame, with the rover at a stop of the demonstration and the mast at its target.
fn rig_in_site(rig: CameraRig, image_size: u32, stop: usize) -> (Camera, Camera) {
    let mut settings = demo().scenario.camera.clone();
    (settings.rig, settings.image_size) = (rig, image_size);
    let site_from_rover = demo().index.stops[stop].truth.as_ref().unwrap().site_from_rover.to_pose();
    let rig = Rig::new(&settings);
    let centre_in_rover = site_from_rover.inverse_transform_point(&demo().world.targets_centre());
    let (left, right) = rig.cameras_in_rover(rig.point_at(&centre_in_rover).unwrap());
    (left.moved(&site_from_rover), right.moved(&site_from_rover))
}

/// The window of 60 × 60 px, without sky, with the most equal numbers of rock and ground pixels.
fn window_with_most_rock(world: &World, camera: &Camera) -> Region {
    let evenness = |window: &Region| {
        let pixels = (0..225).map(|k| (window.x + 4 * (k % 15), window.y + 4 * (k / 15)));
        let rays = pixels.filter_map(|(x, y)| camera.ray(Pixel::new(f64::from(x), f64::from(y))));
        let surfaces: Vec<_> = rays.filter_map(|ray| Some(world.cast(&ray)?.surface)).collect();
        let rocks = surfaces.iter().filter(|surface| **surface != SurfaceId::Ground).count();
        if surfaces.len() == 225 { rocks.min(225 - rocks) } else { 0 }
    };
    let [columns, rows] = camera.size.map(|side| (side - 60) / 20);
    let windows = (0..=columns * rows).map(|k| (20 * (k % columns), 20 * (k / columns)));
    let windows = windows.map(|(x, y)| Region { x, y, width: 60, height: 60 });
    windows.max_by_key(evenness).unwrap()
}

#[test]
fn silhouettes_of_every_rig_lie_where_exact_rays_of_its_models_put_them() {
    let mut scene = silhouettes();
    scene.0.camera.samples_per_axis = 8;
    for rig in [CameraRig::MerPancam, CameraRig::MerFrontHazcam, CameraRig::Table1Pancam] {
        let (left, right) = rig_in_site(rig, 256, 13);
        let camera = if rig == CameraRig::MerPancam { left } else { right };
        let window = window_with_most_rock(&scene.1, &camera);
        let shift = silhouette_shift(&scene, &[(camera, window)]);
        assert!(shift.iter().all(|s| s.abs() < 0.01), "{rig:?} {window:?} {shift:?}");
    }
}

#[test]
fn a_picture_that_is_not_square_is_rendered_and_developed_whole() {
    let mut scenario = demo().scenario.clone();
    (scenario.camera.rig, scenario.camera.image_size) = (CameraRig::Table1Navcam, 128);
    let (left, _) = rig_in_site(CameraRig::Table1Navcam, 128, 8);
    let picture = render(&demo().world, &scenario, &left, NoiseSeed { step: 8, eye: Eye::Left });
    assert_eq!(picture.dimensions(), (128, 96));
    let window = Region { x: 90, y: 70, width: 30, height: 20 };
    let (_, part) = recorded(&demo().world, &scenario, &left, window, NoiseSeed { step: 8, eye: Eye::Left });
    for (x, y, pixel) in part.enumerate_pixels() {
        assert_eq!(picture.get_pixel(x + 90, y + 70), pixel);
    }
}

#[test]
fn sky_that_enters_the_frame_darkens_the_target_unless_a_subframe_is_metered() {
    let mut scenario = demo().scenario.clone();
    // An optical depth of 1 with the sun at 45° (domain.md 11.1).
    scenario.sun.diffuse_fraction = 0.66;
    (scenario.camera.samples_per_axis, scenario.camera.auto_exposure.subframe_px) = (1, 21);
    // The flat-field pattern depends on the position in the frame, which differs between the frames.
    scenario.camera.flat_field_residue = 0.0;
    let world = World::new(&scenario);
    let (camera, _) = rig_in_site(CameraRig::MerNavcam, 128, 0);
    // The fraction of a frame that shows sky, and the mean DN of the 21 × 21 px around the target.
    let frame = |side: u32, mode: ExposureMode| {
        let mut scenario = scenario.clone();
        scenario.camera.exposure = mode;
        let camera = camera.subframe(64 - side / 2, 64 - side / 2, [side, side]);
        let radiance = region(&world, &scenario, &camera, Region::whole(&camera));
        let rays =
            (0..side * side).filter_map(|k| camera.ray(Pixel::new(f64::from(k % side), f64::from(k / side))));
        let sky = rays.filter(|ray| world.cast(ray).is_none()).count() as f64 / f64::from(side * side);
        let rates = Rates::new(&radiance, &scenario, &camera, Eye::Left, [0, 0]);
        let time_s = automatic(&rates, &scenario.camera, None, scenario.camera.auto_exposure.start_s).time_s;
        let picture = rates.levels(time_s, &scenario.camera);
        let corner = side / 2 - 10;
        let window = (0..21 * 21).map(|k| picture.get_pixel(corner + k % 21, corner + k / 21).0[0]);
        (sky, 4095.0 / 441.0 * window.map(f64::from).sum::<f64>())
    };
    let of_mode = |mode: ExposureMode| [36, 60, 90, 128].map(|side| frame(side, mode));
    let (full, sub) = (of_mode(ExposureMode::FullFrame), of_mode(ExposureMode::Subframe));
    assert!(full[0].0 == 0.0 && full[3].0 > 0.25, "{full:?}");
    // From 1514 DN without sky to 643 DN with 10, 23 and 31 % of sky: the target gets 58 % darker.
    assert!(full[1..].iter().all(|(_, dn)| dn / full[0].1 < 0.6), "{full:?}");
    assert!(sub.iter().all(|(_, dn)| (dn / sub[0].1 - 1.0).abs() < 1e-3), "{sub:?}");
}

#[test]
fn the_same_seed_gives_the_same_bits_with_one_thread_and_with_four() {
    let demo = demo();
    let camera = camera(&demo.index, 9, Eye::Left);
    let window = Region { x: 440, y: 460, width: 128, height: 128 };
    let picture = |threads: usize, seed: u64| {
        let mut scenario = demo.scenario.clone();
        scenario.seed = seed;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let world = World::new(&scenario);
            let seed = NoiseSeed { step: 9, eye: Eye::Left };
            let (clean, noisy) = recorded(&world, &scenario, &camera, window, seed);
            (clean.into_raw(), noisy.into_raw())
        })
    };
    let (clean, noisy) = picture(1, 1);
    assert!((clean.clone(), noisy.clone()) == picture(4, 1));
    let other = picture(4, 2);
    assert!(clean != other.0 && noisy != other.1 && clean != noisy);
}

#[test]
fn a_region_has_the_bits_of_the_whole_picture() {
    let demo = demo();
    let camera = camera(&demo.index, 12, Eye::Right);
    let big = Region { x: 400, y: 500, width: 90, height: 70 };
    let small = Region { x: 423, y: 517, width: 31, height: 29 };
    let seed = NoiseSeed { step: 12, eye: Eye::Right };
    // With fewer samples a pixel, different neighbours share the rays that are cast at once.
    for samples_per_axis in [1, 2, 4] {
        let mut scenario = demo.scenario.clone();
        scenario.camera.samples_per_axis = samples_per_axis;
        let record = |window: Region| recorded(&demo.world, &scenario, &camera, window, seed);
        let (whole, part) = (record(big), record(small));
        for (whole, part) in [(whole.0, part.0), (whole.1, part.1)] {
            for (x, y, pixel) in part.enumerate_pixels() {
                assert_eq!(whole.get_pixel(x + 23, y + 17), pixel, "{samples_per_axis}: {x}, {y}");
            }
        }
    }
}

#[test]
fn the_clean_picture_is_the_mean_of_noisy_ones_and_the_first_has_the_stated_level() {
    let mut scenario = demo().scenario.clone();
    (scenario.camera.image_size, scenario.camera.samples_per_axis) = (128, 2);
    scenario.camera.response_spread = 0.0;
    let world = World::new(&scenario);
    let index = index(&scenario, &world).unwrap();
    let camera = camera(&index, 0, Eye::Left);
    let radiance = region(&world, &scenario, &camera, Region::whole(&camera));
    let rates = Rates::new(&radiance, &scenario, &camera, Eye::Left, [0, 0]);
    let clean = rates.levels(fixed_s(&world, &scenario), &scenario.camera);
    let mean = |image: &GrayImage| image.iter().map(|v| f64::from(*v)).sum::<f64>() / image.len() as f64;
    assert!((mean(&clean) - 0.4).abs() < 0.01, "{}", mean(&clean));
    let noisy = render(&world, &scenario, &camera, NoiseSeed { step: 0, eye: Eye::Left });
    // 16 384 pixels with a noise of 7 DN each.
    assert!((mean(&noisy) - mean(&clean)).abs() < 4.0 * 7.0 / 4095.0 / 128.0);
}

#[test]
fn rendering_stops_when_it_is_cancelled() {
    let demo = demo();
    let camera = camera(&demo.index, 0, Eye::Left);
    let cancelled = AtomicBool::new(true);
    let result = clean_radiance(&demo.world, &demo.scenario, &camera, Region::whole(&camera), &cancelled);
    assert!(matches!(result, Err(Error::Cancelled)));
}
