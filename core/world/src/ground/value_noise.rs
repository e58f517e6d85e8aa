//! Value noise over a lattice: hashes of full coordinates, interpolated smoothly.
//!
//! A hash gives every lattice point two independent numbers in [−1, 1] (16 bits each), which are interpolated by the
//! quintic `w(t) = t³(6t² − 15t + 10)`, so that value and slope are continuous. The noise returns the *value* of the first
//! and the *gradient* of the second. Nothing repeats, because the hash takes full 32-bit lattice coordinates.
//!
//! All of it is free of branches and tables, so that loops over many points vectorise (`texture.rs`, `Octaves::at_lanes`).
//! Lattice coordinates are `f64`, positions within a cell `f32`. Points of one pixel are close together: the corner of a
//! coarse square is located in `f64` and the points by `f32` offsets from it ([`Points`]); if all are in one cell, its
//! corners are hashed once ([`Cells`]).
//!
//! Source: domain.md 10.4.

#![expect(
    clippy::needless_range_loop,
    reason = "plain loops over lanes become vectors, adaptors do not always"
)]

use crate::ground::texture::LANES;

/// A lattice of points in the plane (2) or in space (3).
pub struct Lattice<const DIMENSIONS: usize>;

/// Value noise of one lattice.
pub trait ValueNoise<const DIMENSIONS: usize> {
    /// The two numbers of each corner of a cell, x fastest.
    type Corners: Copy;

    /// The corners of a cell.
    fn corners(cell: [u32; DIMENSIONS], seed: u32) -> Self::Corners;

    /// Interpolates at a position within a cell, 0 to 1: value of the first channel, gradient of the second.
    fn join(corners: &Self::Corners, part: [f32; DIMENSIONS]) -> (f32, [f32; DIMENSIONS]);

    /// Noise at a point in lattice units: value of the first channel, gradient of the second.
    #[inline(always)]
    fn noise(lattice: [f64; DIMENSIONS], seed: u32) -> (f32, [f32; DIMENSIONS]) {
        let split = lattice.map(split);
        Self::join(&Self::corners(split.map(|(cell, _)| cell), seed), split.map(|(_, part)| part))
    }
}

/// Points, each as a corner of a coarse square of [`SQUARE_M`] and an offset from it.
///
/// An `f32` offset is precise enough for millimetres, and if all points are in one square, like those of a pixel, only its
/// corner is located in `f64`. The corner and the noise of a point do not depend on the other points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Points<const DIMENSIONS: usize> {
    corners_m: [[f64; LANES]; DIMENSIONS],
    offsets_m: [[f32; LANES]; DIMENSIONS],
    /// Whether all points are in one square.
    is_one: bool,
}

/// Side of the coarse squares, m.
const SQUARE_M: f64 = 0.5;

impl<const DIMENSIONS: usize> Points<DIMENSIONS> {
    /// Points by component and lane, m.
    #[inline(always)]
    pub(crate) fn new(p_m: &[[f64; LANES]; DIMENSIONS]) -> Self {
        let (mut corners_m, mut offsets_m) = ([[0.0; LANES]; DIMENSIONS], [[0.0; LANES]; DIMENSIONS]);
        let mut differs = false;
        for k in 0..DIMENSIONS {
            for lane in 0..LANES {
                let corner_m = ((p_m[k][lane] * (1.0 / SQUARE_M) + ROUND) - ROUND) * SQUARE_M;
                corners_m[k][lane] = corner_m;
                offsets_m[k][lane] = (p_m[k][lane] - corner_m) as f32;
            }
            for lane in 0..LANES {
                differs |= corners_m[k][lane] != corners_m[k][0];
            }
        }
        Self { corners_m, offsets_m, is_one: !differs }
    }
}

/// The affine map from points, m, to lattice coordinates.
#[derive(Clone, Debug)]
pub(crate) struct LatticeMap<const DIMENSIONS: usize> {
    matrix: [[f64; DIMENSIONS]; DIMENSIONS],
    matrix_f32: [[f32; DIMENSIONS]; DIMENSIONS],
    shift: [f64; DIMENSIONS],
}

