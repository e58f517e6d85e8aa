//! A covariance as the outline of its ellipse.
//!
//! The ellipse of n σ consists of the points d with `dᵀ Σ⁻¹ d = n²`; with `Σ = V diag(λ) Vᵀ` it is `n V diag(√λ) (cos t,
//! sin t)ᵀ`. Negative eigenvalues, which only rounding produces, are set to zero.

use nalgebra::{Matrix2, Vector2};

/// Points of an outline.
const POINTS: usize = 48;

/// The closed outline at `sigmas` σ about the origin; `None` if the covariance is not finite.
pub(crate) fn outline(covariance: &Matrix2<f64>, sigmas: f64) -> Option<Vec<Vector2<f64>>> {
    let axes = axes(covariance)?;
    let point = |i: usize| {
        let t = std::f64::consts::TAU * i as f64 / POINTS as f64;
        (axes[0] * t.cos() + axes[1] * t.sin()) * sigmas
    };
    Some((0..=POINTS).map(point).collect())
}

/// The two half axes of the 1σ ellipse, the longer first; `None` if the covariance is not finite.
pub(crate) fn axes(covariance: &Matrix2<f64>) -> Option<[Vector2<f64>; 2]> {
    if covariance.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let eigen = ((covariance + covariance.transpose()) * 0.5).symmetric_eigen();
    let axis = |i: usize| eigen.eigenvectors.column(i) * eigen.eigenvalues[i].max(0.0).sqrt();
    let (a, b): (Vector2<f64>, Vector2<f64>) = (axis(0), axis(1));
    Some(if a.norm() >= b.norm() { [a, b] } else { [b, a] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_of_the_outline_lies_at_its_number_of_sigmas() {
        let covariance = Matrix2::new(4.0, 1.2, 1.2, 0.9);
        let inverse = covariance.try_inverse().unwrap();
        for point in outline(&covariance, 3.0).unwrap() {
            assert!((point.dot(&(inverse * point)) - 9.0).abs() < 1e-9, "{point}");
        }
    }

    #[test]
    fn the_longer_axis_comes_first_and_has_the_right_length() {
        let [long, short] = axes(&Matrix2::new(1.0, 0.0, 0.0, 25.0)).unwrap();
        assert!((long.norm() - 5.0).abs() < 1e-12 && (short.norm() - 1.0).abs() < 1e-12);
        assert!(long.x.abs() < 1e-12);
    }

    #[test]
    fn a_covariance_that_is_not_finite_has_no_outline() {
        assert!(outline(&Matrix2::new(f64::NAN, 0.0, 0.0, 1.0), 1.0).is_none());
        assert!(outline(&Matrix2::zeros(), 1.0).unwrap().iter().all(|p| p.norm() == 0.0));
    }
}
