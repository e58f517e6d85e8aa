//! Culling of rocks: a tree for single rays and for the cone of an image tile, a grid for the rays to the sun.
//!
//! All three only exclude rocks whose bounding sphere the ray misses, so results never depend on them.
//!
//! * [`Tree`]: bounding boxes of spheres, split at the median of the longest axis; a cone is tested with the sphere
//!   around a box.
//! * [`SunGrid`]: all rays to the sun are parallel. The rocks' bounding spheres are projected along them onto a plane,
//!   and each grid cell lists the discs that overlap it: a shadow ray tests one cell.
//! * [`in_cone`]: the rays of an image tile fill a narrow cone. A sphere of radius r at distance |v| is in it when
//!   the angle from the cone's axis is at most the cone's half angle plus asin(r/|v|), below 180° in sum.
//!
//! Frames: site, m. Sources: ours.

use sightline_geometry::frames::{Point3, Ray, Vector3};

use crate::ground::rocks::Rock;

/// A node of the tree: a box with either two children or a run of rocks.
#[derive(Clone, Debug)]
struct Node {
    low: [f64; 3],
    high: [f64; 3],
    /// First rock of a leaf in `order`, or the index of the first of two neighbouring children.
    first: usize,
    /// Rocks in a leaf; 0 for an inner node.
    count: usize,
}

/// A tree of boxes over the rocks.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    order: Vec<usize>,
}

/// Rocks in a leaf of the tree.
const LEAF: usize = 4;

impl Tree {
    /// Builds the tree.
    pub(crate) fn new(rocks: &[Rock]) -> Self {
        let mut tree = Self { nodes: Vec::new(), order: (0..rocks.len()).collect() };
        if !rocks.is_empty() {
            tree.nodes.push(Node { low: [0.0; 3], high: [0.0; 3], first: 0, count: rocks.len() });
            tree.split(rocks, 0);
        }
        tree
    }

    fn split(&mut self, rocks: &[Rock], index: usize) {
        let (first, count) = (self.nodes[index].first, self.nodes[index].count);
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for rock in self.order[first..first + count].iter().map(|&k| &rocks[k]) {
            for k in 0..3 {
                low[k] = low[k].min(rock.centre[k] - rock.radius_m);
                high[k] = high[k].max(rock.centre[k] + rock.radius_m);
            }
        }
        (self.nodes[index].low, self.nodes[index].high) = (low, high);
        if count <= LEAF {
            return;
        }
        let axis = (0..3).max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b]))).unwrap_or(0);
        self.order[first..first + count]
            .sort_by(|&a, &b| rocks[a].centre[axis].total_cmp(&rocks[b].centre[axis]));
        let half = count / 2;
        let child = self.nodes.len();
        for (first, count) in [(first, half), (first + half, count - half)] {
            self.nodes.push(Node { low: [0.0; 3], high: [0.0; 3], first, count });
        }
        (self.nodes[index].first, self.nodes[index].count) = (child, 0);
        self.split(rocks, child);
        self.split(rocks, child + 1);
    }

    /// Calls `visit` with every rock whose bounding box the ray meets nearer than the limit.
    ///
    /// The limit is `to_m` at first, then the last value that `visit` returned, m along the ray.
    pub(crate) fn along(&self, ray: &Ray, mut to_m: f64, mut visit: impl FnMut(usize) -> f64) {
        let mut open = [0usize; 64];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let node = &self.nodes[open[depth]];
            if !meets_box(node, ray, to_m) {
                continue;
            }
            if node.count > 0 {
                for &rock in &self.order[node.first..node.first + node.count] {
                    to_m = visit(rock);
                }
            } else {
                open[depth] = node.first;
                open[depth + 1] = node.first + 1;
                depth += 2;
            }
        }
    }

    /// Calls `visit` with the index of every rock that a ray of the cone can meet, and of some others (conservative).
    pub(crate) fn in_cone(&self, cone: &Cone, mut visit: impl FnMut(usize)) {
        let mut open = Vec::from_iter(self.nodes.first());
        while let Some(node) = open.pop() {
            let (middle, radius_m) = node.sphere();
            if !in_cone(cone, &middle, radius_m * 1.000_001) {
                continue;
            }
            if node.count > 0 {
                self.order[node.first..node.first + node.count].iter().for_each(|&rock| visit(rock));
            } else {
                open.extend(&self.nodes[node.first..node.first + 2]);
            }
        }
    }
}

