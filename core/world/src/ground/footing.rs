//! Footing: the surface that supports the wheels, which is the ground and the rocks that wheels can climb.
//!
//! A wheel is 16 cm wide, while its contact model is a thin disc (`suspension.rs`). For the disc each rock therefore has a
//! skirt that falls off within half a wheel's width: a rock under the wheel's shoulder lifts it, the more the nearer it is
//! to the wheel's middle, and no disc hangs on a vertical edge. A rock with its skirt is convex: its upper surface is the
//! highest one below the planes of all facets less steep than S, and below planes of slope S that touch the rock in each
//! of sixteen directions d:
//! ```text
//! z(p) = max over facets and skirts of z0 + g·p      facet: g = −(n_x, n_y)/n_z, z0 = h/n_z      (z down)
//! skirt: g = S d,  z0 = min over vertices v of v_z − S d·(v_x, v_y),   S = max(1, H / (w/2))
//! footing(x, y) = min of the ground's z and of z over the rocks near there
//! ```
//! The top of a rock is met exactly. Rocks whose height H is above `rover.climb_m` are not part of the footing: a planner
//! avoids them, and a drive that leads a wheel against one is rejected (`course.rs`). Fiducials and occluders, which no
//! rover meets, are not part of it either.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | n, h; v | `Plane`, `vertices` of a rock | –, m; m, axes of the site, from the rock's centre |
//! | H | `height_m` | m |
//! | w | `WHEEL_WIDTH_M` | m |
//! | S | `steepness` | m/m |
//!
//! Frame: site. Sources: ours; domain.md 5.4 (wheels, climb).

use std::f64::consts::TAU;

use crate::ground::rocks::Rock;
use crate::ground::terrain::Terrain;
use crate::rover::suspension::WHEEL_WIDTH_M;
use sightline_geometry::frames::{Point3, Ray, Vector3};

/// Side of a cell of the rock grid, m.
const CELL_M: f64 = 0.25;
/// Number of skirt directions of a rock.
const SKIRTS: u32 = 16;

/// A plane z = z0 + g·p, p from the centre of its rock.
#[derive(Clone, Copy, Debug)]
struct Face {
    z0_m: f64,
    gradient: [f64; 2],
}

/// A rock with its skirt.
#[derive(Clone, Debug)]
struct Tent {
    centre: Point3,
    /// Radius from the centre beyond which the skirt is below the ground, m.
    reach_m: f64,
    faces: Vec<Face>,
}

/// The rocks around a drive as obstacles and supports for wheels.
#[derive(Clone, Debug)]
pub(crate) struct Footing {
    origin_m: [f64; 2],
    cells: [usize; 2],
    /// Indices of the tents that overlap each cell.
    climbed: Vec<Vec<u32>>,
    tents: Vec<Tent>,
    /// Indices (in the world) of the rocks too high to climb that overlap each cell.
    avoided: Vec<Vec<u32>>,
}

impl Footing {
    /// The rocks on the rectangle `x_m` × `y_m` of the site frame; wheels climb rocks up to `climb_m`.
    pub(crate) fn new(rocks: &[Rock], x_m: [f64; 2], y_m: [f64; 2], climb_m: f64) -> Self {
        let cells = [x_m, y_m].map(|[from, to]| ((to - from) / CELL_M).ceil().max(1.0) as usize);
        let none = vec![Vec::new(); cells[0] * cells[1]];
        let origin_m = [x_m[0], y_m[0]];
        let mut footing = Self { origin_m, cells, climbed: none.clone(), tents: Vec::new(), avoided: none };
        for (number, rock) in rocks.iter().enumerate() {
            if rock.height_m > climb_m {
                for cell in footing.cells_around(&rock.centre, rock.radius_m) {
                    footing.avoided[cell].push(number as u32);
                }
                continue;
            }
            let tent = Tent::over(rock);
            for cell in footing.cells_around(&tent.centre, tent.reach_m) {
                footing.climbed[cell].push(footing.tents.len() as u32);
            }
            footing.tents.push(tent);
        }
        footing
    }

    /// Indices of the cells that the square around a circle overlaps.
    fn cells_around(&self, centre: &Point3, reach_m: f64) -> Vec<usize> {
        let range = |k: usize| {
            let cell = |by_m: f64| (centre[k] + by_m - self.origin_m[k]) / CELL_M;
            let (low, high) = (cell(-reach_m).floor().max(0.0), cell(reach_m).floor());
            (low as usize)..((high + 1.0).max(0.0) as usize).min(self.cells[k])
        };
        range(1).flat_map(|y| range(0).map(move |x| (x, y))).map(|(x, y)| y * self.cells[0] + x).collect()
    }

