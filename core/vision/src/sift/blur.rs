//! The Gaussian filter, down the columns and then along the rows.
//!
//! ```text
//! B(x, y) = Σ_j g_j Σ_i g_i I(x + i, y + j),     g_i ∝ exp(−i²/(2σ²)),   Σ g = 1,   |i| ≤ r = 4σ
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | g | [`Kernel`] | – |
//! | r | [`Kernel::radius`] | px |
//!
//! The image is mirrored at its edges (… 2 1 0 1 2 …). A few rows are filtered downwards at a time, so that each loaded
//! pixel contributes to all of them, into lines that stay in the L1 cache; these are then filtered along the row.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::lanes::{Line, WIDEST, store};
use super::plane::Plane;

/// Rows filtered at a time.
const ROWS: usize = 4;
/// Rows of a parallel task, a multiple of [`ROWS`].
const BAND: usize = 16;
/// Vectors of a strip, down the columns and along the rows.
const DOWN: usize = 4;
const ALONG: usize = 8;
/// Radius of the kernel, in σ.
const EXTENT: f64 = 4.0;

/// g: a sampled Gaussian.
pub(super) struct Kernel {
    /// g from −r to r, between `ROWS` − 1 zeros on either side.
    taps: Vec<f32>,
}

impl Kernel {
    /// The Gaussian of standard deviation `sigma_px`.
    pub(super) fn gaussian(sigma_px: f64) -> Self {
        let radius = (EXTENT * sigma_px).round().max(1.0) as i32;
        let value = |i: i32| (-0.5 * (f64::from(i) / sigma_px).powi(2)).exp();
        let sum: f64 = (-radius..=radius).map(value).sum();
        let mut taps = vec![0.0; ROWS - 1];
        taps.extend((-radius..=radius).map(|i| (value(i) / sum) as f32));
        taps.resize(taps.len() + ROWS - 1, 0.0);
        Self { taps }
    }

    /// r.
    pub(super) fn radius(&self) -> usize {
        (self.taps.len() - 2 * (ROWS - 1)) / 2
    }
}

/// Computes the rows of B above `end` whose input rows are available.
pub(super) fn blur(source: &Plane, kernel: &Kernel, blurred: &mut Plane, end: usize) {
    let radius = kernel.radius();
    let possible =
        if source.made == source.height { source.height } else { source.made.saturating_sub(radius) };
    let stride = blurred.stride;
    for (first, rows) in blurred.make(end.min(possible)) {
        rows.par_chunks_mut(BAND * stride).enumerate().for_each_init(
            Scratch::default,
            |scratch, (band, rows)| {
                let top = first + band * BAND;
                Arch::new().dispatch(Band { source, kernel, top, rows, scratch });
            },
        );
    }
}

/// Index of the pixel of a row of `side` pixels at position `at` of its mirrored extension.
fn mirrored(at: isize, side: usize) -> usize {
    let period = (2 * (side as isize - 1)).max(1);
    let at = at.rem_euclid(period);
    at.min(period - at) as usize
}

/// Buffers for a few lines, and start indices of their input rows.
#[derive(Default)]
struct Scratch {
    lines: Vec<Line>,
    starts: Vec<usize>,
}

/// Some rows of B.
struct Band<'a> {
    source: &'a Plane,
    kernel: &'a Kernel,
    /// Index of the first row.
    top: usize,
    rows: &'a mut [f32],
    scratch: &'a mut Scratch,
}

impl WithSimd for Band<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { source, kernel, top, rows, scratch } = self;
        let (radius, width, stride) = (kernel.radius(), source.width, source.stride);
        let margin = radius.next_multiple_of(WIDEST);
        let length = margin + stride + margin + WIDEST;
        let Scratch { lines, starts } = scratch;
        lines.resize(ROWS * length / WIDEST, Line::ZERO);
        starts.resize(2 * radius + ROWS, 0);
        let lines: &mut [f32] = bytemuck::cast_slice_mut(lines);
        for (block, rows) in rows.chunks_mut(ROWS * stride).enumerate() {
            let first = (top + block * ROWS) as isize - radius as isize;
            for (k, start) in starts.iter_mut().enumerate() {
                *start = source.start(mirrored(first + k as isize, source.height));
            }
            down_all(simd, source, starts, &kernel.taps, (lines, margin, length));
            for (line, row) in lines.chunks_exact_mut(length).zip(rows.chunks_exact_mut(stride)) {
                for i in 1..=radius {
                    line[margin - i] = line[margin + mirrored(-(i as isize), width)];
                    line[margin + width - 1 + i] = line[margin + mirrored((width - 1 + i) as isize, width)];
                }
                along_all(simd, &line[margin - radius..], &kernel.taps[ROWS - 1..][..2 * radius + 1], row);
            }
        }
    }
}

