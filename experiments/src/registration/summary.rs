//! Registrations summed up by method and offset: success, accuracy, calibration, false results.

use serde::{Deserialize, Serialize};

use sightline_geometry::estimate::quantile::{median, quantile};

use super::{Method, Row};
use sightline_study::calibration::Calibration;

/// Registrations of one method from one offset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// How they were refined.
    pub method: Method,
    /// Shift of the start over the rock's half width.
    pub offset: f64,
    /// How many.
    pub count: usize,
    /// Share accepted and right to 2 cm.
    pub success: f64,
    /// Share accepted.
    pub accepted: f64,
    /// How many were accepted and are wrong by more than 5 cm and 3σ.
    pub false_results: usize,
    /// Median and 95th percentile of the target's error of those accepted, m.
    pub error_m: Option<[f64; 2]>,
    /// Alike of the attitude, rad.
    pub error_rad: Option<[f64; 2]>,
    /// Median 1σ of the target in its weakest direction of those accepted, m.
    pub sigma_m: Option<f64>,
    /// Whether their covariances are right.
    pub calibration: Option<Calibration>,
}

/// Sums rows up, by method and offset in the order in which these first appear.
pub fn summarise(rows: &[Row]) -> Vec<Summary> {
    let mut groups: Vec<(Method, f64)> = Vec::new();
    for row in rows {
        if !groups.contains(&(row.method, row.offset)) {
            groups.push((row.method, row.offset));
        }
    }
    let of = |&(method, offset): &(Method, f64)| {
        summary(rows.iter().filter(|row| (row.method, row.offset) == (method, offset)).collect())
    };
    groups.iter().filter_map(of).collect()
}

fn summary(rows: Vec<&Row>) -> Option<Summary> {
    let first = rows.first()?;
    let accepted: Vec<&&Row> = rows.iter().filter(|row| row.failure.is_none()).collect();
    let share = |count: usize| count as f64 / rows.len() as f64;
    let nees: Vec<f64> = accepted.iter().filter_map(|row| row.nees).collect();
    let sigmas: Vec<f64> = accepted.iter().filter_map(|row| row.sigma_m).collect();
    Some(Summary {
        method: first.method,
        offset: first.offset,
        count: rows.len(),
        success: share(rows.iter().filter(|row| row.is_success()).count()),
        accepted: share(accepted.len()),
        false_results: rows.iter().filter(|row| row.is_false()).count(),
        error_m: median_and_high(accepted.iter().map(|row| row.error_m).collect()),
        error_rad: median_and_high(accepted.iter().map(|row| row.error_rad).collect()),
        sigma_m: median(&sigmas),
        calibration: Calibration::of(&nees, nees.len()),
    })
}

/// The median and the 95th percentile.
fn median_and_high(values: Vec<f64>) -> Option<[f64; 2]> {
    Some([median(&values)?, quantile(&values, 0.95)?])
}
