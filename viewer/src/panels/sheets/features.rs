//! The evidence of the feature tracker at one step as tables: residuals, RANSAC iterations, and the shown features.

use sightline_track::locate::features::rows::{Feature, Matched};

use crate::cache::Slot;
use crate::panels::features::charts::Histogram;
use crate::panels::sheets::{Cell, Column, Sheet};
use crate::state::State;
use crate::tables::MatchOutcome;

/// The histogram of the residuals, the number of inliers of each RANSAC iteration, and the features that are shown.
pub(crate) fn features(state: &State) -> Result<Vec<Sheet>, String> {
    let evidence = state.feature_evidence().filter(|evidence| evidence.detect.is_some());
    let evidence = evidence.ok_or_else(|| state.missing_features())?;
    let all = match state.features() {
        Slot::Ready(all) => all.as_slice(),
        Slot::Failed(problem) => return Err(format!("The features cannot be shown: {}", problem.detail)),
        Slot::Absent | Slot::Loading => return Err("The features are being loaded.".to_owned()),
    };
    let mut sheets = Vec::new();
    if let Some(motion) = &evidence.fit_motion {
        sheets.push(residuals(state, all));
        sheets.push(draws(&motion.consensus_by_draw));
    }
    sheets.push(each(state, all));
    Ok(sheets)
}

fn residuals(state: &State, all: &[Feature]) -> Sheet {
    let columns = [("from", "cm"), ("to", "cm"), ("inliers", ""), ("outliers", "")];
    let columns = columns.map(|(name, unit)| Column::new(name, unit)).to_vec();
    let mut sheet = Sheet::of(format!("Residuals of matches, step {}", state.cursor.step), columns);
    let histogram = Histogram::of(state, all);
    let last = histogram.inliers.len() - 1;
    for (bar, (inliers, outliers)) in histogram.inliers.iter().zip(&histogram.outliers).enumerate() {
        let edge = |edge: usize| Cell::Number(edge as f64 * histogram.step_m * 100.0);
        // The last bin also counts all larger residuals.
        let to = if bar == last { Cell::Nothing } else { edge(bar + 1) };
        let counts = [inliers, outliers].map(|count| Cell::Number(*count as f64));
        sheet.row(false, [edge(bar), to].into_iter().chain(counts).collect());
    }
    sheet
}

fn draws(agreeing: &[u32]) -> Sheet {
    let columns = vec![Column::new("iteration", ""), Column::new("inliers", "")];
    let mut sheet = Sheet::of("Inliers by RANSAC iteration", columns);
    let best = agreeing.iter().max();
    for (draw, count) in agreeing.iter().enumerate() {
        sheet.row(Some(count) == best, vec![Cell::Number(draw as f64), Cell::Number(f64::from(*count))]);
    }
    sheet
}

fn each(state: &State, all: &[Feature]) -> Sheet {
    let columns = [
        ("x", "px"),
        ("y", "px"),
        ("scale", "px"),
        ("range", "m"),
        ("outcome", ""),
        ("x before", "px"),
        ("y before", "px"),
        ("residual", "cm"),
    ];
    let columns = columns.map(|(name, unit)| Column::new(name, unit)).to_vec();
    let mut sheet = Sheet::of(format!("Features that are shown, step {}", state.cursor.step), columns);
    for feature in all.iter().filter(|feature| state.feature_view.shows(feature)) {
        let kind = match MatchOutcome::of(feature) {
            MatchOutcome::Unmatched => "no match",
            MatchOutcome::Inlier => "inlier",
            MatchOutcome::Outlier => "outlier",
        };
        let matched = |of: fn(&Matched) -> Option<f64>| Cell::from(feature.matched.as_ref().and_then(of));
        let (x, y) = (Cell::Number(feature.pixel.x), Cell::Number(feature.pixel.y));
        let found =
            [x, y, Cell::Number(feature.sigma_px), feature.range_m.into(), Cell::Word(kind.to_owned())];
        let before = [
            matched(|m| Some(m.then.x)),
            matched(|m| Some(m.then.y)),
            matched(|m| m.residual_m.map(|m| m * 100.0)),
        ];
        sheet.row(false, found.into_iter().chain(before).collect());
    }
    sheet
}
