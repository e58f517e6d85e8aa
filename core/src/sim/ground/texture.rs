//! Seeded noise: the fine texture of soil and rock, and the coarse relief of the ground.
//!
//! Value noise: a hash gives every lattice point two independent numbers in [−1, 1] (16 bits each), which
//! are joined by the quintic `w(t) = t³(6t² − 15t + 10)`, so that value and slope are continuous. The first
//! number makes the albedo, the second a height whose *gradient* tilts the shading normal: both come from
//! one look-up. Sums of octaves follow a power law; every octave is turned and shifted by its own amount so
//! that no lattice shows. Nothing repeats, because the hash takes full 32-bit lattice coordinates.
//!
//! Octaves shorter than what a picture can resolve are faded out (`cutoff_m`), the rest is left to the
//! sampling of the pixel area (`render.rs`): `weight(λ) = smoothstep((λ − c)/c)`, 0 below c and 1 above 2c.
//! Lattice coordinates are formed in `f64` (1.5 mm cells tens of metres from the origin), the rest in `f32`.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | λ | `wavelength_m` | m: the lattice constant of an octave |
//! | c | `cutoff_m` | m: the shortest wavelength worth evaluating |
//!
//! Frames: soil is evaluated at (x, y) of the site frame, rock at a point relative to the rock's centre.
//! Sources: domain.md 10.4 (band-limited noise on rocks, fractal ground), 11.3 (anti-aliasing).

use std::f64::consts::TAU;

/// Mean of w² + (1 − w)² over a cell: what joining two lattice numbers keeps of their variance, 1/3.
const JOINED_VARIANCE: f64 = 2.0 * 181.0 / 462.0;
/// Standard deviation of one component of an octave's gradient over that of its value: sqrt(2 ∫w'² / I),
/// with ∫w'² = 10/7 and I the variance kept.
const SLOPE_OVER_VALUE: f64 = 1.9096;

/// What a sum of octaves gives at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureSample<const DIMENSIONS: usize> {
    /// Relative deviation of the albedo from its mean, without unit.
    pub albedo: f32,
    /// Gradient of the micro-relief in the frame of the argument, without unit (metres per metre).
    pub slope: [f32; DIMENSIONS],
}

/// How a sum of octaves is made.
#[derive(Clone, Copy, Debug)]
pub struct OctaveSettings {
    /// The longest wavelength, m.
    pub longest_m: f64,
    /// No octave is shorter than this, m.
    pub shortest_m: f64,
    /// Ratio of neighbouring wavelengths, > 1.
    pub ratio: f64,
    /// Exponent of the albedo's amplitude over wavelength: `a ∝ λ^h`.
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
    lattice_from_site: [[f64; DIMENSIONS]; DIMENSIONS],
    /// The same turn without the scale, for taking gradients back.
    turn: [[f32; DIMENSIONS]; DIMENSIONS],
    shift: [f64; DIMENSIONS],
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

/// A number in [0, 1) from a seed and an index, for settings that need no stream of randomness.
fn unit_interval(seed: u64, index: u64) -> f64 {
    (mix(mix(seed) ^ index) >> 11) as f64 / (1u64 << 53) as f64
}

/// Avalanche of 32 bits.
#[inline(always)]
fn scramble(mut h: u32) -> u32 {
    h ^= h >> 16;
    h = h.wrapping_mul(0x7feb_352d);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846c_a68b);
    h ^ (h >> 16)
}

/// The two numbers of a lattice point, each in [−1, 1].
#[inline(always)]
fn channels(h: u32) -> (f32, f32) {
    const SCALE: f32 = 2.0 / 65535.0;
    ((h & 0xffff) as f32 * SCALE - 1.0, (h >> 16) as f32 * SCALE - 1.0)
}

/// The quintic and its derivative.
#[inline(always)]
fn fade(t: f32) -> (f32, f32) {
    (t * t * t * (t * (t * 6.0 - 15.0) + 10.0), 30.0 * t * t * (t * (t - 2.0) + 1.0))
}

/// Splits a lattice coordinate into its integer, of which the last 32 bits count, and its fraction in [0, 1).
#[inline(always)]
fn split(coordinate: f64) -> (u32, f32) {
    // 64 bits hold the millimetres of the horizon, where a ray along the plain may end.
    let whole = coordinate as i64;
    let whole = if whole as f64 > coordinate { whole.wrapping_sub(1) } else { whole };
    (whole as u32, (coordinate - whole as f64) as f32)
}