    fn cell(&self, x_m: f64, y_m: f64) -> Option<usize> {
        let p = [(x_m - self.origin_m[0]) / CELL_M, (y_m - self.origin_m[1]) / CELL_M];
        (0..2)
            .all(|k| p[k] >= 0.0 && p[k] < self.cells[k] as f64)
            .then(|| p[1] as usize * self.cells[0] + p[0] as usize)
    }

    /// z of the footing at a point, site frame, m, positive down.
    pub(crate) fn z_at(&self, terrain: &Terrain, x_m: f64, y_m: f64) -> f64 {
        let ground_z_m = terrain.z_at(x_m, y_m);
        let Some(cell) = self.cell(x_m, y_m) else { return ground_z_m };
        self.climbed[cell].iter().fold(ground_z_m, |z_m, &tent| {
            self.tents[tent as usize].z_at(x_m, y_m).map_or(z_m, |top_m| z_m.min(top_m))
        })
    }

    /// Height of the rock at a point that is too high to climb, m; `None` if there is none.
    pub(crate) fn blocked_by_m(&self, rocks: &[Rock], x_m: f64, y_m: f64) -> Option<f64> {
        let down = Ray { origin: Point3::new(x_m, y_m, 0.0), direction: Vector3::z() };
        let near = self.avoided[self.cell(x_m, y_m)?].iter().map(|&number| &rocks[number as usize]);
        near.filter(|rock| rock.interval(&down).is_some()).map(|rock| rock.height_m).next()
    }
}

impl Tent {
    fn over(rock: &Rock) -> Self {
        let steepness = (rock.height_m / (0.5 * WHEEL_WIDTH_M)).max(1.0);
        let facets = rock.planes().iter().filter(|plane| plane.normal.z < 0.0).map(|plane| {
            let n = plane.normal;
            Face { z0_m: plane.offset_m / n.z, gradient: [-n.x / n.z, -n.y / n.z] }
        });
        let gentle = |face: &Face| face.gradient[0].hypot(face.gradient[1]) <= steepness;
        let skirts = (0..SKIRTS).map(|k| {
            let (sine, cosine) = (TAU * f64::from(k) / f64::from(SKIRTS)).sin_cos();
            let gradient = [steepness * cosine, steepness * sine];
            let below = |v: &Vector3| v.z - gradient[0] * v.x - gradient[1] * v.y;
            Face { z0_m: rock.vertices().iter().map(below).fold(f64::INFINITY, f64::min), gradient }
        });
        let outline_m = rock.vertices().iter().map(|v| v.xy().norm()).fold(0.0, f64::max);
        Self {
            centre: rock.centre,
            // Four rock heights below the top a skirt is below the ground on any slope that a scenario allows.
            reach_m: outline_m + 4.0 * rock.height_m / steepness + 0.02,
            faces: facets.filter(gentle).chain(skirts).collect(),
        }
    }

