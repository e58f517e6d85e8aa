//! Intersection of the rays of one or a few neighbouring pixels with the ground and with rocks, in vector lanes.
//!
//! Such rays cross the same few cells. The columns of cells along the axis of largest advance are visited in order, and in
//! each column the rows that any ray crosses. A cell's patch is the same for all rays, so that its quadratic
//! (`terrain_cast.rs`) is solved for [`LANES`] rays at once. Rays outside this scheme (a long footprint, the edge of the
//! grid) are cast one by one.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | t | distance along a ray, `_m` | m |
//! | F(t) | height of the ray below the patch | m |
//!
//! Frame: site. Source: ours.

#![expect(
    clippy::needless_range_loop,
    reason = "plain loops over lanes become vectors, adaptors do not always"
)]

use sightline_geometry::frames::{Point3, Ray, Vector3};

use crate::culling::Cone;
use crate::ground::rocks::Rock;
use crate::ground::terrain::Terrain;
use crate::ground::texture::{LANES, least};

/// A number for each ray.
pub(crate) type Lanes = [f64; LANES];

/// The rays of one or a few pixels, by component and lane; unused lanes repeat another ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayLanes {
    /// Origins, site frame, m.
    pub(crate) origin: [Lanes; 3],
    /// Unit directions, site frame.
    pub(crate) direction: [Lanes; 3],
}

/// Footprint of the rays, in cells along the view, above which rays are cast one by one.
const FOOTPRINT_MAX: f64 = 10.0;
/// Columns, and rows in one column, after which the remaining rays are cast one by one.
const COLUMNS_MAX: usize = 40;
const ROWS_MAX: i64 = 8;

/// The rays in units of cells over the ground without its tilt.
struct CellRays {
    p: [Lanes; 2],
    d: [Lanes; 2],
    inverse: [Lanes; 2],
    z_m: Lanes,
    dz: Lanes,
}

/// The crossing of a column of cells.
struct Crossing {
    /// Distances of entry and exit, m.
    enter_m: Lanes,
    leave_m: Lanes,
    /// First and last row that an open ray crosses there.
    rows: Option<[i64; 2]>,
}

/// The hits so far.
struct Found {
    /// Distance of the nearest hit, m; infinite if there is none yet.
    hit_m: Lanes,
    /// Distance up to which a ray is known to be above the ground, m.
    open_from_m: Lanes,
    /// Whether a ray may still hit.
    is_open: [bool; LANES],
}

/// A cell's patch `z00 + a u + b v + c u v` at its position in the grid.
struct Patch {
    cell: [f64; 2],
    z00: f64,
    a: f64,
    b: f64,
    c: f64,
    top_m: f64,
}

impl RayLanes {
    /// The ray of a lane.
    #[inline(always)]
    pub(crate) fn ray(&self, lane: usize) -> Ray {
        let [origin, direction] =
            [&self.origin, &self.direction].map(|v| [v[0][lane], v[1][lane], v[2][lane]]);
        Ray { origin: Point3::from(origin), direction: Vector3::from(direction) }
    }
}

impl Terrain {
    /// Distances at which rays meet the ground before `to_m`, m; infinite where they do not.
    ///
    /// No ray meets the grid before `clear_m`, the [`Terrain::clear_m`] of `cone`.
    #[inline(always)]
    pub(crate) fn cast_lanes(&self, rays: &RayLanes, cone: &Cone, clear_m: f64, to_m: &Lanes) -> Lanes {
        let mut found =
            Found { hit_m: [f64::INFINITY; LANES], open_from_m: [clear_m; LANES], is_open: [true; LANES] };
        if self.is_narrow(cone, clear_m) {
            self.cast_columns(rays, clear_m, to_m, &mut found);
        }
        for lane in 0..LANES {
            if found.is_open[lane] {
                let cast = self.cast_beyond(&rays.ray(lane), found.open_from_m[lane], 0.0, to_m[lane]);
                found.hit_m[lane] = cast.unwrap_or(f64::INFINITY);
            }
        }
        found.hit_m
    }

