//! Contour lines of a sampled grid by marching squares.
//!
//! The crate `contour` is not used because it closes every ring along the border and around missing values; here a cell
//! with a missing corner has no line.

/// A segment between two points, each (column, row) in samples.
pub(crate) type Segment = [[f64; 2]; 2];

/// The segments of the contour at `level` of a row-major grid with `width` columns.
pub(crate) fn contour(values: &[f32], width: usize, level: f32) -> Vec<Segment> {
    if width < 2 {
        return Vec::new();
    }
    let height = values.len() / width;
    let at = |x: usize, y: usize| values[y * width + x];
    let mut segments = Vec::new();
    for y in 0..height.saturating_sub(1) {
        for x in 0..width - 1 {
            let corners = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            cell(corners, level, [x as f64, y as f64], &mut segments);
        }
    }
    segments
}

/// Adds the segments of one cell; `corners` are clockwise on the screen from the top left.
fn cell(corners: [f32; 4], level: f32, origin: [f64; 2], segments: &mut Vec<Segment>) {
    const OFFSETS: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    if corners.iter().any(|v| v.is_nan()) {
        return;
    }
    let above = corners.map(|v| v >= level);
    let crossing = |i: usize| {
        let j = (i + 1) % 4;
        let t = f64::from((level - corners[i]) / (corners[j] - corners[i]));
        let along = |k: usize| origin[k] + OFFSETS[i][k] + (OFFSETS[j][k] - OFFSETS[i][k]) * t;
        [along(0), along(1)]
    };
    let mut crossed: Vec<usize> = (0..4).filter(|&i| above[i] != above[(i + 1) % 4]).collect();
    if crossed.len() == 4 {
        // A saddle: the mean of the corners decides which two are joined through the centre.
        let joined = corners.iter().sum::<f32>() / 4.0 >= level;
        if joined == above[0] {
            crossed = vec![0, 1, 2, 3];
        } else {
            crossed = vec![3, 0, 1, 2];
        }
    }
    for pair in crossed.chunks_exact(2) {
        segments.push([crossing(pair[0]), crossing(pair[1])]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contour_of_a_cone_is_a_circle() {
        let (width, middle) = (41, 20.0_f64);
        let values: Vec<f32> = (0..width * width)
            .map(|i| {
                let (x, y) = ((i % width) as f64 - middle, (i / width) as f64 - middle);
                (20.0 - x.hypot(y)) as f32
            })
            .collect();
        let segments = contour(&values, width, 10.0);
        assert!(segments.len() > 40);
        for [x, y] in segments.into_iter().flatten() {
            assert!(((x - middle).hypot(y - middle) - 10.0).abs() < 0.05, "{x} {y}");
        }
    }

    #[test]
    fn a_cell_with_a_missing_corner_has_no_line() {
        assert_eq!(contour(&[0.0, 1.0, 0.0, 1.0], 2, 0.5), vec![[[0.5, 0.0], [0.5, 1.0]]]);
        assert!(contour(&[0.0, 1.0, f32::NAN, 1.0], 2, 0.5).is_empty());
    }

    #[test]
    fn a_saddle_has_two_lines_that_do_not_cross() {
        let high = contour(&[1.0, 0.0, 0.0, 0.9], 2, 0.4);
        assert_eq!(high.len(), 2);
        // The high corners are joined, so each line cuts off one low corner: top right and bottom left.
        let near = |segment: &Segment, corner: [f64; 2]| {
            segment.iter().all(|p| (p[0] - corner[0]).abs() + (p[1] - corner[1]).abs() <= 1.0)
        };
        assert!(
            high.iter().any(|s| near(s, [1.0, 0.0])) && high.iter().any(|s| near(s, [0.0, 1.0])),
            "{high:?}"
        );
    }

    #[test]
    fn a_flat_or_thin_surface_has_no_contour() {
        assert!(contour(&[0.2; 9], 3, 0.5).is_empty());
        assert!(contour(&[0.2, 0.9], 1, 0.5).is_empty());
        assert!(contour(&[], 3, 0.5).is_empty());
    }
}
