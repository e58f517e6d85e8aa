//! The criteria on images with known results, and the map on a plane with exact ground truth.

use image::Luma;

use sightline_geometry::error::Error;
use sightline_geometry::frames::{Pixel, Pose};
use sightline_rover::pipeline;
use sightline_rover::trackability::depth::edge_distances;
use sightline_rover::trackability::ground::Measured;
use sightline_rover::trackability::*;
use sightline_testing::{PlaneWorld, Trouble};
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_vision::correlate::Focus;
use sightline_vision::image::GrayImage;
use sightline_vision::image::patch::{self, Patch};
use sightline_vision::image::sample::Kernel;
use sightline_vision::stereo::{DisparityMap, Outcome};

fn plane() -> PlaneWorld {
    PlaneWorld::new(vec![Pose::identity()])
}

fn ground(world: &PlaneWorld) -> Ground {
    Ground::new(world, 0, &Settings::default(), &TrackabilityLimits::default()).unwrap()
}

fn window(value: impl Fn(u32, u32) -> f32) -> Patch {
    GrayImage::from_fn(21, 21, |x, y| Luma([value(x, y)])).into()
}

#[test]
fn noise_is_measured_through_slopes_and_bends() {
    // A pseudo-random ±1 has standard deviation 1; the mask removes the curved background.
    let sign = |x: u32, y: u32| {
        let mixed = (x.wrapping_mul(2_654_435_761) ^ y.wrapping_mul(40_503).wrapping_mul(97))
            .wrapping_mul(0x9e37_79b1);
        if mixed >> 31 == 0 { 1.0 } else { -1.0 }
    };
    let image = GrayImage::from_fn(200, 200, |x, y| {
        let bend = 1e-5 * (x * x) as f32 + 2e-3 * y as f32;
        Luma([0.2 + bend + 0.01 * sign(x, y)])
    });
    let found = texture::noise(&image);
    assert!((found / 0.01 - 1.0).abs() < 0.25, "{found}");
}

#[test]
fn a_match_is_uncertain_along_an_edge_and_certain_at_a_corner() {
    let focus = Focus::new(21, 4.0);
    let sigma = |patch: &Patch| texture::match_sigma_px(patch, 0.003, 0.95, &focus);
    let step = |v: f32| 0.5 + 0.3 * v.clamp(-1.0, 1.0);
    let corner = window(|x, y| step((x as f32 - 10.0).min(y as f32 - 10.0)));
    let slanted = window(|x, y| step(x as f32 - 10.0 + 0.02 * (y as f32 - 10.0)));
    let (corner, slanted) = (sigma(&corner).unwrap(), sigma(&slanted).unwrap_or(f64::INFINITY));
    assert!(corner < 0.5 && slanted > 5.0 * corner, "corner {corner}, edge {slanted}");
    assert_eq!(sigma(&window(|_, _| 0.5)), None);
}

#[test]
fn only_a_repeated_pattern_has_a_second_match() {
    let spot = |x: f64, y: f64| (-(x * x + y * y) / 30.0).exp();
    let likeness = |places: &[(f64, f64)]| {
        let image = GrayImage::from_fn(200, 200, |x, y| {
            let spots: f64 = places.iter().map(|(u, v)| spot(f64::from(x) - u, f64::from(y) - v)).sum();
            // A slow ramp prevents far windows from being uniform.
            Luma([(0.2 + 0.4 * spots + 1e-4 * f64::from(x)) as f32])
        });
        let pixel = Pixel::new(100.0, 100.0);
        let window = patch::extract(&image, pixel, 10, Kernel::Bicubic);
        texture::likeness(&image, pixel, &window, 143).unwrap_or(0.0)
    };
    assert!(likeness(&[(100.0, 100.0), (140.0, 110.0)]) > 0.99);
    assert!(likeness(&[(100.0, 100.0)]) < 0.8);
}

#[test]
fn a_depth_edge_is_a_step_beyond_any_slope_also_across_a_hole() {
    let map = |disparity: &dyn Fn(u32) -> f32| {
        let (width, height) = (60_u32, 40_u32);
        let values: Vec<f32> = (0..height).flat_map(|_| (0..width).map(disparity)).collect();
        let outcome = vec![Outcome::Found; values.len()];
        DisparityMap { width, height, disparity_px: values, outcome }
    };
    let at = |map: &DisparityMap, x: usize| edge_distances(map, &TrackabilityLimits::default())[20 * 60 + x];
    let step = map(&|x| if x < 30 { 20.0 } else { 26.0 });
    assert_eq!((at(&step, 29), at(&step, 30)), (0.0, 0.0));
    assert_eq!((at(&step, 20), at(&step, 37)), (9.0, 7.0));
    // A nearer surface hides a strip as wide as the difference of the disparities.
    let hidden = map(&|x| match x {
        0..24 => 20.0,
        24..30 => f32::NAN,
        _ => 26.0,
    });
    assert_eq!((at(&hidden, 23), at(&hidden, 30)), (0.0, 0.0));
    let slope = map(&|x| 20.0 + 0.4 * x as f32);
    assert!(at(&slope, 30).is_infinite());
}

