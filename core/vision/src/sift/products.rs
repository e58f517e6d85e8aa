//! Nearest neighbours of all descriptors by a product of matrices.
//!
//! ```text
//! |q − t|² = |q|² + |t|² − 2 q·t
//! ```
//! | symbol | our name | unit |
//! |---|---|---|
//! | q, t | `query`, `train` | 0 … 255 each of 128 |
//! | \|t\|² − 2 q·t | `less` | – |
//!
//! All these values are integers below 2²⁴ = 16 777 216 (128 · 255² is 8 323 200), as are the partial sums, so that
//! single precision is exact and the order of summation does not matter.
//!
//! Train descriptors are side by side in vectors, a block of them in the L1 cache. Their products with a few queries at
//! a time stay in registers; each lane keeps the nearest and the second nearest of its own, and the lanes are compared
//! at the end.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::lanes::{Line, WIDEST, load, places, store};
use super::{Descriptor, Neighbours};

/// Elements of a descriptor.
const NUMBERS: usize = 128;
/// Queries whose sums are kept in registers at a time.
const QUERIES: usize = 6;
/// Lines of train descriptors in a block: vectors of the widest processor.
const LINES: usize = 4;
/// Descriptors of a block.
const BLOCK: usize = LINES * WIDEST;
/// Queries of a parallel task.
const TASK: usize = 16 * QUERIES;

/// The nearest neighbours in `train` of each of `query`.
pub(super) fn nearest(query: &[Descriptor], train: &[Descriptor]) -> Vec<Option<Neighbours>> {
    let train = Train::of(train);
    let of_task = |queries: &[Descriptor]| Arch::new().dispatch(Task { queries, train: &train });
    query.par_chunks(TASK).flat_map_iter(of_task).collect()
}

/// |t|².
fn square(descriptor: &Descriptor) -> f32 {
    descriptor.iter().map(|&number| u32::from(number).pow(2)).sum::<u32>() as f32
}

/// Train descriptors, in blocks.
struct Train {
    /// For each block the first elements of its descriptors, then the second ones …
    numbers: Vec<Line>,
    /// |t|², infinite in the padding of the last block.
    squares: Vec<Line>,
}

impl Train {
    fn of(train: &[Descriptor]) -> Self {
        let blocks = train.len().div_ceil(BLOCK);
        let mut numbers = vec![Line::ZERO; blocks * LINES * NUMBERS];
        let mut squares = vec![Line([f32::INFINITY; WIDEST]); blocks * LINES];
        numbers
            .par_chunks_exact_mut(LINES * NUMBERS)
            .zip(squares.par_chunks_exact_mut(LINES))
            .zip(train.par_chunks(BLOCK))
            .for_each(|((numbers, squares), train)| {
                let numbers: &mut [f32] = bytemuck::cast_slice_mut(numbers);
                let squares: &mut [f32] = bytemuck::cast_slice_mut(squares);
                for (i, descriptor) in train.iter().enumerate() {
                    squares[i] = square(descriptor);
                    for (k, &number) in descriptor.iter().enumerate() {
                        numbers[k * BLOCK + i] = f32::from(number);
                    }
                }
            });
        Self { numbers, squares }
    }
}

/// Best of each lane for a query: |t|² − 2 q·t of the nearest and the second nearest, and the index of the nearest.
#[derive(Clone, Copy)]
struct Found {
    nearest: [f32; WIDEST],
    second: [f32; WIDEST],
    index: [f32; WIDEST],
}

impl Found {
    const NOTHING: Self =
        Self { nearest: [f32::INFINITY; WIDEST], second: [f32::INFINITY; WIDEST], index: [0.0; WIDEST] };

    /// Compares the lanes.
    fn neighbours(&self, query: &Descriptor) -> Option<Neighbours> {
        let lanes = || self.nearest.iter().zip(&self.index);
        let (&nearest, &index) = lanes().min_by(|a, b| a.0.total_cmp(b.0).then(a.1.total_cmp(b.1)))?;
        // The second is the second of a lane, or the nearest of another lane.
        let others = lanes().filter(|lane| *lane.1 != index || nearest == f32::INFINITY).map(|lane| *lane.0);
        let second = others.chain(self.second).fold(f32::INFINITY, f32::min);
        let square = square(query);
        let is_there = |less: f32| less < f32::INFINITY;
        is_there(nearest).then_some(Neighbours {
            nearest: index as u32,
            distance2: (square + nearest) as u32,
            second_distance2: is_there(second).then_some((square + second) as u32),
        })
    }
}

