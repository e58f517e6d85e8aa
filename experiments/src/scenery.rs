//! How natural a world is: its rocks, its ground and its pictures in numbers, against laws and real frames.
//!
//! * **Rocks**: the number of diameter D or more in a rectangle against `N(≥D)` of Golombek & Rapp and its Poisson σ,
//!   and the part of the ground that they cover against `F(≥D) = k e^{−qD}`, both up to the largest rock allowed.
//! * **Ground**: the mean plane by least squares; the RMS difference of height above it between places a distance r
//!   apart against `s r^H`; and r's bidirectional slope, atan of that difference over r (domain.md 10.4).
//!
//! What a picture shows is measured in `picture.rs`, alike for simulated and real frames.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | k | `area_fraction` | – |
//! | q | 1.79 + 0.152/k | 1/m |
//! | D | `diameter_m` | m |
//! | r | `distance_m` | m |
//! | s, H | `rms_at_1m_m`, `hurst` | m, – |
//!
//! Frame: site. Pure computation. Sources: domain.md 10.1, 10.4; Golombek & Rapp 1997.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use sightline_world::World;
use sightline_world::ground::rock_law::number_per_m2;
use sightline_world::scenario::{RockSettings, TerrainSettings};

/// A rectangle of the site.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Rectangle {
    /// From and to ahead, m.
    pub x_m: [f64; 2],
    /// From and to on the right, m.
    pub y_m: [f64; 2],
}

/// Rocks of one diameter or more.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RockRow {
    /// The least diameter, m.
    pub diameter_m: f64,
    /// How many the law expects.
    pub expected: f64,
    /// How many there are.
    pub counted: u32,
    /// 1σ of the number expected.
    pub sigma: f64,
}

/// The rocks of some worlds against the law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct RockReport {
    /// How many worlds.
    pub worlds: usize,
    /// The area counted over all worlds, m².
    pub area_m2: f64,
    /// Rocks of all sizes and places in a world, on average.
    pub rocks_per_world: f64,
    /// Part of the area that rocks cover.
    pub covered: f64,
    /// Part that the law expects.
    pub covered_expected: f64,
    /// Numbers by least diameter.
    pub rows: Vec<RockRow>,
}

/// Differences of height over one distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct GroundRow {
    /// The distance, m.
    pub distance_m: f64,
    /// RMS difference of height above the mean plane, m.
    pub rms_difference_m: f64,
    /// What the settings of the fractal expect, without ripples, m.
    pub expected_m: f64,
    /// RMS bidirectional slope over the distance, deg.
    pub slope_deg: f64,
}

/// The ground of some worlds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct GroundReport {
    /// Slope of the mean plane, mean over the worlds, deg.
    pub slope_deg: f64,
    /// Direction of its steepest ascent, deg clockwise from above, 0 ahead; nothing on level ground (below 0.5°).
    pub slope_azimuth_deg: Option<f64>,
    /// By distance.
    pub rows: Vec<GroundRow>,
}

impl Rectangle {
    fn holds(&self, x_m: f64, y_m: f64) -> bool {
        (self.x_m[0]..self.x_m[1]).contains(&x_m) && (self.y_m[0]..self.y_m[1]).contains(&y_m)
    }

    /// Area, m².
    pub(crate) fn area_m2(&self) -> f64 {
        (self.x_m[1] - self.x_m[0]) * (self.y_m[1] - self.y_m[0])
    }

    /// The place at parts (0 to 1) of both sides.
    fn place(&self, u: f64, v: f64) -> [f64; 2] {
        [self.x_m[0] + u * (self.x_m[1] - self.x_m[0]), self.y_m[0] + v * (self.y_m[1] - self.y_m[0])]
    }
}

/// Counts the rocks of worlds of the same settings in rectangles that keep clear of the tracks and the cluster.
///
/// `diameters_m` are the least diameters of the rows.
pub(crate) fn rock_report(
    worlds: &[&World],
    settings: &RockSettings,
    rectangles: &[Rectangle],
    diameters_m: &[f64],
) -> RockReport {
    let (k, largest_m) = (settings.area_fraction, settings.largest_m);
    let area_m2 = worlds.len() as f64 * rectangles.iter().map(Rectangle::area_m2).sum::<f64>();
    let inside: Vec<f64> = worlds
        .iter()
        .flat_map(|world| world.rocks())
        .filter(|rock| rectangles.iter().any(|r| r.holds(rock.centre.x, rock.centre.y)))
        .map(|rock| rock.diameter_m)
        .collect();
    let rows = diameters_m.iter().map(|&diameter_m| {
        let expected = (number_per_m2(k, diameter_m) - number_per_m2(k, largest_m)).max(0.0) * area_m2;
        let counted = inside.iter().filter(|d| **d >= diameter_m).count() as u32;
        RockRow { diameter_m, expected, counted, sigma: expected.sqrt() }
    });
    let q = 1.79 + 0.152 / k.max(1e-9);
    let rocks: usize = worlds.iter().map(|world| world.rocks().len()).sum();
    RockReport {
        worlds: worlds.len(),
        area_m2,
        rocks_per_world: rocks as f64 / worlds.len().max(1) as f64,
        covered: inside.iter().map(|d| PI * d * d / 4.0).sum::<f64>() / area_m2,
        covered_expected: k * ((-q * settings.smallest_m).exp() - (-q * largest_m).exp()),
        rows: rows.collect(),
    }
}

