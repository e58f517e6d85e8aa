//! Triangle rasterisation: the inner loops of the virtual range sensor (R191).
//!
//! ```text
//! E_ab(p) = (b_x − a_x)(p_y − a_y) − (b_y − a_y)(p_x − a_x)        twice the area of (a, b, p), integer
//! inside:   E > 0, or E = 0 on an edge that points up, or level and to the right
//! w(p)    = (E_bc w_a + E_ca w_b + E_ab w_c) / (E_bc + E_ca + E_ab)
//! ```
//! Vertices are first rounded to a lattice of 1/256 pixel, so that E is exact. The rule for E = 0 ("top-left rule") is
//! that of a pixel centre moved by an infinitesimal amount to the right and a much smaller one down: it is inside
//! exactly one of the triangles around an edge or a vertex, so that shared edges have neither gaps nor doubles.
//!
//! Transform and projection of the vertices are plain loops over lanes. Most triangles are about the size of a pixel;
//! those whose bounding box contains no pixel centre are dropped before any product is computed.
//!
//! | name | meaning | unit, frame |
//! |---|---|---|
//! | `Facets::x`, `y`, `z` | vertices | m, sensor frame before the motion |
//! | `Picture::u`, `v` | projected vertices | 1/256 px |
//! | `Picture::w` | depth, or its reciprocal | m or 1/m |
//!
//! Source: D§2, "virtual range sensor"; R191; lattice and rule as in graphics processors.

use pulp::{Arch, Simd, WithSimd};

use super::mesh::Mesh;
use super::range_sensor::{NEAR_M, Projection, RangeImage, RangeSensor};
use sightline_geometry::frames::Pose;

/// Lattice points per pixel.
const PLACES: f32 = 256.0;
/// Base-2 logarithm of `PLACES`.
const PLACES_LOG: u32 = 8;
/// Coordinates are clamped to ±this, 1/256 px; triangles of such vertices are outside the image or huge.
const FARTHEST: f32 = (1 << 27) as f32;

/// A mesh as columns of coordinates, in the sensor's frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Facets {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    /// Vertex indices.
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Facets {
    pub(super) fn new(mesh: &Mesh, sensor_from_mesh: &Pose) -> Self {
        let mut facets = Self { triangles: mesh.triangles.clone(), ..Self::default() };
        for vertex in &mesh.vertices {
            let [x, y, z] = (sensor_from_mesh * vertex).coords.map(|value| value as f32).into();
            facets.x.push(x);
            facets.y.push(y);
            facets.z.push(z);
        }
        facets
    }

    /// Returns the triangles within `reach_px` of the sensor's image after a motion, with their vertices only, and the
    /// original indices of these vertices.
    pub(super) fn near(&self, sensor: &RangeSensor, motion: &Pose, reach_px: usize) -> (Self, Vec<u32>) {
        let mut picture = Picture::default();
        let wide = sensor.widened(reach_px);
        picture.project(&wide, self, motion);
        let [right, bottom] = [wide.width, wide.height].map(|count| (count as i32) << PLACES_LOG);
        let is_near = |triangle: &&[u32; 3]| {
            let [u, v] =
                [&picture.u, &picture.v].map(|values| triangle.map(|vertex| values[vertex as usize]));
            let within = |values: [i32; 3], end: i32| {
                values.iter().any(|&value| value > 0) && values.iter().any(|&value| value < end)
            };
            within(u, right) && within(v, bottom)
        };
        let mut new_number = vec![u32::MAX; self.x.len()];
        let (mut near, mut old_numbers) = (Self::default(), Vec::new());
        for triangle in self.triangles.iter().filter(is_near) {
            let numbers = triangle.map(|vertex| {
                let number = &mut new_number[vertex as usize];
                if *number == u32::MAX {
                    *number = near.x.len() as u32;
                    old_numbers.push(vertex);
                    near.x.push(self.x[vertex as usize]);
                    near.y.push(self.y[vertex as usize]);
                    near.z.push(self.z[vertex as usize]);
                }
                *number
            });
            near.triangles.push(numbers);
        }
        (near, old_numbers)
    }
}

/// Projected vertices; a buffer that is reused between calls.
#[derive(Clone, Debug, Default)]
pub(super) struct Picture {
    u: Vec<i32>,
    v: Vec<i32>,
    w: Vec<f32>,
}

