//! `sightline study drive-grid`: commanded drives over slope, rock coverage, use of visual odometry and navigator.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use clap::{Args, ValueEnum};
use serde::Serialize;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::{Error, Result};
use sightline_rover::visual_odometry::OdometryMode;
use sightline_study::drive_grid::{Cell, CellSummary, DriveGrid, DriveRow};

use super::drive_options::{NavigatorName, Odometry};
use super::terminal::{self, Progress};

/// The grid and the file of rows.
#[derive(Debug, Args)]
pub(super) struct DriveGridStudy {
    /// Mean slopes of the ground, deg.
    #[arg(long, value_name = "DEG", value_delimiter = ',', default_value = "0,5,10,15")]
    slopes: Vec<f64>,
    /// Rock coverages, fractions of the ground.
    #[arg(long, value_name = "PART", value_delimiter = ',', default_value = "0,0.05,0.1")]
    coverages: Vec<f64>,
    /// The uses of visual odometry.
    #[arg(long, value_name = "USE", value_delimiter = ',', default_value = "off,slip-check,full")]
    odometry: Vec<Odometry>,
    /// The navigators.
    #[arg(long, value_name = "NAME", value_delimiter = ',', default_value = "gestalt")]
    navigators: Vec<NavigatorName>,
    /// Number of worlds for each cell of the grid.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    worlds: u64,
    /// The seed of the first world; the others follow.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// Side of the images, px.
    #[arg(long, default_value_t = 512, value_parser = clap::value_parser!(u32).range(64..=2048))]
    size: u32,
    /// Samples along each side of a pixel.
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=8))]
    samples_per_axis: u32,
    /// A file with one JSON object per drive, to which each drive is appended when it ends; drives that it contains from the
    /// same code are not repeated.
    #[arg(long, value_name = "FILE")]
    rows: Option<PathBuf>,
    /// Output format.
    #[arg(long, default_value = "text")]
    format: Format,
}

/// Output format.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Format {
    /// One line for each cell of the grid.
    Text,
    /// One JSON object with all rows and cells.
    Json,
}

/// The study as JSON.
#[derive(Serialize)]
struct Document {
    rows: Vec<DriveRow>,
    cells: Vec<CellSummary>,
}

impl DriveGridStudy {
    /// Runs the drives and writes the outcome of each cell.
    ///
    /// # Errors
    /// A grid for which no world can be created, a file that does not contain rows, or no space for images.
    pub(super) fn run(&self) -> Result<()> {
        let grid = self.grid();
        for cell in &grid.cells {
            grid.scenario(cell, self.first_seed)?;
        }
        let known = match self.rows.as_deref() {
            Some(path) => {
                // A path that cannot be written is reported now, not after the first drive.
                open(path)?;
                read(path)?
            }
            None => Vec::new(),
        };
        let folder = std::env::temp_dir().join(format!("sightline-drive-grid-{}", std::process::id()));
        let shared = Mutex::new((0, Progress::new("drive")));
        let tell = |row: &DriveRow| {
            let mut shared = shared.lock().unwrap_or_else(PoisonError::into_inner);
            shared.0 += 1;
            let done = shared.0;
            shared.1.tell(done, left(&grid, &known, &row.code));
            self.rows.as_deref().map_or(Ok(()), |path| add(path, row))
        };
        let rows = grid.run(&known, &folder, Cancel::default(), &tell);
        let _ = std::fs::remove_dir_all(&folder);
        let rows = rows?;
        let cells = grid.summaries(&rows);
        match self.format {
            Format::Text => cells.iter().try_for_each(|cell| terminal::line(&sentence(cell))),
            Format::Json => {
                let text = serde_json::to_string(&Document { rows, cells });
                terminal::line(&text.map_err(|error| Error::Request(error.to_string()))?)
            }
        }
    }

    fn grid(&self) -> DriveGrid {
        let mut cells = Vec::new();
        for &slope_deg in &self.slopes {
            for &coverage in &self.coverages {
                for odometry in self.odometry.iter().map(|odometry| odometry.mode()) {
                    let cell = |name: &NavigatorName| {
                        let navigator = name.kind();
                        Cell { slope_deg, coverage, odometry, navigator }
                    };
                    cells.extend(self.navigators.iter().map(cell));
                }
            }
        }
        DriveGrid {
            cells,
            seeds: (self.first_seed..self.first_seed.saturating_add(self.worlds)).collect(),
            size: self.size,
            samples_per_axis: self.samples_per_axis,
        }
    }
}

/// Number of drives of the grid that are not among the rows of the same code.
fn left(grid: &DriveGrid, known: &[DriveRow], code: &str) -> usize {
    let is_known = |row: &&DriveRow| {
        row.code == code
            && grid.cells.contains(&row.cell)
            && grid.seeds.contains(&row.seed)
            && (row.size, row.samples_per_axis) == (grid.size, grid.samples_per_axis)
    };
    (grid.cells.len() * grid.seeds.len()).saturating_sub(known.iter().filter(is_known).count())
}

/// The rows of a file.
fn read(path: &Path) -> Result<Vec<DriveRow>> {
    let text =
        std::fs::read_to_string(path).map_err(|source| Error::Read { path: path.to_owned(), source })?;
    let row = |(number, line): (usize, &str)| {
        let problem = |error: serde_json::Error| {
            Error::format(
                path,
                format!("line {}: {error}; remove this line or name another file", number + 1),
            )
        };
        serde_json::from_str(line).map_err(problem)
    };
    text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()).map(row).collect()
}

/// Opens the file of rows for appending, and creates it if it does not exist.
fn open(path: &Path) -> Result<File> {
    let failed = |source| Error::Write { path: path.to_owned(), source };
    OpenOptions::new().create(true).append(true).open(path).map_err(failed)
}

fn add(path: &Path, row: &DriveRow) -> Result<()> {
    let mut text = serde_json::to_string(row).map_err(|error| Error::Request(error.to_string()))?;
    text.push('\n');
    open(path)?.write_all(text.as_bytes()).map_err(|source| Error::Write { path: path.to_owned(), source })
}

/// One line of the table.
fn sentence(summary: &CellSummary) -> String {
    let Cell { slope_deg, coverage, odometry, navigator } = summary.cell;
    let odometry = match odometry {
        OdometryMode::Off => "off",
        OdometryMode::SlipCheck => "slip-check",
        OdometryMode::Full => "full",
    };
    let [low, high] = summary.arrived_interval.map(|share| 100.0 * share);
    let cm = |errors: Option<[f64; 2]>| {
        let words =
            |[median, most]: [f64; 2]| format!("{:.2} cm (largest {:.2})", 100.0 * median, 100.0 * most);
        errors.map_or_else(|| "none".to_owned(), words)
    };
    let reasons: Vec<String> =
        summary.reasons.iter().map(|(reason, count)| format!("{reason} {count}")).collect();
    let others = if reasons.is_empty() { String::new() } else { format!("; {}", reasons.join(", ")) };
    format!(
        "slope {slope_deg}°, coverage {:.0} %, odometry {odometry}, {}: {} of {} arrived ({low:.0} to {high:.0} %), with a way {} of {}{others}; {} collisions; target error {}, goal error {}",
        100.0 * coverage,
        navigator.name(),
        summary.arrived,
        summary.drives,
        summary.with_way[1],
        summary.with_way[0],
        summary.collisions,
        cm(summary.target_error_m),
        cm(summary.goal_error_m)
    )
}