#[test]
fn limits_divide_good_risky_and_bad_on_the_side_that_is_meant() {
    let verdict =
        |aspect, value, risky, bad| Measured::new(aspect, Some(value), Some(risky), Some(bad)).verdict;
    assert_eq!(verdict(Aspect::DepthEdge, 12.0, 10.0, 3.0), Verdict::Good);
    assert_eq!(verdict(Aspect::DepthEdge, 7.0, 10.0, 3.0), Verdict::Risky);
    assert_eq!(verdict(Aspect::DepthEdge, 2.0, 10.0, 3.0), Verdict::Bad);
    assert_eq!(verdict(Aspect::Texture, 0.1, 0.25, 0.5), Verdict::Good);
    assert_eq!(verdict(Aspect::Texture, 0.3, 0.25, 0.5), Verdict::Risky);
    assert_eq!(verdict(Aspect::Texture, 0.6, 0.25, 0.5), Verdict::Bad);
    assert_eq!(Measured::new(Aspect::Relief, None, Some(0.1), None).verdict, Verdict::Good);
}

#[test]
fn every_aspect_has_a_letter_and_a_sentence_of_its_own() {
    let mut letters = std::collections::HashSet::new();
    for aspect in Aspect::ALL {
        assert!(letters.insert(aspect.letter()));
        assert_eq!(Aspect::of_letter(aspect.letter() as u8), Some(aspect));
        assert!(aspect.sentence(Some(2.0), Verdict::Bad).len() > 10);
    }
    assert_eq!(Aspect::of_letter(b'-'), None);
    assert_eq!(Aspect::DepthEdge.sentence(Some(2.0), Verdict::Bad), "depth edge 2 px away");
}

#[test]
fn a_textured_plane_is_good_where_both_eyes_see_it() {
    let world = plane();
    let ground = ground(&world);
    let pixel = Pixel::new(140.0, 120.0);
    let seen = ground.assess(pixel, true);
    assert_eq!((seen.verdict, seen.reason), (Verdict::Good, None), "{:?}", seen.criteria);
    let truth_m = (world.plane_point(0, &world.left, pixel).unwrap() - world.left.model.centre()).norm();
    let stated = seen.criteria.iter().find(|one| one.aspect == Aspect::RangeError).unwrap().value.unwrap();
    let error = (seen.range_m.unwrap() / truth_m - 1.0).abs();
    // One pixel of disparity in 15.6 at 7.7 m.
    assert!(error < stated && (0.06..0.07).contains(&stated), "{error} of {stated}");
    // A plane across the line of sight is not foreshortened: the papers' rule limits the step.
    assert!((seen.longest_step_m.unwrap() - 0.1 * seen.range_m.unwrap()).abs() < 1e-9);
    let rim = ground.assess(Pixel::new(6.0, 120.0), false);
    assert_eq!((rim.verdict, rim.reason), (Verdict::Bad, Some(Aspect::Rim)));
}

#[test]
fn a_good_pixel_is_accepted_by_the_designation() {
    let world = plane();
    let ground = ground(&world);
    for pixel in [Pixel::new(140.0, 120.0), Pixel::new(90.3, 180.6), Pixel::new(200.0, 60.0)] {
        let verdict = PixelVerdict::of(&world, &ground, pixel);
        let first = pipeline::designate(&world, Designation::new(0, pixel), &ground.settings).unwrap();
        assert_eq!(verdict.verdict, Verdict::Good, "{verdict:?}");
        assert_eq!(verdict.range_m, Some(first.update.target.initial_distance_m));
        assert_eq!(verdict.nearest_good, None);
    }
}

