//! Shapes of rocks: convex polyhedra of four kinds, about their own centre.
//!
//! Every kind is an intersection of half-spaces n·p ≤ h around a body with semi-axes (1, b, c):
//!
//! * **angular**: planes tangent to the ellipsoid, pushed in by up to 18 %, their normals spread over the sphere
//!   and jittered: broken rock;
//! * **cobble**: the same with twice the planes, pushed in by at most 4 %: rounded by water or wind;
//! * **block**: the six sides of a box, leaning a little, with chamfered edges and corners;
//! * **slab**: a block with a flat top and bottom.
//!
//! Large rocks get more planes than pebbles. Planes that touch no vertex are dropped.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | b, c | `axes` | – |
//! | n, h | `Plane` | –, in the unit of the axes |
//!
//! Frame: the rock's own, x along the longest axis, z down. Source: domain.md 10.4, in half-spaces instead of hulls.

use std::f64::consts::TAU;

use nalgebra::Rotation3;
use rand::RngExt;
use rand_pcg::Pcg64;

use crate::scenario::RockShape;
use sightline_geometry::frames::Vector3;

/// A half-space n·p ≤ h, p relative to the centre of the rock.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// Outward unit normal, site axes.
    pub normal: Vector3,
    /// Distance of the plane from the rock's centre, m.
    pub offset_m: f64,
}

/// A bounded convex polyhedron.
#[derive(Clone, Debug)]
pub(super) struct Polyhedron {
    pub(super) planes: Vec<Plane>,
    pub(super) vertices: Vec<Vector3>,
}

impl Polyhedron {
    /// A rock of a kind around a body with semi-axes `axes`, with the detail of a rock of `diameter_m`.
    pub(super) fn grow(shape: RockShape, axes: &Vector3, diameter_m: f64, random: &mut Pcg64) -> Self {
        let planes = match shape {
            RockShape::Angular => around_ellipsoid(axes, angular_count(diameter_m), [0.35, 0.18], random),
            RockShape::Cobble => around_ellipsoid(axes, 2 * angular_count(diameter_m), [0.15, 0.04], random),
            RockShape::Block => around_box(axes, 0.12, diameter_m, random),
            RockShape::Slab => around_box(axes, 0.05, diameter_m, random),
        };
        Self::of(planes)
    }

    /// A block for a placed rock: its +x side is flat, leans back by 12° and keeps its edges.
    pub(super) fn with_face(axes: &Vector3, random: &mut Pcg64) -> Self {
        let (lean_sin, lean_cos) = 12f64.to_radians().sin_cos();
        let face = Vector3::new(lean_cos, 0.0, -lean_sin);
        let mut planes = around_box(axes, 0.08, 1.0, random);
        // Remove the side itself and the chamfers that would cut its edges.
        planes.retain(|plane| plane.normal.x < 0.3);
        planes.push(Plane { normal: face, offset_m: 0.9 * axes.x * lean_cos });
        Self::of(planes)
    }

    /// The body bounded by these half-spaces, without those that touch no vertex.
    pub(super) fn of(planes: Vec<Plane>) -> Self {
        let (mut used, mut vertices) = (vec![false; planes.len()], Vec::new());
        for (i, a) in planes.iter().enumerate() {
            for (j, b) in planes.iter().enumerate().skip(i + 1) {
                let edge = a.normal.cross(&b.normal);
                for (k, c) in planes.iter().enumerate().skip(j + 1) {
                    let determinant = edge.dot(&c.normal);
                    // Two of the three are nearly parallel.
                    if determinant.abs() < 1e-9 {
                        continue;
                    }
                    let across = (b.normal * a.offset_m - a.normal * b.offset_m).cross(&c.normal);
                    let vertex = (across + edge * c.offset_m) / determinant;
                    let room = 1e-9 * vertex.norm();
                    if planes.iter().all(|p| p.normal.dot(&vertex) <= p.offset_m + room) {
                        vertices.push(vertex);
                        [i, j, k].into_iter().for_each(|index| used[index] = true);
                    }
                }
            }
        }
        let planes = planes.into_iter().zip(used).filter_map(|(plane, used)| used.then_some(plane)).collect();
        Self { planes, vertices }
    }