impl<const DIMENSIONS: usize> LatticeMap<DIMENSIONS> {
    /// `matrix · p + shift`.
    pub(crate) fn new(matrix: [[f64; DIMENSIONS]; DIMENSIONS], shift: [f64; DIMENSIONS]) -> Self {
        Self { matrix, matrix_f32: matrix.map(|row| row.map(|v| v as f32)), shift }
    }

    /// Coordinates of a point.
    #[inline(always)]
    pub(crate) fn at(&self, p_m: [f64; DIMENSIONS]) -> [f64; DIMENSIONS] {
        let mut lattice = [0.0; DIMENSIONS];
        for k in 0..DIMENSIONS {
            for from in 0..DIMENSIONS {
                lattice[k] += self.matrix[k][from] * p_m[from];
            }
            lattice[k] += self.shift[k];
        }
        lattice
    }

    /// The lattice cells of points.
    #[inline(always)]
    pub(crate) fn cells(&self, points: &Points<DIMENSIONS>) -> Cells<DIMENSIONS> {
        let (mut cells, mut parts) = ([[0; LANES]; DIMENSIONS], [[0.0; LANES]; DIMENSIONS]);
        let corner_m = |lane: usize| {
            let mut corner_m = [0.0; DIMENSIONS];
            for k in 0..DIMENSIONS {
                corner_m[k] = points.corners_m[k][lane];
            }
            corner_m
        };
        if points.is_one {
            let corner = self.at(corner_m(0));
            for k in 0..DIMENSIONS {
                let (cell, part) = split(corner[k]);
                (cells[k], parts[k]) = ([cell; LANES], [part; LANES]);
            }
        } else {
            for lane in 0..LANES {
                let corner = self.at(corner_m(lane));
                for k in 0..DIMENSIONS {
                    (cells[k][lane], parts[k][lane]) = split(corner[k]);
                }
            }
        }
        let mut differs = 0;
        for k in 0..DIMENSIONS {
            for lane in 0..LANES {
                let mut offset = parts[k][lane];
                for from in 0..DIMENSIONS {
                    offset += self.matrix_f32[k][from] * points.offsets_m[from][lane];
                }
                let (whole, part) = split_near(offset);
                cells[k][lane] = cells[k][lane].wrapping_add(whole);
                parts[k][lane] = part;
            }
            for lane in 0..LANES {
                differs |= cells[k][lane] ^ cells[k][0];
            }
        }
        Cells { cells, parts, is_one: differs == 0 }
    }
}

/// Lattice cells of points, and positions within them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cells<const DIMENSIONS: usize> {
    /// The cells, by component and lane.
    cells: [[u32; LANES]; DIMENSIONS],
    /// Positions within the cells, 0 to 1, by component and lane.
    parts: [[f32; LANES]; DIMENSIONS],
    /// Whether all points are in one cell, so that one set of corners serves all.
    pub(crate) is_one: bool,
}

impl<const DIMENSIONS: usize> Cells<DIMENSIONS> {
    /// The cells of points on a lattice of `per_m` cells a metre, located in `f64`: for features with edges, where a
    /// change in the last digit of [`Points`] could move a point across an edge.
    #[inline(always)]
    pub(crate) fn at(p_m: &[[f64; LANES]; DIMENSIONS], per_m: f64) -> Self {
        let (mut cells, mut parts) = ([[0; LANES]; DIMENSIONS], [[0.0; LANES]; DIMENSIONS]);
        let mut differs = 0;
        for k in 0..DIMENSIONS {
            for lane in 0..LANES {
                (cells[k][lane], parts[k][lane]) = split(p_m[k][lane] * per_m);
            }
            for lane in 0..LANES {
                differs |= cells[k][lane] ^ cells[k][0];
            }
        }
        Self { cells, parts, is_one: differs == 0 }
    }

    /// The position of a lane within its cell.
    #[inline(always)]
    pub(crate) fn part(&self, lane: usize) -> [f32; DIMENSIONS] {
        let mut part = [0.0; DIMENSIONS];
        for k in 0..DIMENSIONS {
            part[k] = self.parts[k][lane];
        }
        part
    }

    /// The cell of a lane.
    #[inline(always)]
    pub(crate) fn cell(&self, lane: usize) -> [u32; DIMENSIONS] {
        let mut cell = [0; DIMENSIONS];
        for k in 0..DIMENSIONS {
            cell[k] = self.cells[k][lane];
        }
        cell
    }
}

