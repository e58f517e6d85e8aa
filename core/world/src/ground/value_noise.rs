//! Value noise over a lattice: hashes of full coordinates, joined smoothly.
//!
//! A hash gives every lattice point two independent numbers in [−1, 1] (16 bits each), which are joined by the
//! quintic `w(t) = t³(6t² − 15t + 10)`, so that value and slope are continuous. Of the first the *value* is given, of
//! the second the *gradient*. Nothing repeats, because the hash takes full 32-bit lattice coordinates.
//!
//! All of it is free of branches and of tables, so that loops over many points become loops over vectors
//! (`texture.rs`, `Octaves::at_lanes`). Lattice coordinates are `f64`, what lies within a cell is `f32`.
//!
//! Source: domain.md 10.4.

/// A lattice of points in the plane (2) or in space (3).
pub struct Lattice<const DIMENSIONS: usize>;

/// Value noise of one lattice.
pub trait ValueNoise<const DIMENSIONS: usize> {
    /// At a point in units of the lattice: value of the first channel, gradient of the second.
    fn noise(lattice: [f64; DIMENSIONS], seed: u32) -> (f32, [f32; DIMENSIONS]);
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
///
/// Free of branches and of the processor's slow conversions, so that many go at once; exact below 2^51, which holds
/// the millimetres of the horizon, where a ray along the plain may end.
#[inline(always)]
fn split(coordinate: f64) -> (u32, f32) {
    /// 1.5 · 2^52: what is added to it is rounded to an integer, which then stands in the last bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let nearest = (coordinate + ROUND) - ROUND;
    let whole = nearest - if nearest > coordinate { 1.0 } else { 0.0 };
    ((whole + ROUND).to_bits() as u32, (coordinate - whole) as f32)
}

/// A hash of the lattice cell that holds a point, and the position in the cell, 0 to 1.
#[inline(always)]
pub(crate) fn cell_hash<const DIMENSIONS: usize>(
    lattice: [f64; DIMENSIONS],
    seed: u32,
) -> (u32, [f32; DIMENSIONS]) {
    let (mut hash, mut place) = (seed, [0.0; DIMENSIONS]);
    for k in 0..DIMENSIONS {
        let (whole, part) = split(lattice[k]);
        hash = scramble(hash ^ whole.wrapping_mul(PRIME[k % PRIME.len()]));
        place[k] = part;
    }
    (hash, place)
}

const PRIME: [u32; 3] = [0x9e37_79b1, 0x85eb_ca77, 0xc2b2_ae3d];

impl ValueNoise<2> for Lattice<2> {
    #[inline(always)]
    fn noise([x, y]: [f64; 2], seed: u32) -> (f32, [f32; 2]) {
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
}

impl ValueNoise<3> for Lattice<3> {
    #[inline(always)]
    fn noise([x, y, z]: [f64; 3], seed: u32) -> (f32, [f32; 3]) {
        let ((ix, fx), (iy, fy), (iz, fz)) = (split(x), split(y), split(z));
        let ((wx, dx), (wy, dy), (wz, dz)) = (fade(fx), fade(fy), fade(fz));
        let x0 = ix.wrapping_mul(PRIME[0]) ^ seed;
        let x1 = ix.wrapping_add(1).wrapping_mul(PRIME[0]) ^ seed;
        let y0 = iy.wrapping_mul(PRIME[1]);
        let y1 = y0.wrapping_add(PRIME[1]);
        let z0 = iz.wrapping_mul(PRIME[2]);
        let z1 = z0.wrapping_add(PRIME[2]);
        let (z0, z1) = (z0.rotate_left(7), z1.rotate_left(7));
        let e00 = edge([x0, x1], y0 ^ z0, wx);
        let e10 = edge([x0, x1], y1 ^ z0, wx);
        let e01 = edge([x0, x1], y0 ^ z1, wx);
        let e11 = edge([x0, x1], y1 ^ z1, wx);
        let albedo = lerp(lerp(e00.0, e10.0, wy), lerp(e01.0, e11.0, wy), wz);
        let slope_x = dx * lerp(lerp(e00.2, e10.2, wy), lerp(e01.2, e11.2, wy), wz);
        let slope_y = dy * lerp(e10.1 - e00.1, e11.1 - e01.1, wz);
        let slope_z = dz * (lerp(e01.1, e11.1, wy) - lerp(e00.1, e10.1, wy));
        (albedo, [slope_x, slope_y, slope_z])
    }
}

/// Of an edge of a cell along x: the value of the first channel, the value of the second and its difference.
#[inline(always)]
fn edge([x0, x1]: [u32; 2], yz: u32, wx: f32) -> (f32, f32, f32) {
    let (a0, b0) = channels(scramble(x0 ^ yz));
    let (a1, b1) = channels(scramble(x1 ^ yz));
    (a0 + wx * (a1 - a0), b0 + wx * (b1 - b0), b1 - b0)
}

#[inline(always)]
fn lerp(a: f32, b: f32, w: f32) -> f32 {
    a + w * (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn slopes_are_the_gradient_of_the_second_channel() {
        // The second channel's value is read off by integrating its gradient between lattice points,
        // where it must equal the difference of the lattice's own numbers.
        let integral: f64 = (0..20_000)
            .map(|k| {
                f64::from(Lattice::noise([(f64::from(k) + 0.5) / 20_000.0 + 4.0, 7.0], 9).1[0]) / 20_000.0
            })
            .sum();
        let lattice = |ix: u32, iy: u32| {
            channels(scramble((ix.wrapping_mul(PRIME[0]) ^ 9) ^ iy.wrapping_mul(PRIME[1]))).1
        };
        assert!((integral - f64::from(lattice(5, 7) - lattice(4, 7))).abs() < 1e-4);
    }
}