    /// Whether a cone of rays that comes near the ground at `clear_m` has a short footprint there.
    pub(crate) fn is_narrow(&self, cone: &Cone, clear_m: f64) -> bool {
        if clear_m <= 0.0 || !clear_m.is_finite() {
            return false;
        }
        let [radius_m, growth] = cone.spread();
        let falls = cone.axis.z - self.tilt_m(cone.axis.x, cone.axis.y);
        let width_m = 2.0 * (radius_m + growth * clear_m);
        falls > 0.0 && width_m * cone.axis.xy().norm() < FOOTPRINT_MAX * self.cell_m * falls
    }

    /// The same rays over the ground without its tilt, in cells.
    #[inline(always)]
    fn cell_rays(&self, rays: &RayLanes) -> CellRays {
        let scale = 1.0 / self.cell_m;
        let mut cell = CellRays {
            p: [[0.0; LANES]; 2],
            d: [[0.0; LANES]; 2],
            inverse: [[0.0; LANES]; 2],
            z_m: [0.0; LANES],
            dz: [0.0; LANES],
        };
        for k in 0..2 {
            for lane in 0..LANES {
                cell.p[k][lane] = (rays.origin[k][lane] - self.origin_m[k]) * scale;
                let d = rays.direction[k][lane] * scale;
                cell.d[k][lane] = d;
                // A ray along a row never leaves it: a tiny slope replaces zero.
                cell.inverse[k][lane] = 1.0 / if d.abs() < 1e-12 { 1e-12 } else { d };
            }
        }
        for lane in 0..LANES {
            cell.z_m[lane] = rays.origin[2][lane]
                - self.tilt[0] * rays.origin[0][lane]
                - self.tilt[1] * rays.origin[1][lane];
            cell.dz[lane] = rays.direction[2][lane]
                - self.tilt[0] * rays.direction[0][lane]
                - self.tilt[1] * rays.direction[1][lane];
        }
        cell
    }

    /// Casts the rays column by column; a ray that stays open is above the ground up to `open_from_m`.
    #[inline(always)]
    fn cast_columns(&self, rays: &RayLanes, clear_m: f64, to_m: &Lanes, found: &mut Found) {
        let rays = self.cell_rays(rays);
        let major = usize::from(rays.d[1][0].abs() > rays.d[0][0].abs());
        let (minor, is_forward) = (1 - major, rays.d[major][0] > 0.0);
        let Some(mut column) = rays.rearmost_column(major, is_forward, clear_m) else { return };
        for _ in 0..COLUMNS_MAX {
            if column < 0 || column >= self.cells[major] as i64 {
                return;
            }
            let crossing = rays.cross(major, [column, column + 1], is_forward, clear_m, &found.is_open);
            if let Some([first, last]) = crossing.rows {
                if first < 0 || last >= self.cells[minor] as i64 || last - first >= ROWS_MAX {
                    return;
                }
                for row in first..=last {
                    let mut cell = [0usize; 2];
                    (cell[major], cell[minor]) = (column as usize, row as usize);
                    self.patch(cell).meet(&rays, minor, &crossing, &mut found.hit_m);
                }
            }
            if !found.close(&crossing.leave_m, to_m) {
                return;
            }
            column += if is_forward { 1 } else { -1 };
        }
    }

    #[inline(always)]
    fn patch(&self, cell: [usize; 2]) -> Patch {
        let [z00, z10, z01, z11] = self.corners(cell);
        let (a, b, c) = (z10 - z00, z01 - z00, z00 - z10 - z01 + z11);
        Patch { cell: cell.map(|k| k as f64), z00, a, b, c, top_m: z00.min(z10).min(z01).min(z11) }
    }
}

impl CellRays {
    /// The column of the ray that has advanced least at `clear_m`; `None` if the rays advance in both directions.
    #[inline(always)]
    fn rearmost_column(&self, major: usize, is_forward: bool, clear_m: f64) -> Option<i64> {
        let (mut rear, mut turns) = ([0.0; LANES], false);
        for lane in 0..LANES {
            let at = self.p[major][lane] + self.d[major][lane] * clear_m;
            rear[lane] = if is_forward { at } else { -at };
            turns |= (self.d[major][lane] > 0.0) != is_forward;
        }
        let rear = least(&rear);
        (!turns).then(|| (if is_forward { rear } else { -rear }).floor() as i64)
    }