/// (slope along x, slope along y, height at the origin) of the plane nearest to a world's ground in a rectangle.
fn mean_plane(world: &World, rectangle: &Rectangle) -> Vector3<f64> {
    const SIDE: u32 = 100;
    let (mut matrix, mut right_side) = (Matrix3::zeros(), Vector3::zeros());
    for k in 0..SIDE * SIDE {
        let part = |k: u32| (f64::from(k) + 0.5) / f64::from(SIDE);
        let [x, y] = rectangle.place(part(k % SIDE), part(k / SIDE));
        let row = Vector3::new(x, y, 1.0);
        matrix += row * row.transpose();
        right_side += row * world.ground_z_at(x, y);
    }
    // A rectangle with area has places that are not on one line.
    matrix.try_inverse().unwrap_or_else(Matrix3::identity) * right_side
}

/// Measures the bare ground of worlds of the same settings in a rectangle.
pub(crate) fn ground_report(
    worlds: &[&World],
    settings: &TerrainSettings,
    rectangle: &Rectangle,
    distances_m: &[f64],
) -> GroundReport {
    let planes: Vec<Vector3<f64>> = worlds.iter().map(|world| mean_plane(world, rectangle)).collect();
    let mean = planes.iter().sum::<Vector3<f64>>() / planes.len().max(1) as f64;
    let slope_deg = mean.x.hypot(mean.y).atan().to_degrees();
    let rows = distances_m.iter().map(|&distance_m| {
        let sum: f64 =
            worlds.iter().map(|world| mean_square_difference(world, rectangle, &mean, distance_m)).sum();
        let rms_difference_m = (sum / worlds.len().max(1) as f64).sqrt();
        GroundRow {
            distance_m,
            rms_difference_m,
            expected_m: settings.rms_at_1m_m * distance_m.powf(settings.hurst),
            slope_deg: (rms_difference_m / distance_m).atan().to_degrees(),
        }
    });
    GroundReport {
        slope_deg,
        // z points down: the ground rises against its gradient.
        slope_azimuth_deg: (slope_deg > 0.5).then(|| (-mean.y).atan2(-mean.x).to_degrees()),
        rows: rows.collect(),
    }
}

/// Mean squared difference of height above a plane over a distance, in all directions.
fn mean_square_difference(
    world: &World,
    rectangle: &Rectangle,
    plane: &Vector3<f64>,
    distance_m: f64,
) -> f64 {
    const PAIRS: u32 = 4000;
    let height_m = |x: f64, y: f64| world.ground_z_at(x, y) - plane.x * x - plane.y * y;
    let sum: f64 = (0..PAIRS)
        .map(|k| {
            // The plastic number's sequence fills the rectangle evenly, the golden angle all directions.
            let k = f64::from(k);
            let [x, y] =
                rectangle.place((k * 0.754_877_666_246_693).fract(), (k * 0.569_840_290_998_053).fract());
            let angle_rad = (k * 0.381_966_011_250_105).fract() * TAU;
            let there = height_m(x + distance_m * angle_rad.cos(), y + distance_m * angle_rad.sin());
            (there - height_m(x, y)).powi(2)
        })
        .sum();
    sum / f64::from(PAIRS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sightline_world::Scenario;

    fn worlds(change: impl Fn(&mut Scenario)) -> (Scenario, Vec<World>) {
        let mut scenario = Scenario::demo();
        scenario.terrain.cell_m = 0.05;
        scenario.rocks.farthest_m = 9.0;
        change(&mut scenario);
        let worlds = (1..=6).map(|seed| World::new(&Scenario { seed, ..scenario.clone() })).collect();
        (scenario, worlds)
    }

    #[test]
    fn rocks_of_sparse_and_dense_worlds_follow_the_law_from_pebbles_to_boulders() {
        let beside = |side: [f64; 2]| Rectangle { x_m: [3.0, 8.0], y_m: side };
        for area_fraction in [0.05, 0.30] {
            let (scenario, worlds) = worlds(|s| {
                s.rocks.area_fraction = area_fraction;
                s.rocks.cluster_count = 0;
            });
            let worlds: Vec<&World> = worlds.iter().collect();
            let rectangles = [beside([-3.2, -1.9]), beside([1.9, 3.2])];
            let report = rock_report(&worlds, &scenario.rocks, &rectangles, &[0.02, 0.05, 0.1, 0.3]);
            for row in &report.rows {
                assert!((f64::from(row.counted) - row.expected).abs() < 4.0 * row.sigma, "{row:?}");
            }
            // The largest rocks carry the area: a few of them in 78 m² leave a third of uncertainty when sparse.
            let ratio = report.covered / report.covered_expected;
            assert!((0.6..1.5).contains(&ratio), "{report:?}");
        }
    }

    #[test]
    fn ground_has_its_slope_and_its_roughness_with_and_without_tilt() {
        for (slope_deg, slope_azimuth_deg) in [(0.0, 0.0), (8.0, -60.0)] {
            let (scenario, worlds) = worlds(|s| {
                s.rocks.area_fraction = 0.0;
                s.rocks.cluster_count = 0;
                (s.terrain.slope_deg, s.terrain.slope_azimuth_deg) = (slope_deg, slope_azimuth_deg);
            });
            let worlds: Vec<&World> = worlds.iter().collect();
            let rectangle = Rectangle { x_m: [1.0, 15.0], y_m: [-4.0, 4.0] };
            let report = ground_report(&worlds, &scenario.terrain, &rectangle, &[0.25, 0.5, 1.0]);
            // A relief of 2 cm over metres tilts the plane of one world by some tenths of a degree.
            assert!((report.slope_deg - slope_deg).abs() < 0.25, "{report:?}");
            let azimuth_deg = report.slope_azimuth_deg.unwrap_or(0.0);
            assert!((azimuth_deg - slope_azimuth_deg).abs() < 2.0, "{report:?}");
            for row in &report.rows {
                assert!((row.rms_difference_m / row.expected_m - 1.0).abs() < 0.15, "{row:?}");
            }
        }
    }
}