impl Node {
    /// Centre of the box and radius of its circumscribed sphere, m.
    fn sphere(&self) -> (Point3, f64) {
        let middle = Point3::from([0, 1, 2].map(|k| 0.5 * (self.low[k] + self.high[k])));
        (middle, (Point3::from(self.high) - middle).norm())
    }
}

/// Whether the ray passes through the node's box within [0, `to_m`].
fn meets_box(node: &Node, ray: &Ray, to_m: f64) -> bool {
    let (mut enter_m, mut leave_m) = (0.0f64, to_m);
    for k in 0..3 {
        let (origin, speed) = (ray.origin[k], ray.direction[k]);
        if speed == 0.0 {
            if origin < node.low[k] || origin > node.high[k] {
                return false;
            }
            continue;
        }
        let (a, b) = ((node.low[k] - origin) / speed, (node.high[k] - origin) / speed);
        enter_m = enter_m.max(a.min(b));
        leave_m = leave_m.min(a.max(b));
    }
    enter_m <= leave_m
}

/// Grid over the plane across the sun's rays, with the rocks that overlap each cell.
#[derive(Clone, Debug)]
pub(crate) struct SunGrid {
    /// Unit direction towards the sun, site frame.
    to_sun: Vector3,
    across: [Vector3; 2],
    low_m: [f64; 2],
    cells: [usize; 2],
    /// Offset of each cell's list in `rocks`; one more entry than there are cells.
    starts: Vec<u32>,
    rocks: Vec<u32>,
}

impl SunGrid {
    /// Side of a cell, m: near the size of the rocks that cover most ground.
    const CELL_M: f64 = 0.25;

    /// Projects the rocks along `sun_direction` (unit, towards the sun).
    pub(crate) fn new(rocks: &[Rock], sun_direction: &Vector3) -> Self {
        let aside = if sun_direction.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
        let first = sun_direction.cross(&aside).normalize();
        let across = [first, sun_direction.cross(&first)];
        let span = |rock: &Rock, k: usize| {
            let middle_m = rock.centre.coords.dot(&across[k]);
            [middle_m - rock.radius_m, middle_m + rock.radius_m]
        };
        let (mut low_m, mut high_m) = ([0.0f64; 2], [0.0f64; 2]);
        for k in 0..2 {
            low_m[k] = rocks.iter().map(|rock| span(rock, k)[0]).fold(f64::INFINITY, f64::min);
            high_m[k] = rocks.iter().map(|rock| span(rock, k)[1]).fold(f64::NEG_INFINITY, f64::max);
        }
        if rocks.is_empty() {
            return Self {
                to_sun: *sun_direction,
                across,
                low_m: [0.0; 2],
                cells: [0; 2],
                starts: vec![0],
                rocks: Vec::new(),
            };
        }
        let cells: [usize; 2] = std::array::from_fn(|k| ((high_m[k] - low_m[k]) / Self::CELL_M) as usize + 1);
        let mut lists = vec![Vec::new(); cells[0] * cells[1]];
        for (index, rock) in rocks.iter().enumerate() {
            let range: [[usize; 2]; 2] = std::array::from_fn(|k| {
                span(rock, k).map(|m| (((m - low_m[k]) / Self::CELL_M).max(0.0) as usize).min(cells[k] - 1))
            });
            for y in range[1][0]..=range[1][1] {
                for x in range[0][0]..=range[0][1] {
                    lists[y * cells[0] + x].push(index as u32);
                }
            }
        }
        let mut starts = vec![0u32];
        for list in &lists {
            starts.push(starts[starts.len() - 1] + list.len() as u32);
        }
        Self { to_sun: *sun_direction, across, low_m, cells, starts, rocks: lists.concat() }
    }