/// [`split`] of a number below 2^22, without branches; for a larger one an arbitrary cell, and a fraction within [0, 1].
#[inline(always)]
fn split_near(coordinate: f32) -> (u32, f32) {
    /// 1.5 · 2^23, as in [`split`].
    const ROUND_F32: f32 = 12_582_912.0;
    let nearest = (coordinate + ROUND_F32) - ROUND_F32;
    let whole = nearest - if nearest > coordinate { 1.0 } else { 0.0 };
    ((whole + ROUND_F32).to_bits().wrapping_sub(ROUND_F32.to_bits()), (coordinate - whole).clamp(0.0, 1.0))
}

/// Avalanche mixing of 32 bits.
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

/// The two numbers of several lattice points; a loop, because closures are not always inlined into vector code.
#[inline(always)]
fn numbers<const COUNT: usize>(hashes: [u32; COUNT]) -> [(f32, f32); COUNT] {
    let mut numbers = [(0.0, 0.0); COUNT];
    for k in 0..COUNT {
        numbers[k] = channels(scramble(hashes[k]));
    }
    numbers
}

/// The quintic and its derivative.
#[inline(always)]
fn fade(t: f32) -> (f32, f32) {
    (t * t * t * (t * (t * 6.0 - 15.0) + 10.0), 30.0 * t * t * (t * (t - 2.0) + 1.0))
}

/// 1.5 · 2^52: a number added to it is rounded to an integer, which then fills the last bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Splits a lattice coordinate into its integer modulo 2^32 and its fraction in [0, 1).
///
/// Free of branches and of slow conversions, so that it vectorises; exact below 2^51, which covers millimetre cells up to
/// the horizon, where a ray along the plain may end.
#[inline(always)]
fn split(coordinate: f64) -> (u32, f32) {
    let nearest = (coordinate + ROUND) - ROUND;
    let whole = nearest - if nearest > coordinate { 1.0 } else { 0.0 };
    ((whole + ROUND).to_bits() as u32, (coordinate - whole) as f32)
}

/// A hash of a lattice cell.
#[inline(always)]
pub(crate) fn cell_hash<const DIMENSIONS: usize>(cell: [u32; DIMENSIONS], seed: u32) -> u32 {
    let mut hash = seed;
    for k in 0..DIMENSIONS {
        hash = scramble(hash ^ cell[k].wrapping_mul(PRIME[k % PRIME.len()]));
    }
    hash
}

/// The lattice cell that contains a point, and the position in the cell, 0 to 1.
#[inline(always)]
pub(crate) fn cell_of<const DIMENSIONS: usize>(
    lattice: [f64; DIMENSIONS],
) -> ([u32; DIMENSIONS], [f32; DIMENSIONS]) {
    let split = lattice.map(split);
    (split.map(|(cell, _)| cell), split.map(|(_, part)| part))
}

const PRIME: [u32; 3] = [0x9e37_79b1, 0x85eb_ca77, 0xc2b2_ae3d];

impl ValueNoise<2> for Lattice<2> {
    type Corners = [(f32, f32); 4];

    #[inline(always)]
    fn corners([ix, iy]: [u32; 2], seed: u32) -> Self::Corners {
        let (x0, y0) = (ix.wrapping_mul(PRIME[0]) ^ seed, iy.wrapping_mul(PRIME[1]));
        let (x1, y1) = (ix.wrapping_add(1).wrapping_mul(PRIME[0]) ^ seed, y0.wrapping_add(PRIME[1]));
        numbers([x0 ^ y0, x1 ^ y0, x0 ^ y1, x1 ^ y1])
    }

    #[inline(always)]
    fn join(corners: &Self::Corners, [fx, fy]: [f32; 2]) -> (f32, [f32; 2]) {
        let [(a00, b00), (a10, b10), (a01, b01), (a11, b11)] = *corners;
        let ((wx, dx), (wy, dy)) = (fade(fx), fade(fy));
        let (near, far) = (a00 + wx * (a10 - a00), a01 + wx * (a11 - a01));
        let (bump_near, bump_far) = (b00 + wx * (b10 - b00), b01 + wx * (b11 - b01));
        let along_x = dx * ((b10 - b00) + wy * ((b11 - b01) - (b10 - b00)));
        (near + wy * (far - near), [along_x, dy * (bump_far - bump_near)])
    }
}