    /// The rotated body.
    pub(super) fn turned(mut self, turn: &Rotation3<f64>) -> Self {
        self.planes.iter_mut().for_each(|plane| plane.normal = turn * plane.normal);
        self.vertices.iter_mut().for_each(|vertex| *vertex = turn * *vertex);
        self
    }

    /// The body stretched along the axes by the factors `by`.
    pub(super) fn stretched(mut self, by: &Vector3) -> Self {
        for plane in &mut self.planes {
            let normal = plane.normal.component_div(by);
            let length = normal.norm();
            *plane = Plane { normal: normal / length, offset_m: plane.offset_m / length };
        }
        self.vertices.iter_mut().for_each(|vertex| vertex.component_mul_assign(by));
        self
    }

    /// Lower and upper limit of the body along an axis.
    pub(super) fn extent(&self, axis: usize) -> [f64; 2] {
        self.vertices.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], vertex| {
            [low.min(vertex[axis]), high.max(vertex[axis])]
        })
    }

    /// Area of the outline seen from above.
    pub(super) fn area_from_above(&self) -> f64 {
        let mut points: Vec<[f64; 2]> = self.vertices.iter().map(|v| [v.x, v.y]).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        let cross = |o: [f64; 2], a: [f64; 2], b: [f64; 2]| {
            (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])
        };
        // Andrew's monotone chain: the lower side from left to right, the upper one back.
        let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
            let mut chain: Vec<[f64; 2]> = Vec::new();
            for point in points {
                while chain.len() > 1 && cross(chain[chain.len() - 2], chain[chain.len() - 1], point) <= 0.0 {
                    chain.pop();
                }
                chain.push(point);
            }
            chain
        };
        let mut outline = chain(&mut points.iter().copied());
        outline.extend(chain(&mut points.iter().rev().copied()));
        let next = outline.iter().cycle().skip(1);
        0.5 * outline.iter().zip(next).map(|(a, b)| a[0] * b[1] - b[0] * a[1]).sum::<f64>()
    }
}

/// More faces on larger rocks, so that none looks like a crystal; a pebble spans a few pixels.
fn angular_count(diameter_m: f64) -> usize {
    if diameter_m < 0.06 { 10 } else { 14 + (40.0 * diameter_m).min(14.0) as usize }
}

/// Planes tangent to an ellipsoid, with jittered normals and pushed in by up to the given fractions, and the six planes of
/// a box around it that guarantee a bounded body.
fn around_ellipsoid(
    axes: &Vector3,
    count: usize,
    [jitter, push]: [f64; 2],
    random: &mut Pcg64,
) -> Vec<Plane> {
    let golden_rad = TAU * 0.381_966_011_250_105;
    let support = |n: &Vector3| n.component_mul(axes).norm();
    let mut angle_rad = || random.random_range(0.0..TAU);
    let spin = Rotation3::from_euler_angles(angle_rad(), angle_rad(), angle_rad());
    let mut planes = Vec::with_capacity(count + 6);
    for k in 0..count {
        // Points on a spiral are nearly uniform over the sphere; the jitter breaks the pattern.
        let z = 1.0 - (2.0 * k as f64 + 1.0) / count as f64;
        let (r, angle) = ((1.0 - z * z).sqrt(), golden_rad * k as f64);
        let direction = Vector3::new(r * angle.cos(), r * angle.sin(), z);
        let shake = Vector3::from_fn(|_, _| random.random_range(-jitter..jitter));
        let normal = (spin * direction + shake).normalize();
        planes.push(Plane { normal, offset_m: support(&normal) * random.random_range(1.0 - push..1.0) });
    }
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        for side in [-1.0, 1.0] {
            planes.push(Plane { normal: axis * side, offset_m: 1.08 * support(&axis) });
        }
    }
    planes
}

