//! Tests of the sums of a tile: every instruction set of this processor against the definition in `f64`.

use super::super::dot;
use super::super::moments::{GROUP, Moments};
use super::*;

/// A tile of hashed pixels between −0.5 and 0.5 and a hashed template.
struct Case {
    size: usize,
    template: Vec<f32>,
    filters: Filters,
    input: Vec<f32>,
}

impl Case {
    fn new(size: usize) -> Self {
        let value = |i: usize| ((i * 7919 + size) % 101) as f32 / 101.0 - 0.5;
        let template: Vec<f32> = (0..size * size).map(value).collect();
        let filters = Filters::new(&template, size);
        let input = (0..filters.input_rows() * filters.input_columns()).map(|i| value(3 * i + 1)).collect();
        Self { size, template, filters, input }
    }

    /// Σ over a window of what `term` makes of template and pixel.
    fn expected(&self, [x, y]: [usize; 2], term: impl Fn(f64, f64) -> f64) -> f64 {
        let stride = self.filters.input_columns();
        let values = self.template.iter().enumerate();
        values
            .map(|(i, t)| {
                let pixel = self.input[(y + i / self.size) * stride + x + i % self.size];
                term(f64::from(*t), f64::from(pixel))
            })
            .sum()
    }

    /// Compares the first `rows` × `columns` sums in rows of `stride` with the definition.
    fn assert_sums(&self, found: &[f32], stride: usize, size: [usize; 2], term: impl Fn(f64, f64) -> f64) {
        for (y, x) in (0..size[0]).flat_map(|y| (0..size[1]).map(move |x| (y, x))) {
            let (found, expected) = (f64::from(found[y * stride + x]), self.expected([x, y], &term));
            let tolerance = 2e-6 * (self.size * self.size) as f64;
            assert!(
                (found - expected).abs() < tolerance,
                "template of {} at ({x}, {y}): {found} instead of {expected}",
                self.size
            );
        }
    }
}

fn assert_all<S: Simd>(simd: S) {
    for size in [1, 3, 5, 7, 9, 11, 15, 21, 23, 31, 41] {
        let case = Case::new(size);
        let rows = case.filters.tile_rows();
        let mut sums = vec![0.0; rows * TILE_COLUMNS];
        for columns in [1, 17, 50, TILE_COLUMNS] {
            let (filters, input) = (&case.filters, case.input.as_slice());
            filters.sum(simd, &mut filters.scratch(), input, columns, &mut sums);
            case.assert_sums(&sums, TILE_COLUMNS, [rows, columns], |t, v| t * v);
            let (template, input_stride) = (case.template.as_slice(), filters.input_columns());
            let few = dot::Rows { template, size, input, input_stride };
            few.sum(simd, [3, columns], &mut sums, TILE_COLUMNS);
            case.assert_sums(&sums, TILE_COLUMNS, [3, columns], |t, v| t * v);
        }
        let mut moments = Moments::new(size, rows, case.filters.input_columns());
        moments.down(simd, &case.input, rows);
        let (mut all_sums, mut all_squares) = (Vec::new(), Vec::new());
        for y in 0..rows {
            if y % GROUP == 0 {
                moments.across(simd, y, GROUP.min(rows - y));
            }
            let [sums, squares] = moments.row::<S>(y % GROUP, TILE_COLUMNS / S::F32_LANES);
            all_sums.extend_from_slice(bytemuck::cast_slice(sums));
            all_squares.extend_from_slice(bytemuck::cast_slice(squares));
        }
        case.assert_sums(&all_sums, TILE_COLUMNS, [rows, TILE_COLUMNS], |_, v| v);
        case.assert_sums(&all_squares, TILE_COLUMNS, [rows, TILE_COLUMNS], |_, v| v * v);
    }
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
