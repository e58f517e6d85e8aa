//! Traversal of the ground's grid along a ray: nested blocks of 64, 16, 4 and 1 cells.
//!
//! A block is skipped while the ray stays above its highest point. A hierarchical digital differential analyser over a
//! pyramid of maxima; each maximum is that of the block, or of the block and its neighbours.

use crate::ground::terrain::{BLOCK_SHIFT, Tops};

/// A ray in units of cells: position p + d t, t in metres.
pub(super) struct CellRay {
    pub(super) p: [f64; 2],
    pub(super) d: [f64; 2],
    /// 1/d, infinite if d is 0.
    pub(super) inverse: [f64; 2],
    pub(super) z_m: f64,
    pub(super) dz: f64,
}

/// Traversal of nested blocks of cells along a ray, from coarse to fine.
pub(super) struct Blocks<'a, IsLeaf, Leaf> {
    /// Highest points of the blocks of each level.
    pub(super) tops: &'a [Tops],
    /// Cells along x and y.
    pub(super) cells: [usize; 2],
    /// Whether a block is not subdivided, given its level and the distance at which the ray leaves it, m.
    pub(super) is_leaf: IsLeaf,
    /// The result for a block, given its first cell and the distances of entry and exit, m.
    pub(super) leaf: Leaf,
}

impl<IsLeaf, Leaf> Blocks<'_, IsLeaf, Leaf>
where
    IsLeaf: Fn(usize, f64) -> bool,
    Leaf: Fn([usize; 2], f64, f64) -> Option<f64>,
{
    /// Walks the blocks of `level` of the whole grid over [enter, leave].
    #[inline(always)]
    pub(super) fn walk(&self, level: usize, ray: &CellRay, enter_m: f64, leave_m: f64) -> Option<f64> {
        self.walk_in(level, [0, 0], usize::MAX >> 1, ray, enter_m, leave_m)
    }

    /// Walks the blocks of `level` inside the square of `span` cells that starts at cell `first`.
    fn walk_in(
        &self,
        level: usize,
        first: [usize; 2],
        span: usize,
        ray: &CellRay,
        enter_m: f64,
        leave_m: f64,
    ) -> Option<f64> {
        let shift = BLOCK_SHIFT[level];
        let side = (1usize << shift) as f64;
        let inverse_side = 1.0 / side;

        let (mut block, mut next_m, mut step_m) = ([0usize; 2], [f64::INFINITY; 2], [f64::INFINITY; 2]);
        let mut last = [0usize; 2];
        for k in 0..2 {
            let low = first[k] >> shift;
            let high = ((first[k] + span).min(self.cells[k]) - 1) >> shift;
            let position = (ray.p[k] + ray.d[k] * enter_m) * inverse_side;
            block[k] = (position.max(0.0) as usize).clamp(low, high);
            last[k] = if ray.d[k] > 0.0 { high } else { low };
            if ray.d[k] != 0.0 {
                let border = block[k] + usize::from(ray.d[k] > 0.0);
                next_m[k] = (border as f64 * side - ray.p[k]) * ray.inverse[k];
                step_m[k] = side * ray.inverse[k].abs();
            }
        }
        let tops = &self.tops[level];
        let mut t = enter_m;
        loop {
            let axis = usize::from(next_m[1] < next_m[0]);
            let end = next_m[axis].min(leave_m);
            let top_m = f64::from(tops.z_m[block[1] * tops.columns + block[0]]);
            let lowest_m = ray.z_m + ray.dz * if ray.dz > 0.0 { end } else { t };
            if lowest_m >= top_m && end >= t {
                let cell = [block[0] << shift, block[1] << shift];
                let hit = if (self.is_leaf)(level, end) {
                    (self.leaf)(cell, t, end)
                } else {
                    self.walk_in(level + 1, cell, side as usize, ray, t, end)
                };
                if hit.is_some() {
                    return hit;
                }
            }
            if next_m[axis] >= leave_m {
                return None;
            }
            t = end.max(t);
            next_m[axis] += step_m[axis];
            if block[axis] == last[axis] {
                return None;
            }
            block[axis] = if ray.d[axis] > 0.0 { block[axis] + 1 } else { block[axis] - 1 };
        }
    }
}
