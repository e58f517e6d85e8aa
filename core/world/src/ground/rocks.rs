//! Rocks: convex polyhedra with exact ray intersection.
//!
//! **Size.** D is the diameter of the disc with the area of the rock's outline seen from above, so that the area that
//! rocks cover is that of the size distribution; the visible height is H. A shape (`shape.rs`) is tilted by up to 15°,
//! rotated by any yaw and stretched to D and H exactly. A placed rock is not tilted, and D is its width across the
//! direction that its face points in.
//!
//! **Burial.** A fraction β of the full height is below the ground, so the full height is H/(1 − β). On a slope the rock
//! is aligned with the normal of the mean plane, as if it had been buried before the ground was tilted.
//!
//! **Intersection.** Along a ray, n·(o + t d) ≤ h is a half-line in t for each plane; their intersection is
//! an interval [enter, leave], empty when the ray misses. Nothing is approximated.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | D | `diameter_m` | m |
//! | H | `height_m` | m, above the ground |
//! | β | burial | – (0.1 to 0.4: domain.md 10.4) |
//! | n, h | `Plane` | unit normal, m; relative to the rock's centre, axes of the site frame |
//! | t | `enter_m`, `leave_m` | m along the ray |
//!
//! Sources: domain.md 10.3, 10.4.

use std::f64::consts::{PI, TAU};

use nalgebra::Rotation3;
use rand::RngExt;
use rand_pcg::Pcg64;

use crate::ground::shape::{Plane, Polyhedron};
use crate::scenario::RockShape;
use sightline_geometry::frames::{Point3, Ray, Vector3};

/// A rock in the site frame.
#[derive(Clone, Debug)]
pub struct Rock {
    /// Origin of the planes, inside the rock, site frame, m.
    pub centre: Point3,
    /// Diameter of the disc of the same area seen from above, m; for a placed rock its width.
    pub diameter_m: f64,
    /// Height above the ground at the rock's position, m.
    pub height_m: f64,
    /// Radius of a bounding sphere about the centre, m.
    pub radius_m: f64,
    /// The kind of polyhedron.
    pub shape: RockShape,
    /// Appearance relative to other rocks.
    pub look: RockLook,
    planes: Vec<Plane>,
    vertices: Vec<Vector3>,
}

/// Appearance of one rock relative to others.
#[derive(Clone, Copy, Debug)]
pub struct RockLook {
    /// Albedo relative to the mean of all rocks.
    pub brightness: f32,
    /// Strength of veins, 0 to 1; most rocks have none.
    pub veins: f32,
    /// Strength of pits, 0 to 1; most rocks have none.
    pub pits: f32,
    /// Offset of the rock's texture coordinates in the noise, m.
    pub texture_shift_m: [f64; 3],
}

/// The interval of a ray inside a rock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Distance of the entry, m; always finite because rocks are bounded.
    pub enter_m: f64,
    /// Distance of the exit, m.
    pub leave_m: f64,
    /// Index of the plane of entry.
    pub plane: usize,
}

/// Parameters from which a rock is grown.
#[derive(Clone, Copy, Debug)]
pub struct RockSeed {
    /// x in the site frame, m.
    pub x_m: f64,
    /// y in the site frame, m.
    pub y_m: f64,
    /// Diameter, or width of a placed rock, m.
    pub diameter_m: f64,
    /// Visible height, m.
    pub height_m: f64,
    /// The kind of polyhedron.
    pub shape: RockShape,
    /// Direction of the face of a placed rock, rad clockwise from above, 0 ahead; `None` for scattered rocks.
    pub face_yaw_rad: Option<f64>,
    /// Seed of the rock's own random numbers.
    pub seed: u64,
}

