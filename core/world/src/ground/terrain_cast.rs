//! The exact intersection of a ray with the ground.
//!
//! Within a cell, z(u, v) = z00 + a u + b v + c u v and a ray is linear in t, so that `F(t) = z_ray(t) − z(u(t), v(t))` is
//! a quadratic whose root is the exact hit. F > 0 is below ground (z points down). Cells are found by traversing nested
//! blocks (`block_walk.rs`). A ray that enters a cell already below the ground hits at its entry, which closes the
//! rounding gap between neighbouring cells.
//!
//! Tilted ground is level ground sheared along z, `z = z_level + a x + b y`. The ray is sheared back and remains a
//! straight line with the same t, so that everything below uses level ground. The ground beyond the slope has its own
//! intersection (`far.rs`).
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | t | distance along the ray, `_m` | m |
//! | s | distance along the ray from its entry into a cell | m |
//! | u, v | position within a cell, 0 to 1 along x and y | – |
//! | z | height, `z_m` | m, site frame, down |
//!
//! Source: ours.

use sightline_geometry::frames::Ray;

use crate::culling::Cone;
use crate::ground::block_walk::{Blocks, CellRay};
use crate::ground::level::MEAN_GROUND_Z_M;
use crate::ground::terrain::{BLOCK_SHIFT, Terrain};

/// The level of blocks at which a traversal starts near the ground: 4 × 4 cells.
const NEAR_LEVEL: usize = 2;

impl Terrain {
    /// Distance along `ray` to the ground within [`from_m`, `to_m`], m; `None` without a hit.
    ///
    /// A ray that is below ground at `from_m` hits there.
    #[inline(always)]
    pub(crate) fn cast(&self, ray: &Ray, from_m: f64, to_m: f64) -> Option<f64> {
        self.cast_beyond(ray, 0.0, from_m, to_m)
    }

    /// [`Terrain::cast`] for a ray that does not meet the grid before `clear_m`, m ([`Terrain::clear_m`]).
    #[inline(always)]
    pub(crate) fn cast_beyond(&self, ray: &Ray, clear_m: f64, from_m: f64, to_m: f64) -> Option<f64> {
        let Some(far) = &self.far else { return self.cast_slope(ray, clear_m, from_m, to_m) };
        let [enter_m, leave_m] = far.over_slope(ray);
        far.cast(ray, from_m, to_m.min(enter_m))
            .or_else(|| self.cast_slope(ray, clear_m, from_m.max(enter_m), to_m.min(leave_m)))
            .or_else(|| far.cast(ray, from_m.max(leave_m), to_m))
    }

    /// A distance before which no ray of a narrow cone meets the grid, m.
    ///
    /// The cone's axis traverses the highest points of blocks with their neighbours, lowered by the cone's radius, as long
    /// as the cone is narrower than a block.
    pub(crate) fn clear_m(&self, cone: &Cone) -> f64 {
        let [radius_m, growth] = cone.spread();
        let lower = 1.0 + self.tilt[0].hypot(self.tilt[1]);
        let mut ray = self.level(&Ray { origin: cone.apex, direction: cone.axis });
        ray.origin.z += radius_m * lower;
        ray.direction.z += growth * lower;
        let above_m = self.highest_z_m - ray.origin.z;
        if above_m <= 0.0 {
            return 0.0;
        }
        let start_m = if ray.direction.z > 0.0 { above_m / ray.direction.z } else { return f64::INFINITY };
        let ray = self.cell_ray(&ray);
        let (enter_m, leave_m) = self.inside(&ray, 0.0, f64::INFINITY);
        if enter_m > 0.0 {
            return 0.0;
        }
        if start_m >= leave_m {
            return leave_m;
        }
        let is_narrow = |level: usize, t: f64| {
            radius_m + growth * t <= self.cell_m * (1usize << BLOCK_SHIFT[level]) as f64
        };
        if !is_narrow(0, leave_m) {
            return start_m;
        }
        let blocks = Blocks {
            tops: &self.wide_tops,
            cells: self.cells,
            is_leaf: |level: usize, end: f64| level + 1 == BLOCK_SHIFT.len() || !is_narrow(level + 1, end),
            leaf: |_: [usize; 2], t: f64, _: f64| Some(t),
        };
        blocks.walk(0, &ray, start_m, leave_m).unwrap_or(leave_m)
    }

    /// A ray over the ground without its tilt; its direction need not be a unit vector.
    #[inline(always)]
    fn level(&self, ray: &Ray) -> Ray {
        let mut ray = *ray;
        ray.origin.z -= self.tilt_m(ray.origin.x, ray.origin.y);
        ray.direction.z -= self.tilt_m(ray.direction.x, ray.direction.y);
        ray
    }

    /// [`Terrain::cast_beyond`] where the mean ground is a plane.
    #[inline(always)]
    fn cast_slope(&self, ray: &Ray, clear_m: f64, from_m: f64, to_m: f64) -> Option<f64> {
        self.cast_level(&self.level(ray), clear_m, from_m, to_m)
    }

