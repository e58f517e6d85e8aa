//! Rocks: convex polyhedra, met by rays exactly.
//!
//! **Shape** (domain.md 10.4, in half-spaces instead of hulls). A rock is the intersection of at least 14
//! half-spaces n·p ≤ h: planes tangent to an ellipsoid with semi-axes D/2 · (1, 0.8 ± 0.15, H'/D), each
//! pushed inwards by up to 18 %, their normals spread over the sphere and jittered, the whole turned by a
//! random yaw and a tilt of up to 15°. Large rocks get more planes. Six planes of a box that is 8 % larger
//! than the ellipsoid bound every rock for certain. Planes that touch no vertex are dropped.
//!
//! **Burial.** A part β of the full height 2c lies below the ground, so the visible height is
//! H = 2c (1 − β) and the centre lies c (1 − 2β) above the ground.
//!
//! **Intersection.** Along a ray, n·(o + t d) ≤ h is a half-line in t for each plane; their intersection is
//! an interval [enter, leave], empty when the ray misses. Nothing is approximated.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | D | `diameter_m` | m, longest horizontal axis of the ellipsoid |
//! | n, h | `Plane` | unit normal, m; relative to the rock's centre, axes of the site frame |
//! | t | `enter_m`, `leave_m` | m along the ray |

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Rotation3};
use rand::RngExt;
use rand_pcg::Pcg64;

use crate::frames::{Point3, Ray, Vector3};

/// A half-space n·p ≤ h, p relative to the centre of the rock.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// Outward unit normal, site axes.
    pub normal: Vector3,
    /// Distance of the plane from the rock's centre, m.
    pub offset_m: f64,
}

/// A rock standing in the site.
#[derive(Clone, Debug)]
pub struct Rock {
    /// Centre of the ellipsoid, site frame, m.
    pub centre: Point3,
    /// Length of the longest horizontal axis, m.
    pub diameter_m: f64,
    /// Radius of a sphere about the centre that holds the rock, m.
    pub radius_m: f64,
    /// Albedo relative to the mean of all rocks.
    pub brightness: f32,
    /// Where in the noise the rock's texture is taken, m.
    pub texture_shift_m: [f64; 3],
    planes: Vec<Plane>,
}

/// Where a ray is inside a rock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Where the ray enters, m; negative infinity never occurs because rocks are bounded.
    pub enter_m: f64,
    /// Where it leaves, m.
    pub leave_m: f64,
    /// The plane through which it enters.
    pub plane: usize,
}

/// What a rock is grown from.
#[derive(Clone, Copy, Debug)]
pub struct RockSeed {
    /// Place in the site frame, m.
    pub x_m: f64,
    /// Place in the site frame, m.
    pub y_m: f64,
    /// Longest horizontal axis, m.
    pub diameter_m: f64,
    /// Visible height over the diameter.
    pub height_ratio: f64,
    /// Where the rock's own stream of random numbers starts.
    pub seed: u64,
}

impl Rock {
    /// Grows a rock on ground of height `ground_z_m` (m down).
    pub fn grow(from: &RockSeed, ground_z_m: f64) -> Self {
        let mut random = Pcg64::new(u128::from(from.seed), 0x0a02_bdbf_7bb3_c0a7);
        let half_m = from.diameter_m / 2.0;
        let burial = random.random_range(0.10..0.40);
        let width = (0.8 + 0.15 * random.random_range(-1.7..1.7f64)).clamp(0.5, 1.0);
        let ratio = from.height_ratio * random.random_range(0.75..1.25);
        let height_m = ratio * from.diameter_m / (2.0 * (1.0 - burial));
        let axes_m = Vector3::new(half_m, half_m * width, height_m);
        let turn = Rotation3::from_euler_angles(
            random.random_range(-0.26..0.26),
            random.random_range(-0.26..0.26),
            random.random_range(0.0..TAU),
        );
        let planes = tangent_planes(&axes_m, plane_count(from.diameter_m), &turn, &mut random);
        let (planes, radius_m) = without_idle_planes(planes);
        Self {
            centre: Point3::new(from.x_m, from.y_m, ground_z_m - height_m * (1.0 - 2.0 * burial)),
            diameter_m: from.diameter_m,
            radius_m,
            brightness: (1.0 + 0.15 * random.random_range(-1.7..1.7f32)).max(0.5),
            texture_shift_m: std::array::from_fn(|_| random.random_range(-50.0..50.0)),
            planes,
        }
    }

    /// Where a ray is inside the rock, or nothing where it misses it. The ray is a whole line here.
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

