//! Smoothness of a row of targets at the last stop (R115).
//!
//! Targets of one row are designated on a straight line of the first image at equal spacing. After the approach their
//! pixels, as functions of their position t in the row, are a smooth curve unless targets drifted. The RMS residual of a
//! cubic fit to x(t) and y(t) measures the unevenness, px. The rock's relief also bends the row: the residual of the
//! true pixels is the baseline.

use nalgebra::{DMatrix, DVector};

use super::run::Run;
use sightline_geometry::frames::Pixel;

/// Coefficients of a cubic.
const COEFFICIENTS: usize = 4;

/// RMS residual of a cubic fit to pixels at positions `t`, px; `None` without redundancy.
pub(crate) fn residual_px(row: &[(f64, Pixel)]) -> Option<f64> {
    if row.len() <= COEFFICIENTS + 1 {
        return None;
    }
    let (low, high) =
        row.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &(t, _)| (l.min(t), h.max(t)));
    // Positions scaled to −1 … 1 keep the powers well conditioned.
    let place = |t: f64| (2.0 * t - low - high) / (high - low);
    let powers = DMatrix::from_fn(row.len(), COEFFICIENTS, |i, k| place(row[i].0).powi(k as i32));
    let solver = powers.clone().svd(true, true);
    let sum_px2 = [|pixel: Pixel| pixel.x, |pixel: Pixel| pixel.y].iter().try_fold(0.0, |sum, axis| {
        let values = DVector::from_iterator(row.len(), row.iter().map(|&(_, pixel)| axis(pixel)));
        let fit = solver.solve(&values, 1e-12).ok()?;
        Some(sum + (&powers * fit - values).norm_squared())
    })?;
    Some((sum_px2 / (row.len() - COEFFICIENTS) as f64).sqrt())
}

/// Mean unevenness over the rows of some runs, px: of the located and of the true pixels of tracked targets.
pub(crate) fn of_rows(runs: &[&Run]) -> Option<[f64; 2]> {
    let mut groups: Vec<&str> =
        runs.iter().map(|run| run.group.as_str()).filter(|group| group.starts_with("row")).collect();
    groups.sort_unstable();
    groups.dedup();
    let of_group = |group: &str| -> Option<[f64; 2]> {
        let members = runs.iter().filter(|run| run.group == group && run.summary.run_tracked == Some(true));
        let ends: Vec<(f64, Pixel, Pixel)> =
            members.filter_map(|run| Some((run.pixel.x, run.end_pixel?, run.true_end_pixel?))).collect();
        let located: Vec<_> = ends.iter().map(|&(t, pixel, _)| (t, pixel)).collect();
        let truth: Vec<_> = ends.iter().map(|&(t, _, pixel)| (t, pixel)).collect();
        Some([residual_px(&located)?, residual_px(&truth)?])
    };
    let found: Vec<[f64; 2]> = groups.into_iter().filter_map(of_group).collect();
    (!found.is_empty())
        .then(|| [0, 1].map(|k| found.iter().map(|pair| pair[k]).sum::<f64>() / found.len() as f64))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_row_has_no_residual_and_one_pixel_of_alternating_drift_has_one() {
        let smooth = |k: u32| {
            let t = f64::from(k);
            Pixel::new(100.0 + 17.0 * t + 0.1 * t * t, 300.0 - 0.02 * t.powi(3))
        };
        let row: Vec<_> = (0..30).map(|k| (f64::from(k), smooth(k))).collect();
        assert!(residual_px(&row).unwrap() < 1e-9);
        let zigzag: Vec<_> = row
            .iter()
            .enumerate()
            .map(|(k, &(t, pixel))| (t, pixel.offset(0.0, if k % 2 == 0 { 1.0 } else { -1.0 })))
            .collect();
        let residual = residual_px(&zigzag).unwrap();
        assert!((residual - (30.0_f64 / 26.0).sqrt()).abs() < 0.01, "{residual}");
        assert_eq!(residual_px(&row[..5]), None);
    }
}