/// The sides of a box, leaning by up to `lean`, and chamfers of its edges and corners; a pebble has few.
fn around_box(axes: &Vector3, lean: f64, diameter_m: f64, random: &mut Pcg64) -> Vec<Plane> {
    let support = |n: &Vector3| n.abs().dot(axes);
    let kept = (0.3 + 3.0 * diameter_m).min(1.0);
    let mut planes = Vec::with_capacity(26);
    for code in 0..27 {
        let direction = Vector3::new(f64::from(code % 3), f64::from(code / 3 % 3), f64::from(code / 9));
        let direction = direction.add_scalar(-1.0);
        let rank = direction.norm_squared().round() as u32;
        let (jitter, reach) = match rank {
            0 => continue,
            1 => (lean, 0.88..1.0),
            2 => (0.2, 0.80..0.97),
            _ => (0.2, 0.72..0.93),
        };
        let shake = Vector3::from_fn(|_, _| random.random_range(-jitter..jitter));
        let normal = (direction.normalize() + shake).normalize();
        let offset_m =
            random.random_range(reach) * if rank == 1 { support(&direction) } else { support(&normal) };
        if rank == 1 || random.random_bool(kept) {
            planes.push(Plane { normal, offset_m });
        }
    }
    planes
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPES: [RockShape; 4] = [RockShape::Angular, RockShape::Cobble, RockShape::Block, RockShape::Slab];

    #[test]
    fn a_plain_box_has_its_vertices_extent_and_area() {
        let plane = |normal: Vector3, offset_m: f64| Plane { normal, offset_m };
        let sides = [(Vector3::x(), 3.0), (Vector3::y(), 2.0), (Vector3::z(), 1.0)];
        let mut planes: Vec<Plane> =
            sides.iter().flat_map(|(n, h)| [plane(*n, *h), plane(-*n, *h)]).collect();
        planes.push(plane(Vector3::new(1.0, 1.0, 1.0).normalize(), 9.0));
        let body = Polyhedron::of(planes);
        assert_eq!((body.planes.len(), body.vertices.len()), (6, 8));
        assert_eq!(body.extent(0), [-3.0, 3.0]);
        assert!((body.area_from_above() - 24.0).abs() < 1e-12);
        let turned = body.turned(&Rotation3::from_euler_angles(0.0, 0.0, 0.7));
        assert!((turned.area_from_above() - 24.0).abs() < 1e-12);
        let stretched = turned.stretched(&Vector3::new(2.0, 2.0, 5.0));
        assert!((stretched.area_from_above() - 96.0).abs() < 1e-12);
        assert!((stretched.extent(2)[1] - 5.0).abs() < 1e-12);
        for vertex in &stretched.vertices {
            let touched =
                stretched.planes.iter().filter(|p| (p.normal.dot(vertex) - p.offset_m).abs() < 1e-9).count();
            assert_eq!(touched, 3);
        }
    }

    #[test]
    fn every_kind_is_bounded_and_cobbles_are_rounder_than_blocks() {
        let axes = Vector3::new(1.0, 0.8, 0.5);
        let mut faces = [0usize; 4];
        for seed in 0..40u64 {
            for (index, shape) in SHAPES.into_iter().enumerate() {
                for diameter_m in [0.02, 0.5] {
                    let body =
                        Polyhedron::grow(shape, &axes, diameter_m, &mut Pcg64::new(u128::from(seed), 5));
                    let reach = body.vertices.iter().map(Vector3::norm).fold(0.0, f64::max);
                    assert!(reach < 1.7 && body.planes.len() >= 6, "{shape:?} {seed}: {reach}");
                    faces[index] += if diameter_m > 0.1 { body.planes.len() } else { 0 };
                }
            }
        }
        let [angular, cobble, block, slab] = faces.map(|sum| sum as f64 / 40.0);
        assert!(cobble > 1.4 * angular && angular > 14.0 && block > 12.0 && slab > 10.0, "{faces:?}");
    }
}