/// Filters a block of rows downwards, in all columns.
#[inline(always)]
fn down_all<S: Simd>(
    simd: S,
    source: &Plane,
    starts: &[usize],
    taps: &[f32],
    (lines, margin, length): (&mut [f32], usize, usize),
) {
    let vectors = source.width.div_ceil(S::F32_LANES);
    let mut x = 0;
    while x + DOWN <= vectors {
        simd.vectorize(Down::<DOWN> { values: source.values(), starts, taps, x, lines, margin, length });
        x += DOWN;
    }
    while x < vectors {
        simd.vectorize(Down::<1> { values: source.values(), starts, taps, x, lines, margin, length });
        x += 1;
    }
}

/// A strip of `X` vectors of the lines.
struct Down<'a, const X: usize> {
    values: &'a [f32],
    /// Start indices of the input rows.
    starts: &'a [usize],
    taps: &'a [f32],
    /// Index of the first vector.
    x: usize,
    lines: &'a mut [f32],
    /// Values before the first pixel of a line, and length of a line.
    margin: usize,
    length: usize,
}

impl<const X: usize> WithSimd for Down<'_, X> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { values, starts, taps, x, lines, margin, length } = self;
        let x = x * S::F32_LANES;
        let mut sums = [[simd.splat_f32s(0.0); X]; ROWS];
        for (k, &start) in starts.iter().enumerate() {
            let pixels = &S::as_simd_f32s(&values[start + x..]).0[..X];
            let taps = &taps[k..k + ROWS];
            for row in 0..ROWS {
                let tap = simd.splat_f32s(taps[ROWS - 1 - row]);
                for i in 0..X {
                    sums[row][i] = simd.mul_add_e_f32s(tap, pixels[i], sums[row][i]);
                }
            }
        }
        for (row, sums) in sums.iter().enumerate() {
            for (i, &sum) in sums.iter().enumerate() {
                store::<S>(lines, row * length + margin + x + i * S::F32_LANES, sum);
            }
        }
    }
}

/// Filters a row of B from a line that begins r pixels before it.
#[inline(always)]
fn along_all<S: Simd>(simd: S, line: &[f32], taps: &[f32], row: &mut [f32]) {
    let vectors = row.len() / S::F32_LANES;
    let mut x = 0;
    while x + ALONG <= vectors {
        simd.vectorize(Along::<ALONG> { line: &line[x * S::F32_LANES..], taps, x, row });
        x += ALONG;
    }
    while x < vectors {
        simd.vectorize(Along::<1> { line: &line[x * S::F32_LANES..], taps, x, row });
        x += 1;
    }
}

/// A strip of `X` vectors of a row of B.
struct Along<'a, const X: usize> {
    line: &'a [f32],
    taps: &'a [f32],
    /// Index of the first vector.
    x: usize,
    row: &'a mut [f32],
}

impl<const X: usize> WithSimd for Along<'_, X> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { line, taps, x, row } = self;
        let mut sums = [simd.splat_f32s(0.0); X];
        for (k, &tap) in taps.iter().enumerate() {
            let tap = simd.splat_f32s(tap);
            let pixels = &S::as_simd_f32s(&line[k..]).0[..X];
            for i in 0..X {
                sums[i] = simd.mul_add_e_f32s(tap, pixels[i], sums[i]);
            }
        }
        for (i, &sum) in sums.iter().enumerate() {
            store::<S>(row, (x + i) * S::F32_LANES, sum);
        }
    }
}
