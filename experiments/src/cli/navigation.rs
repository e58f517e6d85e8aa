//! `sightline-experiments navigation`: the navigator in many worlds without images, beside a planner that knows the ground.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use clap::{Args, ValueEnum};
use serde_json::Value;
use sightline_geometry::error::{Error, Result};
use sightline_rover::driving::DriveCommand;
use sightline_rover::hazards::HazardSettings;
use sightline_rover::navigation::{NavigatorPreset, NavigatorSettings};
use sightline_server::cli::open;
use sightline_server::cli::terminal::{self, Progress};

use crate::navigation::{Drive, Drives};

/// The worlds and the navigator.
#[derive(Debug, Args)]
pub(super) struct Navigation {
    /// The scenario: a file, or a name that `sightline scenarios` lists.
    #[arg(default_value = "obstacles-10")]
    scenario: PathBuf,
    /// How many worlds.
    #[arg(long, default_value_t = 30)]
    worlds: u64,
    /// The seed of the first world.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Horizontal distance of the goal from the target, m.
    #[arg(long, default_value_t = 2.0)]
    standoff: f64,
    /// Distance from the goal at which the rover has arrived, m.
    #[arg(long, default_value_t = 0.05)]
    tolerance: f64,
    /// The navigator.
    #[arg(long, default_value = "gestalt")]
    navigator: Preset,
    /// A setting of the navigator; can be given more than once.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// A preset of the navigator.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Preset {
    Gestalt,
    Morphin,
}

impl Navigation {
    /// Drives and writes one JSON object a drive, and a summary.
    ///
    /// # Errors
    /// A scenario that cannot be read, a bad setting, or no room for the states of the worlds.
    pub(super) fn run(&self) -> Result<()> {
        let scenario = open::scenario(&self.scenario)?;
        let folder = std::env::temp_dir().join(format!("sightline-navigation-{}", std::process::id()));
        let seeds: Vec<u64> = (self.seed..self.seed + self.worlds).collect();
        let command = DriveCommand {
            standoff_m: self.standoff,
            tolerance_m: self.tolerance,
            ..DriveCommand::default()
        };
        let progress = Mutex::new((0, Progress::new("drive")));
        let tell = || {
            let mut progress = progress.lock().unwrap_or_else(PoisonError::into_inner);
            progress.0 += 1;
            let done = progress.0;
            progress.1.tell(done, seeds.len());
        };
        let study = Drives {
            from: &scenario,
            command: &command,
            hazards: &HazardSettings::default(),
            navigator: &self.settings()?,
            folder: &folder,
        };
        let drives = study.run(&seeds, &tell);
        let _ = std::fs::remove_dir_all(&folder);
        for drive in &drives {
            let line = serde_json::to_string(drive).map_err(|error| Error::Request(error.to_string()))?;
            terminal::line(&line)?;
        }
        terminal::line(&summary(&drives))
    }

    fn settings(&self) -> Result<NavigatorSettings> {
        let preset = match self.navigator {
            Preset::Gestalt => NavigatorPreset::Gestalt,
            Preset::Morphin => NavigatorPreset::Morphin,
        };
        let mut document = serde_json::to_value(preset.settings())
            .map_err(|error| Error::setting("navigator", error.to_string()))?;
        for text in &self.set {
            let (key, value) = text
                .split_once('=')
                .ok_or_else(|| Error::setting("set", format!("`{text}` is not KEY=VALUE")))?;
            let known = document
                .get_mut(key)
                .ok_or_else(|| Error::setting(key, "the navigator has no such setting"))?;
            *known = value.parse::<Value>().map_err(|error| Error::setting(key, error.to_string()))?;
        }
        let settings: NavigatorSettings =
            serde_json::from_value(document).map_err(|error| Error::setting("set", error.to_string()))?;
        settings.validate()?;
        Ok(settings)
    }
}

fn summary(drives: &[Drive]) -> String {
    let made: Vec<&Drive> = drives.iter().filter(|drive| drive.problem.is_none()).collect();
    let count = |is: &dyn Fn(&Drive) -> bool| made.iter().filter(|drive| is(drive)).count();
    let with_way = count(&|drive| drive.way_m.is_some());
    let both = count(&|drive| drive.way_m.is_some() && drive.arrived);
    let only = count(&|drive| drive.way_m.is_none() && drive.arrived);
    let ends = ["goal_blocked", "no_safe_path", "stalled", "touched", "stop_limit"]
        .map(|end| format!("{} {end}", count(&|drive| drive.end == end)));
    let mut longer: Vec<f64> = made
        .iter()
        .filter(|drive| drive.arrived)
        .filter_map(|drive| Some(drive.driven_m / drive.way_m?))
        .collect();
    longer.sort_by(f64::total_cmp);
    let median = longer.get(longer.len() / 2).copied().unwrap_or(f64::NAN);
    format!(
        "{} drives; a way exists in {with_way}, of which {both} arrived; {only} arrived without one; {}; path over way {median:.2}",
        made.len(),
        ends.join(", ")
    )
}