    /// The crossing of the column between two borders.
    #[inline(always)]
    fn cross(
        &self,
        major: usize,
        borders: [i64; 2],
        is_forward: bool,
        clear_m: f64,
        is_open: &[bool; LANES],
    ) -> Crossing {
        let minor = 1 - major;
        let [near, far] = if is_forward { borders } else { [borders[1], borders[0]] };
        let (mut enter_m, mut leave_m) = ([0.0; LANES], [0.0; LANES]);
        let (mut low, mut high) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let enter = (near as f64 - self.p[major][lane]) * self.inverse[major][lane];
            let leave = (far as f64 - self.p[major][lane]) * self.inverse[major][lane];
            let enter = if enter > clear_m { enter } else { clear_m };
            (enter_m[lane], leave_m[lane]) = (enter, leave);
            let a = self.p[minor][lane] + self.d[minor][lane] * enter;
            let b = self.p[minor][lane] + self.d[minor][lane] * leave;
            let is_here = is_open[lane] && leave > clear_m;
            low[lane] = if is_here { if a < b { a } else { b } } else { f64::INFINITY };
            high[lane] = if is_here { if a < b { -b } else { -a } } else { f64::INFINITY };
        }
        let (low, high) = (least(&low), -least(&high));
        let rows = (low <= high).then(|| [low.floor() as i64, high.floor() as i64]);
        Crossing { enter_m, leave_m, rows }
    }
}

impl Found {
    /// Closes the rays that hit, or end, before they leave a column; returns whether any stays open.
    #[inline(always)]
    fn close(&mut self, leave_m: &Lanes, to_m: &Lanes) -> bool {
        let mut any_open = false;
        for lane in 0..LANES {
            // A hit in a later column is farther.
            let is_done = self.hit_m[lane] < f64::INFINITY || leave_m[lane] >= to_m[lane];
            self.is_open[lane] &= !is_done;
            self.open_from_m[lane] = self.open_from_m[lane].max(leave_m[lane]);
            any_open |= self.is_open[lane];
            self.hit_m[lane] = if self.hit_m[lane] <= to_m[lane] { self.hit_m[lane] } else { f64::INFINITY };
        }
        any_open
    }
}

impl Patch {
    /// Lowers `hit_m` to the first distance within the column at which a ray is on or below the patch.
    #[inline(always)]
    fn meet(&self, rays: &CellRays, minor: usize, crossing: &Crossing, hit_m: &mut Lanes) {
        let (enter_m, leave_m) = (&crossing.enter_m, &crossing.leave_m);
        let (mut from_m, mut until_m) = ([0.0; LANES], [0.0; LANES]);
        let mut is_near = false;
        for lane in 0..LANES {
            let side = |at: f64| (at - rays.p[minor][lane]) * rays.inverse[minor][lane];
            let (a, b) = (side(self.cell[minor]), side(self.cell[minor] + 1.0));
            let (a, b) = if a < b { (a, b) } else { (b, a) };
            let from = if a > enter_m[lane] { a } else { enter_m[lane] };
            let until = if b < leave_m[lane] { b } else { leave_m[lane] };
            (from_m[lane], until_m[lane]) = (from, until);
            let [z_from_m, z_until_m] =
                [rays.z_m[lane] + rays.dz[lane] * from, rays.z_m[lane] + rays.dz[lane] * until];
            let is_low = (z_from_m >= self.top_m) | (z_until_m >= self.top_m);
            is_near |= (from <= until) & is_low;
        }
        if !is_near {
            return;
        }
        for lane in 0..LANES {
            let (t, d) = (from_m[lane], [rays.d[0][lane], rays.d[1][lane]]);
            let u = rays.p[0][lane] + d[0] * t - self.cell[0];
            let v = rays.p[1][lane] + d[1] * t - self.cell[1];
            // F(s) = q0 + q1 s + q2 s², s measured from the point of entry.
            let q0 =
                rays.z_m[lane] + rays.dz[lane] * t - (self.z00 + self.a * u + self.b * v + self.c * u * v);
            let q1 = rays.dz[lane] - (self.a * d[0] + self.b * d[1] + self.c * (u * d[1] + v * d[0]));
            let q2 = -self.c * d[0] * d[1];
            let discriminant = q1 * q1 - 4.0 * q2 * q0;
            // Both roots without cancellation; a plane has only the second, and the first is then infinite.
            let w = -0.5 * (q1 + discriminant.max(0.0).sqrt().copysign(q1));
            let [first, second] = [w / q2, q0 / w];
            let positive = |s: f64| if s > 0.0 { s } else { f64::INFINITY };
            let root =
                if discriminant >= 0.0 { positive(first).min(positive(second)) } else { f64::INFINITY };
            let s = if q0 >= 0.0 { 0.0 } else { root };
            let is_hit = t <= until_m[lane] && t + s <= until_m[lane];
            hit_m[lane] = hit_m[lane].min(if is_hit { t + s } else { f64::INFINITY });
        }
    }
}