#[test]
fn a_bad_pixel_has_one_reason_and_the_nearest_good_pixel() {
    let world = plane();
    let ground = ground(&world);
    let verdict = PixelVerdict::of(&world, &ground, Pixel::new(3.0, 120.0));
    assert_eq!(verdict.verdict, Verdict::Bad);
    assert!(verdict.reason.as_deref().unwrap().contains("rim"), "{verdict:?}");
    let good = verdict.nearest_good.expect("a good pixel");
    assert_eq!(PixelVerdict::of(&world, &ground, good).verdict, Verdict::Good);
    // No closer cell of the map is good.
    let map = TrackabilityMap::of(&ground);
    let nearest = map.nearest_good(Pixel::new(3.0, 120.0)).unwrap();
    assert!(nearest.distance(Pixel::new(3.0, 120.0)) <= good.distance(Pixel::new(3.0, 120.0)) + 1e-9);
}

#[test]
fn a_map_agrees_with_the_evaluation_of_each_pixel() {
    let world = plane();
    let ground = ground(&world);
    let whole = TrackabilityMap::of(&ground);
    assert_eq!((whole.columns, whole.rows, whole.rows_done()), (32, 32, 32));
    let mut half = TrackabilityMap::empty(&ground);
    assert_eq!(half.cell(0, 0), None);
    for row in 0..16 {
        half.add(&half.judge_row(&ground, row));
    }
    assert_eq!((half.rows_done(), half.cell(3, 20)), (16, None));
    assert_eq!(half.verdicts, whole.verdicts[..half.verdicts.len()]);
    let pixel = Pixel::new(143.0, 117.0);
    let cell = whole.at(pixel).unwrap();
    let own = ground.assess(cell.pixel, false);
    assert!(cell.pixel.distance(pixel) < 6.0);
    assert_eq!((cell.verdict, cell.reason), (own.verdict, own.reason));
    assert!((cell.range_m.unwrap() - own.range_m.unwrap()).abs() < 0.01 * own.range_m.unwrap());
    assert!((whole.shares().iter().sum::<f64>() - 1.0).abs() < 1e-12);
    let text = serde_json::to_string(&whole).unwrap();
    assert_eq!(serde_json::from_str::<TrackabilityMap>(&text).unwrap(), whole);
}

#[test]
fn without_texture_every_pixel_is_bad() {
    let mut world = plane();
    world.troubles = vec![Trouble::Covered];
    let ground = ground(&world);
    let verdict = PixelVerdict::of(&world, &ground, Pixel::new(128.0, 128.0));
    assert_eq!((verdict.verdict, verdict.nearest_good), (Verdict::Bad, None));
    assert!(verdict.reason.unwrap().contains("stereo hole"));
    world.troubles = vec![Trouble::Missing];
    let limits = TrackabilityLimits::default();
    assert!(Ground::new(&world, 0, &Settings::default(), &limits).is_err());
    assert!(matches!(Ground::new(&world, 7, &Settings::default(), &limits), Err(Error::Target(_))));
}

#[test]
fn the_expected_match_sigma_is_the_scatter_under_white_noise() {
    const SIGMA: f64 = 0.03;
    let mut state = 7_u64;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut noisy = |side: u32| {
        GrayImage::from_fn(side, side, |x, y| {
            // The sum of twelve uniform numbers is nearly Gaussian with variance 1.
            let noise = (0..12).map(|_| uniform()).sum::<f64>() - 6.0;
            let (u, v) = (f64::from(x) - f64::from(side / 2), f64::from(y) - f64::from(side / 2));
            Luma([(0.5 + 0.1 * (0.7 * u).sin() * (0.6 * v + 0.3).cos() + SIGMA * noise) as f32])
        })
    };
    let focus = Focus::new(21, 4.0);
    let (mut offsets, mut expected) = (Vec::new(), 0.0);
    for _ in 0..200 {
        let (template, image) = (Patch::from(noisy(21)), noisy(41));
        let window_at = |x: i32, y: i32| {
            let centre = Pixel::new(20.0 + f64::from(x), 20.0 + f64::from(y));
            Some(patch::extract(&image, centre, 10, Kernel::Bicubic))
        };
        offsets.extend(focus.climb(&template, true, window_at).map(|found| found.offset_px));
        expected += texture::match_sigma_px(&template, SIGMA, 1.0, &focus).unwrap() / 200.0;
    }
    let variance = |axis: usize| offsets.iter().map(|o| o[axis].powi(2)).sum::<f64>() / offsets.len() as f64;
    let scatter = variance(0).max(variance(1)).sqrt();
    println!("{} matches scatter by {scatter:.3} px, {expected:.3} px expected", offsets.len());
    assert!(offsets.len() > 190 && (0.5..2.0).contains(&(expected / scatter)), "{expected} of {scatter}");
}
