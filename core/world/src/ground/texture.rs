//! Seeded noise: the fine texture of soil and rock, and the coarse relief of the ground.
//!
//! Sums of octaves of value noise (`value_noise.rs`). Its first channel gives the albedo, its second a height whose
//! *gradient* tilts the shading normal: both come from one look-up. The sums follow a power law; every octave is rotated
//! and shifted differently so that no lattice shows.
//!
//! Octaves shorter than an image can resolve are faded out (`cutoff_m`), the rest is left to the sampling of the pixel
//! area (`render.rs`): `weight(λ) = smoothstep((λ − c)/c)`, 0 below c and 1 above 2c. Lattice coordinates are formed in
//! `f64` (1.5 mm cells tens of metres from the origin), those of many points at once partly in `f32` (`value_noise.rs`).
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | λ | `wavelength_m` | m: the lattice constant of an octave |
//! | c | `cutoff_m` | m: the shortest wavelength worth evaluating |
//!
//! Frames: soil is evaluated at (x, y) of the site frame, rock at a point relative to the rock's centre.
//! Sources: domain.md 10.4 (band-limited noise on rocks, fractal ground), 11.3 (anti-aliasing).

#![expect(
    clippy::needless_range_loop,
    reason = "plain loops over lanes become vectors, adaptors do not always"
)]

use std::f64::consts::TAU;

use crate::ground::value_noise::{Lattice, LatticeMap, Points, ValueNoise};

/// Number of points evaluated together: the samples of a pixel, and the lanes of the widest vector.
pub const LANES: usize = 16;

/// Mean of w² + (1 − w)² over a cell: the fraction of the lattice numbers' variance (1/3) that interpolation keeps.
const JOINED_VARIANCE: f64 = 2.0 * 181.0 / 462.0;
/// Standard deviation of one component of an octave's gradient over that of its value: sqrt(2 ∫w'² / I), with ∫w'² = 10/7
/// and I the fraction kept.
const SLOPE_OVER_VALUE: f64 = 1.9096;

/// Value of a sum of octaves at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureSample<const DIMENSIONS: usize> {
    /// Relative deviation of the albedo from its mean, without unit.
    pub albedo: f32,
    /// Gradient of the micro-relief in the frame of the argument, without unit (metres per metre).
    pub slope: [f32; DIMENSIONS],
}

/// Values of a sum of octaves at [`LANES`] points, by component and lane.
#[derive(Clone, Copy, Debug)]
pub struct TextureLanes<const DIMENSIONS: usize> {
    /// As in [`TextureSample`].
    pub albedo: [f32; LANES],
    /// As in [`TextureSample`].
    pub slope: [[f32; LANES]; DIMENSIONS],
}

/// Parameters of a sum of octaves.
#[derive(Clone, Copy, Debug)]
pub struct OctaveSettings {
    /// The longest wavelength, m.
    pub longest_m: f64,
    /// Lower limit of the wavelengths, m.
    pub shortest_m: f64,
    /// Ratio of neighbouring wavelengths, > 1.
    pub ratio: f64,
    /// Exponent h of the albedo's amplitude over wavelength: `a ∝ λ^h`.
    pub albedo_exponent: f64,
    /// Standard deviation of the albedo, relative, all octaves together.
    pub albedo_std: f64,
    /// Standard deviation of one component of the slope, all octaves together.
    pub slope_std: f64,
}

/// One octave: lattice coordinates are `lattice_from_site · p + shift`.
#[derive(Clone, Debug)]
struct Octave<const DIMENSIONS: usize> {
    wavelength_m: f32,
    lattice_from_site: LatticeMap<DIMENSIONS>,
    /// The same rotation without the scale, to transform gradients back.
    turn: [[f32; DIMENSIONS]; DIMENSIONS],
    seed: u32,
    albedo: f32,
    slope: f32,
}

