//! Appearance of wheel tracks: darker soil, with the slopes of a groove and of cleat marks.
//!
//! Like all relief finer than the height grid, a track tilts the shading normal and darkens the soil. The surface that
//! rays meet is unchanged, so that it need not be rebuilt at every stop.
//!
//! **Groove.** All tracks together press the soil once: at a point at distance r from the nearest point of a wheel's path
//! the groove has the depth below, and where tracks overlap the deepest counts. A path is a smooth curve (Catmull–Rom)
//! through the wheel's positions, in nearly straight pieces; a corner sharper than 30° (the wheel stopped and was steered)
//! is kept.
//! **Cleats.** The last wheel to pass leaves its marks along its path. They fade where an image cannot resolve them.
//! ```text
//! z(r, l) = depth · step((w/2 − r)/EDGE_M) + a CLEAT_M/2 · cos(2π l / CLEAT_SPACING_M),   step(t) = t²(3 − 2t)
//! a = clamp(2 − c/CLEAT_SPACING_M, 0, 1)
//! ```
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | r, l | from the line and along it | m |
//! | w | width of the track | m |
//! | c | `cutoff_m`: the shortest wavelength that the samples carry | m |
//! | z | depth below the untouched ground, positive down | m |
//!
//! Frame: site. Sources: papers.md R142; domain.md 10.4 (16 cm wide, 5 to 10 mm deep, albedo × 0.8).

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::Vector2;

use crate::light::reflection::Appearance;
use crate::rover::tracks::Tracks;

/// Albedo of a track over that of the untouched soil.
const DARKER: f32 = 0.8;
/// Width over which the groove reaches its depth at each side, m.
const EDGE_M: f64 = 0.03;
/// Depth of the cleat marks from trough to crest, m, and their spacing, m.
const CLEAT_M: f64 = 0.003;
const CLEAT_SPACING_M: f64 = 0.04;
/// Side of a cell of the piece grid, m.
const CELL_M: f64 = 0.125;
/// Number of pieces into which the curve between two wheel positions is divided where it bends.
const PIECES: u32 = 4;
/// Cosine of the angle between curve and chord up to which a curve counts as straight: 1°.
const STRAIGHT: f64 = 0.999_85;
/// Cosine of the sharpest corner that is smoothed.
const SMOOTH_CORNER: f64 = 0.866;
/// Largest distance between consecutive wheel positions of one track, m.
const GAP_M: f64 = 1.0;
/// Wheel positions within which a wheel's pass counts as one, so that its own neighbouring pieces do not hide each other.
const ONE_PASSING: u32 = 3;

/// A straight piece of a track.
#[derive(Clone, Copy, Debug)]
struct Piece {
    from_m: Vector2<f64>,
    /// Unit direction along the piece.
    along: Vector2<f64>,
    length_m: f64,
    /// Length of the track before this piece, m.
    before_m: f64,
    wheel: usize,
    /// Index of the drive position at which it ends, in order of time.
    number: u32,
}

/// All tracks of a drive, in a spatial grid.
#[derive(Clone, Debug, Default)]
pub(crate) struct Laid {
    pieces: Vec<Piece>,
    cells: HashMap<(i32, i32), Vec<u32>>,
    half_width_m: f64,
    depth_m: f64,
    /// Number of drive positions passed at each stop.
    passed: Vec<usize>,
}

/// The tracks on the ground at one stop.
#[derive(Clone, Debug)]
pub(crate) struct Imprint {
    laid: Arc<Laid>,
    passed: u32,
}

/// A piece near a point.
#[derive(Clone, Copy)]
struct Near<'a> {
    piece: &'a Piece,
    /// From the nearest point of the piece to the query point, m.
    aside_m: Vector2<f64>,
    r_m: f64,
    /// Distance of the nearest point along the track, m.
    along_m: f64,
}

impl Laid {
    /// The tracks of a whole drive.
    pub(crate) fn new(tracks: &Tracks) -> Self {
        let lines = tracks.lines();
        let mut laid = Self {
            half_width_m: lines.first().map_or(0.0, |line| 0.5 * line.width_m),
            depth_m: lines.first().map_or(0.0, |line| line.depth_m),
            passed: tracks.laid().to_vec(),
            ..Self::default()
        };
        for line in lines {
            let mut places: Vec<(u32, Vector2<f64>)> = Vec::with_capacity(line.points_in_site.len());
            for (number, point) in line.points_in_site.iter().enumerate() {
                let place = Vector2::from(*point);
                // A wheel that does not move gives its path no direction.
                if places.last().is_none_or(|(_, last)| (place - last).norm() > 1e-9) {
                    places.push((number as u32, place));
                }
            }
            // A gap in a recorded path leaves no track.
            let is_joined = |a: &(u32, Vector2<f64>), b: &(u32, Vector2<f64>)| (b.1 - a.1).norm() <= GAP_M;
            for part in places.chunk_by(is_joined) {
                laid.add_line(line.wheel, part);
            }
        }
        laid
    }

