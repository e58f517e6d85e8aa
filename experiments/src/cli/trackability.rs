//! `sightline-experiments trackability`: what the trackability map is worth, over worlds that are there already.

use std::path::PathBuf;
use std::time::Instant;

use crate::trackability::{self, Counts, Outcome, Table};
use clap::{Args, ValueEnum};
use serde::Serialize;
use sightline_geometry::error::{Error, Result};
use sightline_rover::trackability::{TrackabilityMap, Verdict};
use sightline_track::settings::{Changes, Settings, parse_assignment};

use sightline_server::cli::open;
use sightline_server::cli::terminal::{self, Progress};

/// The worlds whose targets are drawn by the map.
#[derive(Debug, Args)]
pub(super) struct Worlds {
    /// Folders of simulated traverses, or scenarios; what is not rendered yet is rendered.
    #[arg(required = true)]
    traverses: Vec<PathBuf>,
    /// How many targets are drawn of each verdict in each world.
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    targets: u32,
    /// The seed of the draws.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// A setting of the tracker; can be given more than once.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// What is written to the standard output.
    #[arg(long, default_value = "text")]
    format: Format,
}

/// What is written to the standard output.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Format {
    /// Tables.
    Text,
    /// One JSON object with every target.
    Json,
}

/// What was found in one world.
#[derive(Serialize)]
struct World {
    name: String,
    /// Shares of good, risky and bad cells.
    shares: [f64; 3],
    map_s: f64,
    outcomes: Vec<Outcome>,
}

impl Worlds {
    /// Draws, tracks and says how it went.
    ///
    /// # Errors
    /// A traverse that cannot be opened, is not simulated, or cannot be aligned; a bad setting.
    pub(super) fn run(&self) -> Result<()> {
        let changes = self.set.iter().map(|text| parse_assignment(text)).collect::<Result<Changes>>()?;
        let settings = Settings::default().with(&changes)?;
        let mut progress = Progress::new("trackability: world");
        let mut worlds = Vec::new();
        for (number, path) in self.traverses.iter().enumerate() {
            progress.tell(number, self.traverses.len());
            let traverse = open::open(path, None)?;
            if traverse.world().is_none() {
                let name = path.display();
                return Err(Error::Request(format!(
                    "{name} is recorded: only a simulated drive has a truth"
                )));
            }
            open::render(&traverse)?;
            let begun = Instant::now();
            let ground = trackability::ground(&traverse, &settings)?;
            let map = TrackabilityMap::of(&ground);
            let map_s = begun.elapsed().as_secs_f64();
            let seed = self.seed.wrapping_add(number as u64);
            let outcomes = trackability::measure(&traverse, (&ground, &map), self.targets as usize, seed);
            worlds.push(World { name: path.display().to_string(), shares: map.shares(), map_s, outcomes });
        }
        progress.tell(self.traverses.len(), self.traverses.len());
        match self.format {
            Format::Json => {
                let text = serde_json::to_string(&worlds).map_err(|e| Error::Request(e.to_string()))?;
                terminal::line(&text)
            }
            Format::Text => words(&worlds).iter().try_for_each(|line| terminal::line(line)),
        }
    }
}

/// The tables as lines of Markdown.
fn words(worlds: &[World]) -> Vec<String> {
    let all = || worlds.iter().flat_map(|world| &world.outcomes);
    let table = Table::of(all());
    let cells = |counts: &Counts| {
        format!(
            "{} | {} | {} | {:.0} % | {}",
            counts.targets,
            counts.refused,
            counts.kept,
            100.0 * counts.kept_share(),
            counts.false_tracked
        )
    };
    let head = "targets | refused | tracked to the end | share | false tracking |\n|---|---|---|---|---|---|";
    let mut lines = vec![format!("| verdict | {head}")];
    for verdict in Verdict::ALL {
        lines.push(format!("| {} | {} |", verdict.word(), cells(&table.verdict(verdict))));
    }
    lines.push(format!("\n| reason | {head}"));
    for (reason, counts) in &table.reasons {
        lines.push(format!("| {} | {} |", reason.word(), cells(counts)));
    }
    lines.push("\n| world | good | risky | bad | map, s | good kept | risky kept | bad kept |\n|---|---|---|---|---|---|---|---|".to_owned());
    for world in worlds {
        let own = Table::of(&world.outcomes);
        let kept = Verdict::ALL.map(|verdict| format!("{:.0} %", 100.0 * own.verdict(verdict).kept_share()));
        let shares = world.shares.map(|share| format!("{:.0} %", 100.0 * share));
        lines.push(format!(
            "| {} | {} | {:.2} | {} |",
            world.name,
            shares.join(" | "),
            world.map_s,
            kept.join(" | ")
        ));
    }
    lines
}