impl Rock {
    /// Grows a rock on ground at `ground_z_m` (m, positive down) whose mean plane has the unit normal `up` (site frame).
    pub fn grow(from: &RockSeed, ground_z_m: f64, up: &Vector3) -> Self {
        let mut random = Pcg64::new(u128::from(from.seed), 0x0a02_bdbf_7bb3_c0a7);
        let burial = random.random_range(0.10..0.40);
        let full_m = from.height_m / (1.0 - burial);
        let width = (0.8 + 0.15 * random.random_range(-1.7..1.7f64)).clamp(0.5, 1.0);
        let axes = Vector3::new(1.0, width, full_m / from.diameter_m);
        let body = match from.face_yaw_rad {
            Some(yaw_rad) => placed_body(from, &axes, full_m, yaw_rad, &mut random),
            None => scattered_body(from, &axes, full_m, &mut random),
        };
        let top_m = body.extent(2)[0];
        let stand = Rotation3::rotation_between(&-Vector3::z(), up).unwrap_or_else(Rotation3::identity);
        let body = body.turned(&stand);
        let from_base = stand * Vector3::new(0.0, 0.0, -from.height_m - top_m);
        // Margin for rounding: a ray through the farthest vertex must pass the test against the sphere.
        let radius_m = body.vertices.iter().map(Vector3::norm).fold(0.0, f64::max) * (1.0 + 1e-9);
        Self {
            centre: Point3::new(from.x_m, from.y_m, ground_z_m) + from_base,
            diameter_m: from.diameter_m,
            height_m: from.height_m,
            radius_m,
            shape: from.shape,
            look: RockLook::draw(&mut random),
            planes: body.planes,
            vertices: body.vertices,
        }
    }

    /// Returns the interval inside the rock, or `None` if the ray misses it. The ray counts as an infinite line here.
    #[inline(always)]
    pub fn interval(&self, ray: &Ray) -> Option<Interval> {
        let from_centre = ray.origin - self.centre;
        let along_m = from_centre.dot(&ray.direction);
        let aside_m2 = from_centre.norm_squared() - along_m * along_m;
        if aside_m2 > self.radius_m * self.radius_m {
            return None;
        }
        let (mut enter_m, mut leave_m, mut plane) = (f64::NEG_INFINITY, f64::INFINITY, 0);
        for (index, half_space) in self.planes.iter().enumerate() {
            let speed = half_space.normal.dot(&ray.direction);
            let room_m = half_space.offset_m - half_space.normal.dot(&from_centre);
            if speed == 0.0 {
                if room_m < 0.0 {
                    return None;
                }
                continue;
            }
            let t = room_m / speed;
            if speed < 0.0 {
                if t > enter_m {
                    (enter_m, plane) = (t, index);
                }
            } else if t < leave_m {
                leave_m = t;
            }
            if enter_m > leave_m {
                return None;
            }
        }
        Some(Interval { enter_m, leave_m, plane })
    }

    /// The outward unit normal of a plane of the rock.
    pub fn normal(&self, plane: usize) -> Vector3 {
        self.planes[plane].normal
    }

    /// The bounding planes.
    pub fn planes(&self) -> &[Plane] {
        &self.planes
    }

    /// The vertices relative to the centre, axes of the site frame, m.
    pub fn vertices(&self) -> &[Vector3] {
        &self.vertices
    }

    /// Whether a point in the site frame is inside all of the rock's planes moved outwards by `margin_m`.
    pub fn contains(&self, point: &Point3, margin_m: f64) -> bool {
        let p = point - self.centre;
        self.planes.iter().all(|plane| plane.normal.dot(&p) <= plane.offset_m + margin_m)
    }
}

impl RockLook {
    /// Brightness varies by 15 % (1σ); three rocks of ten have veins, three others pits (ours).
    fn draw(random: &mut Pcg64) -> Self {
        let kind: f32 = random.random();
        let strength = random.random_range(0.4..1.0f32);
        Self {
            brightness: (1.0 + 0.15 * random.random_range(-1.7..1.7f32)).max(0.5),
            veins: if kind < 0.3 { strength } else { 0.0 },
            pits: if kind > 0.7 { strength } else { 0.0 },
            texture_shift_m: std::array::from_fn(|_| random.random_range(-50.0..50.0)),
        }
    }
}