    /// The same over the ground without its tilt; the ray's direction need not be a unit vector.
    #[inline(always)]
    fn cast_level(&self, ray: &Ray, clear_m: f64, from_m: f64, to_m: f64) -> Option<f64> {
        // No hit is possible above the highest point, where most of a camera's ray is.
        let (mut from_m, mut to_m) = (from_m, to_m);
        let above_m = self.highest_z_m - ray.origin.z;
        let dz = ray.direction.z;
        if dz > 0.0 {
            from_m = from_m.max(above_m / dz);
        } else if dz < 0.0 {
            to_m = to_m.min(above_m / dz);
        } else if above_m > 0.0 {
            return None;
        }
        if from_m >= to_m {
            return None;
        }
        let ray = self.cell_ray(ray);
        let (enter_m, leave_m) = self.inside(&ray, from_m, to_m);
        let plane_m = if ray.dz > 0.0 { (MEAN_GROUND_Z_M - ray.z_m) / ray.dz } else { f64::INFINITY };
        let plane_m = if ray.z_m + ray.dz * from_m > MEAN_GROUND_Z_M { from_m } else { plane_m.max(from_m) };
        let on_plane = (plane_m <= to_m).then_some(plane_m);
        if enter_m >= leave_m || plane_m < enter_m {
            return on_plane;
        }
        let blocks = Blocks {
            tops: &self.tops,
            cells: self.cells,
            is_leaf: |level: usize, _: f64| level + 1 == BLOCK_SHIFT.len(),
            leaf: |cell: [usize; 2], t: f64, end: f64| self.hit_cell(cell, &ray, t, end),
        };
        let from_m = enter_m.max(clear_m);
        let on_grid = if clear_m > 0.0 {
            // The ground is near: the coarse blocks would all be entered.
            (from_m < leave_m).then(|| blocks.walk(NEAR_LEVEL, &ray, from_m, leave_m)).flatten()
        } else {
            blocks.walk(0, &ray, from_m, leave_m)
        };
        on_grid.or(on_plane.filter(|t| *t >= leave_m))
    }

    fn cell_ray(&self, ray: &Ray) -> CellRay {
        let scale = 1.0 / self.cell_m;
        let d = [ray.direction.x * scale, ray.direction.y * scale];
        CellRay {
            p: [(ray.origin.x - self.origin_m[0]) * scale, (ray.origin.y - self.origin_m[1]) * scale],
            d,
            inverse: d.map(|v| 1.0 / v),
            z_m: ray.origin.z,
            dz: ray.direction.z,
        }
    }

    /// The part of [from, to] over the grid.
    #[inline(always)]
    fn inside(&self, ray: &CellRay, from_m: f64, to_m: f64) -> (f64, f64) {
        let (mut enter_m, mut leave_m) = (from_m, to_m);
        for k in 0..2 {
            let (low, high) = (0.0, self.cells[k] as f64);
            if ray.d[k] == 0.0 {
                if ray.p[k] < low || ray.p[k] > high {
                    return (1.0, 0.0);
                }
                continue;
            }
            let (a, b) = ((low - ray.p[k]) * ray.inverse[k], (high - ray.p[k]) * ray.inverse[k]);
            enter_m = enter_m.max(a.min(b));
            leave_m = leave_m.min(a.max(b));
        }
        (enter_m, leave_m)
    }

    /// The first distance in [enter, leave] at which the ray is on or below the patch of a cell.
    #[inline(always)]
    fn hit_cell(&self, cell: [usize; 2], ray: &CellRay, enter_m: f64, leave_m: f64) -> Option<f64> {
        let [z00, z10, z01, z11] = self.corners(cell);
        let (a, b, c) = (z10 - z00, z01 - z00, z00 - z10 - z01 + z11);
        let u = ray.p[0] + ray.d[0] * enter_m - cell[0] as f64;
        let v = ray.p[1] + ray.d[1] * enter_m - cell[1] as f64;
        // F(s) = q0 + q1 s + q2 s², s measured from the point of entry.
        let q0 = ray.z_m + ray.dz * enter_m - (z00 + a * u + b * v + c * u * v);
        if q0 >= 0.0 {
            return Some(enter_m);
        }
        let q1 = ray.dz - (a * ray.d[0] + b * ray.d[1] + c * (u * ray.d[1] + v * ray.d[0]));
        let q2 = -c * ray.d[0] * ray.d[1];
        let s = first_root(q0, q1, q2)?;
        (enter_m + s <= leave_m).then_some(enter_m + s)
    }
}

