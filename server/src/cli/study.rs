//! `sightline study`: validation experiments, from a grid of worlds to a table and a report.

use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::AtomicBool;

use clap::{Args, Subcommand, ValueEnum};
use serde::Serialize;
use sightline_geometry::error::{Error, Result};
use sightline_study::hand_over_table;
use sightline_study::plan::Plan;
use sightline_study::row::Row;
use sightline_study::terrain_table;

use super::open;
use super::study_commanded::{CheckoutsStudy, K9DayStudy};
use super::study_drive_grid::DriveGridStudy;
use super::study_odometry::OdometryStudy;
use super::terminal::{self, Progress};
use crate::jobs::lock;
use crate::naming::slug;
use crate::study::{self, Order, Seeds, tables};

/// Run a validation experiment.
#[derive(Debug, Args)]
pub(super) struct Study {
    #[command(subcommand)]
    experiment: Experiment,
}

#[derive(Debug, Subcommand)]
enum Experiment {
    /// Straight approaches in steps of 5 to 23 %, by skipping images (the paper's Figure 8).
    Straight(Experimental),
    /// Crab motion around a target in steps of 5 to 60°, two search windows (the paper's Figure 10).
    Sideways(Experimental),
    /// Turning in place in steps of 5 to 45°.
    TurnInPlace(Experimental),
    /// Approaches over 10 m in steps of 10 %: the paper's overall claim.
    Claim(Experimental),
    /// Approaches from 10 m to 2 m: the final error and whether it agrees with the covariance.
    Approach(Experimental),
    /// Slopes and slip with the pose from wheels and IMU, with a slip check, and with visual odometry (the paper's Table
    /// II).
    Terrain(Experimental),
    /// Around a rock, step by step (the paper's Table III).
    #[command(name = "checkout-1")]
    Checkout1(Experimental),
    /// From 9.65 m to 1.92 m, step by step.
    #[command(name = "checkout-2")]
    Checkout2(Experimental),
    /// Turn, back up and return, step by step.
    #[command(name = "checkout-3")]
    Checkout3(Experimental),
    /// Occlusion, cloud, shadow, boundary, jumps: still tracked, or declared lost within the step?
    Faults(Experimental),
    /// The K9 rover's three targets at 5, 7.5 and 10 m: the error added by feature tracking.
    #[command(name = "k9")]
    K9(Experimental),
    /// Approaches from 10 m to 2 m with features: whether the covariance agrees with the error.
    FeatureCovariance(Experimental),
    /// Occlusion, cloud, shadow, few features, wrong poses: does the confidence fall before the drift grows?
    FeatureFaults(Experimental),
    /// Without features on the way: how large an error can the shape tracker recover from?
    Recovery(Experimental),
    /// Visual odometry: convergence rate, silent errors and drift.
    Odometry(OdometryStudy),
    /// Commanded drives over slope, rock coverage, use of visual odometry and navigator: which arrive, and why others do
    /// not.
    DriveGrid(DriveGridStudy),
    /// The four checkouts on Mars as commanded drives, compared with the paper's tables III and IV.
    Checkouts(CheckoutsStudy),
    /// The K9 rover's three targets in one commanded drive, each handed over to the hazcams.
    #[command(name = "k9-day")]
    K9Day(K9DayStudy),
}

/// Arguments of a study over worlds, configurations and a grid.
#[derive(Debug, Args)]
struct Experimental {
    /// The seeds of the worlds; each world contributes all its targets.
    #[arg(long, value_delimiter = ',', value_name = "SEEDS", conflicts_with_all = ["worlds", "first_seed"])]
    seeds: Vec<u64>,
    /// Number of worlds; a world with fewer targets than the scenario requires is skipped and reported.
    #[arg(long, default_value_t = 10, value_parser = clap::value_parser!(u64).range(1..=1000))]
    worlds: u64,
    /// The seed of the first world; the others follow.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// The configurations: names from `sightline presets`, each with changes such as ncc+ncc_min=0.6; by default those of
    /// the study.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    configurations: Vec<String>,
    /// Values of the study's variable; by default those of the study.
    #[arg(long, value_delimiter = ',', value_name = "VALUES")]
    grid: Vec<String>,
    /// The scenario for the worlds, a file or a name from `sightline scenarios`, instead of the study's own.
    #[arg(long, value_name = "SCENARIO")]
    scenario: Option<PathBuf>,
    /// The folder for worlds and results, by default one of the program's own; existing results are reused.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Output format.
    #[arg(long, default_value = "text")]
    format: Format,
}

/// Output format.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Format {
    /// One sentence per row.
    Text,
    /// One JSON object with all rows.
    Json,
    /// A CSV table of all rows.
    Csv,
}

/// The rows as JSON.
#[derive(Serialize)]
struct Document<'a> {
    rows: &'a [Row],
}

impl Study {
    /// Runs the experiment.
    ///
    /// # Errors
    /// A bad scenario, configuration or grid, too few worlds with enough targets, or a folder that cannot be written.
    pub(super) fn run(self) -> Result<()> {
        match self.experiment {
            Experiment::Straight(arguments) => arguments.run("straight"),
            Experiment::Sideways(arguments) => arguments.run("sideways"),
            Experiment::TurnInPlace(arguments) => arguments.run("turn-in-place"),
            Experiment::Claim(arguments) => arguments.run("claim"),
            Experiment::Approach(arguments) => arguments.run("approach"),
            Experiment::Terrain(arguments) => arguments.run("terrain"),
            Experiment::Checkout1(arguments) => arguments.run("checkout-1"),
            Experiment::Checkout2(arguments) => arguments.run("checkout-2"),
            Experiment::Checkout3(arguments) => arguments.run("checkout-3"),
            Experiment::Faults(arguments) => arguments.run("faults"),
            Experiment::K9(arguments) => arguments.run("k9"),
            Experiment::FeatureCovariance(arguments) => arguments.run("feature-covariance"),
            Experiment::FeatureFaults(arguments) => arguments.run("feature-faults"),
            Experiment::Recovery(arguments) => arguments.run("recovery"),
            Experiment::Odometry(arguments) => arguments.run(),
            Experiment::DriveGrid(arguments) => arguments.run(),
            Experiment::Checkouts(arguments) => arguments.run(),
            Experiment::K9Day(arguments) => arguments.run(),
        }
    }
}

