//! The relief of the ground: a fractal of given roughness, and sand ripples on it.
//!
//! **Fractal.** Octaves of value noise with amplitude ∝ λ^H, so that the RMS difference of height grows as distance^H
//! (domain.md 10.4: H = 0.8, 2 cm at 1 m). The sum is scaled by its own expected RMS difference at 1 m, computed and not
//! fitted: an octave of wavelength λ and variance σ² contributes `2σ² (1 − ρ(1 m/λ))`, with the correlation ρ of value
//! noise, `ρ(s) = mean over angle of c(s cos) c(s sin)`, where c(s) is that of value noise along a line between points s
//! lattice constants apart. So the given roughness holds for every cell size, exponent and longest wavelength; ripples are
//! added to it.
//!
//! Each missing octave above the longest wavelength would act like a tilt over a short distance and contribute λ^{2H−2}: a
//! geometric series with ratio q = 1.8^{2H−2} and sum q/(1 − q), without which the power law would flatten. For H < 1 one
//! more octave of the longest wavelength, the swell, has this variance.
//!
//! **Ripples.** `z = −h/2 · m · p(2π s/λ_r + φ)`, s along the ripples' azimuth, `p(x) = cos x + cos(2x)/4`: sharp crests,
//! flat troughs, h from trough to crest. The phase φ is noise of 1.6 rad (1σ) over four to eight wavelengths, which makes
//! crests wind and meet; m is noise about 1 within 0.4 and 1.6 that leaves gaps. The ripples are not strictly periodic.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | λ, H | wavelength, `hurst` | m, – |
//! | h, λ_r | `ripple_height_m`, `ripple_wavelength_m` | m |
//!
//! Frame: site; heights down, relative to the mean plane. Sources: domain.md 10.4; ripples are ours.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::ground::texture::{OctaveSettings, Octaves, mix};
use crate::scenario::TerrainSettings;

/// Ratio of neighbouring wavelengths of the fractal.
const RATIO: f64 = 1.8;
/// 1σ of the ripples' phase, rad.
const PHASE_STD_RAD: f64 = 1.6;

/// Heights relative to the mean plane, positive down.
pub(super) struct Relief {
    fractal: Octaves<2>,
    swell: Octaves<2>,
    amplitude_m: f64,
    ripples: Option<Ripples>,
}

struct Ripples {
    /// cos and sin of the azimuth over the wavelength, 1/m.
    waves_per_m: [f64; 2],
    half_height_m: f64,
    phase: Octaves<2>,
    strength: Octaves<2>,
}

impl Relief {
    /// Builds the relief from its settings.
    pub(super) fn new(settings: &TerrainSettings, seed: u64) -> Self {
        let octaves = fractal_octaves(settings);
        let amplitude_m = settings.rms_at_1m_m / rms_difference(&octaves, 1.0);
        let swell = OctaveSettings {
            shortest_m: octaves.longest_m,
            albedo_std: swell_variance(&octaves).sqrt(),
            ..octaves
        };
        let swell = Octaves::new(&swell, mix(seed ^ 0x53e1_1000));
        let fractal = Octaves::new(&octaves, mix(seed ^ 0x7e44_a170));
        let ripples = (settings.ripple_height_m > 0.0).then(|| Ripples::new(settings, seed));
        Self { fractal, swell, amplitude_m, ripples }
    }

    /// z of the relief at a point relative to the mean plane, m, positive down.
    pub(super) fn z_m(&self, x_m: f64, y_m: f64) -> f64 {
        let noise =
            [&self.fractal, &self.swell].map(|octaves| f64::from(octaves.at([x_m, y_m], 1e-6).albedo));
        let ripples_m = self.ripples.as_ref().map_or(0.0, |ripples| ripples.z_m(x_m, y_m));
        self.amplitude_m * (noise[0] + noise[1]) + ripples_m
    }
}

