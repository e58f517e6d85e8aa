//! Wheel tracks as one sees them: darker soil, with the slopes of a groove and of cleat marks.
//!
//! Like all relief finer than the grid of heights, a track tilts the normal for shading and darkens the soil; the
//! surface that rays meet stays as it was, so that it need not be made anew at every stop. Across a track the
//! groove falls to its depth over `EDGE_M` at each side, as a smooth step; along it, cleats leave waves:
//! ```text
//! z(s, l) = depth · step((w/2 − |s|)/EDGE_M) + CLEAT_M/2 · cos(2π l / CLEAT_SPACING_M),   step(t) = t²(3 − 2t)
//! ```
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | s, l | across and along the track | m |
//! | w | width of the track | m |
//! | z | depth below the untouched ground, positive down | m |
//!
//! Frame: site. Sources: papers.md R142; domain.md 10.4 (16 cm wide, 5 to 10 mm deep, albedo × 0.8).

use std::collections::HashMap;
use std::f64::consts::TAU;

use crate::sim::light::reflection::Appearance;
use crate::sim::rover::tracks::Polyline;

/// What a track leaves of the soil's albedo.
const DARKER: f32 = 0.8;
/// Over which width the groove falls to its depth at each side, m.
const EDGE_M: f64 = 0.03;
/// Depth of the cleat marks from trough to crest, m, and their distance, m.
const CLEAT_M: f64 = 0.003;
const CLEAT_SPACING_M: f64 = 0.04;
/// Side of a cell of the map, m.
const CELL_M: f64 = 0.25;

/// A straight piece of a track.
#[derive(Clone, Copy, Debug)]
struct Piece {
    from_m: [f64; 2],
    /// Unit direction along the piece.
    along: [f64; 2],
    length_m: f64,
    /// Length of the track before this piece, m.
    before_m: f64,
    half_width_m: f64,
    depth_m: f64,
}

/// The tracks that lie on the ground, by place.
#[derive(Clone, Debug, Default)]
pub struct Imprint {
    pieces: Vec<Piece>,
    cells: HashMap<(i32, i32), Vec<u32>>,
}

impl Imprint {
    /// The imprint of some tracks.
    pub fn new(lines: &[Polyline]) -> Self {
        let mut imprint = Self::default();
        for line in lines {
            let mut before_m = 0.0;
            for pair in line.points_in_site.windows(2) {
                let way = (pair[1] - pair[0]).xy();
                let length_m = way.norm();
                if length_m > 0.0 {
                    imprint.add(Piece {
                        from_m: [pair[0].x, pair[0].y],
                        along: [way.x / length_m, way.y / length_m],
                        length_m,
                        before_m,
                        half_width_m: 0.5 * line.width_m,
                        depth_m: line.depth_m,
                    });
                }
                before_m += length_m;
            }
        }
        imprint
    }

    fn add(&mut self, piece: Piece) {
        let index = self.pieces.len() as u32;
        let reach_m = piece.half_width_m;
        let to_m = [0, 1].map(|k| piece.from_m[k] + piece.along[k] * piece.length_m);
        let range = |k: usize| {
            let [low, high] =
                [piece.from_m[k].min(to_m[k]) - reach_m, piece.from_m[k].max(to_m[k]) + reach_m];
            (low / CELL_M).floor() as i32..=(high / CELL_M).floor() as i32
        };
        for y in range(1) {
            for x in range(0) {
                self.cells.entry((x, y)).or_default().push(index);
            }
        }
        self.pieces.push(piece);
    }

