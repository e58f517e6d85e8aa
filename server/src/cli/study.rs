//! `sightline study`: the validation experiments, from a grid of worlds to a table and a figure.

use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use sightline_core::error::{Error, Result};
use sightline_core::settings::{Changes, Settings, parse_assignment};
use sightline_core::sim::{self, Scenario};
use sightline_core::study::approach::{self, ApproachRun, ApproachSummary};
use sightline_core::traverse::create_simulated;

use super::figure;
use super::{open, say};

/// Seeds that are tried for each world asked for.
const SEEDS_PER_WORLD: u64 = 10;

/// Run a validation experiment.
#[derive(Debug, Args)]
pub struct Study {
    #[command(subcommand)]
    experiment: Experiment,
}

#[derive(Debug, Subcommand)]
enum Experiment {
    /// Straight approaches from 10 m to 2 m: many targets in many worlds against the truth.
    Approach(Approach),
}

/// Straight approaches: each world is rendered once, each of its targets is one run.
#[derive(Debug, Args)]
struct Approach {
    /// How many worlds; one that offers fewer targets than the scenario asks for is passed over and named.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    worlds: u64,
    /// The seed of the first world; the others follow.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// The scenario of which the worlds are made, a file or a name of the library; by default that of the
    /// demonstration.
    #[arg(long, value_name = "SCENARIO")]
    scenario: Option<PathBuf>,
    /// A setting of the tracker; can be given more than once.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The folder for worlds, table, summary and figure; worlds that are there already are used again.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

impl Study {
    /// Runs the experiment.
    ///
    /// # Errors
    /// A bad scenario or setting, or a folder that cannot be written.
    pub fn run(self) -> Result<()> {
        match self.experiment {
            Experiment::Approach(approach) => approach.run(),
        }
    }
}

impl Approach {
    fn run(self) -> Result<()> {
        let scenario = self.scenario.as_deref().map_or_else(|| Ok(Scenario::demo()), open::scenario)?;
        let changes = self.set.iter().map(|text| parse_assignment(text)).collect::<Result<Changes>>()?;
        let settings = Settings::default().with(&changes)?;
        let mut runs = Vec::new();
        let mut worlds = 0;
        let seeds = self.first_seed..self.first_seed.saturating_add(self.worlds * SEEDS_PER_WORLD);
        for seed in seeds.clone() {
            if worlds == self.worlds {
                break;
            }
            if let Some(of_world) = self.track_world(&Scenario { seed, ..scenario.clone() }, &settings)? {
                runs.extend(of_world);
                worlds += 1;
            }
        }
        if worlds < self.worlds {
            return Err(Error::Request(format!(
                "only {worlds} of {} worlds with seeds from {} to {} offer {} targets: lower targets.count or widen targets.radius_m in the scenario",
                self.worlds,
                seeds.start,
                seeds.end - 1,
                scenario.targets.count
            )));
        }
        let summary = approach::summarise_runs(&runs);
        write(&self.out.join("runs.csv"), table(&runs).as_bytes())?;
        let document = serde_json::to_vec_pretty(&summary).map_err(|e| Error::Request(e.to_string()))?;
        write(&self.out.join("summary.json"), &document)?;
        figure::approach(&self.out.join("nees.svg"), &runs, &summary)?;
        say::line(&sentence(&summary))
    }

    /// Renders a world and tracks all its targets; nothing if it offers fewer than the scenario asks for, which
    /// depends on its surface and its light alone.
    fn track_world(&self, scenario: &Scenario, settings: &Settings) -> Result<Option<Vec<ApproachRun>>> {
        let traverse = create_simulated(scenario, &self.out.join(format!("world-{}", scenario.seed)))?;
        let world =
            traverse.world().ok_or_else(|| Error::Request("a simulated world has no surface".to_owned()))?;
        let targets = sim::choose_targets(world, scenario, traverse.index());
        if targets.len() < scenario.targets.count as usize {
            say::line(&format!("world {}: {} targets, passed over", scenario.seed, targets.len()))?;
            return Ok(None);
        }
        open::render(&traverse)?;
        let runs = approach::track_world(&traverse, scenario.seed, &targets, settings);
        say::line(&format!("world {}: {}", scenario.seed, sentence(&approach::summarise_runs(&runs))))?;
        Ok(Some(runs))
    }
}

/// The summary in one line.
fn sentence(summary: &ApproachSummary) -> String {
    let centimetres = |m: Option<f64>| m.map_or_else(|| "–".to_owned(), |m| format!("{:.2} cm", 100.0 * m));
    let calibration = summary.calibration.as_ref().map_or_else(String::new, |c| {
        format!(
            "; mean NEES {:.2} (bands {:.2} to {:.2} for {} runs, {:.2} to {:.2} for {} worlds), {:.0} % inside 3 sigma",
            c.mean_nees,
            c.band[0],
            c.band[1],
            c.count,
            c.band_of_worlds[0],
            c.band_of_worlds[1],
            summary.worlds,
            100.0 * c.inside_3_sigma
        )
    });
    format!(
        "{} targets, {:.0} % tracked, median error {} (all runs {}), median sigma {}, false tracking {}, false loss {}{}",
        summary.targets,
        100.0 * summary.tracked_share,
        centimetres(summary.median_err_m),
        centimetres(summary.median_err_of_all_m),
        centimetres(summary.median_sigma_m),
        summary.false_tracked,
        summary.false_lost,
        calibration
    )
}

/// The runs as comma separated values, one a line.
fn table(runs: &[ApproachRun]) -> String {
    let number = |v: Option<f64>| v.map_or_else(String::new, |v| v.to_string());
    let mut text =
        "world,target,x_px,y_px,distance_m,run_tracked,steps_lost,err_px,err_m,err_range_m,sigma_m,nees\n"
            .to_owned();
    for run in runs {
        let tracked = run.summary.run_tracked.map_or_else(String::new, |t| t.to_string());
        let columns = [
            run.world.to_string(),
            run.target.to_string(),
            run.pixel.x.to_string(),
            run.pixel.y.to_string(),
            number(run.distance_m),
            tracked,
            run.summary.steps_lost.to_string(),
            number(run.summary.final_err_px),
            number(run.summary.final_err_m),
            number(run.err_range_m),
            number(run.sigma_m),
            number(run.nees),
        ];
        text.push_str(&columns.join(","));
        text.push('\n');
    }
    text
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    std::fs::write(path, bytes).map_err(|source| Error::Write { path: path.to_owned(), source })
}