    fn add_line(&mut self, wheel: usize, places: &[(u32, Vector2<f64>)]) {
        let tangents = tangents(places);
        let mut before_m = 0.0;
        for (k, pair) in places.windows(2).enumerate() {
            let ((_, from_m), (number, to_m)) = (pair[0], pair[1]);
            let chord_m = (to_m - from_m).norm();
            let [leaving, arriving] = [tangents[k].1 * chord_m, tangents[k + 1].0 * chord_m];
            let least_cosine = leaving.dot(&(to_m - from_m)).min(arriving.dot(&(to_m - from_m)));
            let pieces = if least_cosine >= STRAIGHT * chord_m * chord_m { 1 } else { PIECES };
            let mut last_m = from_m;
            for part in 1..=pieces {
                let t = f64::from(part) / f64::from(pieces);
                let next_m = hermite(from_m, leaving, to_m, arriving, t);
                let way_m = next_m - last_m;
                let length_m = way_m.norm();
                if length_m > 0.0 {
                    let along = way_m / length_m;
                    self.add(Piece { from_m: last_m, along, length_m, before_m, wheel, number });
                }
                before_m += length_m;
                last_m = next_m;
            }
        }
    }

    fn add(&mut self, piece: Piece) {
        let index = self.pieces.len() as u32;
        let to_m = piece.from_m + piece.along * piece.length_m;
        let range = |k: usize| {
            let low = piece.from_m[k].min(to_m[k]) - self.half_width_m;
            let high = piece.from_m[k].max(to_m[k]) + self.half_width_m;
            (low / CELL_M).floor() as i32..=(high / CELL_M).floor() as i32
        };
        for y in range(1) {
            for x in range(0) {
                self.cells.entry((x, y)).or_default().push(index);
            }
        }
        self.pieces.push(piece);
    }

    /// The pieces with numbers below `passed` that cover a point.
    fn near(&self, place_m: Vector2<f64>, passed: u32) -> impl Iterator<Item = Near<'_>> + Clone {
        let cell = ((place_m.x / CELL_M).floor() as i32, (place_m.y / CELL_M).floor() as i32);
        let pieces = self.cells.get(&cell).into_iter().flatten();
        pieces
            .map(|&index| &self.pieces[index as usize])
            .filter(move |piece| piece.number < passed)
            .filter_map(move |piece| {
                let from_start = place_m - piece.from_m;
                let along_m = from_start.dot(&piece.along).clamp(0.0, piece.length_m);
                let aside_m = from_start - piece.along * along_m;
                let r_m2 = aside_m.norm_squared();
                let along_m = piece.before_m + along_m;
                let is_near = r_m2 <= self.half_width_m * self.half_width_m;
                is_near.then(|| Near { piece, aside_m, r_m: r_m2.sqrt(), along_m })
            })
    }

    /// Gradient of the depth at a point along x and y, m/m; `None` beside the tracks.
    fn slope_at(&self, place_m: Vector2<f64>, passed: u32, cutoff_m: f64) -> Option<Vector2<f64>> {
        let near = self.near(place_m, passed);
        let (mut deepest, mut last) = (near.clone().next()?, None::<&Piece>);
        for one in near.clone() {
            deepest = if one.r_m < deepest.r_m { one } else { deepest };
            last = last.filter(|last| last.number >= one.piece.number).or(Some(one.piece));
        }
        let last = last?;
        let t = ((self.half_width_m - deepest.r_m) / EDGE_M).min(1.0);
        let fall = self.depth_m * 6.0 * t * (1.0 - t) / EDGE_M;
        let outward = if deepest.r_m > 0.0 { deepest.aside_m / deepest.r_m } else { Vector2::zeros() };
        let is_last_passing =
            |one: &Near<'_>| one.piece.wheel == last.wheel && one.piece.number + ONE_PASSING >= last.number;
        let mark = near.filter(is_last_passing).min_by(|a, b| a.r_m.total_cmp(&b.r_m))?;
        let carried = (2.0 - cutoff_m / CLEAT_SPACING_M).clamp(0.0, 1.0);
        let phase = TAU * mark.along_m / CLEAT_SPACING_M;
        let cleat = -0.5 * carried * CLEAT_M * TAU / CLEAT_SPACING_M * phase.sin();
        Some(cleat * mark.piece.along - fall * outward)
    }
}

