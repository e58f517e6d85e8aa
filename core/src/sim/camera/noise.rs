//! The sensor chain: from the clean picture to the recorded numbers.
//!
//! ```text
//! S  = g (4095 · level − bias) · (1 + response)        electrons; level: fraction of full scale
//! N  = Poisson(S) + Normal(0, σ_read)
//! DN = clip(round(N/g + bias), 0, 4095),  value = DN/4095                        12 bit
//! DN8 = round(DN · 255/4095),             value = DN8/255                         8 bit
//! ```
//!
//! `response` is a pixel's own deviation, Gaussian and fixed for each camera of a scenario; the scene moves
//! over it from stop to stop. Dark current and smear are left out (below −55 °C the one is negligible, the
//! other is corrected on board). Var(DN) = S/g² + (σ_read/g)² + 1/12 for a fixed scene without `response`.
//!
//! Each pixel has its own stream of random numbers, started from (scenario, step, eye, place), so that the
//! noise of a region equals that of the whole picture, whatever the number of threads.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | g | `gain_electrons_per_dn` | e⁻/DN |
//! | σ_read | `read_noise_electrons` | e⁻ |
//! | bias | `bias_dn` | DN |
//!
//! Frame: pixels. Sources: domain.md 5.1, 11.3; R227.

use rand_distr::{Distribution, Poisson, StandardNormal};
use rand_pcg::Pcg32;
use rayon::prelude::*;

use crate::image::GrayImage;

use crate::sim::camera::render::{Eye, NoiseSeed};
use crate::sim::ground::texture::mix;
use crate::sim::scenario::{CameraSettings, Scenario};

/// The largest number of the 12-bit converter.
pub const FULL_SCALE_DN: f64 = 4095.0;

/// Records a clean picture whose first pixel is `first` of the whole picture.
pub fn expose(clean: &GrayImage, scenario: &Scenario, seed: NoiseSeed, first: [u32; 2]) -> GrayImage {
    let width = clean.width() as usize;
    let eye = match seed.eye {
        Eye::Left => 1,
        Eye::Right => 2,
    };
    let camera_key = mix(scenario.seed ^ mix(0xca3e_0000 + eye));
    let exposure_key = mix(camera_key ^ (u64::from(seed.step) + 1));
    let mut recorded = clean.clone();
    recorded.par_chunks_mut(width.max(1)).enumerate().for_each(|(y, line)| {
        for (x, value) in line.iter_mut().enumerate() {
            let place = ((u64::from(first[1]) + y as u64) << 32) | (u64::from(first[0]) + x as u64);
            let response = normal(&mut stream(camera_key, place)) * scenario.camera.response_spread;
            *value = record(f64::from(*value), response, &scenario.camera, &mut stream(exposure_key, place));
        }
    });
    recorded
}

/// The stream of random numbers of one pixel.
fn stream(key: u64, place: u64) -> Pcg32 {
    let state = mix(key ^ mix(place));
    Pcg32::new(state, mix(state))
}

fn normal(random: &mut Pcg32) -> f64 {
    StandardNormal.sample(random)
}

/// One pixel: its recorded value as a fraction of full scale.
fn record(level: f64, response: f64, camera: &CameraSettings, random: &mut Pcg32) -> f32 {
    let gain = camera.gain_electrons_per_dn;
    let electrons = (gain * (FULL_SCALE_DN * level - camera.bias_dn) * (1.0 + response)).max(0.0);
    let counted = Poisson::new(electrons).map_or(0.0, |poisson| poisson.sample(random));
    let read = counted + camera.read_noise_electrons * normal(random);
    let dn = (read / gain + camera.bias_dn).round().clamp(0.0, FULL_SCALE_DN);
    if camera.bit_depth == 8 {
        return ((dn * 255.0 / FULL_SCALE_DN).round() / 255.0) as f32;
    }
    (dn / FULL_SCALE_DN) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recorded(level: f32, change: impl Fn(&mut CameraSettings)) -> GrayImage {
        let mut scenario = Scenario::demo();
        scenario.camera.response_spread = 0.0;
        change(&mut scenario.camera);
        let clean = GrayImage::from_pixel(256, 256, image::Luma([level]));
        expose(&clean, &scenario, NoiseSeed { step: 3, eye: Eye::Left }, [0, 0])
    }

    fn mean_and_variance_dn(image: &GrayImage) -> (f64, f64) {
        let dn: Vec<f64> = image.pixels().map(|p| f64::from(p.0[0]) * FULL_SCALE_DN).collect();
        let mean = dn.iter().sum::<f64>() / dn.len() as f64;
        (mean, dn.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / dn.len() as f64)
    }

    #[test]
    fn variance_is_that_of_shot_and_read_noise() {
        for (level, gain, read) in
            [(0.05f32, 42.0, 30.0), (0.4, 42.0, 30.0), (0.8, 42.0, 30.0), (0.3, 8.0, 60.0)]
        {
            let image = recorded(level, |camera| {
                camera.gain_electrons_per_dn = gain;
                camera.read_noise_electrons = read;
            });
            let (mean, variance) = mean_and_variance_dn(&image);
            let level_dn = f64::from(level) * FULL_SCALE_DN;
            let expected = (level_dn - 20.0) / gain + (read / gain).powi(2) + 1.0 / 12.0;
            assert!((mean - level_dn).abs() < 5.0 * (expected / 65_536.0).sqrt(), "{mean} {level_dn}");
            assert!((variance / expected - 1.0).abs() < 0.05, "{variance} {expected}");
        }
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
    fn the_response_of_a_pixel_stays_from_one_exposure_to_the_next() {
        let scenario = Scenario::demo();
        let clean = GrayImage::from_pixel(256, 256, image::Luma([0.5]));
        let take = |step, eye| expose(&clean, &scenario, NoiseSeed { step, eye }, [0, 0]);
        let correlation = |a: &GrayImage, b: &GrayImage| {
            let (ma, va) = mean_and_variance_dn(a);
            let (mb, vb) = mean_and_variance_dn(b);
            let sum: f64 = (a.pixels().zip(b.pixels()))
                .map(|(p, q)| {
                    (f64::from(p.0[0]) * FULL_SCALE_DN - ma) * (f64::from(q.0[0]) * FULL_SCALE_DN - mb)
                })
                .sum();
            sum / 65_536.0 / (va * vb).sqrt()
        };
        let first = take(0, Eye::Left);
        // Response 1 % of 2028 DN against a shot and read noise of 7 DN.
        assert!(correlation(&first, &take(1, Eye::Left)) > 0.85);
        assert!(correlation(&first, &take(0, Eye::Right)).abs() < 0.02);
    }
}
