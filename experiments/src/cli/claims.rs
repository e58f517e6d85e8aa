//! `sightline-experiments claims`: tracked targets and their NEES in worlds with pointing error.

use clap::Args;
use serde::Serialize;
use sightline_geometry::error::{Error, Result};
use sightline_server::cli::terminal::{self, Progress};
use sightline_study::randomised;

use super::worlds::Worlds;
use crate::claims::{Claims, claims, world_claim};

/// The worlds and the tracker.
#[derive(Debug, Args)]
pub(super) struct Claimed {
    /// How many worlds.
    #[arg(long, default_value_t = 10)]
    worlds: u64,
    #[command(flatten)]
    of: Worlds,
    /// 1σ error of each mast angle, deg; without it, that of the study.
    #[arg(long, value_name = "DEG")]
    pointing_error_deg: Option<f64>,
}

/// The last line.
#[derive(Serialize)]
struct Summary {
    summary: Claims,
}

impl Claimed {
    /// Tracks the targets of every world; writes one JSON object a world, then one of all.
    ///
    /// # Errors
    /// A bad setting, or no room for images.
    pub(super) fn run(&self) -> Result<()> {
        let settings = self.of.settings()?;
        let mut base = randomised::base("claim")?;
        self.of.size(&mut base);
        let folder = std::env::temp_dir().join(format!("sightline-claims-{}", std::process::id()));
        let mut progress = Progress::new("claims: world");
        let mut found = Vec::new();
        for number in 0..self.worlds {
            progress.tell(number as usize, self.worlds as usize);
            let mut scenario = randomised::world("claim", &base, self.of.seed + number);
            if let Some(error_deg) = self.pointing_error_deg {
                scenario.drive.pointing_error_deg = error_deg;
            }
            scenario.validate()?;
            let world = world_claim(&scenario, &settings, &folder.join(format!("{number}")));
            // The images are not needed any more.
            let _ = std::fs::remove_dir_all(&folder);
            let world = world?;
            line(&world)?;
            found.push(world);
        }
        line(&Summary { summary: claims(&found) })
    }
}

fn line(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string(value).map_err(|error| Error::Request(error.to_string()))?;
    terminal::line(&text)
}
