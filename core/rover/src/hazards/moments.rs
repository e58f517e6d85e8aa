//! Sums over points for a plane fit, and the fit.
//!
//! ```text
//! z = a x + b y + c      Sxx = Σx² − (Σx)²/n, …      [Sxx Sxy; Sxy Syy] (a, b) = (Sxz, Syz)
//! tilt = atan √(a² + b²)      roughness = √((Szz − a Sxz − b Syz)/n)
//! ```
//! | symbol | name | unit |
//! |---|---|---|
//! | n | number of points, decayed with the distance driven | – |
//! | x, y, z | position relative to a reference of the sums, z down | m |
//! | – | `odometer`: Σ distance driven at the observation | m |
//! | σ² | expected variance of a point's height | m² |
//!
//! Frame: axes of the site. Source: domain.md 8.2; the normal equations are those of least squares.

use serde::{Deserialize, Serialize};

/// Number of sums.
pub(super) const SUMS: usize = 12;

/// n, Σx, Σy, Σz, Σx², Σxy, Σxz, Σy², Σyz, Σz², Σ of the distance driven at the observation, and Σσ².
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Moments(pub(super) [f64; SUMS]);

/// A plane fitted to points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plane {
    /// Angle between its normal and the vertical, rad.
    pub(super) tilt_rad: f64,
    /// RMS residual along z, m.
    pub(super) roughness_m: f64,
}

/// Least ratio of the determinant of the points' horizontal scatter to its squared trace: below it they are on a line.
const SCATTER_MIN: f64 = 1e-3;

impl Moments {
    /// Adds a point with this height variance, m², observed when the rover had driven `odometer_m`.
    #[inline]
    pub(super) fn add(&mut self, [x, y, z]: [f64; 3], odometer_m: f64, variance_m2: f64) {
        let added = [1.0, x, y, z, x * x, x * y, x * z, y * y, y * z, z * z, odometer_m, variance_m2];
        for (sum, value) in self.0.iter_mut().zip(added) {
            *sum += value;
        }
    }

    /// Multiplies every sum, and so the weight of the points.
    pub(super) fn scale(&mut self, factor: f64) {
        self.0.iter_mut().for_each(|sum| *sum *= factor);
    }

    /// The decayed number of points.
    #[inline]
    pub(super) fn count(&self) -> f64 {
        self.0[0]
    }

    /// Mean height; not finite without points.
    pub(super) fn mean_height_m(&self) -> f64 {
        self.0[3] / self.0[0]
    }

    /// Mean of the points; not finite without points.
    pub(super) fn mean(&self) -> [f64; 3] {
        [1, 2, 3].map(|k| self.0[k] / self.0[0])
    }

    /// Standard deviation of the heights beyond their expected error, m; NaN without points.
    pub(super) fn spread_m(&self) -> f64 {
        let mean_m = self.mean_height_m();
        (self.0[9] / self.0[0] - mean_m * mean_m - self.variance_m2()).max(0.0).sqrt()
    }

    /// Sum of the distances driven at the observations, m.
    #[inline]
    pub(super) fn odometer_m(&self) -> f64 {
        self.0[10]
    }

    /// Mean expected variance of the heights, m². It is not divided by the number of points, because stereo errors of
    /// neighbouring points are correlated. Not finite without points.
    pub(super) fn variance_m2(&self) -> f64 {
        self.0[11] / self.0[0]
    }

    /// The same sums relative to a reference displaced by (−x, −y).
    pub(super) fn shifted(&self, x: f64, y: f64) -> Self {
        let [n, sx, sy, sz, sxx, sxy, sxz, syy, syz, szz, odometer, variance] = self.0;
        Self([
            n,
            sx + n * x,
            sy + n * y,
            sz,
            sxx + 2.0 * x * sx + n * x * x,
            sxy + x * sy + y * sx + n * x * y,
            sxz + x * sz,
            syy + 2.0 * y * sy + n * y * y,
            syz + y * sz,
            szz,
            odometer,
            variance,
        ])
    }

    /// The plane through the points; `None` for points on a line, or fewer than three.
    pub(super) fn plane(&self) -> Option<Plane> {
        let [n, sx, sy, sz, sxx, sxy, sxz, syy, syz, szz, ..] = self.0;
        let scatter = |product: f64, a: f64, b: f64| product - a * b / n;
        let (xx, xy, yy) = (scatter(sxx, sx, sx), scatter(sxy, sx, sy), scatter(syy, sy, sy));
        let (xz, yz, zz) = (scatter(sxz, sx, sz), scatter(syz, sy, sz), scatter(szz, sz, sz));
        let (determinant, trace) = (xx * yy - xy * xy, xx + yy);
        // The comparison is false for NaN as well.
        if !(trace > 0.0 && determinant > SCATTER_MIN * trace * trace) {
            return None;
        }
        let a = (xz * yy - yz * xy) / determinant;
        let b = (yz * xx - xz * xy) / determinant;
        let residual = (zz - a * xz - b * yz).max(0.0);
        Some(Plane { tilt_rad: a.hypot(b).atan(), roughness_m: (residual / n).sqrt() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_exact_plane_has_its_tilt_and_no_roughness() {
        for (deg, direction) in [(0.0f64, 0.0f64), (5.0, 0.3), (17.2, 2.0), (30.0, -1.1)] {
            let slope = deg.to_radians().tan();
            let mut moments = Moments::default();
            for k in 0..200 {
                let (x, y) = (0.04 * f64::from(k % 20) - 0.4, 0.07 * f64::from(k / 20));
                let z = slope * (x * direction.cos() + y * direction.sin()) + 1.7;
                moments.add([x, y, z], 0.0, 0.0);
            }
            for reference in [[0.0, 0.0], [7.0, -8.0]] {
                let plane = moments.shifted(reference[0], reference[1]).plane().unwrap();
                assert!((plane.tilt_rad.to_degrees() - deg).abs() < 1e-6, "{deg}: {plane:?}");
                assert!(plane.roughness_m < 1e-6);
            }
        }
    }

    #[test]
    fn roughness_is_the_rms_residual_of_the_plane() {
        let mut moments = Moments::default();
        for k in 0..400 {
            let (column, row) = (k % 20, k / 20);
            // A chequered offset is uncorrelated with x and y.
            let offset = if (column + row) % 2 == 0 { 0.03 } else { -0.03 };
            let (x, y) = (0.05 * f64::from(column), 0.05 * f64::from(row));
            moments.add([x, y, 0.2 * x - 0.1 * y + offset], 0.0, 0.0);
        }
        let plane = moments.plane().unwrap();
        assert!((plane.roughness_m - 0.03).abs() < 2e-4, "{plane:?}");
    }

    #[test]
    fn points_on_a_line_have_no_plane() {
        let mut moments = Moments::default();
        assert!(moments.plane().is_none());
        for k in 0..50 {
            let x = 0.02 * f64::from(k);
            moments.add([x, 0.5 * x, 0.1 * x], 0.0, 0.0);
        }
        assert!(moments.plane().is_none());
    }
}
