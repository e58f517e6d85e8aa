//! `sightline-experiments registration`: rocks registered by their shape from beside the truth.
//!
//! How far off a registration may start (R204), how right it ends, how well its covariance says so, and what it makes of
//! another rock; both ways of refining it beside each other, with the time of each.

use std::path::PathBuf;
use std::time::Instant;

use crate::registration::views::Stereo;
use crate::registration::{Case, Row, Staging, Summary, rock_cases, summarise};
use clap::{Args, ValueEnum};
use rayon::prelude::*;
use serde::Serialize;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::estimate::quantile::median;
use sightline_geometry::frames::Pose;
use sightline_track::locate::shape_tracker::ShapeTrackerSettings;
use sightline_vision::registration::Method;

use sightline_server::cli::terminal::{self, Progress};
use sightline_server::study::chart::{Chart, Line, merged};

/// Both ways of refining a registration, as they are reported.
const METHODS: [(Method, &str); 2] =
    [(Method::SimplexL1, "simplex, L1 of depths"), (Method::PointToPlane, "point to plane")];

/// Register rocks of simulated plains.
#[derive(Debug, Args)]
pub(super) struct Registrations {
    /// How many rocks.
    #[arg(long, default_value_t = 50, value_parser = clap::value_parser!(u32).range(2..=2000))]
    rocks: u32,
    /// The seed of the first plain.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// How far beside the truth registrations start, in half widths of the rock.
    #[arg(long, value_delimiter = ',', default_values_t = [0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0])]
    offsets: Vec<f64>,
    /// A file for the figure, SVG: how many registrations end right, over how far off they start.
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// What is written to the standard output.
    #[arg(long, default_value = "text")]
    format: Format,
}

/// What is written to the standard output.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Format {
    /// A line for every method and offset.
    Text,
    /// One JSON object with all rows and their summaries.
    Json,
}

/// The results as JSON.
#[derive(Serialize)]
struct Document {
    rows: Vec<Timed>,
    summaries: Vec<Summary>,
    wrong_rocks: Vec<WrongRocks>,
}

/// A registration and how long it took, its meshes included.
#[derive(Clone, Serialize)]
struct Timed {
    #[serde(flatten)]
    row: Row,
    milliseconds: f64,
}

/// Registrations with another rock than the one of the first view.
#[derive(Serialize)]
struct WrongRocks {
    method: Method,
    count: usize,
    accepted: usize,
}

impl Registrations {
    /// Registers the rocks and says how it went.
    ///
    /// # Errors
    /// An offset that is no number from 0 to 10.
    pub(super) fn run(&self) -> Result<()> {
        if let Some(offset) = self.offsets.iter().find(|offset| !(0.0..=10.0).contains(*offset)) {
            return Err(Error::setting("offsets", format!("must be numbers from 0 to 10, not {offset}")));
        }
        let staging = Staging::default();
        let cases = rock_cases(self.rocks as usize, &staging, &Stereo::default(), self.first_seed);
        let mut progress = Progress::new("registrations: group");
        let groups = METHODS.len() * (self.offsets.len() + 1);
        let (mut rows, mut wrong_rocks) = (Vec::new(), Vec::new());
        for (number, (method, _)) in METHODS.into_iter().enumerate() {
            for (offset_number, &offset) in self.offsets.iter().enumerate() {
                let of = |case: &Case| {
                    let start = case.start(offset, &staging, case.rock as u64);
                    registered(case, case, &start, offset, method)
                };
                rows.par_extend(cases.par_iter().map(of));
                progress.tell(number * (self.offsets.len() + 1) + offset_number + 1, groups);
            }
            wrong_rocks.push(wrong(&cases, method));
            progress.tell((number + 1) * (self.offsets.len() + 1), groups);
        }
        self.say(rows, wrong_rocks)
    }