/// The unit directions of arrival at and departure from each wheel position; they differ at corners.
fn tangents(places: &[(u32, Vector2<f64>)]) -> Vec<(Vector2<f64>, Vector2<f64>)> {
    let way = |k: usize| (places[k + 1].1 - places[k].1).normalize();
    let last = places.len().saturating_sub(1);
    (0..places.len())
        .map(|k| match (k.checked_sub(1).map(way), (k < last).then(|| way(k))) {
            (Some(before), Some(after)) if before.dot(&after) >= SMOOTH_CORNER => {
                let middle = (before + after).normalize();
                (middle, middle)
            }
            (before, after) => {
                let only = before.or(after).unwrap_or_else(Vector2::zeros);
                (only, after.unwrap_or(only))
            }
        })
        .collect()
}

/// Cubic Hermite interpolation between two positions with the given derivatives, at parameter t.
fn hermite(
    from_m: Vector2<f64>,
    leaving_m: Vector2<f64>,
    to_m: Vector2<f64>,
    arriving_m: Vector2<f64>,
    t: f64,
) -> Vector2<f64> {
    let (t2, t3) = (t * t, t * t * t);
    from_m * (2.0 * t3 - 3.0 * t2 + 1.0)
        + leaving_m * (t3 - 2.0 * t2 + t)
        + to_m * (3.0 * t2 - 2.0 * t3)
        + arriving_m * (t3 - t2)
}

impl Imprint {
    /// The tracks on the ground at a stop; `None` if there are none.
    pub(crate) fn at_stop(laid: &Arc<Laid>, stop: usize) -> Option<Self> {
        let passed = laid.passed.get(stop).or(laid.passed.last()).copied().unwrap_or(0);
        (passed > 0).then(|| Self { laid: Arc::clone(laid), passed: passed as u32 })
    }

