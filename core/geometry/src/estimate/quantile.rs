//! Order statistics of samples: the definitions of median and quantile of the whole workspace.
//!
//! ```text
//! h = (n − 1) p,  k = ⌊h⌋
//! Q(p) = x_(k) + (h − k) (x_(k+1) − x_(k))      x_(0) ≤ … ≤ x_(n−1)
//! ```
//! Linear interpolation between order statistics, type 7 of Hyndman and Fan (1996), as in NumPy and R.

/// The quantile of `share`, from 0 (least) to 1 (greatest). `None` without values; NaN sorts last.
pub fn quantile(values: &[f64], share: f64) -> Option<f64> {
    quantile_of_sorted(&sorted(values), share)
}

/// The quantile of values in ascending order.
pub fn quantile_of_sorted(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let (below, part) = (sorted[place as usize], place.fract());
    // With a zero fraction the next value is not used: it may be infinite.
    if part == 0.0 {
        return Some(below);
    }
    Some(below + part * (sorted[place as usize + 1] - below))
}

/// The median: the middle value, or the mean of the two middle values. `None` without values; NaN sorts last.
///
/// The same as the quantile of 0.5, but rounded once.
pub fn median(values: &[f64]) -> Option<f64> {
    let sorted = sorted(values);
    let middle = sorted.len() / 2;
    match sorted.len() {
        0 => None,
        n if n % 2 == 1 => Some(sorted[middle]),
        _ => Some((sorted[middle - 1] + sorted[middle]) / 2.0),
    }
}

/// The upper median x_(⌊n/2⌋): a value of the sample itself, found by selection in O(n), for many pixels. `None` without
/// values; changes the order of `values`.
pub fn upper_median(values: &mut [f32]) -> Option<f32> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_numpy() {
        // numpy.quantile([7, 1, 4, 2], [0, 0.25, 0.5, 0.95, 1])
        let expected = [1.0, 1.75, 3.0, 6.55, 7.0];
        for (share, expected) in [0.0, 0.25, 0.5, 0.95, 1.0].into_iter().zip(expected) {
            let found = quantile(&[7.0, 1.0, 4.0, 2.0], share).unwrap();
            assert!((found - expected).abs() < 1e-12, "{share}: {found}");
        }
        assert_eq!(quantile(&[1.0, 2.0, 3.0, 4.0, 5.0], 0.95), Some(4.8));
        assert_eq!(quantile(&[1.0, f64::INFINITY], 0.0), Some(1.0));
    }

    #[test]
    fn one_value_is_every_quantile_and_none_has_none() {
        assert_eq!((quantile(&[2.0], 0.95), quantile(&[], 0.5)), (Some(2.0), None));
        assert_eq!((median(&[2.0]), median(&[])), (Some(2.0), None));
        assert_eq!((upper_median(&mut [2.0]), upper_median(&mut [])), (Some(2.0), None));
    }

    #[test]
    fn an_even_number_of_values_has_the_mean_of_its_middle_as_median() {
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(upper_median(&mut [4.0, 1.0, 3.0, 2.0]), Some(3.0));
    }
}