impl Experimental {
    fn run(self, name: &str) -> Result<()> {
        // Checks all arguments before rendering.
        let order = self.order(name)?;
        let (folder, variable) = (order.folder.join(order.plan.study.name), order.plan.study.variable);
        let reporter = Mutex::new(ProgressReporter::new());
        let outcome =
            study::carry_out(order, &AtomicBool::new(false), &|progress| lock(&reporter).report(progress))?;
        terminal::error(&format!(
            "{} units, {} of them found now; the report is {}",
            outcome.units.len(),
            outcome.found,
            folder.join(study::report::NAME).display()
        ));
        match self.format {
            Format::Json => {
                let document = serde_json::to_string(&Document { rows: &outcome.rows });
                terminal::line(&document.map_err(|error| Error::Request(error.to_string()))?)
            }
            Format::Csv => terminal::line(tables::rows_csv(&outcome.rows).trim_end()),
            Format::Text => {
                let mut table = hand_over_table::lines(&outcome.rows, variable);
                table.extend(terrain_table::lines(&outcome.rows));
                let sentences = outcome.rows.iter().map(sentence);
                sentences.chain(table).try_for_each(|line| terminal::line(&line))
            }
        }
    }

    fn order(&self, name: &str) -> Result<Order> {
        let plan = Plan::new(name, &self.configurations, &self.grid)?;
        let scenario = match &self.scenario {
            Some(path) => {
                let stem = path.file_stem().unwrap_or_default().to_string_lossy();
                Some((slug(&stem), open::scenario(path)?))
            }
            None => None,
        };
        let seeds = if self.seeds.is_empty() {
            Seeds::Count { worlds: self.worlds, first: self.first_seed }
        } else {
            Seeds::Named(self.seeds.clone())
        };
        let folder = match &self.out {
            Some(folder) => folder.clone(),
            None => open::data_folder(None)?.join("studies"),
        };
        Ok(Order { command: self.command(name, &plan), plan, seeds, scenario, folder })
    }

    /// The command line that reproduces the study.
    fn command(&self, name: &str, plan: &Plan) -> String {
        let mut words = vec![format!("sightline study {name}")];
        if self.seeds.is_empty() {
            words.push(format!("--worlds {} --first-seed {}", self.worlds, self.first_seed));
        } else {
            words.push(format!("--seeds {}", join(&self.seeds)));
        }
        let names: Vec<&str> = plan.configurations.iter().map(|c| c.name.as_str()).collect();
        words.push(format!("--configurations {}", names.join(",")));
        if !self.grid.is_empty() {
            words.push(format!("--grid {}", self.grid.join(",")));
        }
        if let Some(path) = &self.scenario {
            words.push(format!("--scenario {}", path.display()));
        }
        words.join(" ")
    }
}

fn join(seeds: &[u64]) -> String {
    seeds.iter().map(u64::to_string).collect::<Vec<_>>().join(",")
}

/// A row as one line of text.
fn sentence(row: &Row) -> String {
    let number = |column: &str| row.number(column);
    let whole = |column: &str| number(column).map_or_else(|| "?".to_owned(), |v| format!("{v:.0}"));
    let own = [
        "n_skip",
        "azimuth_step_deg",
        "search_window_px",
        "turn_step_deg",
        "terrain",
        "odometry",
        "fault",
        "position",
    ];
    let variables: Vec<String> =
        own.iter().filter_map(|name| Some(format!("{name} {}", row.columns.get(*name)?))).collect();
    let error = number("err_m_median")
        .or_else(|| number("err_m"))
        .map_or_else(String::new, |m| format!(", error {:.2} cm", 100.0 * m));
    let fault = number("cases").map_or_else(String::new, |cases| {
        let [tracked, lost, wrong] = ["fault_tracked", "fault_lost", "fault_false"].map(whole);
        format!(", {cases:.0} cases: {tracked} tracked, {lost} lost, {wrong} false at the fault")
    });
    format!(
        "{} seed {} {}: {} of {} targets tracked, {} false tracking, {} false loss{error}{fault}",
        row.configuration,
        row.seed,
        variables.join(" "),
        whole("tracked"),
        whole("targets"),
        whole("false_tracked"),
        whole("false_lost"),
    )
}

/// Reports the progress of a study on the standard error.
struct ProgressReporter {
    units: Progress,
    rendering: Option<(String, Progress)>,
}

impl ProgressReporter {
    fn new() -> Self {
        Self { units: Progress::new("study: unit"), rendering: None }
    }

    fn report(&mut self, progress: study::Progress) {
        match progress {
            study::Progress::Units { k, n, .. } => self.units.tell(k, n),
            study::Progress::Rows(_) => {}
            study::Progress::Notice(text) => terminal::error(&text),
            study::Progress::Rendering { world, k, n, .. } => {
                if self.rendering.as_ref().is_none_or(|(known, _)| *known != world) {
                    self.rendering = Some((world.clone(), Progress::new(format!("{world}: rendered stop"))));
                }
                if let Some((_, progress)) = &mut self.rendering {
                    progress.tell(k, n);
                }
            }
        }
    }
}
