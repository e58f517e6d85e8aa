//! The detector has the noise of its gain, the steps of its converter and a constant response.

use super::*;
use crate::camera::exposure::Rates;
use crate::camera::picture::Eye;
use sightline_geometry::camera::Mast;
use sightline_geometry::cancel::Cancel;

const SIDE: u32 = 256;

fn scenario() -> Scenario {
    let mut scenario = Scenario::demo();
    scenario.camera.flat_field_residue = 0.0;
    scenario
}

/// The recorded image of uniform light that fills `level` of full scale in 1 s.
fn recorded_of(level: f64, scenario: &Scenario, seed: NoiseSeed) -> GrayImage {
    let camera = &scenario.camera;
    let electrons = camera.gain_electrons_per_dn * (FULL_SCALE_DN * level - camera.bias_dn);
    let radiance = (electrons / camera.electrons_per_s) as f32;
    let radiance = GrayImage::from_pixel(SIDE, SIDE, image::Luma([radiance]));
    let geometry = Mast::spirit().left_in_head.downsampled(4);
    let rates = Rates::new(&radiance, scenario, &geometry, seed.eye, [0, 0]);
    record(&rates, scenario, 1.0, seed, [0, 0], Cancel::default()).unwrap()
}

fn recorded(level: f64, change: impl Fn(&mut CameraSettings)) -> GrayImage {
    let mut scenario = scenario();
    scenario.camera.response_spread = 0.0;
    change(&mut scenario.camera);
    recorded_of(level, &scenario, NoiseSeed { step: 3, eye: Eye::Left })
}

fn mean_and_variance_dn(image: &GrayImage) -> (f64, f64) {
    let dn: Vec<f64> = image.pixels().map(|p| f64::from(p.0[0]) * FULL_SCALE_DN).collect();
    let mean = dn.iter().sum::<f64>() / dn.len() as f64;
    (mean, dn.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / dn.len() as f64)
}

fn correlation(a: &GrayImage, b: &GrayImage) -> f64 {
    let ((ma, va), (mb, vb)) = (mean_and_variance_dn(a), mean_and_variance_dn(b));
    let product = |(p, q): (&image::Luma<f32>, &image::Luma<f32>)| {
        (f64::from(p.0[0]) * FULL_SCALE_DN - ma) * (f64::from(q.0[0]) * FULL_SCALE_DN - mb)
    };
    a.pixels().zip(b.pixels()).map(product).sum::<f64>() / f64::from(SIDE * SIDE) / (va * vb).sqrt()
}

#[test]
fn the_line_of_variance_over_mean_gives_the_gain_and_the_read_noise_back() {
    for (gain, read) in [(42.0, 30.0), (8.0, 60.0), (50.0, 25.0)] {
        let points = (1..=12).map(|k| {
            let image = recorded(0.07 * f64::from(k), |camera| {
                (camera.gain_electrons_per_dn, camera.read_noise_electrons) = (gain, read);
            });
            mean_and_variance_dn(&image)
        });
        let points: Vec<(f64, f64)> = points.collect();
        let count = points.len() as f64;
        let (mean, variance) =
            points.iter().fold((0.0, 0.0), |(m, v), (a, b)| (m + a / count, v + b / count));
        let slope = points.iter().map(|(m, v)| (m - mean) * (v - variance)).sum::<f64>()
            / points.iter().map(|(m, _)| (m - mean).powi(2)).sum::<f64>();
        assert!((1.0 / slope / gain - 1.0).abs() < 0.02, "{gain}: {}", 1.0 / slope);
        // Twelve levels with 65 536 pixels each determine every variance to 0.6 %.
        for (mean_dn, variance) in points {
            let expected = (mean_dn - 20.0) / gain + (read / gain).powi(2) + 1.0 / 12.0;
            assert!((variance / expected - 1.0).abs() < 0.03, "{variance} {expected}");
        }
    }
}

#[test]
fn the_mean_is_the_light_and_darkness_is_the_bias() {
    for level in [0.05, 0.4, 0.8] {
        let (mean, variance) = mean_and_variance_dn(&recorded(level, |_| {}));
        let error = (mean - level * FULL_SCALE_DN).abs();
        assert!(error < 5.0 * (variance / f64::from(SIDE * SIDE)).sqrt(), "{mean}");
    }
    let (dark, variance) = mean_and_variance_dn(&recorded(20.0 / FULL_SCALE_DN, |_| {}));
    // Read noise of 30 e⁻ is 0.71 DN.
    assert!((dark - 20.0).abs() < 0.02 && (variance - (30.0f64 / 42.0).powi(2) - 1.0 / 12.0).abs() < 0.02);
}