    /// Collects into `found` the rocks whose shadow may fall within `radius_m` of a point. Returns false if the
    /// region covers more than two cells along an axis.
    pub(crate) fn near(&self, point: &Point3, radius_m: f64, rocks: &[Rock], found: &mut Vec<u32>) -> bool {
        found.clear();
        if self.rocks.is_empty() {
            return true;
        }
        let mut range = [[0usize; 2]; 2];
        let middle_m = self.across.map(|axis| point.coords.dot(&axis));
        for (k, range) in range.iter_mut().enumerate() {
            let [from, to] =
                [-radius_m, radius_m].map(|by| (middle_m[k] + by - self.low_m[k]) / Self::CELL_M);
            if to < 0.0 || from >= self.cells[k] as f64 {
                return true;
            }
            *range = [from.max(0.0) as usize, (to as usize).min(self.cells[k] - 1)];
            if range[1] - range[0] > 1 {
                return false;
            }
        }
        for y in range[1][0]..=range[1][1] {
            for x in range[0][0]..=range[0][1] {
                let at = y * self.cells[0] + x;
                for &index in &self.rocks[self.starts[at] as usize..self.starts[at + 1] as usize] {
                    let rock = &rocks[index as usize];
                    let reach_m = rock.radius_m + radius_m;
                    let off_m = rock.centre - point;
                    let towards_m = off_m.dot(&self.to_sun);
                    let aside_m2 = off_m.norm_squared() - towards_m * towards_m;
                    // A rock behind the point casts no shadow on it.
                    if towards_m > -reach_m && aside_m2 <= reach_m * reach_m && !found.contains(&index) {
                        found.push(index);
                    }
                }
            }
        }
        true
    }

    /// The rocks that may occlude the sun at a point.
    #[inline(always)]
    pub(crate) fn towards_sun(&self, point: &Point3) -> &[u32] {
        let mut cell = [0usize; 2];
        for (k, cell) in cell.iter_mut().enumerate() {
            let position = (point.coords.dot(&self.across[k]) - self.low_m[k]) / Self::CELL_M;
            if position < 0.0 || position >= self.cells[k] as f64 {
                return &[];
            }
            *cell = position as usize;
        }
        let at = cell[1] * self.cells[0] + cell[0];
        &self.rocks[self.starts[at] as usize..self.starts[at + 1] as usize]
    }
}

/// A cone of rays, which bounds the rays of an image tile.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cone {
    /// Origin of the rays, site frame, m; for a fisheye, the origin of the middle ray.
    pub apex: Point3,
    /// Largest distance of a ray's origin from the apex, m.
    pub apex_radius_m: f64,
    /// Unit mean direction of the rays.
    pub axis: Vector3,
    /// Cosine of half the opening angle, which is at most a right angle.
    pub half_angle_cos: f64,
    /// Sine of half the opening angle.
    pub half_angle_sin: f64,
}

impl Cone {
    /// Returns the narrowest cone around the mean direction of the rays, widened by `margin_rad`; `None` without
    /// rays.
    pub(crate) fn around<'a>(rays: impl Iterator<Item = &'a Ray> + Clone, margin_rad: f64) -> Option<Self> {
        let count = rays.clone().count();
        let apex = rays.clone().nth(count / 2)?.origin;
        let axis = rays.clone().map(|ray| ray.direction).sum::<Vector3>().normalize();
        let (mut chord_m2, mut apex_radius_m2) = (0.0f64, 0.0f64);
        for ray in rays {
            chord_m2 = chord_m2.max((ray.direction - axis).norm_squared());
            apex_radius_m2 = apex_radius_m2.max((ray.origin - apex).norm_squared());
        }
        // The chord of a narrow cone keeps digits that its cosine loses.
        let half_angle_rad = 2.0 * (0.5 * chord_m2.sqrt()).min(1.0).asin() + margin_rad;
        let (half_angle_sin, half_angle_cos) = half_angle_rad.min(std::f64::consts::FRAC_PI_2).sin_cos();
        Some(Self { apex, apex_radius_m: apex_radius_m2.sqrt(), axis, half_angle_cos, half_angle_sin })
    }

    /// Radius of the cone around its axis at distance 0, m, and its growth with the distance along any ray.
    pub(crate) fn spread(&self) -> [f64; 2] {
        // The chord of the half angle: points at equal distances, not at equal depths.
        [self.apex_radius_m, (2.0 * (1.0 - self.half_angle_cos)).sqrt().max(self.half_angle_sin) * 1.000_001]
    }
}

/// Whether any ray of the cone can meet a sphere.
pub(crate) fn in_cone(cone: &Cone, centre: &Point3, radius_m: f64) -> bool {
    let v = centre - cone.apex;
    let (distance_m2, radius_m) = (v.norm_squared(), radius_m + cone.apex_radius_m);
    if distance_m2 <= radius_m * radius_m {
        return true;
    }
    // cos(half angle + asin(r/d)) · d, without trigonometry: this runs for every rock of every tile.
    let tangent_m = (distance_m2 - radius_m * radius_m).sqrt();
    v.dot(&cone.axis) >= cone.half_angle_cos * tangent_m - cone.half_angle_sin * radius_m
}