/// A hash of the lattice cell that holds a point, and the position in the cell, 0 to 1.
#[inline(always)]
pub(super) fn cell_hash<const DIMENSIONS: usize>(
    lattice: [f64; DIMENSIONS],
    seed: u32,
) -> (u32, [f32; DIMENSIONS]) {
    let mut hash = seed;
    let place = std::array::from_fn(|k| {
        let (whole, part) = split(lattice[k]);
        hash = scramble(hash ^ whole.wrapping_mul(PRIME[k % PRIME.len()]));
        part
    });
    (hash, place)
}

const PRIME: [u32; 3] = [0x9e37_79b1, 0x85eb_ca77, 0xc2b2_ae3d];

/// One octave of two-dimensional noise: value of the first channel, gradient of the second.
#[inline(always)]
fn value_noise_2d(x: f64, y: f64, seed: u32) -> (f32, [f32; 2]) {
    let ((ix, fx), (iy, fy)) = (split(x), split(y));
    let ((wx, dx), (wy, dy)) = (fade(fx), fade(fy));
    let (x0, y0) = (ix.wrapping_mul(PRIME[0]) ^ seed, iy.wrapping_mul(PRIME[1]));
    let (x1, y1) = (ix.wrapping_add(1).wrapping_mul(PRIME[0]) ^ seed, y0.wrapping_add(PRIME[1]));
    let (a00, b00) = channels(scramble(x0 ^ y0));
    let (a10, b10) = channels(scramble(x1 ^ y0));
    let (a01, b01) = channels(scramble(x0 ^ y1));
    let (a11, b11) = channels(scramble(x1 ^ y1));
    let (near, far) = (a00 + wx * (a10 - a00), a01 + wx * (a11 - a01));
    let (bump_near, bump_far) = (b00 + wx * (b10 - b00), b01 + wx * (b11 - b01));
    let along_x = dx * ((b10 - b00) + wy * ((b11 - b01) - (b10 - b00)));
    (near + wy * (far - near), [along_x, dy * (bump_far - bump_near)])
}

/// One octave of three-dimensional noise: value of the first channel, gradient of the second.
#[inline(always)]
fn value_noise_3d(p: [f64; 3], seed: u32) -> (f32, [f32; 3]) {
    let ((ix, fx), (iy, fy), (iz, fz)) = (split(p[0]), split(p[1]), split(p[2]));
    let ((wx, dx), (wy, dy), (wz, dz)) = (fade(fx), fade(fy), fade(fz));
    let x0 = ix.wrapping_mul(PRIME[0]) ^ seed;
    let x1 = ix.wrapping_add(1).wrapping_mul(PRIME[0]) ^ seed;
    let y0 = iy.wrapping_mul(PRIME[1]);
    let y1 = y0.wrapping_add(PRIME[1]);
    let z0 = iz.wrapping_mul(PRIME[2]);
    let z1 = z0.wrapping_add(PRIME[2]);
    // Per edge along x: the value of channel a, the value of channel b and b's difference.
    let edge = |y: u32, z: u32| {
        let (a0, b0) = channels(scramble(x0 ^ y ^ z.rotate_left(7)));
        let (a1, b1) = channels(scramble(x1 ^ y ^ z.rotate_left(7)));
        (a0 + wx * (a1 - a0), b0 + wx * (b1 - b0), b1 - b0)
    };
    let (e00, e10, e01, e11) = (edge(y0, z0), edge(y1, z0), edge(y0, z1), edge(y1, z1));
    let lerp = |a: f32, b: f32, w: f32| a + w * (b - a);
    let albedo = lerp(lerp(e00.0, e10.0, wy), lerp(e01.0, e11.0, wy), wz);
    let slope_x = dx * lerp(lerp(e00.2, e10.2, wy), lerp(e01.2, e11.2, wy), wz);
    let slope_y = dy * lerp(e10.1 - e00.1, e11.1 - e01.1, wz);
    let slope_z = dz * (lerp(e01.1, e11.1, wy) - lerp(e00.1, e10.1, wy));
    (albedo, [slope_x, slope_y, slope_z])
}

