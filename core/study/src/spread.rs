//! Statistics of values as columns of a study's table.

use std::collections::BTreeMap;

use serde_json::Value;

use sightline_geometry::estimate::quantile::{median, quantile_of_sorted};

/// Adds count, median, 95th percentile and root mean square.
pub(super) fn spread(columns: &mut BTreeMap<String, Value>, name: &str, values: &[f64]) {
    let mut sorted = values.to_vec();
    // Summation in ascending order reduces rounding.
    sorted.sort_by(f64::total_cmp);
    let rms = (!sorted.is_empty())
        .then(|| (sorted.iter().map(|v| v * v).sum::<f64>() / sorted.len() as f64).sqrt());
    columns.insert(format!("{name}_n"), sorted.len().into());
    columns.insert(format!("{name}_median"), median(&sorted).into());
    columns.insert(format!("{name}_p95"), quantile_of_sorted(&sorted, 0.95).into());
    columns.insert(format!("{name}_rms"), rms.into());
}
