//! Speckle filter: removes small patches that differ from their surroundings (domain.md 7, step 7).
//!
//! Two neighbours (left and right, above and below) with disparities belong to one patch if these differ by at most a
//! step. Rows are split into runs; touching runs of consecutive rows are joined by union-find: each run points to an
//! earlier one of its patch, the first to itself.

/// Consecutive pixels of a row in one patch.
struct Run {
    /// Index of the first pixel in the image, and one past the last.
    start: usize,
    end: usize,
    /// Index of an earlier run of the patch, or of itself.
    parent: usize,
    /// Pixels of the patch, in its first run only.
    pixels: usize,
}

/// Returns the pixels, run by run, of patches with fewer than `least` pixels; NaN is no disparity.
pub(super) fn small_patches(
    disparity_px: &[f32],
    width: usize,
    least: usize,
    step_px: f32,
) -> Vec<std::ops::Range<usize>> {
    let mut runs: Vec<Run> = Vec::new();
    // The first run of the row above that may touch.
    let mut above = 0;
    for (y, row) in disparity_px.chunks_exact(width.max(1)).enumerate() {
        let first = runs.len();
        for (x, pixel) in row.iter().enumerate().filter(|(_, pixel)| pixel.is_finite()) {
            let at = y * width + x;
            let next = runs.len();
            match runs.last_mut() {
                Some(last) if next > first && last.end == at && (pixel - row[x - 1]).abs() <= step_px => {
                    last.end += 1;
                }
                _ => runs.push(Run { start: at, end: at + 1, parent: next, pixels: 0 }),
            }
        }
        for this in first..runs.len() {
            let (start, end) = (runs[this].start - width.min(runs[this].start), runs[this].end);
            while above < first && runs[above].end <= start {
                above += 1;
            }
            let mut other = above;
            while other < first && runs[other].start + width < end {
                let from = runs[other].start.max(start);
                let to = runs[other].end.min(end - width);
                let pairs = disparity_px[from..to].iter().zip(&disparity_px[from + width..to + width]);
                if pairs.into_iter().any(|(up, down)| (up - down).abs() <= step_px) {
                    join(&mut runs, this, other);
                }
                other += 1;
            }
        }
        above = first;
    }
    for at in 0..runs.len() {
        let (root, pixels) = (root(&mut runs, at), runs[at].end - runs[at].start);
        runs[root].pixels += pixels;
    }
    let small = (0..runs.len()).filter(|&at| runs[root_of(&runs, at)].pixels < least);
    small.map(|at| runs[at].start..runs[at].end).collect()
}

/// First run of the patch, with path halving.
fn root(runs: &mut [Run], mut at: usize) -> usize {
    while runs[at].parent != at {
        runs[at].parent = runs[runs[at].parent].parent;
        at = runs[at].parent;
    }
    at
}

/// First run of the patch.
fn root_of(runs: &[Run], mut at: usize) -> usize {
    while runs[at].parent != at {
        at = runs[at].parent;
    }
    at
}

fn join(runs: &mut [Run], a: usize, b: usize) {
    let (a, b) = (root(runs, a), root(runs, b));
    runs[a.max(b)].parent = a.min(b);
}