impl Ripples {
    fn new(settings: &TerrainSettings, seed: u64) -> Self {
        let wavelength_m = settings.ripple_wavelength_m;
        let (sin, cos) = settings.ripple_azimuth_deg.to_radians().sin_cos();
        let noise = |longest_m: f64, std: f64, salt: u64| {
            let settings = OctaveSettings {
                longest_m,
                shortest_m: 0.49 * longest_m,
                ratio: 2.0,
                albedo_exponent: 1.0,
                albedo_std: std,
                slope_std: 0.0,
            };
            Octaves::new(&settings, mix(seed ^ salt))
        };
        Self {
            waves_per_m: [cos / wavelength_m, sin / wavelength_m],
            half_height_m: 0.5 * settings.ripple_height_m,
            phase: noise(8.0 * wavelength_m, PHASE_STD_RAD, 0x0071_bb1e),
            strength: noise(6.0 * wavelength_m, 0.3, 0x5712_e467),
        }
    }

    fn z_m(&self, x_m: f64, y_m: f64) -> f64 {
        let phase_rad = f64::from(self.phase.at([x_m, y_m], 1e-6).albedo);
        let strength = 1.0 + f64::from(self.strength.at([x_m, y_m], 1e-6).albedo).clamp(-0.6, 0.6);
        let angle_rad = TAU * (self.waves_per_m[0] * x_m + self.waves_per_m[1] * y_m) + phase_rad;
        -self.half_height_m * strength * (angle_rad.cos() + 0.25 * (2.0 * angle_rad).cos())
    }
}

/// The octaves of the fractal, with unit standard deviation in total.
fn fractal_octaves(settings: &TerrainSettings) -> OctaveSettings {
    let shortest_m = 3.0 * settings.cell_m;
    OctaveSettings {
        longest_m: settings.longest_wavelength_m.max(shortest_m),
        shortest_m,
        ratio: RATIO,
        albedo_exponent: settings.hurst,
        albedo_std: 1.0,
        slope_std: 0.0,
    }
}

/// The wavelengths of the octaves, m, and their variances relative to that of the longest one.
fn variances(octaves: &OctaveSettings) -> impl Iterator<Item = (f64, f64)> {
    let OctaveSettings { longest_m, shortest_m, ratio, albedo_exponent, .. } = *octaves;
    std::iter::successors(Some(longest_m), move |w| Some(w / ratio))
        .take_while(move |w| *w >= shortest_m * 0.999)
        .map(move |w| (w, (w / longest_m).powf(2.0 * albedo_exponent)))
}

/// Variance of the swell for unit variance of all octaves together (header).
fn swell_variance(octaves: &OctaveSettings) -> f64 {
    let q = octaves.ratio.powf(2.0 * octaves.albedo_exponent - 2.0);
    if q >= 0.999 {
        return 0.0;
    }
    q / (1.0 - q) / variances(octaves).map(|(_, variance)| variance).sum::<f64>()
}

/// Expected RMS difference of the fractal between points `distance_m` apart, for unit variance of all octaves together.
fn rms_difference(octaves: &OctaveSettings, distance_m: f64) -> f64 {
    let all: f64 = variances(octaves).map(|(_, variance)| variance).sum();
    let part =
        |wavelength_m: f64, variance: f64| 2.0 * variance * (1.0 - correlation(distance_m / wavelength_m));
    let octaves_sum: f64 =
        variances(octaves).map(|(wavelength_m, variance)| part(wavelength_m, variance / all)).sum();
    (octaves_sum + part(octaves.longest_m, swell_variance(octaves))).sqrt()
}

/// Correlation of two-dimensional value noise between points `s` lattice constants apart, over all directions.
fn correlation(s: f64) -> f64 {
    const ANGLES: u32 = 32;
    let variance = along_line(0.0).powi(2);
    let sum: f64 = (0..ANGLES)
        .map(|k| (f64::from(k) + 0.5) / f64::from(ANGLES) * FRAC_PI_2)
        .map(|angle| along_line(s * angle.cos()) * along_line(s * angle.sin()))
        .sum();
    sum / f64::from(ANGLES) / variance
}

