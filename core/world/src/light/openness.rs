//! The part of the sky that the ground sees beside rocks: soft contact shadows in the ambient light.
//!
//! A rock of radius r at distance x hides about F = 0.4 (r/x)³ of the sky's light on level ground: the form factor of half
//! a disc is 0.21 (r/x)³ far off (area πr²/2, its centroid 0.42 r high) and approaches one half where it touches. A 4 cm
//! grid stores 1/(1 + ΣF), summed over the rocks and interpolated bilinearly. It only scales the sky's light, so no
//! geometry depends on it.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | r, x | rock radius, distance between the point and the rock's centre | m, site |
//!
//! Sources: ours, after domain.md 11.1 (ambient occlusion in shadows).

use crate::ground::rocks::Rock;

/// Side of a cell, m.
const CELL_M: f64 = 0.04;
/// Distance up to which a rock has influence, in radii: 0.4/5³ is 0.3 %.
const REACH: f64 = 5.0;

/// The visible part of the sky over the ground.
#[derive(Clone, Debug)]
pub(crate) struct Openness {
    origin_m: [f64; 2],
    size: [usize; 2],
    part: Vec<f32>,
}

impl Openness {
    /// For the rectangle `x_m` × `y_m` of the site frame.
    pub(crate) fn new(rocks: &[Rock], x_m: [f64; 2], y_m: [f64; 2]) -> Self {
        let size = [x_m, y_m].map(|[from, to]| ((to - from) / CELL_M) as usize + 2);
        let origin_m = [x_m[0], y_m[0]];
        let mut hidden = vec![0.0f32; size[0] * size[1]];
        for rock in rocks {
            let radius_m = 0.5 * rock.diameter_m;
            let reach_m = REACH * radius_m;
            let range: [[usize; 2]; 2] = std::array::from_fn(|k| {
                [-reach_m, reach_m].map(|by| {
                    let cell = (rock.centre[k] + by - origin_m[k]) / CELL_M;
                    (cell.max(0.0) as usize).min(size[k])
                })
            });
            for iy in range[1][0]..range[1][1] {
                for ix in range[0][0]..range[0][1] {
                    let dx = origin_m[0] + ix as f64 * CELL_M - rock.centre.x;
                    let dy = origin_m[1] + iy as f64 * CELL_M - rock.centre.y;
                    let ratio = radius_m / dx.hypot(dy).max(radius_m);
                    hidden[iy * size[0] + ix] += (0.4 * ratio.powi(3)) as f32;
                }
            }
        }
        Self { origin_m, size, part: hidden.into_iter().map(|f| 1.0 / (1.0 + f)).collect() }
    }

    /// The part of the sky visible from the ground at a point, 0 to 1.
    #[inline(always)]
    pub(crate) fn at(&self, x_m: f64, y_m: f64) -> f32 {
        let (x, y) = ((x_m - self.origin_m[0]) / CELL_M, (y_m - self.origin_m[1]) / CELL_M);
        if x < 0.0 || y < 0.0 || x >= (self.size[0] - 1) as f64 || y >= (self.size[1] - 1) as f64 {
            return 1.0;
        }
        let (ix, iy) = (x as usize, y as usize);
        let (u, v) = ((x - ix as f64) as f32, (y - iy as f64) as f32);
        let at = iy * self.size[0] + ix;
        let row = |at: usize| self.part[at] + u * (self.part[at + 1] - self.part[at]);
        row(at) + v * (row(at + self.size[0]) - row(at))
    }
}