    /// Modifies the soil's appearance at a point by the tracks there.
    pub(crate) fn on_soil(&self, look: Appearance, x_m: f64, y_m: f64, cutoff_m: f32) -> Appearance {
        let place_m = Vector2::new(x_m, y_m);
        let Some(slope) = self.laid.slope_at(place_m, self.passed, f64::from(cutoff_m)) else {
            return look;
        };
        // With z down, the normal that points up is (∂z/∂x, ∂z/∂y, −1) up to scale: slopes of two reliefs add.
        let [nx, ny, nz] = look.normal;
        let tilted = [nx / -nz + slope.x as f32, ny / -nz + slope.y as f32, -1.0];
        let scale = 1.0 / (tilted[0] * tilted[0] + tilted[1] * tilted[1] + 1.0).sqrt();
        Appearance { albedo: look.albedo * DARKER, normal: tilted.map(|v| v * scale) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOOK: Appearance = Appearance { albedo: 0.25, normal: [0.0, 0.0, -1.0] };

    fn imprint(lines: &[Vec<[f64; 2]>]) -> Imprint {
        let mut laid = Laid { half_width_m: 0.08, depth_m: 0.01, ..Laid::default() };
        let mut number = 0;
        for (wheel, line) in lines.iter().enumerate() {
            let places: Vec<_> = line
                .iter()
                .map(|&[x, y]| {
                    number += 1;
                    (number, Vector2::new(x, y))
                })
                .collect();
            laid.add_line(wheel, &places);
        }
        Imprint { laid: Arc::new(laid), passed: u32::MAX }
    }

    fn straight() -> Imprint {
        imprint(&[vec![[1.0, 2.0], [3.0, 2.0]]])
    }

    #[test]
    fn a_track_darkens_its_width_and_nothing_beside_it() {
        let imprint = straight();
        for (y_m, albedo) in [(2.0, 0.2), (2.079, 0.2), (2.081, 0.25), (1.921, 0.2), (1.919, 0.25)] {
            assert!((imprint.on_soil(LOOK, 2.0, y_m, 0.0).albedo - albedo).abs() < 1e-6, "{y_m}");
        }
        assert_eq!(imprint.on_soil(LOOK, 3.2, 2.0, 0.0).albedo, 0.25);
    }

    #[test]
    fn slopes_are_the_gradient_of_the_groove_s_depth() {
        let imprint = straight();
        let depth = |x_m: f64, y_m: f64, carried: f64| {
            let t = ((0.08 - (y_m - 2.0f64).abs()) / EDGE_M).clamp(0.0, 1.0);
            let cleats = 0.5 * CLEAT_M * (TAU * (x_m - 1.0) / CLEAT_SPACING_M).cos();
            0.01 * t * t * (3.0 - 2.0 * t) + carried * cleats
        };
        for (cutoff_m, carried) in [(0.01, 1.0), (0.06, 0.5), (0.1, 0.0)] {
            for (x_m, y_m) in [(1.5, 2.06), (2.013, 1.94), (2.7, 2.01)] {
                let slope = imprint.laid.slope_at(Vector2::new(x_m, y_m), u32::MAX, cutoff_m).unwrap();
                let step = 1e-6;
                let along_x =
                    (depth(x_m + step, y_m, carried) - depth(x_m - step, y_m, carried)) / (2.0 * step);
                let along_y =
                    (depth(x_m, y_m + step, carried) - depth(x_m, y_m - step, carried)) / (2.0 * step);
                assert!((slope.x - along_x).abs() < 1e-6 && (slope.y - along_y).abs() < 1e-6, "{slope:?}");
            }
        }
    }

    #[test]
    fn a_turn_s_track_is_a_ring_without_gaps_notches_or_ridges() {
        // A wheel on a circle of 0.88 m in steps of 5°, as left by a turn in place.
        let ring = (0..=18).map(|k| {
            let (sine, cosine) = (5.0 * f64::from(k)).to_radians().sin_cos();
            [0.88 * cosine, 0.88 * sine]
        });
        let imprint = imprint(&[ring.collect()]);
        // Its ends have no neighbouring piece.
        for tenth in 50..850 {
            let (sine, cosine) = (0.1 * f64::from(tenth)).to_radians().sin_cos();
            let at = |r_m: f64| Vector2::new(r_m * cosine, r_m * sine);
            for aside_m in [-0.0797, -0.07, -0.06, 0.0, 0.06, 0.07, 0.0797] {
                let slope = imprint.laid.slope_at(at(0.88 + aside_m), u32::MAX, 1.0).unwrap();
                let t = ((0.08 - f64::abs(aside_m)) / EDGE_M).min(1.0);
                let fall = -0.01 * 6.0 * t * (1.0 - t) / EDGE_M * aside_m.signum();
                // Pieces of 1.25° keep the edge within 0.05 mm of the circle and its direction within 0.7°.
                let off = slope - fall * Vector2::new(cosine, sine);
                assert!(off.norm() < 0.02, "{tenth} {aside_m}: {slope:?} {fall}");
            }
            assert!(
                [-0.0803, 0.0803]
                    .iter()
                    .all(|aside_m| imprint.laid.slope_at(at(0.88 + aside_m), u32::MAX, 1.0).is_none())
            );
        }
    }

    #[test]
    fn crossing_tracks_press_the_soil_once_and_the_last_wheel_leaves_its_cleats() {
        let imprint = imprint(&[vec![[-1.0, 0.0], [1.0, 0.0]], vec![[0.0, -1.0], [0.0, 1.0]]]);
        // On the edge of the first track, well inside the second: no edge is left there.
        let inside = imprint.laid.slope_at(Vector2::new(0.01, 0.065), u32::MAX, 1.0).unwrap();
        assert_eq!(inside, Vector2::zeros());
        assert!((imprint.on_soil(LOOK, 0.0, 0.0, 1.0).albedo - 0.2).abs() < 1e-6);
        // The cleats follow the second track, the last one: their slope is along y.
        let cleats = imprint.laid.slope_at(Vector2::new(0.01, 0.01), u32::MAX, 0.0).unwrap();
        assert!(cleats.x == 0.0 && cleats.y.abs() > 0.1, "{cleats:?}");
        // Before the second wheel passed, they were those of the first.
        let before = imprint.laid.slope_at(Vector2::new(0.01, 0.01), 3, 0.0).unwrap();
        assert!(before.y == 0.0 && before.x.abs() > 0.1, "{before:?}");
    }
}