/// Finds the neighbours of some queries.
struct Task<'a> {
    queries: &'a [Descriptor],
    train: &'a Train,
}

impl WithSimd for Task<'_> {
    type Output = Vec<Option<Neighbours>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { queries, train } = self;
        let groups = queries.len().div_ceil(QUERIES);
        // The queries of a group, element by element, in the order of multiplication.
        let mut numbers = vec![0.0; groups * NUMBERS * QUERIES];
        for (i, query) in queries.iter().enumerate() {
            let group = &mut numbers[i / QUERIES * NUMBERS * QUERIES..];
            for (k, &number) in query.iter().enumerate() {
                group[k * QUERIES + i % QUERIES] = f32::from(number);
            }
        }
        let mut found = vec![Found::NOTHING; groups * QUERIES];
        let blocks = train.numbers.chunks_exact(LINES * NUMBERS).zip(train.squares.chunks_exact(LINES));
        for (block, (train, squares)) in blocks.enumerate() {
            let (train, squares): (&[f32], &[f32]) =
                (bytemuck::cast_slice(train), bytemuck::cast_slice(squares));
            for (query, found) in numbers.chunks_exact(NUMBERS * QUERIES).zip(found.chunks_exact_mut(QUERIES))
            {
                let first = block * BLOCK;
                if S::REGISTER_COUNT >= 32 {
                    simd.vectorize(Product::<4> { query, train, squares, first, found });
                } else {
                    simd.vectorize(Product::<2> { query, train, squares, first, found });
                }
            }
        }
        found.iter().zip(queries).map(|(found, query)| found.neighbours(query)).collect()
    }
}

/// Computes the products of a group of queries and a block, `V` vectors of it at a time.
struct Product<'a, const V: usize> {
    query: &'a [f32],
    train: &'a [f32],
    squares: &'a [f32],
    /// Index of the first descriptor of the block.
    first: usize,
    found: &'a mut [Found],
}

impl<const V: usize> WithSimd for Product<'_, V> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { query, train, squares, first, found } = self;
        let mut start = 0;
        while start < BLOCK {
            let mut sums = [[simd.splat_f32s(0.0); V]; QUERIES];
            for (query, train) in query.chunks_exact(QUERIES).zip(train.chunks_exact(BLOCK)) {
                let train = &S::as_simd_f32s(&train[start..]).0[..V];
                for q in 0..QUERIES {
                    let number = simd.splat_f32s(query[q]);
                    for v in 0..V {
                        sums[q][v] = simd.mul_add_e_f32s(number, train[v], sums[q][v]);
                    }
                }
            }
            for (sums, found) in sums.iter().zip(found.iter_mut()) {
                let mut nearest = load::<S>(&found.nearest, 0);
                let mut second = load::<S>(&found.second, 0);
                let mut index = load::<S>(&found.index, 0);
                for (v, &sum) in sums.iter().enumerate() {
                    let at = start + v * S::F32_LANES;
                    let square = load::<S>(squares, at);
                    let less = simd.mul_add_e_f32s(sum, simd.splat_f32s(-2.0), square);
                    let here = simd.add_f32s(places::<S>(), simd.splat_f32s((first + at) as f32));
                    let is_nearer = simd.less_than_f32s(less, nearest);
                    index = simd.select_f32s(is_nearer, here, index);
                    second = simd.min_f32s(second, simd.max_f32s(nearest, less));
                    nearest = simd.min_f32s(nearest, less);
                }
                store::<S>(&mut found.nearest, 0, nearest);
                store::<S>(&mut found.second, 0, second);
                store::<S>(&mut found.index, 0, index);
            }
            start += V * S::F32_LANES;
        }
    }
}