/// The smallest positive root of q0 + q1 s + q2 s², given q0 < 0.
#[inline(always)]
fn first_root(q0: f64, q1: f64, q2: f64) -> Option<f64> {
    if q2 == 0.0 {
        return (q1 > 0.0).then(|| -q0 / q1);
    }
    let discriminant = q1 * q1 - 4.0 * q2 * q0;
    if discriminant < 0.0 {
        return None;
    }
    // Both roots without cancellation.
    let w = -0.5 * (q1 + discriminant.sqrt().copysign(q1));
    let roots = [w / q2, q0 / w];
    roots
        .into_iter()
        .filter(|s| *s > 0.0)
        .fold(None, |best: Option<f64>, s| Some(best.map_or(s, |b| b.min(s))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::texture::mix;
    use crate::scenario::TerrainSettings;
    use sightline_geometry::frames::{Point3, Vector3};

    fn ground(seed: u64, rms_m: f64) -> Terrain {
        let settings = TerrainSettings { rms_at_1m_m: rms_m, ..TerrainSettings::default() };
        Terrain::new(&settings, [-2.0, 10.0], [-4.0, 4.0], seed)
    }

    /// Steps along the ray until it is below ground, then bisects.
    fn march(terrain: &Terrain, ray: &Ray, to_m: f64) -> Option<f64> {
        let below = |t: f64| ray.at(t).z >= terrain.z_at(ray.at(t).x, ray.at(t).y);
        let step = 5e-4;
        let first = (0..=(to_m / step) as usize).map(|k| k as f64 * step).find(|t| below(*t))?;
        let (mut above, mut under) = ((first - step).max(0.0), first);
        for _ in 0..60 {
            let middle = 0.5 * (above + under);
            if below(middle) { under = middle } else { above = middle }
        }
        Some(under)
    }

    #[test]
    fn cast_agrees_with_a_march_on_gentle_and_rough_ground() {
        for (seed, rms_m) in [(1, 0.02), (2, 0.15)] {
            let terrain = ground(seed, rms_m);
            let mut grazing_misses = 0;
            for k in 0..120u32 {
                let unit = |n: u64| (mix(u64::from(k) * 8 + n) >> 11) as f64 / (1u64 << 53) as f64;
                let origin = Point3::new(-1.0 + 9.0 * unit(0), -3.0 + 6.0 * unit(1), -1.5 + unit(2));
                let heading = std::f64::consts::TAU * unit(3);
                let down = 0.02 + unit(4) * 0.6;
                let direction = Vector3::new(heading.cos(), heading.sin(), down).normalize();
                let ray = Ray { origin, direction };
                match (terrain.cast(&ray, 0.0, 20.0), march(&terrain, &ray, 20.0)) {
                    (Some(cast), Some(marched)) if (cast - marched).abs() < 1e-9 => {}
                    // The march can step over a crest that the ray just touches; `cast` must then be nearer.
                    (Some(cast), marched) if marched.is_none_or(|m| cast < m) => {
                        grazing_misses += 1;
                        let p = ray.at(cast);
                        assert!((p.z - terrain.z_at(p.x, p.y)).abs() < 1e-9);
                    }
                    (None, None) => {}
                    other => panic!("{other:?} for {ray:?}"),
                }
            }
            assert!(grazing_misses <= 2, "{grazing_misses}");
        }
    }

    #[test]
    fn cast_agrees_with_a_march_on_slopes_with_ripples() {
        let settings = TerrainSettings {
            slope_deg: 18.0,
            slope_azimuth_deg: 140.0,
            ripple_height_m: 0.05,
            ..TerrainSettings::default()
        };
        let terrain = Terrain::new(&settings, [-2.0, 10.0], [-4.0, 4.0], 5);
        let (mut on_grid, mut beyond, mut missed) = (0, 0, 0);
        for k in 0..150u32 {
            let unit = |n: u64| (mix(u64::from(k) * 8 + n) >> 11) as f64 / (1u64 << 53) as f64;
            let (x, y) = (-1.0 + 9.0 * unit(0), -3.0 + 6.0 * unit(1));
            let origin = Point3::new(x, y, terrain.z_at(x, y) - 0.1 - unit(2));
            let heading = std::f64::consts::TAU * unit(3);
            let direction = Vector3::new(heading.cos(), heading.sin(), 0.7 * unit(4) - 0.3).normalize();
            let ray = Ray { origin, direction };
            match (terrain.cast(&ray, 0.0, 20.0), march(&terrain, &ray, 20.0)) {
                (Some(cast), Some(marched)) if (cast - marched).abs() < 1e-9 => {
                    let inside = terrain.origin_m[0] < ray.at(cast).x && ray.at(cast).x < 10.0;
                    if inside && ray.at(cast).y.abs() < 4.0 { on_grid += 1 } else { beyond += 1 }
                }
                (Some(cast), marched) if marched.is_none_or(|m| cast < m) => {
                    let p = ray.at(cast);
                    assert!((p.z - terrain.z_at(p.x, p.y)).abs() < 1e-9);
                }
                (None, None) => missed += 1,
                other => panic!("{other:?} for {ray:?}"),
            }
        }
        assert!(on_grid > 50 && beyond > 5 && missed > 20, "{on_grid} {beyond} {missed}");
    }

    #[test]
    fn beyond_the_grid_lies_the_plane() {
        let terrain = ground(3, 0.02);
        let ray = Ray {
            origin: Point3::new(0.0, 0.0, -1.2),
            direction: Vector3::new(20.0, 1.0, 1.494).normalize(),
        };
        let t = terrain.cast(&ray, 0.0, 100.0).unwrap();
        assert!((ray.at(t).x - 20.0).abs() < 1e-9);
    }
}