impl ValueNoise<3> for Lattice<3> {
    type Corners = [(f32, f32); 8];

    #[inline(always)]
    fn corners([ix, iy, iz]: [u32; 3], seed: u32) -> Self::Corners {
        let x0 = ix.wrapping_mul(PRIME[0]) ^ seed;
        let x1 = ix.wrapping_add(1).wrapping_mul(PRIME[0]) ^ seed;
        let y0 = iy.wrapping_mul(PRIME[1]);
        let y1 = y0.wrapping_add(PRIME[1]);
        let z0 = iz.wrapping_mul(PRIME[2]);
        let z1 = z0.wrapping_add(PRIME[2]);
        let (z0, z1) = (z0.rotate_left(7), z1.rotate_left(7));
        let [e00, e10, e01, e11] = [y0 ^ z0, y1 ^ z0, y0 ^ z1, y1 ^ z1];
        numbers([x0 ^ e00, x1 ^ e00, x0 ^ e10, x1 ^ e10, x0 ^ e01, x1 ^ e01, x0 ^ e11, x1 ^ e11])
    }

    #[inline(always)]
    fn join(corners: &Self::Corners, [fx, fy, fz]: [f32; 3]) -> (f32, [f32; 3]) {
        let ((wx, dx), (wy, dy), (wz, dz)) = (fade(fx), fade(fy), fade(fz));
        let [c0, c1, c2, c3, c4, c5, c6, c7] = *corners;
        let [e00, e10, e01, e11] = [edge(c0, c1, wx), edge(c2, c3, wx), edge(c4, c5, wx), edge(c6, c7, wx)];
        let albedo = lerp(lerp(e00.0, e10.0, wy), lerp(e01.0, e11.0, wy), wz);
        let slope_x = dx * lerp(lerp(e00.2, e10.2, wy), lerp(e01.2, e11.2, wy), wz);
        let slope_y = dy * lerp(e10.1 - e00.1, e11.1 - e01.1, wz);
        let slope_z = dz * (lerp(e01.1, e11.1, wy) - lerp(e00.1, e10.1, wy));
        (albedo, [slope_x, slope_y, slope_z])
    }
}

/// Along an edge of a cell in x: the value of the first channel, the value of the second and its difference.
#[inline(always)]
fn edge((a0, b0): (f32, f32), (a1, b1): (f32, f32), wx: f32) -> (f32, f32, f32) {
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
        // 2^40 lattice cells away only the fraction has fewer bits.
        let far = -((1i64 << 40) as f64) - 0.25;
        assert_eq!(split(far), ((-(1i64 << 40) - 1) as u32, 0.75));
    }

    #[test]
    fn many_points_have_the_cells_and_positions_of_each_alone() {
        let map = LatticeMap::new([[300.0, 200.0], [-200.0, 300.0]], [1000.25, -3.5]);
        let near = [std::array::from_fn(|n| 7.1 + 3e-4 * n as f64), [-2.2; LANES]];
        let spread =
            [std::array::from_fn(|n| 0.37 * n as f64 - 2.0), std::array::from_fn(|n| -3.1 * n as f64)];
        let tiny = [[7.1; LANES], std::array::from_fn(|n| -2.2 + 1e-6 * n as f64)];
        for (p_m, is_one) in [(near, false), (spread, false), (tiny, true)] {
            let cells = map.cells(&Points::new(&p_m));
            assert_eq!(cells.is_one, is_one);
            for lane in 0..LANES {
                let lattice = map.at([p_m[0][lane], p_m[1][lane]]);
                let (cell, part) = (cells.cell(lane), cells.part(lane));
                for k in 0..2 {
                    let whole = f64::from(cell[k] as i32) + f64::from(part[k]);
                    assert!((whole - lattice[k]).abs() < 5e-5, "{whole} {}", lattice[k]);
                }
            }
            // The lanes do not depend on one another.
            let alone = map.cells(&Points::new(&p_m.map(|axis| [axis[5]; LANES])));
            assert_eq!((alone.cell(0), alone.part(0)), (cells.cell(5), cells.part(5)));
        }
    }

    #[test]
    fn slopes_are_the_gradient_of_the_second_channel() {
        // The second channel's value follows by integrating its gradient between lattice points, where it must equal the
        // difference of the lattice's own numbers.
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