/// How much of an octave is left above the cutoff: 0 below it, 1 from twice the cutoff.
#[inline(always)]
pub(super) fn weight(wavelength_m: f32, cutoff_m: f32) -> f32 {
    let t = ((wavelength_m - cutoff_m) / cutoff_m).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

impl<const DIMENSIONS: usize> Octaves<DIMENSIONS> {
    /// The octaves of `settings`, seeded; amplitudes are scaled to the stated standard deviations.
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
            Octave {
                wavelength_m: wavelength_m as f32,
                lattice_from_site: turn.map(|row| row.map(|v| v / wavelength_m)),
                turn: turn.map(|row| row.map(|v| v as f32)),
                shift: std::array::from_fn(|k| 1000.0 * unit_interval(seed, (index * 8 + 4 + k) as u64)),
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

impl Octaves<2> {
    /// The sum at (x, y), metres of the site frame, without octaves shorter than `cutoff_m`.
    #[inline(always)]
    pub fn at(&self, x_m: f64, y_m: f64, cutoff_m: f32) -> TextureSample<2> {
        let mut sum = TextureSample { albedo: 0.0, slope: [0.0; 2] };
        for octave in &self.octaves {
            let weight = weight(octave.wavelength_m, cutoff_m);
            if weight <= 0.0 {
                break;
            }
            let m = &octave.lattice_from_site;
            let u = m[0][0] * x_m + m[0][1] * y_m + octave.shift[0];
            let v = m[1][0] * x_m + m[1][1] * y_m + octave.shift[1];
            let (albedo, g) = value_noise_2d(u, v, octave.seed);
            sum.albedo += weight * octave.albedo * albedo;
            let (slope, r) = (weight * octave.slope, &octave.turn);
            sum.slope[0] += slope * (r[0][0] * g[0] + r[1][0] * g[1]);
            sum.slope[1] += slope * (r[0][1] * g[0] + r[1][1] * g[1]);
        }
        sum
    }
}

impl Octaves<3> {
    /// The sum at a point relative to the rock's centre, m, without octaves shorter than `cutoff_m`.
    #[inline(always)]
    pub fn at(&self, p_m: [f64; 3], cutoff_m: f32) -> TextureSample<3> {
        let mut sum = TextureSample { albedo: 0.0, slope: [0.0; 3] };
        for octave in &self.octaves {
            let weight = weight(octave.wavelength_m, cutoff_m);
            if weight <= 0.0 {
                break;
            }
            let m = &octave.lattice_from_site;
            let lattice: [f64; 3] = std::array::from_fn(|k| {
                m[k][0] * p_m[0] + m[k][1] * p_m[1] + m[k][2] * p_m[2] + octave.shift[k]
            });
            let (albedo, g) = value_noise_3d(lattice, octave.seed);
            sum.albedo += weight * octave.albedo * albedo;
            let (slope, r) = (weight * octave.slope, &octave.turn);
            for (k, sum) in sum.slope.iter_mut().enumerate() {
                *sum += slope * (r[0][k] * g[0] + r[1][k] * g[1] + r[2][k] * g[2]);
            }
        }
        sum
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
    fn coordinates_split_into_floor_and_fraction_as_far_as_the_horizon() {
        for (coordinate, whole, fraction) in
            [(2.25, 2u32, 0.25), (-0.75, u32::MAX, 0.25), (-3.0, -3i32 as u32, 0.0)]
        {
            assert_eq!(split(coordinate), (whole, fraction));
        }
        // 2^40 lattice cells away only the fraction's bits are fewer.
        let far = -((1i64 << 40) as f64) - 0.25;
        assert_eq!(split(far), ((-(1i64 << 40) - 1) as u32, 0.75));
    }

    #[test]
    fn one_octave_has_the_stated_standard_deviation() {
        let walk = |k: usize| (k as f64 * 0.754_877_666, k as f64 * 0.569_840_291);
        let plane: Vec<f64> =
            (0..400_000).map(|k| f64::from(value_noise_2d(walk(k).0, walk(k).1, 3).0)).collect();
        let space: Vec<f64> = (0..400_000)
            .map(|k| f64::from(value_noise_3d([walk(k).0, walk(k).1, k as f64 * 0.4301], 3).0))
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
            let (s, r) = (plane.at(x, y, 1e-4), space.at([x, y, x * 0.31], 1e-4));
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
    fn slopes_are_the_gradient_of_the_second_channel() {
        // The second channel's value is read off by integrating its gradient between lattice points,
        // where it must equal the difference of the lattice's own numbers.
        let integral: f64 = (0..20_000)
            .map(|k| f64::from(value_noise_2d((f64::from(k) + 0.5) / 20_000.0 + 4.0, 7.0, 9).1[0]) / 20_000.0)
            .sum();
        let lattice = |ix: u32, iy: u32| {
            channels(scramble((ix.wrapping_mul(PRIME[0]) ^ 9) ^ iy.wrapping_mul(PRIME[1]))).1
        };
        assert!((integral - f64::from(lattice(5, 7) - lattice(4, 7))).abs() < 1e-4);
    }
}
