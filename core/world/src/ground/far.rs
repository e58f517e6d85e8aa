//! Far ground: beyond a given distance a slope returns to the mean level, so that the horizon is level.
//!
//! Within ρ0 of the site's origin the mean ground is the plane `z = z0 + s`, `s = a x + b y`. Beyond, it is
//! ```text
//! z(x, y) = z0 + (ρ0/ρ)² s,    ∇z = (ρ0/ρ)² [ (a, b) − 2 s (x, y)/ρ² ],    ρ² = x² + y²
//! ```
//! which continues the plane at ρ0, is nowhere steeper than it, and approaches the level z0: uphill the slope ends in a
//! crest, downhill in a valley whose far side rises to the horizon. Level ground has no such part.
//!
//! **Intersection.** Along a ray `F(t) = z_ray(t) − z(t)`, positive below the ground, has the sign of the cubic
//! `P(t) = (p + d_z t)(A t² + 2 B t + C) − ρ0² (s_o + s_d t)`. Between the roots of P' it is monotone, so that the first
//! of these intervals at whose end F is not negative contains the hit; secants and bisection find it to the last bit.
//!
//! | symbol | name | unit, frame |
//! |---|---|---|
//! | ρ0 | `radius_m` | m, site |
//! | a, b | `tilt` | m/m |
//! | p, d_z | height of the ray's origin below z0, its change | m, – |
//! | A, B, C | ρ² along the ray | –, m, m² |
//! | s_o, s_d | s at the ray's origin, its change | m, – |
//!
//! Frame: site. Sources: ours.

use crate::ground::level::MEAN_GROUND_Z_M;
use sightline_geometry::frames::Ray;

/// Largest distance along a ray at which ground is searched, m.
const FARTHEST_M: f64 = 1e7;

/// The ground beyond the slope.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Far {
    radius_m: f64,
    tilt: [f64; 2],
}

impl Far {
    /// The ground beyond a slope of radius `radius_m`.
    pub(crate) fn new(radius_m: f64, tilt: [f64; 2]) -> Self {
        Self { radius_m, tilt }
    }

    /// (ρ0/ρ)² and ρ², m², at a point beyond the slope; `None` on the slope.
    fn beyond(&self, x_m: f64, y_m: f64) -> Option<(f64, f64)> {
        let (square_m2, rho_m2) = (self.radius_m * self.radius_m, x_m * x_m + y_m * y_m);
        (rho_m2 > square_m2).then(|| (square_m2 / rho_m2, rho_m2))
    }

    fn rise_m(&self, x_m: f64, y_m: f64) -> f64 {
        self.tilt[0] * x_m + self.tilt[1] * y_m
    }

    /// z at a point beyond the slope, m, positive down; `None` on the slope.
    pub(crate) fn z_at(&self, x_m: f64, y_m: f64) -> Option<f64> {
        let (part, _) = self.beyond(x_m, y_m)?;
        Some(MEAN_GROUND_Z_M + part * self.rise_m(x_m, y_m))
    }

    /// Gradient of z at a point beyond the slope, m/m; `None` on the slope.
    pub(crate) fn gradient_at(&self, x_m: f64, y_m: f64) -> Option<[f64; 2]> {
        let (part, rho_m2) = self.beyond(x_m, y_m)?;
        let along = 2.0 * self.rise_m(x_m, y_m) / rho_m2;
        Some([part * (self.tilt[0] - along * x_m), part * (self.tilt[1] - along * y_m)])
    }

    /// The interval in which a ray is over the slope itself, m; empty if it passes beside it.
    pub(crate) fn over_slope(&self, ray: &Ray) -> [f64; 2] {
        let [a, b, c] = rho_squared(ray);
        let room_m2 = c - self.radius_m * self.radius_m;
        if a == 0.0 {
            let is_inside = room_m2 <= 0.0;
            return if is_inside {
                [f64::NEG_INFINITY, f64::INFINITY]
            } else {
                [f64::INFINITY, f64::NEG_INFINITY]
            };
        }
        let discriminant = b * b - a * room_m2;
        if discriminant <= 0.0 {
            return [f64::INFINITY, f64::NEG_INFINITY];
        }
        let root = discriminant.sqrt();
        [(-b - root) / a, (-b + root) / a]
    }