/// A shape tilted, rotated and stretched so that its outline has the area of the disc; z is centred by its planes.
fn scattered_body(from: &RockSeed, axes: &Vector3, full_m: f64, random: &mut Pcg64) -> Polyhedron {
    let body = Polyhedron::grow(from.shape, axes, from.diameter_m, random);
    let tilt_rad = if from.shape == RockShape::Slab { 0.12 } else { 0.26 };
    let turn = Rotation3::from_euler_angles(
        random.random_range(-tilt_rad..tilt_rad),
        random.random_range(-tilt_rad..tilt_rad),
        random.random_range(0.0..TAU),
    );
    let body = body.turned(&turn);
    let level = 0.5 * from.diameter_m * (PI / body.area_from_above()).sqrt();
    let [top, bottom] = body.extent(2);
    body.stretched(&Vector3::new(level, level, full_m / (bottom - top)))
}

/// A shape whose +x side points along the yaw and whose width across it is the diameter.
fn placed_body(from: &RockSeed, axes: &Vector3, full_m: f64, yaw_rad: f64, random: &mut Pcg64) -> Polyhedron {
    let across = Vector3::new(0.7, 1.0, axes.z);
    let body = match from.shape {
        RockShape::Block => Polyhedron::with_face(&across, random),
        _ => Polyhedron::grow(from.shape, &across, from.diameter_m, random),
    };
    let [left, right] = body.extent(1);
    let [top, bottom] = body.extent(2);
    let level = from.diameter_m / (right - left);
    body.stretched(&Vector3::new(level, level, full_m / (bottom - top)))
        .turned(&Rotation3::from_euler_angles(0.0, 0.0, yaw_rad))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::texture::mix;

    fn rock(seed: u64, diameter_m: f64) -> Rock {
        let shape =
            [RockShape::Angular, RockShape::Block, RockShape::Cobble, RockShape::Slab][seed as usize % 4];
        let height_m = 0.5 * diameter_m;
        let from = RockSeed { x_m: 3.0, y_m: -1.0, diameter_m, height_m, shape, face_yaw_rad: None, seed };
        Rock::grow(&from, 0.3, &-Vector3::z())
    }

    #[test]
    fn intervals_agree_with_a_march_through_the_half_spaces() {
        let mut hits = 0;
        for seed in 0..60u64 {
            let rock = rock(seed, 0.1 + 0.01 * seed as f64);
            let unit = |n: u64| (mix(seed * 16 + n) >> 11) as f64 / (1u64 << 53) as f64;
            let origin = Point3::new(unit(0) * 2.0, unit(1) * 2.0 - 2.0, -1.0 + unit(2));
            let aim = rock.centre + Vector3::new(unit(3) - 0.5, unit(4) - 0.5, unit(5) - 0.5) * rock.radius_m;
            let ray = Ray { origin, direction: (aim - origin).normalize() };
            let inside = |t: f64| rock.contains(&ray.at(t), 0.0);
            let step = 1e-4;
            let first = (0..60_000).map(|k| f64::from(k) * step).find(|t| inside(*t));
            match (rock.interval(&ray), first) {
                (Some(interval), Some(mut high)) => {
                    hits += 1;
                    let mut low = high - step;
                    for _ in 0..60 {
                        let middle = 0.5 * (low + high);
                        if inside(middle) { high = middle } else { low = middle }
                    }
                    assert!((interval.enter_m - high).abs() < 1e-9, "{} {high}", interval.enter_m);
                    assert!(inside(interval.leave_m - 1e-9) && !inside(interval.leave_m + 1e-9));
                    assert!(rock.normal(interval.plane).dot(&ray.direction) < 0.0);
                }
                (Some(interval), None) => assert!(interval.leave_m - interval.enter_m < 2.0 * step),
                (None, first) => assert!(first.is_none()),
            }
        }
        assert!(hits > 40, "{hits}");
    }

    #[test]
    fn rocks_cover_their_disc_have_their_height_and_are_partly_buried() {
        for seed in 0..40 {
            let rock = rock(seed, 0.3);
            let down = |x: f64, y: f64| {
                rock.interval(&Ray { origin: Point3::new(x, y, -5.0), direction: Vector3::z() })
            };
            let (mut top_z_m, mut bottom_z_m, mut area_m2) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
            let cell_m = 0.002;
            for k in 0..300 * 300 {
                let (x, y) = (f64::from(k % 300) - 149.5, f64::from(k / 300) - 149.5);
                if let Some(interval) = down(3.0 + cell_m * x, -1.0 + cell_m * y) {
                    top_z_m = top_z_m.min(interval.enter_m - 5.0);
                    bottom_z_m = bottom_z_m.max(interval.leave_m - 5.0);
                    area_m2 += cell_m * cell_m;
                }
            }
            assert!((area_m2 / (PI * 0.15 * 0.15) - 1.0).abs() < 0.01, "{seed}: {area_m2}");
            assert!((0.3 - top_z_m - 0.15).abs() < 0.0015, "{seed}: {top_z_m}");
            let buried = (bottom_z_m - 0.3) / (bottom_z_m - top_z_m);
            assert!((0.09..0.41).contains(&buried), "{seed}: {buried}");
            assert!(rock.radius_m < 0.36, "{}", rock.radius_m);
        }
    }

    #[test]
    fn a_placed_block_shows_a_flat_face_of_its_width_to_where_it_looks() {
        let shape = RockShape::Block;
        let face_yaw_rad = Some(PI);
        let from =
            RockSeed { x_m: 3.0, y_m: -1.0, diameter_m: 0.5, height_m: 0.4, shape, face_yaw_rad, seed: 8 };
        let rock = Rock::grow(&from, 0.3, &-Vector3::z());
        let ahead =
            |y: f64, z: f64| rock.interval(&Ray { origin: Point3::new(0.0, y, z), direction: Vector3::x() });
        let (mut faces, mut widest_m) =
            (std::collections::HashMap::new(), [f64::INFINITY, f64::NEG_INFINITY]);
        for k in 0..200 * 100 {
            let (y, z) = (-1.5 + f64::from(k % 200) * 0.005, 0.3 - f64::from(k / 200) * 0.004);
            if let Some(interval) = ahead(y, z) {
                *faces.entry(interval.plane).or_insert(0u32) += 1;
                widest_m = [widest_m[0].min(y), widest_m[1].max(y)];
            }
        }
        let all: u32 = faces.values().sum();
        let (&plane, &most) = faces.iter().max_by_key(|(_, count)| **count).unwrap();
        assert!(f64::from(most) > 0.6 * f64::from(all), "{faces:?}");
        let lean_deg = rock.normal(plane).angle(&-Vector3::x()).to_degrees();
        // The stretch to the required height changes the lean of 12°.
        assert!(lean_deg < 20.0, "{lean_deg}");
        let width_m = widest_m[1] - widest_m[0];
        assert!(width_m > 0.44 && width_m < 0.501, "{width_m}");
    }

    #[test]
    fn on_a_slope_rocks_stand_along_its_normal() {
        let up = Vector3::new(-0.3, 0.1, -1.0).normalize();
        for seed in 0..20 {
            let from = RockSeed {
                x_m: 3.0,
                y_m: -1.0,
                diameter_m: 0.3,
                height_m: 0.15,
                shape: RockShape::Block,
                face_yaw_rad: None,
                seed,
            };
            let (level, tilted) = (Rock::grow(&from, 0.3, &-Vector3::z()), Rock::grow(&from, 0.3, &up));
            let base = Point3::new(3.0, -1.0, 0.3);
            let height_of = |rock: &Rock, up: &Vector3| (rock.centre - base).dot(up);
            assert!((height_of(&level, &-Vector3::z()) - height_of(&tilted, &up)).abs() < 1e-12);
            assert!((level.radius_m - tilted.radius_m).abs() < 1e-12);
        }
    }
}
