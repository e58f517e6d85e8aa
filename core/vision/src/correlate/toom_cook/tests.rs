//! Sums of a tile with every instruction set of this processor, against the definition in `f64`.

use super::moments::Moments;
use super::phases::{self, Part};
use super::*;

/// Number of groups of rows in a tile.
const GROUPS: usize = 2;

/// Value subtracted from the pixels.
const LEVEL: f32 = 0.125;

/// A tile of hashed pixels between −0.5 and 0.5 and a hashed template.
struct Case {
    size: usize,
    template: Vec<f32>,
    filters: Filters,
    /// Pixels, in rows of `input_columns`.
    pixels: Vec<f32>,
    input_columns: usize,
}

impl Case {
    fn new(size: usize) -> Self {
        let value = |i: usize| ((i * 7919 + size) % 101) as f32 / 101.0 - 0.5;
        let template: Vec<f32> = (0..size * size).map(value).collect();
        let filters = Filters::new(&template, size);
        let input_columns = TILE_COLUMNS + size - 1;
        let pixels = (0..filters.pixel_rows(GROUPS) * input_columns).map(|i| value(3 * i + 1)).collect();
        Self { size, template, filters, pixels, input_columns }
    }

    /// The pixels of a tile, in phases.
    fn input<S: Simd>(&self, simd: S, tile: Tile, columns: usize) -> Vec<f32> {
        let (rows, stride) = (tile.pixel_rows, tile.pixels);
        let mut planes = [0; PHASES].map(|_| vec![0.0; rows * stride]);
        for (y, row) in self.pixels.chunks_exact(self.input_columns).enumerate() {
            let mut row = row[..columns + self.size - 1].to_vec();
            row.resize(tile.row_pixels(), 0.0);
            let phases = planes.each_mut().map(|plane| &mut plane[y * stride..][..stride]);
            simd.vectorize(Part { row: &row, phases });
        }
        planes.concat()
    }

    /// Σ over a window of `term` of template and pixel.
    fn expected(&self, [x, y]: [usize; 2], term: impl Fn(f64, f64) -> f64) -> f64 {
        let values = self.template.iter().enumerate();
        values
            .map(|(i, t)| {
                let pixel = self.pixels[(y + i / self.size) * self.input_columns + x + i % self.size];
                term(f64::from(*t), f64::from(pixel))
            })
            .sum()
    }

    /// Compares the first `rows` × `columns` sums of a tile with the definition.
    fn assert_sums<S: Simd>(
        &self,
        simd: S,
        found: &[f32],
        tile: Tile,
        [rows, columns]: [usize; 2],
        term: impl Fn(f64, f64) -> f64,
    ) {
        self.assert_sums_from(simd, found, tile, [0, rows, columns], term);
    }

    /// Compares the sums of the rows from `top` to one before `bottom`.
    fn assert_sums_from<S: Simd>(
        &self,
        simd: S,
        found: &[f32],
        tile: Tile,
        [top, bottom, columns]: [usize; 3],
        term: impl Fn(f64, f64) -> f64,
    ) {
        let mut row = vec![0.0; tile.row_columns()];
        for y in top..bottom {
            let phases = tile.phases(&found[(y - top) * tile.row_columns()..]);
            simd.vectorize(phases::Join { phases, row: &mut row });
            for (x, found) in row[..columns].iter().enumerate() {
                let (found, expected) = (f64::from(*found), self.expected([x, y], &term));
                let tolerance = 2e-6 * (self.size * self.size) as f64;
                assert!(
                    (found - expected).abs() < tolerance,
                    "template of {} at ({x}, {y}): {found} instead of {expected}",
                    self.size
                );
            }
        }
    }
}

fn assert_all<S: Simd>(simd: S) {
    for size in [1, 3, 5, 7, 9, 11, 15, 21, 23, 31, 41] {
        for columns in [1, 17, 50, TILE_COLUMNS] {
            assert_tile(simd, &Case::new(size), columns);
        }
    }
}

fn assert_tile<S: Simd>(simd: S, case: &Case, columns: usize) {
    let Case { size, filters, .. } = case;
    let (size, rows) = (*size, GROUPS * filters.group_rows());
    let tile = Tile::new(size, columns, filters.pixel_rows(GROUPS));
    let (input, level) = (case.input(simd, tile, columns), f64::from(LEVEL));
    let mut sums = vec![0.0; rows * tile.row_columns()];
    let mut scratch = filters.scratch(tile);
    filters.begin(simd, &mut scratch, tile, &input, [0, tile.pixel_rows]);
    for (group, sums) in sums.chunks_exact_mut(filters.group_rows() * tile.row_columns()).enumerate() {
        filters.sum(simd, &mut scratch, tile, (group * filters.group_rows(), LEVEL), sums);
    }
    case.assert_sums(simd, &sums, tile, [rows, columns], |t, v| t * (v - level));
    sums.fill(0.0);
    filters.sum_rows(simd, &scratch, tile, ([1, 4], LEVEL), &mut sums);
    case.assert_sums_from(simd, &sums, tile, [1, 4, columns], |t, v| t * (v - level));
    if size < 3 {
        return;
    }
    let mut moments = Moments::new(size, rows, tile);
    moments.down(simd, tile, &input, [0, rows], LEVEL);
    let (mut sums, mut squares) = (Vec::new(), Vec::new());
    for y in 0..rows {
        let [row_sums, row_squares] = moments.across(simd, tile, y);
        sums.extend_from_slice(bytemuck::cast_slice(row_sums));
        squares.extend_from_slice(bytemuck::cast_slice(row_squares));
    }
    case.assert_sums(simd, &sums, tile, [rows, columns], |_, v| v - level);
    case.assert_sums(simd, &squares, tile, [rows, columns], |_, v| (v - level).powi(2));
}

#[test]
fn every_instruction_set_of_this_processor_gives_the_definition() {
    assert_all(pulp::Scalar);
    #[cfg(target_arch = "x86_64")]
    {
        pulp::x86::V3::try_new().into_iter().for_each(assert_all);
        pulp::x86::V4::try_new().into_iter().for_each(assert_all);
    }
}
