//! `sightline-experiments real-motion`: the motion that features or visual odometry find between recorded frames, against
//! their poses.

use std::path::PathBuf;

use super::real_odometry;
use crate::real_motion::{MotionError, Row, Summary, measure, summarise};
use clap::{Args, ValueEnum};
use serde::Serialize;
use sightline_geometry::error::{Error, Result};
use sightline_track::presets::preset;
use sightline_track::settings::{Changes, Settings, parse_assignment};

use sightline_server::cli::terminal;

/// The configuration of the features without `--preset`.
const FEATURES: &str = "features";

/// Measure motions between recorded frames.
#[derive(Debug, Args)]
pub(super) struct RealMotion {
    /// The folder with the recordings kitti-seq1-frames-0-19, euroc-v101 and opencv-chessboard-stereo.
    #[arg(long, value_name = "FOLDER")]
    data: PathBuf,
    /// How motions are found; odometry leaves the chessboard out, whose cameras stand still.
    #[arg(long, default_value = "features")]
    method: Method,
    /// A JSON file for the inliers of odometry, which `python/odometry_pnp.py` reads.
    #[arg(long, value_name = "FILE")]
    matches: Option<PathBuf>,
    /// A folder for the frames as odometry is given them: PNG files without distortion.
    #[arg(long, value_name = "FOLDER")]
    frames: Option<PathBuf>,
    /// The configuration of the features; `sightline presets` lists them.
    #[arg(long, default_value = FEATURES, value_name = "NAME")]
    preset: String,
    /// A change to it; can be given more than once.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// What is written to the standard output.
    #[arg(long, default_value = "text")]
    format: Format,
}

/// How motions are found.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Method {
    /// By features, without a prediction.
    Features,
    /// By visual odometry, with the predictions and settings that `real_motion::odometry` states.
    Odometry,
}

/// What is written to the standard output.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
pub(super) enum Format {
    /// A line for every pair of frames, then one for every set.
    Text,
    /// One JSON object with both.
    Json,
}

/// The results as JSON.
#[derive(Serialize)]
struct Document {
    rows: Vec<Row>,
    sets: Vec<Summary>,
}

impl RealMotion {
    /// Measures the motions and says them.
    ///
    /// # Errors
    /// A recording that is missing or damaged, an unknown configuration, a bad setting, options of the other method, or a file
    /// that cannot be written.
    pub(super) fn run(&self) -> Result<()> {
        if self.method == Method::Odometry {
            if !self.set.is_empty() || self.preset != FEATURES {
                return Err(Error::Request("--preset and --set need --method features".to_owned()));
            }
            let [matches, frames] = [&self.matches, &self.frames].map(Option::as_deref);
            return real_odometry::run(&self.data, self.format, matches, frames);
        }
        if self.matches.is_some() || self.frames.is_some() {
            return Err(Error::Request("--matches and --frames need --method odometry".to_owned()));
        }
        let rows = measure(&self.data, &self.settings()?.features)?;
        let sets = summarise(&rows);
        if self.format == Format::Json {
            let document = serde_json::to_string(&Document { rows, sets });
            return terminal::line(&document.map_err(|error| Error::Request(error.to_string()))?);
        }
        rows.iter().try_for_each(|row| terminal::line(&row_words(row)))?;
        terminal::line("")?;
        sets.iter().try_for_each(|set| terminal::line(&set_words(set)))
    }

    fn settings(&self) -> Result<Settings> {
        let changes = self.set.iter().map(|text| parse_assignment(text)).collect::<Result<Changes>>()?;
        preset(&self.preset)?.settings()?.with(&changes)
    }
}

/// One motion in a line.
pub(super) fn row_words(row: &Row) -> String {
    let error = row.error.map_or_else(|| "no motion found".to_owned(), error_words);
    format!(
        "{:26} {:>8}  {:4} of {:4} matches agree  {:7.2}° {:6.3} m  {error}",
        row.set.name(),
        row.pair,
        row.inliers,
        row.matches,
        row.rotation_deg,
        row.translation_m
    )
}

fn error_words(error: MotionError) -> String {
    let share = error.translation_percent.map(|percent| format!(", {percent:.2} %")).unwrap_or_default();
    format!("off by {:.3}° {:.2} cm{share}", error.rotation_deg, 100.0 * error.translation_m)
}

/// One set in a line: each error as median and worst.
pub(super) fn set_words(set: &Summary) -> String {
    let both = |values: Option<[f64; 2]>, scale: f64, unit: &str| {
        let words = |[median, worst]: [f64; 2]| format!("{:.2}{unit} ({:.2})", scale * median, scale * worst);
        values.map_or_else(|| "-".to_owned(), words)
    };
    let rotation = |[median, worst]: [f64; 2]| format!("{median:.3}° ({worst:.3})");
    format!(
        "{:26} {:2} of {:2} found; median (worst) {}, {}, {}; possible: {}",
        set.set.name(),
        set.found,
        set.pairs,
        set.rotation_deg.map_or_else(|| "-".to_owned(), rotation),
        both(set.translation_m, 100.0, " cm"),
        both(set.translation_percent, 1.0, " %"),
        set.set.possible()
    )
}