#[test]
fn too_much_light_is_full_scale_everywhere_and_a_full_well_ends_before_it() {
    let bright = recorded(1.2, |_| {});
    assert!(bright.pixels().all(|pixel| pixel.0[0] == 1.0));
    let shallow = recorded(0.9, |camera| {
        (camera.full_well_electrons, camera.read_noise_electrons) = (84_000.0, 0.0);
    });
    // 84 000 e⁻ / 42 and the bias.
    assert!(shallow.pixels().all(|pixel| (f64::from(pixel.0[0]) * FULL_SCALE_DN - 2020.0).abs() < 1e-3));
}

#[test]
fn values_are_whole_numbers_of_the_converter() {
    for (depth, steps) in [(12, 4095.0f64), (8, 255.0)] {
        for pixel in recorded(0.37, |camera| camera.bit_depth = depth).pixels() {
            let dn = f64::from(pixel.0[0]) * steps;
            assert!((dn - dn.round()).abs() < 1e-3, "{dn}");
        }
    }
}

#[test]
fn the_square_root_table_stays_linear_with_steps_that_grow_with_the_light() {
    let root =
        CameraSettings { bit_depth: 8, quantisation: Quantisation::SquareRoot, ..CameraSettings::default() };
    let value_dn = |dn: f64| f64::from(quantised(dn, &root)) * FULL_SCALE_DN;
    let mut codes = std::collections::BTreeSet::new();
    for dn in 0..4096 {
        let (dn, value) = (f64::from(dn), value_dn(f64::from(dn)));
        // Half a step of 1/255 in the root, and half a DN from rounding the inverse.
        let half_step =
            (dn / FULL_SCALE_DN).sqrt() * FULL_SCALE_DN / 255.0 + FULL_SCALE_DN / 4.0 / 255f64.powi(2);
        assert!((value - dn).abs() <= half_step + 0.5 + 1e-3, "{dn} {value}");
        codes.insert(value.round() as i64);
    }
    // 256 codes, of which the lowest map to one DN.
    assert!((250..=256).contains(&codes.len()), "{}", codes.len());
    // 4095 (64/255)² and its neighbours: 257.95, 266.08.
    assert!((value_dn(258.0) - 258.0).abs() < 1e-3 && (value_dn(266.0) - 266.0).abs() < 1e-3);
    let (mean, _) = mean_and_variance_dn(&recorded(0.4, |camera| {
        (camera.bit_depth, camera.quantisation) = (8, Quantisation::SquareRoot);
    }));
    // Shot noise of 6 DN under steps of 20 DN leaves a bias of up to half a step.
    assert!((mean - 0.4 * FULL_SCALE_DN).abs() < 10.0, "{mean}");
}

#[test]
fn the_response_of_a_pixel_stays_from_one_exposure_to_the_next() {
    let scenario = scenario();
    let take = |step, eye| recorded_of(0.5, &scenario, NoiseSeed { step, eye });
    let first = take(0, Eye::Left);
    // Response 1 % of 2028 DN against a shot and read noise of 7 DN.
    assert!(correlation(&first, &take(1, Eye::Left)) > 0.85);
    assert!(correlation(&first, &take(0, Eye::Right)).abs() < 0.02);
}

#[test]
fn another_noise_seed_redraws_the_noise_and_keeps_the_response() {
    let seed = NoiseSeed { step: 0, eye: Eye::Left };
    let mut scenario = scenario();
    let take = |scenario: &Scenario| recorded_of(0.5, scenario, seed);
    let first = take(&scenario);
    scenario.camera.noise_seed = Some(scenario.seed);
    assert_eq!(first, take(&scenario));
    scenario.camera.noise_seed = Some(scenario.seed + 1);
    assert!(correlation(&first, &take(&scenario)) > 0.85 && first != take(&scenario));
    scenario.camera.response_spread = 0.0;
    let again = take(&scenario);
    scenario.camera.noise_seed = Some(scenario.seed + 2);
    assert!(correlation(&again, &take(&scenario)).abs() < 0.02);
}

#[test]
fn a_cancelled_development_records_nothing() {
    let scenario = Scenario::default();
    let camera = crate::Rig::new(&scenario.camera).cameras_in_rover(None).0;
    let radiance = GrayImage::from_pixel(8, 8, image::Luma([0.2]));
    let rates = Rates::new(&radiance, &scenario, &camera, Eye::Left, [0, 0]);
    let (flag, seed) = (std::sync::atomic::AtomicBool::new(true), NoiseSeed { step: 0, eye: Eye::Left });
    assert!(record(&rates, &scenario, 1.0, seed, [0, 0], Cancel::from(&flag)).is_err());
}