/// Receiver of the pixels inside triangles.
pub(super) trait Canvas {
    /// `parts` are E_bc, E_ca, E_ab over their sum; `depth_m` is the depth of the facet at the pixel.
    fn put(&mut self, pixel: usize, depth_m: f32, facet: u32, parts: [f32; 3]);
}

impl Canvas for RangeImage {
    #[inline(always)]
    fn put(&mut self, pixel: usize, depth_m: f32, facet: u32, parts: [f32; 3]) {
        if depth_m < self.depth_m[pixel] {
            self.depth_m[pixel] = depth_m;
            self.facet[pixel] = facet;
            self.weights[pixel] = parts;
        }
    }
}

/// Depths alone, m; infinite where there is no facet.
pub(super) struct Depths<'a>(pub(super) &'a mut [f32]);

impl Canvas for Depths<'_> {
    #[inline(always)]
    fn put(&mut self, pixel: usize, depth_m: f32, _: u32, _: [f32; 3]) {
        self.0[pixel] = self.0[pixel].min(depth_m);
    }
}

/// Renders facets, moved by `motion` in the sensor's frame, to a canvas of the sensor's size.
pub(super) fn rasterise(
    sensor: &RangeSensor,
    facets: &Facets,
    motion: &Pose,
    picture: &mut Picture,
    canvas: &mut impl Canvas,
) {
    picture.project(sensor, facets, motion);
    match sensor.projection {
        Projection::Orthographic { .. } => picture.fill::<false>(sensor, facets, canvas),
        Projection::Pinhole { .. } => picture.fill::<true>(sensor, facets, canvas),
    }
}

impl Picture {
    fn project(&mut self, sensor: &RangeSensor, facets: &Facets, motion: &Pose) {
        let count = facets.x.len();
        self.u.resize(count, 0);
        self.v.resize(count, 0);
        self.w.resize(count, 0.0);
        let r = motion.rotation.to_rotation_matrix();
        let t = &motion.translation.vector;
        let rows = [0, 1, 2].map(|i| [r[(i, 0)], r[(i, 1)], r[(i, 2)], t[i]].map(|value| value as f32));
        let centre = [sensor.width, sensor.height].map(|count| (count as f32 - 1.0) / 2.0);
        let (scale, is_pinhole) = match sensor.projection {
            Projection::Orthographic { pitch_m } => ((1.0 / pitch_m) as f32, false),
            Projection::Pinhole { focal_px } => (focal_px as f32, true),
        };
        let into = (&mut self.u[..], &mut self.v[..], &mut self.w[..]);
        Arch::new().dispatch(Project { facets, rows, scale, centre, is_pinhole, into });
    }

    fn fill<const PINHOLE: bool>(&self, sensor: &RangeSensor, facets: &Facets, canvas: &mut impl Canvas) {
        let last = [sensor.width as i32 - 1, sensor.height as i32 - 1];
        for (number, triangle) in facets.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(|vertex| vertex as usize);
            let (u, v) = ([self.u[a], self.u[b], self.u[c]], [self.v[a], self.v[b], self.v[c]]);
            let (first_x, last_x) = span(u, last[0]);
            let (first_y, last_y) = span(v, last[1]);
            if first_x > last_x || first_y > last_y {
                continue;
            }
            let w = [self.w[a], self.w[b], self.w[c]];
            // Nearer than the near plane of a pinhole, w is NaN.
            if PINHOLE && (w[0] + w[1] + w[2]).is_nan() {
                continue;
            }
            let edges = [edge(u, v, 1, 2), edge(u, v, 2, 0), edge(u, v, 0, 1)];
            let start = [i64::from(first_x) << PLACES_LOG, i64::from(first_y) << PLACES_LOG];
            let mut row = edges.map(|edge| edge.at(start));
            let area = row[0] + row[1] + row[2];
            if area <= 0 {
                continue;
            }
            let per_area = 1.0 / area as f32;
            for y in first_y..=last_y {
                let mut e = row;
                for x in first_x..=last_x {
                    if (e[0] + edges[0].bias) | (e[1] + edges[1].bias) | (e[2] + edges[2].bias) >= 0 {
                        let parts = e.map(|e| e as f32 * per_area);
                        let pixel = y as usize * sensor.width + x as usize;
                        put::<PINHOLE>(canvas, pixel, number as u32, parts, w);
                    }
                    e = [e[0] + edges[0].right, e[1] + edges[1].right, e[2] + edges[2].right];
                }
                row = [row[0] + edges[0].down, row[1] + edges[1].down, row[2] + edges[2].down];
            }
        }
    }
}

