//! The detector: from the electrons of an image to its recorded numbers.
//!
//! ```text
//! S   = light · (1 + response) + smear + dark                     electrons (`exposure.rs`)
//! N   = min(Poisson(S), full well) + Normal(0, σ_read)
//! DN  = clip(round(N/g + bias), 0, 4095),       value = DN/4095                          12 bit
//! DN8 = round(DN · 255/4095),                   value = DN8/255                          8 bit, linear
//! DN8 = round(255 √(DN/4095)),                  value = round(4095 (DN8/255)²)/4095      8 bit, square root
//! ```
//!
//! The last line's inverse keeps the recorded value linear in the light, as ground products do (ILF): shot
//! noise then has about the same width in DN8 everywhere, and steps of the value grow with the light.
//!
//! `response` is a pixel's own deviation, Gaussian and fixed for each camera of a scenario, while the scene moves over it
//! from stop to stop. It follows the scenario's seed; shot and read noise follow `noise_seed`.
//! Var(DN) = S/g² + (σ_read/g)² + 1/12 for a fixed scene without `response`, so the slope of the variance over
//! the mean is 1/g.
//!
//! Each pixel has its own random stream, seeded by (seed, step, eye, position), so that the noise of a region equals that
//! of the whole image for any number of threads.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | g | `gain_electrons_per_dn` | e⁻/DN |
//! | σ_read | `read_noise_electrons` | e⁻ |
//! | full well | `full_well_electrons` | e⁻ |
//! | bias | `bias_dn` | DN |
//!
//! Frame: pixels. Sources: domain.md 5.1, 5.3, 11.3; R227.

use rand_distr::{Distribution, Poisson, StandardNormal};
use rand_pcg::Pcg32;
use rayon::prelude::*;

use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_vision::image::GrayImage;

use crate::camera::exposure::Rates;
use crate::camera::picture::NoiseSeed;
use crate::ground::texture::mix;
use crate::scenario::{CameraSettings, FULL_SCALE_DN, Quantisation, Scenario};

/// Largest output of the 8-bit conversion.
const BYTE_DN: f64 = 255.0;

/// Records what an image collects in `time_s`; `first` is its first pixel in the whole image. Cancellable.
pub(crate) fn record(
    rates: &Rates,
    scenario: &Scenario,
    time_s: f64,
    seed: NoiseSeed,
    first: [u32; 2],
    cancel: Cancel<'_>,
) -> Result<GrayImage> {
    let camera = &scenario.camera;
    let key_of = |seed_of_key: u64| mix(seed_of_key ^ mix(0xca3e_0000 + seed.eye.number()));
    let response_key = key_of(scenario.seed);
    let noise_key = mix(key_of(camera.noise_seed.unwrap_or(scenario.seed)) ^ (u64::from(seed.step) + 1));
    let mut recorded = rates.per_s().clone();
    let width = recorded.width().max(1) as usize;
    recorded.par_chunks_mut(width).enumerate().try_for_each(|(y, line)| {
        cancel.check()?;
        for (x, value) in line.iter_mut().enumerate() {
            let place = ((u64::from(first[1]) + y as u64) << 32) | (u64::from(first[0]) + x as u64);
            let response = normal(&mut stream(response_key, place)) * camera.response_spread;
            let light = f64::from(*value) * time_s * (1.0 + response);
            let electrons = light.max(0.0) + rates.others(x, time_s, camera);
            let dn = converted(electrons, camera, &mut stream(noise_key, place));
            *value = quantised(dn, camera);
        }
        Ok(())
    })?;
    Ok(recorded)
}

/// The random stream of one pixel.
fn stream(key: u64, place: u64) -> Pcg32 {
    let state = mix(key ^ mix(place));
    Pcg32::new(state, mix(state))
}

fn normal(random: &mut Pcg32) -> f64 {
    StandardNormal.sample(random)
}

/// Rounded output of the 12-bit converter for a mean charge, DN.
fn converted(electrons: f64, camera: &CameraSettings, random: &mut Pcg32) -> f64 {
    let counted = Poisson::new(electrons).map_or(0.0, |poisson| poisson.sample(random));
    let read = counted.min(camera.full_well_electrons) + camera.read_noise_electrons * normal(random);
    (read / camera.gain_electrons_per_dn + camera.bias_dn).round().clamp(0.0, FULL_SCALE_DN)
}

/// The recorded value for a 12-bit DN, fraction of full scale.
fn quantised(dn: f64, camera: &CameraSettings) -> f32 {
    let level = dn / FULL_SCALE_DN;
    let value = match (camera.bit_depth, camera.quantisation) {
        (8, Quantisation::Linear) => (level * BYTE_DN).round() / BYTE_DN,
        (8, Quantisation::SquareRoot) => {
            let byte = (level.sqrt() * BYTE_DN).round() / BYTE_DN;
            (byte * byte * FULL_SCALE_DN).round() / FULL_SCALE_DN
        }
        _ => level,
    };
    value as f32
}

#[cfg(test)]
#[path = "noise_tests.rs"]
mod tests;
