//! `sightline-experiments real-motion --method odometry`: the rows and files of visual odometry.

use std::path::Path;

use crate::real_motion::odometry::{OdometryMotions, OdometryRow, measure};
use crate::real_motion::{Row, Summary, summarise};
use serde::Serialize;
use sightline_geometry::error::{Error, Result};

use super::real_motion::{Format, row_words, set_words};
use sightline_server::cli::terminal;

/// The results as JSON.
#[derive(Serialize)]
struct Document {
    rows: Vec<OdometryRow>,
    sets: Vec<Summary>,
}

/// Measures the motions, prints them, and writes the inliers to `matches` and the frames to `frames` where they are given.
///
/// # Errors
/// A recording that is missing or damaged, or a file that cannot be written.
pub(super) fn run(data: &Path, format: Format, matches: Option<&Path>, frames: Option<&Path>) -> Result<()> {
    let OdometryMotions { rows, matches: inliers } = measure(data, frames)?;
    if let Some(path) = matches {
        let document = json(&inliers)?;
        std::fs::write(path, document).map_err(|source| Error::Write { path: path.to_owned(), source })?;
    }
    let motions: Vec<Row> = rows.iter().map(|row| row.row.clone()).collect();
    let sets = summarise(&motions);
    if format == Format::Json {
        return terminal::line(&json(&Document { rows, sets })?);
    }
    rows.iter().try_for_each(|row| terminal::line(&odometry_words(row)))?;
    terminal::line("")?;
    sets.iter().try_for_each(|set| terminal::line(&set_words(set)))
}

fn json(document: &impl Serialize) -> Result<String> {
    serde_json::to_string(document).map_err(|error| Error::Request(error.to_string()))
}

/// One motion in a line.
fn odometry_words(row: &OdometryRow) -> String {
    let outcome = row.refusal.as_deref().unwrap_or("accepted");
    let found = row.found_rotation_deg.zip(row.found_translation_m);
    let found = found.map_or_else(
        || "nothing found".to_owned(),
        |(rotation_deg, translation_m)| format!("found {rotation_deg:.3}° {translation_m:.4} m"),
    );
    let sigma = row.sigma.map_or_else(String::new, |[translation_m, rotation_deg]| {
        format!("; 1σ {rotation_deg:.3}° {:.2} cm", 100.0 * translation_m)
    });
    format!("{}; {found}{sigma}; {outcome}", row_words(&row.row))
}