/// Depth and weights of a pixel. With a pinhole the weights are multiplied by w, the reciprocal of the depth.
#[inline(always)]
fn put<const PINHOLE: bool>(
    canvas: &mut impl Canvas,
    pixel: usize,
    facet: u32,
    parts: [f32; 3],
    w: [f32; 3],
) {
    let products = [parts[0] * w[0], parts[1] * w[1], parts[2] * w[2]];
    let there = products[0] + products[1] + products[2];
    if PINHOLE {
        canvas.put(pixel, 1.0 / there, facet, products.map(|product| product / there));
    } else {
        canvas.put(pixel, there, facet, parts);
    }
}

/// The first and the last pixel centre within the range of three lattice coordinates, clipped to the image.
#[inline(always)]
fn span(places: [i32; 3], last: i32) -> (i32, i32) {
    let low = places[0].min(places[1]).min(places[2]);
    let high = places[0].max(places[1]).max(places[2]);
    (((low + (1 << PLACES_LOG) - 1) >> PLACES_LOG).max(0), (high >> PLACES_LOG).min(last))
}

/// E of one edge, with its increments from pixel to pixel.
#[derive(Clone, Copy)]
struct Edge {
    from: [i64; 2],
    along: [i64; 2],
    /// Increments per pixel to the right and down.
    right: i64,
    down: i64,
    /// Added before the test of the sign: 0 if the edge belongs to the triangle, else −1.
    bias: i64,
}

#[inline(always)]
fn edge(u: [i32; 3], v: [i32; 3], i: usize, j: usize) -> Edge {
    let from = [i64::from(u[i]), i64::from(v[i])];
    let along = [i64::from(u[j]) - from[0], i64::from(v[j]) - from[1]];
    let is_owned = along[1] < 0 || (along[1] == 0 && along[0] > 0);
    Edge {
        from,
        along,
        right: -along[1] << PLACES_LOG,
        down: along[0] << PLACES_LOG,
        bias: if is_owned { 0 } else { -1 },
    }
}

impl Edge {
    #[inline(always)]
    fn at(&self, [x, y]: [i64; 2]) -> i64 {
        self.along[0] * (y - self.from[1]) - self.along[1] * (x - self.from[0])
    }
}

/// Transforms and projects all vertices.
struct Project<'a> {
    facets: &'a Facets,
    /// Rotation and translation, row by row.
    rows: [[f32; 4]; 3],
    /// Pixels per metre, or the focal length, px.
    scale: f32,
    centre: [f32; 2],
    is_pinhole: bool,
    into: (&'a mut [i32], &'a mut [i32], &'a mut [f32]),
}

impl WithSimd for Project<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (u, v, w) = self.into;
        let count = u.len();
        let (x, y, z) = (&self.facets.x[..count], &self.facets.y[..count], &self.facets.z[..count]);
        let (v, w) = (&mut v[..count], &mut w[..count]);
        let [r, s, t] = self.rows;
        let [cu, cv] = [self.centre[0] * PLACES + 0.5, self.centre[1] * PLACES + 0.5];
        let scale = self.scale * PLACES;
        for i in 0..count {
            let moved_x = r[0] * x[i] + r[1] * y[i] + r[2] * z[i] + r[3];
            let moved_y = s[0] * x[i] + s[1] * y[i] + s[2] * z[i] + s[3];
            let moved_z = t[0] * x[i] + t[1] * y[i] + t[2] * z[i] + t[3];
            let behind = if moved_z < NEAR_M { f32::NAN } else { 1.0 / moved_z };
            let (by, depth) = if self.is_pinhole { (scale * behind, behind) } else { (scale, moved_z) };
            u[i] = (moved_x * by + cu).floor().clamp(-FARTHEST, FARTHEST) as i32;
            v[i] = (moved_y * by + cv).floor().clamp(-FARTHEST, FARTHEST) as i32;
            w[i] = depth;
        }
    }
}