    /// The soil's look at a place with whatever track lies there; the last one where tracks cross.
    pub fn on_soil(&self, look: Appearance, x_m: f64, y_m: f64) -> Appearance {
        let cell = ((x_m / CELL_M).floor() as i32, (y_m / CELL_M).floor() as i32);
        let pieces = self.cells.get(&cell).into_iter().flatten().rev();
        let Some(slope) = pieces.filter_map(|&index| self.pieces[index as usize].slope_at(x_m, y_m)).next()
        else {
            return look;
        };
        // With z down, the normal that points up is (∂z/∂x, ∂z/∂y, −1) up to scale: slopes of two reliefs add.
        let [nx, ny, nz] = look.normal;
        let tilted = [nx / -nz + slope[0] as f32, ny / -nz + slope[1] as f32, -1.0];
        let scale = 1.0 / (tilted[0] * tilted[0] + tilted[1] * tilted[1] + 1.0).sqrt();
        Appearance { albedo: look.albedo * DARKER, normal: tilted.map(|v| v * scale) }
    }
}

impl Piece {
    /// Gradient of the depth at a place of the track, m per m along x and y; nothing beside the piece.
    fn slope_at(&self, x_m: f64, y_m: f64) -> Option<[f64; 2]> {
        let [dx, dy] = [x_m - self.from_m[0], y_m - self.from_m[1]];
        let [ax, ay] = self.along;
        let (along_m, across_m) = (dx * ax + dy * ay, dy * ax - dx * ay);
        // A piece reaches a little beyond its ends, so that no wedge is left where the track bends.
        let slack_m = 0.2 * self.half_width_m;
        if across_m.abs() > self.half_width_m || along_m < -slack_m || along_m > self.length_m + slack_m {
            return None;
        }
        let t = ((self.half_width_m - across_m.abs()) / EDGE_M).min(1.0);
        let fall = -across_m.signum() * self.depth_m * 6.0 * t * (1.0 - t) / EDGE_M;
        let phase = TAU * (self.before_m + along_m) / CLEAT_SPACING_M;
        let cleat = -0.5 * CLEAT_M * TAU / CLEAT_SPACING_M * phase.sin();
        Some([cleat * ax - fall * ay, cleat * ay + fall * ax])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Point3;

    fn line() -> Polyline {
        let points_in_site = vec![Point3::new(1.0, 2.0, 0.3), Point3::new(3.0, 2.0, 0.3)];
        Polyline { wheel: 0, points_in_site, width_m: 0.16, depth_m: 0.01 }
    }

    #[test]
    fn a_track_darkens_its_width_and_nothing_beside_it() {
        let imprint = Imprint::new(&[line()]);
        let look = Appearance { albedo: 0.25, normal: [0.0, 0.0, -1.0] };
        for (y_m, albedo) in [(2.0, 0.2), (2.079, 0.2), (2.081, 0.25), (1.921, 0.2), (1.919, 0.25)] {
            assert!((imprint.on_soil(look, 2.0, y_m).albedo - albedo).abs() < 1e-6, "{y_m}");
        }
        assert_eq!(imprint.on_soil(look, 3.2, 2.0).albedo, 0.25);
    }

    #[test]
    fn slopes_are_the_gradient_of_the_groove_s_depth() {
        let imprint = Imprint::new(&[line()]);
        let piece = imprint.pieces[0];
        let depth = |x_m: f64, y_m: f64| {
            let t = ((0.08 - (y_m - 2.0f64).abs()) / EDGE_M).clamp(0.0, 1.0);
            0.01 * t * t * (3.0 - 2.0 * t) + 0.5 * CLEAT_M * (TAU * (x_m - 1.0) / CLEAT_SPACING_M).cos()
        };
        for (x_m, y_m) in [(1.5, 2.06), (2.013, 1.94), (2.7, 2.01)] {
            let slope = piece.slope_at(x_m, y_m).unwrap();
            let step = 1e-6;
            let along_x = (depth(x_m + step, y_m) - depth(x_m - step, y_m)) / (2.0 * step);
            let along_y = (depth(x_m, y_m + step) - depth(x_m, y_m - step)) / (2.0 * step);
            assert!((slope[0] - along_x).abs() < 1e-6 && (slope[1] - along_y).abs() < 1e-6, "{slope:?}");
        }
    }
}