/// Mean overlap of the interpolation weights of two points `s` ≥ 0 lattice constants apart on a line.
fn along_line(s: f64) -> f64 {
    const STEPS: u32 = 128;
    let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let sum: f64 = (0..STEPS)
        .map(|k| {
            let f = (f64::from(k) + 0.5) / f64::from(STEPS);
            let (w, cell, g) = (fade(f), (f + s).floor(), fade(f + s - (f + s).floor()));
            if cell == 0.0 {
                (1.0 - w) * (1.0 - g) + w * g
            } else if cell == 1.0 {
                w * (1.0 - g)
            } else {
                0.0
            }
        })
        .sum();
    sum / f64::from(STEPS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RMS difference over `distance_m`, over many seeds, points and directions.
    fn measured(settings: &TerrainSettings, distance_m: f64) -> f64 {
        let (mut sum, mut count) = (0.0f64, 0.0);
        for seed in 0..60 {
            let relief = Relief::new(settings, seed);
            for k in 0..400 {
                let (x, y) = (f64::from(k % 20) * 1.71, f64::from(k / 20) * 1.83);
                let angle = 2.4 * f64::from(k);
                let there = relief.z_m(x + distance_m * angle.cos(), y + distance_m * angle.sin());
                sum += (there - relief.z_m(x, y)).powi(2);
                count += 1.0;
            }
        }
        (sum / count).sqrt()
    }

    #[test]
    fn the_stated_roughness_holds_for_every_cell_exponent_and_longest_wavelength() {
        let base = TerrainSettings::default();
        for settings in [
            base,
            TerrainSettings { hurst: 0.5, cell_m: 0.05, ..base },
            TerrainSettings { hurst: 1.1, longest_wavelength_m: 2.0, cell_m: 0.1, ..base },
        ] {
            let rms_m = measured(&settings, 1.0);
            // 24 000 differences in worlds of a few waves each: the scatter of the estimate itself is about 1 %.
            assert!((rms_m / 0.02 - 1.0).abs() < 0.03, "{settings:?}: {rms_m}");
        }
    }

    #[test]
    fn the_difference_grows_with_the_stated_exponent() {
        let settings = TerrainSettings::default();
        let exponent = (measured(&settings, 1.0) / measured(&settings, 0.12)).ln() / (1.0f64 / 0.12).ln();
        assert!((exponent - 0.8).abs() < 0.06, "{exponent}");
    }

    #[test]
    fn ripples_have_their_height_and_wavelength_and_do_not_repeat() {
        let settings = TerrainSettings {
            rms_at_1m_m: 0.0,
            ripple_height_m: 0.03,
            ripple_wavelength_m: 0.5,
            ripple_azimuth_deg: 30.0,
            ..TerrainSettings::default()
        };
        let relief = Relief::new(&settings, 4);
        let (sin, cos) = 30f64.to_radians().sin_cos();
        let line: Vec<f64> =
            (0..20_000).map(|k| relief.z_m(f64::from(k) * 5e-3 * cos, f64::from(k) * 5e-3 * sin)).collect();
        // Crests are tops (smallest z); the line is 100 m long.
        let crests: Vec<usize> =
            (1..line.len() - 1).filter(|&k| line[k] < line[k - 1] && line[k] <= line[k + 1]).collect();
        assert!((crests.len() as f64 / 200.0 - 1.0).abs() < 0.03, "{}", crests.len());
        let spacings: Vec<f64> = crests.windows(2).map(|pair| (pair[1] - pair[0]) as f64 * 5e-3).collect();
        let spread = spacings.iter().map(|s| (s - 0.5).powi(2)).sum::<f64>() / spacings.len() as f64;
        assert!(spread.sqrt() > 0.02, "{}", spread.sqrt());
        let heights: Vec<f64> = line
            .chunks(200)
            .map(|part| {
                part.iter().fold(f64::MIN, |a, b| a.max(*b)) - part.iter().fold(f64::MAX, |a, b| a.min(*b))
            })
            .collect();
        let mean = heights.iter().sum::<f64>() / heights.len() as f64;
        assert!((mean / 0.03 - 1.0).abs() < 0.15, "{mean}");
        // Along the crests the height varies slowly.
        let along = (0..2000).map(|k| relief.z_m(-f64::from(k) * 5e-3 * sin, f64::from(k) * 5e-3 * cos));
        let along: Vec<f64> = along.collect();
        let steepest = along.windows(2).map(|pair| (pair[1] - pair[0]).abs() / 5e-3).fold(0.0, f64::max);
        let across = line.windows(2).map(|pair| (pair[1] - pair[0]).abs() / 5e-3).fold(0.0, f64::max);
        assert!(steepest < 0.6 * across, "{steepest} {across}");
    }
}