    /// Whether a point of the site lies inside the rock, or nearer to it than `margin_m`'s planes.
    pub fn contains(&self, point: &Point3, margin_m: f64) -> bool {
        let p = point - self.centre;
        self.planes.iter().all(|plane| plane.normal.dot(&p) <= plane.offset_m + margin_m)
    }
}

/// More faces on larger rocks, so that none looks like a crystal.
fn plane_count(diameter_m: f64) -> usize {
    14 + (40.0 * diameter_m).min(18.0) as usize
}

/// Planes tangent to the ellipsoid, pushed in at random, and the six of a box around it.
fn tangent_planes(axes_m: &Vector3, count: usize, turn: &Rotation3<f64>, random: &mut Pcg64) -> Vec<Plane> {
    let golden_rad = TAU * 0.381_966_011_250_105;
    let support_m = |n: &Vector3| n.component_mul(axes_m).norm();
    let spread = (0..count).map(|k| {
        // Points on a spiral are nearly even over the sphere; the jitter breaks the pattern.
        let z = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
        let (r, angle) = ((1.0 - z * z).sqrt(), golden_rad * k as f64);
        Vector3::new(r * angle.cos(), r * angle.sin(), z)
    });
    let spread: Vec<Vector3> = spread.collect();
    let spin = Rotation3::from_euler_angles(
        random.random_range(0.0..TAU),
        random.random_range(0.0..TAU),
        random.random_range(0.0..TAU),
    );
    let mut planes = Vec::with_capacity(count + 6);
    for direction in spread {
        let jitter = Vector3::from_fn(|_, _| random.random_range(-0.35..0.35));
        let normal = (spin * direction + jitter).normalize();
        let offset_m = support_m(&normal) * random.random_range(0.82..1.0);
        planes.push(Plane { normal: turn * normal, offset_m });
    }
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        for side in [-1.0, 1.0] {
            planes.push(Plane { normal: turn * (axis * side), offset_m: 1.08 * support_m(&axis) });
        }
    }
    planes
}

/// Keeps the planes that carry a vertex; also gives the distance of the farthest vertex, m.
fn without_idle_planes(planes: Vec<Plane>) -> (Vec<Plane>, f64) {
    let (mut used, mut radius_m) = (vec![false; planes.len()], 0.0f64);
    for i in 0..planes.len() {
        for j in i + 1..planes.len() {
            for k in j + 1..planes.len() {
                let Some(vertex) = meeting_point(&planes, [i, j, k]) else { continue };
                let size_m = vertex.norm();
                let inside = planes.iter().all(|p| p.normal.dot(&vertex) <= p.offset_m + 1e-9 * size_m);
                if inside {
                    radius_m = radius_m.max(size_m);
                    [i, j, k].into_iter().for_each(|index| used[index] = true);
                }
            }
        }
    }
    let kept = planes.into_iter().zip(used).filter_map(|(plane, used)| used.then_some(plane)).collect();
    // Room for rounding: a ray through the farthest vertex must pass the test against the sphere.
    (kept, radius_m * (1.0 + 1e-9))
}

/// Where three planes meet, unless two of them are nearly parallel.
fn meeting_point(planes: &[Plane], [i, j, k]: [usize; 3]) -> Option<Vector3> {
    let (a, b, c) = (&planes[i], &planes[j], &planes[k]);
    let rows = Matrix3::from_rows(&[a.normal.transpose(), b.normal.transpose(), c.normal.transpose()]);
    let determinant = rows.determinant();
    if determinant.abs() < 1e-9 {
        return None;
    }
    let sum = b.normal.cross(&c.normal) * a.offset_m
        + c.normal.cross(&a.normal) * b.offset_m
        + a.normal.cross(&b.normal) * c.offset_m;
    Some(sum / determinant)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim::ground::texture::mix;

    fn rock(seed: u64, diameter_m: f64) -> Rock {
        let from = RockSeed { x_m: 3.0, y_m: -1.0, diameter_m, height_ratio: 0.5, seed };
        Rock::grow(&from, 0.3)
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
    fn rocks_have_faces_enough_stand_on_the_ground_and_are_partly_buried() {
        for seed in 0..40 {
            let rock = rock(seed, 0.3);
            assert!(rock.planes.len() >= 14, "{}", rock.planes.len());
            let top = Ray { origin: Point3::new(3.0, -1.0, -5.0), direction: Vector3::z() };
            let interval = rock.interval(&top).unwrap();
            let (top_z_m, bottom_z_m) = (interval.enter_m - 5.0, interval.leave_m - 5.0);
            let height_m = 0.3 - top_z_m;
            assert!(height_m > 0.08 && height_m < 0.21, "{height_m}");
            assert!(bottom_z_m > 0.3, "{bottom_z_m}");
            assert!(rock.radius_m < 0.3, "{}", rock.radius_m);
        }
    }
}