    fn say(&self, rows: Vec<Timed>, wrong_rocks: Vec<WrongRocks>) -> Result<()> {
        let plain: Vec<Row> = rows.iter().map(|timed| timed.row.clone()).collect();
        let summaries = summarise(&plain);
        if let Some(file) = &self.figure {
            let svg = figure(&summaries).svg().map_err(Error::Request)?;
            std::fs::write(file, svg).map_err(|source| Error::Write { path: file.clone(), source })?;
        }
        if self.format == Format::Json {
            let document = serde_json::to_string(&Document { rows, summaries, wrong_rocks });
            return terminal::line(&document.map_err(|error| Error::Request(error.to_string()))?);
        }
        for (method, name) in METHODS {
            let times = rows.iter().filter(|timed| timed.row.method == method);
            let times_ms: Vec<f64> = times.map(|timed| timed.milliseconds).collect();
            let median_ms = median(&times_ms).unwrap_or_default();
            terminal::line(&format!("{name}: {median_ms:.1} ms in the median"))?;
            let of_method = summaries.iter().filter(|summary| summary.method == method);
            of_method.map(words).try_for_each(|text| terminal::line(&text))?;
            if let Some(wrong) = wrong_rocks.iter().find(|wrong| wrong.method == method) {
                terminal::line(&format!("  another rock: {} of {} accepted", wrong.accepted, wrong.count))?;
            }
        }
        Ok(())
    }
}

/// The basin of convergence (R204).
fn figure(summaries: &[Summary]) -> Chart {
    let line = |(colour, (method, name)): (usize, (Method, &str))| Line {
        label: name.to_owned(),
        colour,
        points: summaries
            .iter()
            .filter(|summary| summary.method == method)
            .map(|summary| (summary.offset, 100.0 * summary.success))
            .collect(),
        ..Line::default()
    };
    Chart {
        title: "registrations that end within 2 cm".to_owned(),
        axes: ["start, half widths of the rock beside the truth".to_owned(), "share, %".to_owned()],
        y_range: Some([0.0, 105.0]),
        lines: merged(METHODS.into_iter().enumerate().map(line).collect()),
        ..Chart::default()
    }
}

/// A registration of the first view of one case with the present view of another, or of its own.
fn registered(first: &Case, present: &Case, start: &Pose, offset: f64, method: Method) -> Timed {
    let begun = Instant::now();
    let seen = Case { views: [first.views[0].clone(), present.views[1].clone()], ..first.clone() };
    let found = seen.register_as_tracked(start, &ShapeTrackerSettings::default(), method);
    Timed { row: seen.row(&found, offset, method), milliseconds: begun.elapsed().as_secs_f64() * 1e3 }
}

/// Every rock's first view with the present view of the next rock, which stands where the first is expected.
fn wrong(cases: &[Case], method: Method) -> WrongRocks {
    let pairs: Vec<(&Case, &Case)> = cases.iter().zip(cases.iter().cycle().skip(1)).collect();
    let is_accepted = |(first, other): &&(&Case, &Case)| {
        let turn = other.fixed_from_moving.rotation;
        let seen_at = other.fixed_from_moving.inverse() * other.target_in_fixed;
        let start = Pose::from_parts((first.target_in_fixed - turn * seen_at).into(), turn);
        registered(first, other, &start, 0.0, method).row.failure.is_none()
    };
    WrongRocks { method, count: pairs.len(), accepted: pairs.par_iter().filter(is_accepted).count() }
}

/// The registrations of one method from one offset in a line.
fn words(summary: &Summary) -> String {
    let both = |values: Option<[f64; 2]>, unit: &str| {
        values.map_or_else(
            || "-".to_owned(),
            |[median, high]| format!("{:.1} {unit} median, {:.1} at 95 %", 1e3 * median, 1e3 * high),
        )
    };
    let nees = summary.calibration.as_ref().map_or_else(String::new, |calibration| {
        let [low, high] = calibration.band;
        format!("; NEES {:.2} (band {low:.2} to {high:.2})", calibration.mean_nees)
    });
    format!(
        "  {:4.2} half widths off: {:3.0} % right, {:3.0} % accepted, {} false; {}; {}{nees}",
        summary.offset,
        100.0 * summary.success,
        100.0 * summary.accepted,
        summary.false_results,
        both(summary.error_m, "mm"),
        both(summary.error_rad, "mrad"),
    )
}