    /// The first distance in [`from_m`, `to_m`] at which a ray that is not over the slope there is on or below
    /// the far ground, m.
    pub(crate) fn cast(&self, ray: &Ray, from_m: f64, to_m: f64) -> Option<f64> {
        let to_m = to_m.min(FARTHEST_M);
        if from_m >= to_m {
            return None;
        }
        let [a, b, c] = rho_squared(ray);
        let (p, dz) = (ray.origin.z - MEAN_GROUND_Z_M, ray.direction.z);
        let square_m2 = self.radius_m * self.radius_m;
        let (so, sd) =
            (self.rise_m(ray.origin.x, ray.origin.y), self.rise_m(ray.direction.x, ray.direction.y));
        let below_m = |t: f64| p + dz * t - square_m2 * (so + sd * t) / ((a * t + 2.0 * b) * t + c);
        if below_m(from_m) >= 0.0 {
            return Some(from_m);
        }
        let turns = turns([dz * a, 2.0 * b * dz + p * a, dz * c + 2.0 * b * p - square_m2 * sd]);
        let ends = turns.into_iter().filter(|t| *t > from_m && *t < to_m).chain([to_m]);
        let mut above_m = from_m;
        for end_m in ends {
            if below_m(end_m) >= 0.0 {
                return Some(first_below(below_m, above_m, end_m));
            }
            above_m = end_m;
        }
        None
    }
}

/// A, B and C of ρ² = A t² + 2 B t + C along a ray.
fn rho_squared(ray: &Ray) -> [f64; 3] {
    let (o, d) = (ray.origin.coords.xy(), ray.direction.xy());
    [d.norm_squared(), o.dot(&d), o.norm_squared()]
}

/// The roots of the derivative of c3 t³ + c2 t² + c1 t in ascending order, NaN where there are none.
fn turns([c3, c2, c1]: [f64; 3]) -> [f64; 2] {
    let discriminant = c2 * c2 - 3.0 * c3 * c1;
    // Both roots without cancellation; NaN and infinity mark roots that do not exist.
    let w = -(c2 + discriminant.sqrt().copysign(c2));
    let roots = [w / (3.0 * c3), c1 / w];
    if roots[0] > roots[1] { [roots[1], roots[0]] } else { roots }
}