/// A sum of octaves over the plane (`DIMENSIONS` = 2) or space (3).
#[derive(Clone, Debug)]
pub struct Octaves<const DIMENSIONS: usize> {
    octaves: Vec<Octave<DIMENSIONS>>,
}

/// Mixes 64 bits into 64 (the finaliser of SplitMix64); every seed of the simulator is derived by it.
pub const fn mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number in [0, 1) from a seed and an index, for parameters that need no random stream.
fn unit_interval(seed: u64, index: u64) -> f64 {
    (mix(mix(seed) ^ index) >> 11) as f64 / (1u64 << 53) as f64
}

/// The smallest of all lanes, found by halving, which vectorises.
#[inline(always)]
pub(crate) fn least<T: Copy + PartialOrd>(lanes: &[T; LANES]) -> T {
    let mut least = *lanes;
    let mut half = LANES / 2;
    while half > 0 {
        for lane in 0..half {
            least[lane] = if least[lane + half] < least[lane] { least[lane + half] } else { least[lane] };
        }
        half /= 2;
    }
    least[0]
}

/// Weight of an octave: 0 below the cutoff, 1 from twice the cutoff.
#[inline(always)]
pub(super) fn weight(wavelength_m: f32, cutoff_m: f32) -> f32 {
    let t = ((wavelength_m - cutoff_m) / cutoff_m).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

impl<const DIMENSIONS: usize> Octaves<DIMENSIONS> {
    /// The octaves of `settings`, seeded; amplitudes are scaled to the given standard deviations.
    pub fn new(settings: &OctaveSettings, seed: u64) -> Self {
        let std_of_one = octave_std(DIMENSIONS);
        let wavelengths_m: Vec<f64> =
            std::iter::successors(Some(settings.longest_m), |w| Some(w / settings.ratio))
                .take_while(|w| *w >= settings.shortest_m * 0.999)
                .collect();
        let amplitude = |w: f64| (w / settings.longest_m).powf(settings.albedo_exponent);
        let norm = wavelengths_m.iter().map(|w| amplitude(*w).powi(2)).sum::<f64>().sqrt();
        let slope =
            settings.slope_std / (SLOPE_OVER_VALUE * std_of_one * (wavelengths_m.len() as f64).sqrt());
        let octaves = wavelengths_m.iter().enumerate().map(|(index, &wavelength_m)| {
            let turn = turn::<DIMENSIONS>(seed, index as u64);
            let shift = std::array::from_fn(|k| 1000.0 * unit_interval(seed, (index * 8 + 4 + k) as u64));
            Octave {
                wavelength_m: wavelength_m as f32,
                lattice_from_site: LatticeMap::new(turn.map(|row| row.map(|v| v / wavelength_m)), shift),
                turn: turn.map(|row| row.map(|v| v as f32)),
                seed: mix(seed ^ (index as u64 + 17)) as u32,
                albedo: (settings.albedo_std * amplitude(wavelength_m) / (norm * std_of_one)) as f32,
                slope: slope as f32,
            }
        });
        Self { octaves: octaves.collect() }
    }
}

/// Standard deviation of one octave with unit amplitude.
fn octave_std(dimensions: usize) -> f64 {
    (JOINED_VARIANCE.powi(dimensions as i32) / 3.0).sqrt()
}

/// The rotation of an octave: any angle in the plane, any Euler angles in space.
fn turn<const DIMENSIONS: usize>(seed: u64, index: u64) -> [[f64; DIMENSIONS]; DIMENSIONS] {
    let angle_rad = |k: u64| TAU * unit_interval(seed, index * 8 + k);
    let rotation = if DIMENSIONS == 2 {
        nalgebra::Rotation3::from_euler_angles(0.0, 0.0, angle_rad(0))
    } else {
        nalgebra::Rotation3::from_euler_angles(angle_rad(0), angle_rad(1), angle_rad(2))
    };
    std::array::from_fn(|row| std::array::from_fn(|column| rotation.matrix()[(row, column)]))
}

impl<const DIMENSIONS: usize> Octave<DIMENSIONS>
where
    Lattice<DIMENSIONS>: ValueNoise<DIMENSIONS>,
{
    /// The octave's weighted contribution to the sum, from its noise.
    #[inline(always)]
    fn weighted(
        &self,
        (albedo, gradient): (f32, [f32; DIMENSIONS]),
        weight: f32,
    ) -> TextureSample<DIMENSIONS> {
        let mut slope = [0.0; DIMENSIONS];
        for k in 0..DIMENSIONS {
            for from in 0..DIMENSIONS {
                slope[k] += self.turn[from][k] * gradient[from];
            }
            slope[k] *= weight * self.slope;
        }
        TextureSample { albedo: weight * self.albedo * albedo, slope }
    }
}

impl<const DIMENSIONS: usize> Octaves<DIMENSIONS>
where
    Lattice<DIMENSIONS>: ValueNoise<DIMENSIONS>,
{
    /// The sum at a point, m, without octaves shorter than `cutoff_m`: (x, y) of the site, or relative to the rock's
    /// centre.
    #[inline(always)]
    pub fn at(&self, p_m: [f64; DIMENSIONS], cutoff_m: f32) -> TextureSample<DIMENSIONS> {
        let mut sum = TextureSample { albedo: 0.0, slope: [0.0; DIMENSIONS] };
        for octave in &self.octaves {
            let weight = weight(octave.wavelength_m, cutoff_m);
            if weight <= 0.0 {
                break;
            }
            let one = octave.weighted(Lattice::noise(octave.lattice_from_site.at(p_m), octave.seed), weight);
            sum.albedo += one.albedo;
            for k in 0..DIMENSIONS {
                sum.slope[k] += one.slope[k];
            }
        }
        sum
    }

    /// The sums at many points, each with its own cutoff. Equals [`Octaves::at`] up to the rounding of `f32` offsets and
    /// is many times as fast where the points are close together. Lanes without a point repeat the first.
    ///
    /// Plain loops over lanes, which the compiler vectorises as widely as the caller's target features allow.
    #[inline(always)]
    pub(crate) fn at_lanes(
        &self,
        points: &Points<DIMENSIONS>,
        cutoff_m: &[f32; LANES],
    ) -> TextureLanes<DIMENSIONS> {
        let mut sum = TextureLanes { albedo: [0.0; LANES], slope: [[0.0; LANES]; DIMENSIONS] };
        let finest_m = least(cutoff_m);
        for octave in &self.octaves {
            if octave.wavelength_m <= finest_m {
                break;
            }
            let mut weights = [0.0; LANES];
            for lane in 0..LANES {
                weights[lane] = weight(octave.wavelength_m, cutoff_m[lane]);
            }
            let cells = octave.lattice_from_site.cells(points);
            if cells.is_one {
                let corners = Lattice::corners(cells.cell(0), octave.seed);
                for lane in 0..LANES {
                    let noise = Lattice::join(&corners, cells.part(lane));
                    sum.add(lane, &octave.weighted(noise, weights[lane]));
                }
            } else {
                for lane in 0..LANES {
                    let corners = Lattice::corners(cells.cell(lane), octave.seed);
                    let noise = Lattice::join(&corners, cells.part(lane));
                    sum.add(lane, &octave.weighted(noise, weights[lane]));
                }
            }
        }
        sum
    }
}

impl<const DIMENSIONS: usize> TextureLanes<DIMENSIONS> {
    #[inline(always)]
    fn add(&mut self, lane: usize, one: &TextureSample<DIMENSIONS>) {
        self.albedo[lane] += one.albedo;
        for k in 0..DIMENSIONS {
            self.slope[k][lane] += one.slope[k];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn std_of(values: &[f64]) -> f64 {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
    }

    #[test]
    fn one_octave_has_the_stated_standard_deviation() {
        let walk = |k: usize| (k as f64 * 0.754_877_666, k as f64 * 0.569_840_291);
        let plane: Vec<f64> =
            (0..400_000).map(|k| f64::from(Lattice::noise([walk(k).0, walk(k).1], 3).0)).collect();
        let space: Vec<f64> = (0..400_000)
            .map(|k| f64::from(Lattice::noise([walk(k).0, walk(k).1, k as f64 * 0.4301], 3).0))
            .collect();
        assert!((std_of(&plane) / octave_std(2) - 1.0).abs() < 0.01, "{}", std_of(&plane));
        assert!((std_of(&space) / octave_std(3) - 1.0).abs() < 0.01, "{}", std_of(&space));
    }

    #[test]
    fn the_sum_has_the_stated_albedo_and_slope() {
        let settings = OctaveSettings {
            longest_m: 0.4,
            shortest_m: 0.0015,
            ratio: 2.0,
            albedo_exponent: 0.2,
            albedo_std: 0.12,
            slope_std: 0.2,
        };
        let (plane, space) = (Octaves::<2>::new(&settings, 5), Octaves::<3>::new(&settings, 5));
        let (mut soil, mut rock) = (Vec::new(), Vec::new());
        let (mut soil_slope, mut rock_slope) = (Vec::new(), Vec::new());
        for k in 0..200_000 {
            let (x, y) = (f64::from(k) * 0.003_71, f64::from(k % 997) * 0.0131);
            let (s, r) = (plane.at([x, y], 1e-4), space.at([x, y, x * 0.31], 1e-4));
            soil.push(f64::from(s.albedo));
            rock.push(f64::from(r.albedo));
            soil_slope.push(f64::from(s.slope[0]));
            rock_slope.push(f64::from(r.slope[2]));
        }
        for albedo in [soil, rock] {
            assert!((std_of(&albedo) / 0.12 - 1.0).abs() < 0.1, "{}", std_of(&albedo));
        }
        for slope in [soil_slope, rock_slope] {
            assert!((std_of(&slope) / 0.2 - 1.0).abs() < 0.15, "{}", std_of(&slope));
        }
    }

    #[test]
    fn many_points_at_once_are_as_one_after_another() {
        let settings = OctaveSettings {
            longest_m: 0.4,
            shortest_m: 0.0015,
            ratio: 2.1,
            albedo_exponent: 0.2,
            albedo_std: 0.12,
            slope_std: 0.2,
        };
        let (plane, space) = (Octaves::<2>::new(&settings, 5), Octaves::<3>::new(&settings, 5));
        for k in 0..200 {
            let axis = |by: f64| -> [f64; LANES] { std::array::from_fn(|n| by * (16 * k + n) as f64 - 7.0) };
            let (x, y, z) = (axis(0.003_71), axis(0.0131), axis(-0.0007));
            // Some lanes include all octaves, some none.
            let cutoff_m: [f32; LANES] = std::array::from_fn(|n| 1e-4 * 1.9f32.powi(n as i32));
            let (soil, rock) = (
                plane.at_lanes(&Points::new(&[x, y]), &cutoff_m),
                space.at_lanes(&Points::new(&[x, y, z]), &cutoff_m),
            );
            for n in 0..LANES {
                let one = plane.at([x[n], y[n]], cutoff_m[n]);
                assert!((one.albedo - soil.albedo[n]).abs() < 2e-5, "{}", one.albedo - soil.albedo[n]);
                assert!((0..2).all(|k| (one.slope[k] - soil.slope[k][n]).abs() < 2e-4));
                let one = space.at([x[n], y[n], z[n]], cutoff_m[n]);
                assert!((one.albedo - rock.albedo[n]).abs() < 2e-5, "{}", one.albedo - rock.albedo[n]);
                assert!((0..3).all(|k| (one.slope[k] - rock.slope[k][n]).abs() < 2e-4));
            }
        }
    }
}