    fn z_at(&self, x_m: f64, y_m: f64) -> Option<f64> {
        let (x, y) = (x_m - self.centre.x, y_m - self.centre.y);
        if x * x + y * y > self.reach_m * self.reach_m {
            return None;
        }
        let z = |face: &Face| face.z0_m + face.gradient[0] * x + face.gradient[1] * y;
        Some(self.centre.z + self.faces.iter().map(z).fold(f64::NEG_INFINITY, f64::max))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::level::MEAN_GROUND_Z_M;
    use crate::ground::rocks::RockSeed;
    use crate::rover::suspension::settle;
    use crate::scenario::{RockShape, TerrainSettings};

    const EXTENT_M: [[f64; 2]; 2] = [[-3.0, 3.0], [-3.0, 3.0]];
    const CLIMB_M: f64 = 0.25;

    fn flat() -> Terrain {
        let settings = TerrainSettings { rms_at_1m_m: 0.0, ..TerrainSettings::default() };
        Terrain::new(&settings, EXTENT_M[0], EXTENT_M[1], 1)
    }

    fn rock(shape: RockShape, height_m: f64, seed: u64) -> Rock {
        let (x_m, y_m, diameter_m) = (0.70, -0.53, 2.0 * height_m);
        let from = RockSeed { x_m, y_m, diameter_m, height_m, shape, face_yaw_rad: None, seed };
        Rock::grow(&from, MEAN_GROUND_Z_M, &-Vector3::z())
    }

    #[test]
    fn footing_is_the_rock_s_top_and_falls_no_steeper_than_its_skirt() {
        let terrain = flat();
        for seed in 0..24u64 {
            let shape =
                [RockShape::Angular, RockShape::Block, RockShape::Cobble, RockShape::Slab][seed as usize % 4];
            let rock = rock(shape, 0.02 + 0.007 * seed as f64, seed);
            let footing = Footing::new(std::slice::from_ref(&rock), EXTENT_M[0], EXTENT_M[1], CLIMB_M);
            let steepness = (rock.height_m / 0.08).max(1.0);
            let step_m = rock.radius_m / 50.0;
            let z = |ix: i32, iy: i32| {
                footing.z_at(&terrain, 0.70 + f64::from(ix) * step_m, -0.53 + f64::from(iy) * step_m)
            };
            let mut highest_z_m = f64::INFINITY;
            for (ix, iy) in (-140..140).flat_map(|ix| (-140..140).map(move |iy| (ix, iy))) {
                let here_m = z(ix, iy);
                highest_z_m = highest_z_m.min(here_m);
                let [x, y] = [0.70 + f64::from(ix) * step_m, -0.53 + f64::from(iy) * step_m];
                let down = Ray { origin: Point3::new(x, y, -2.0), direction: Vector3::z() };
                if let Some(top) = rock.interval(&down) {
                    assert!(here_m <= top.enter_m - 2.0 + 1e-9, "{seed}: inside the rock");
                }
                for next_m in [z(ix + 1, iy), z(ix, iy + 1)] {
                    let fall = (next_m - here_m).abs() / step_m;
                    assert!(fall <= steepness * (1.0 + 1e-9), "{seed}: {fall} {steepness}");
                }
            }
            let height_m = f64::from(MEAN_GROUND_Z_M as f32) - highest_z_m;
            assert!((height_m / rock.height_m - 1.0).abs() < 0.01, "{seed}: {height_m}");
        }
    }

    #[test]
    fn a_slab_under_the_left_front_wheel_gives_the_angles_of_the_levers() {
        // As for the ball's cap in `suspension.rs`, to first order in h: φ = h/3.32, pitch = h/2.1.
        let terrain = flat();
        let ground_z_m = f64::from(MEAN_GROUND_Z_M as f32);
        for seed in 0..4 {
            let from = RockSeed {
                x_m: 0.70,
                y_m: -0.53,
                diameter_m: 0.3,
                height_m: 0.02,
                shape: RockShape::Slab,
                face_yaw_rad: Some(0.3),
                seed,
            };
            let rock = Rock::grow(&from, ground_z_m, &-Vector3::z());
            let footing = Footing::new(&[rock], EXTENT_M[0], EXTENT_M[1], CLIMB_M);
            let stand = settle(&|x, y| footing.z_at(&terrain, x, y), 0.0, 0.0, 0.0).unwrap();
            let (roll, pitch, _) = stand.site_from_rover.rotation.euler_angles();
            let h = ground_z_m - stand.contacts_in_site[0].z;
            assert!(h > 0.015 && h < 0.0201, "{h}");
            assert!((roll / (h / 3.32) - 1.0).abs() < 0.02, "{roll} {h}");
            assert!((pitch / (h / 2.1) - 1.0).abs() < 0.02, "{pitch} {h}");
            let level = |wheel: usize| (stand.contacts_in_site[wheel].z - ground_z_m).abs();
            assert!((1..6).all(|wheel| level(wheel) < 1e-9));
        }
    }

    #[test]
    fn a_rock_above_the_limit_is_no_footing_and_blocks_its_outline_alone() {
        let terrain = flat();
        let ground_z_m = f64::from(MEAN_GROUND_Z_M as f32);
        for (height_m, climb_m, is_climbed) in
            [(0.249, CLIMB_M, true), (0.251, CLIMB_M, false), (0.199, 0.2, true), (0.201, 0.2, false)]
        {
            let rocks = [rock(RockShape::Block, height_m, 3)];
            let footing = Footing::new(&rocks, EXTENT_M[0], EXTENT_M[1], climb_m);
            assert_eq!(footing.z_at(&terrain, 0.70, -0.53) < ground_z_m - 0.1, is_climbed);
            assert_eq!(footing.blocked_by_m(&rocks, 0.70, -0.53).is_none(), is_climbed);
            assert_eq!(footing.blocked_by_m(&rocks, 0.70, 0.53), None);
        }
    }
}