/// The first floating-point number at which `below_m` is not negative, between `above`, where it is negative, and `below`,
/// where it is not.
///
/// If the curve is nearly straight, the root is within a thousandth of the interval from the root of the chord, and two
/// probes there enclose it. The midpoint halves the interval in any case.
fn first_below(below_m: impl Fn(f64) -> f64, mut above: f64, mut below: f64) -> f64 {
    let (mut from_m, mut to_m) = (below_m(above), below_m(below));
    loop {
        let middle = 0.5 * (above + below);
        if middle <= above || middle >= below {
            return below;
        }
        let width = below - above;
        let on_chord = above - from_m * width / (to_m - from_m);
        for probe in [on_chord - 1e-3 * width, on_chord + 1e-3 * width, middle] {
            if probe > above && probe < below {
                let at_m = below_m(probe);
                if at_m >= 0.0 { (below, to_m) = (probe, at_m) } else { (above, from_m) = (probe, at_m) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::terrain::Terrain;
    use crate::ground::texture::mix;
    use crate::scenario::TerrainSettings;
    use sightline_geometry::frames::{Point3, Vector3};

    fn slope() -> Terrain {
        let settings = TerrainSettings {
            slope_deg: 18.0,
            slope_azimuth_deg: 40.0,
            rms_at_1m_m: 0.0,
            ..TerrainSettings::default()
        };
        Terrain::new(&settings, [-2.0, 10.0], [-4.0, 4.0], 1)
    }

    #[test]
    fn far_ground_continues_the_slope_and_its_normals_are_those_of_its_heights() {
        let terrain = slope();
        for k in 0..360 {
            let (sine, cosine) = f64::from(k).to_radians().sin_cos();
            let step_m = terrain.z_at(60.000_001 * cosine, 60.000_001 * sine)
                - terrain.z_at(59.999_999 * cosine, 59.999_999 * sine);
            assert!(step_m.abs() < 1e-6, "{step_m}");
            for rho_m in [61.0, 90.0, 400.0] {
                let (x, y, h) = (rho_m * cosine, rho_m * sine, 1e-4);
                let zx = (terrain.z_at(x + h, y) - terrain.z_at(x - h, y)) / (2.0 * h);
                let zy = (terrain.z_at(x, y + h) - terrain.z_at(x, y - h)) / (2.0 * h);
                let normal = Vector3::new(zx, zy, -1.0).normalize();
                assert!((normal - terrain.normal_at(x, y)).norm() < 1e-8);
                assert!(zx.hypot(zy) <= terrain.steepest());
            }
        }
    }

    #[test]
    fn a_root_is_the_first_number_at_or_below_the_ground() {
        for (root, scale) in [(3.7, 1.0), (0.02, 1e-6), (900.0, 40.0)] {
            for bend in [0.0, 1e-3, 30.0] {
                let below_m = |t: f64| scale * (t - root) * (1.0 + bend * (t - root) * (t - root));
                let found = first_below(below_m, -5.0, 1e7);
                assert!(below_m(found) >= 0.0 && below_m(found.next_down()) < 0.0, "{root} {bend}: {found}");
            }
        }
    }

    #[test]
    fn rays_meet_the_far_ground_where_a_march_meets_it() {
        let terrain = slope();
        let (mut far, mut near, mut missed) = (0, 0, 0);
        for k in 0..400u32 {
            let unit = |n: u64| (mix(u64::from(k) * 8 + n) >> 11) as f64 / (1u64 << 53) as f64;
            let (x, y) = (400.0 * unit(0) - 200.0, 400.0 * unit(1) - 200.0);
            let origin = Point3::new(x, y, terrain.z_at(x, y) - 0.1 - 20.0 * unit(2));
            let heading = std::f64::consts::TAU * unit(3);
            let direction = Vector3::new(heading.cos(), heading.sin(), 0.5 * unit(4) - 0.2).normalize();
            let ray = Ray { origin, direction };
            let below = |t: f64| ray.at(t).z >= terrain.z_at(ray.at(t).x, ray.at(t).y);
            let marched = (0..20_000).map(|step| 0.02 * f64::from(step)).find(|t| below(*t));
            match (terrain.cast(&ray, 0.0, 399.0), marched) {
                (Some(cast), Some(marched)) => {
                    assert!(cast <= marched + 1e-9 && marched - cast < 0.021, "{k}: {cast} {marched}");
                    let at = ray.at(cast);
                    assert!((at.z - terrain.z_at(at.x, at.y)).abs() < 1e-9);
                    if at.xy().coords.norm() > 60.0 { far += 1 } else { near += 1 }
                }
                (None, None) => missed += 1,
                (cast, marched) => panic!("{k}: {cast:?} {marched:?}"),
            }
        }
        assert!(far > 100 && near > 20 && missed > 50, "{far} {near} {missed}");
    }

    #[test]
    fn the_horizon_below_a_slope_is_level() {
        let terrain = slope();
        // Downhill and across the slope the least depression that still meets ground is within 0.01° of horizontal.
        for azimuth_deg in (130..=310).step_by(10) {
            let (sine, cosine) = f64::from(azimuth_deg).to_radians().sin_cos();
            let meets = |down_deg: f64| {
                let (down_sine, down_cosine) = down_deg.to_radians().sin_cos();
                let direction = Vector3::new(down_cosine * cosine, down_cosine * sine, down_sine);
                let ray = Ray { origin: Point3::new(0.0, 0.0, -1.2), direction };
                terrain.cast(&ray, 0.0, f64::INFINITY).is_some()
            };
            assert!(meets(0.01) && !meets(-0.01), "{azimuth_deg}");
        }
    }
}
