//! Number density of rocks by size: the law of Golombek & Rapp.
//!
//! The fraction of the area covered by rocks of diameter D or more is F(D) = k e^{−qD} with q = 1.79 + 0.152/k; from
//! −dF/dD = (π D²/4) n(D) follows their number per m²: `N(≥D) = (4 k q/π) [e^{−qD}/D − q E1(qD)]`. Diameters are
//! drawn by inverting N.
//!
//! | symbol | name | unit |
//! |---|---|---|
//! | k | `area_fraction` | – |
//! | q | – | 1/m |
//! | D | `diameter_m` | m |
//! | N | `number_per_m2` | 1/m² |
//!
//! Sources: Golombek & Rapp 1997; domain.md 10.1.

/// The exponential integral E1(x), x > 0 (series below 1, continued fraction above).
fn exponential_integral(x: f64) -> f64 {
    const EULER: f64 = 0.577_215_664_901_532_9;
    if x < 1.0 {
        let (mut sum, mut term) = (-EULER - x.ln(), 1.0);
        for k in 1..40 {
            let k = f64::from(k);
            term *= -x / k;
            sum -= term / k;
        }
        return sum;
    }
    let fraction = (1..=80).rev().fold(0.0, |rest, k| {
        let k = f64::from(k);
        k / (1.0 + k / (x + rest))
    });
    (-x).exp() / (x + fraction)
}

/// Number of rocks of diameter `diameter_m` or more per m².
pub fn number_per_m2(area_fraction: f64, diameter_m: f64) -> f64 {
    if area_fraction <= 0.0 {
        return 0.0;
    }
    let q = 1.79 + 0.152 / area_fraction;
    let x = q * diameter_m;
    4.0 * area_fraction * q / std::f64::consts::PI * ((-x).exp() / diameter_m - q * exponential_integral(x))
}

/// Maps a uniform number in [0, 1) to a diameter between the two limits, m.
pub(crate) fn draw_diameter_m(area_fraction: f64, smallest_m: f64, largest_m: f64, unit: f64) -> f64 {
    let (most, least) = (number_per_m2(area_fraction, smallest_m), number_per_m2(area_fraction, largest_m));
    let wanted = most + unit * (least - most);
    let (mut low, mut high) = (smallest_m, largest_m);
    for _ in 0..50 {
        let middle = (low * high).sqrt();
        if number_per_m2(area_fraction, middle) > wanted { low = middle } else { high = middle }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_per_area_are_those_of_the_table() {
        // domain.md 10.1: rows k = 0.03, 0.10 and 0.30.
        for (k, d, n) in [(0.03, 0.05, 2.2653), (0.03, 0.5, 0.0033), (0.1, 0.2, 0.5261), (0.3, 1.0, 0.0225)] {
            assert!((number_per_m2(k, d) - n).abs() < 6e-5, "{k} {d}: {}", number_per_m2(k, d));
        }
    }
}