impl Rock {
    /// Distances at which rays from one point outside the rock enter it, m (infinite for a miss), and the planes of entry.
    ///
    /// With s = 1/t the distance from the origin to a plane divides once for all rays: t is largest where s is smallest.
    #[inline(always)]
    pub(crate) fn enter_lanes(&self, origin: &Point3, directions: &[Lanes; 3]) -> (Lanes, [usize; LANES]) {
        let from_centre = origin - self.centre;
        let (mut enter, mut leave, mut planes) = ([f64::INFINITY; LANES], [0.0f64; LANES], [0usize; LANES]);
        for (index, half_space) in self.planes().iter().enumerate() {
            let n = &half_space.normal;
            let room_m = half_space.offset_m - n.dot(&from_centre);
            let per_room = 1.0 / room_m;
            for lane in 0..LANES {
                let speed = n.x * directions[0][lane] + n.y * directions[1][lane] + n.z * directions[2][lane];
                let s = speed * per_room;
                if room_m < 0.0 {
                    let is_later = s < enter[lane];
                    enter[lane] = if is_later { s } else { enter[lane] };
                    planes[lane] = if is_later { index } else { planes[lane] };
                } else {
                    leave[lane] = if s > leave[lane] { s } else { leave[lane] };
                }
            }
        }
        for lane in 0..LANES {
            let is_met = enter[lane] > 0.0 && enter[lane] >= leave[lane] && enter[lane] < f64::INFINITY;
            enter[lane] = if is_met { 1.0 / enter[lane] } else { f64::INFINITY };
        }
        (enter, planes)
    }

    /// Distances at which rays of one direction from many points enter and leave the rock, m; for a miss the exit distance
    /// is smaller than the entry distance.
    #[inline(always)]
    pub(crate) fn passage_lanes(&self, points: &[Lanes; 3], direction: &Vector3) -> [Lanes; 2] {
        let (mut enter_m, mut leave_m) = ([f64::NEG_INFINITY; LANES], [f64::INFINITY; LANES]);
        for half_space in self.planes() {
            let n = &half_space.normal;
            let speed = n.dot(direction);
            let per_speed = 1.0 / speed;
            for lane in 0..LANES {
                let (x, y) = (points[0][lane] - self.centre.x, points[1][lane] - self.centre.y);
                let z = points[2][lane] - self.centre.z;
                let room_m = half_space.offset_m - (n.x * x + n.y * y + n.z * z);
                let t = room_m * per_speed;
                if speed < 0.0 {
                    enter_m[lane] = if t > enter_m[lane] { t } else { enter_m[lane] };
                } else if speed > 0.0 {
                    leave_m[lane] = if t < leave_m[lane] { t } else { leave_m[lane] };
                } else if room_m < 0.0 {
                    leave_m[lane] = f64::NEG_INFINITY;
                }
            }
        }
        [enter_m, leave_m]
    }
}

#[cfg(test)]
#[path = "packet_cast_tests.rs"]
mod tests;
