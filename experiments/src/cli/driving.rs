//! `sightline-experiments driving`: closed-loop drives in many worlds, with a goal that follows the target and a fixed one.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use crate::driving::{Drive, Drives, Outcome, outcome};
use clap::{Args, ValueEnum};
use serde::Serialize;
use sightline_geometry::error::{Error, Result};
use sightline_rover::driving::{DriveCommand, GoalRule};

use super::worlds::Worlds;
use sightline_server::cli::drive_options::NavigatorName;
use sightline_server::cli::open;
use sightline_server::cli::terminal::{self, Progress};

/// The worlds and the command.
#[derive(Debug, Args)]
pub(super) struct Driving {
    /// The scenario: a file, or a name that `sightline scenarios` lists.
    #[arg(default_value = "approach-10")]
    scenario: PathBuf,
    /// How many worlds.
    #[arg(long, default_value_t = 100)]
    worlds: u64,
    #[command(flatten)]
    of: Worlds,
    /// Horizontal distance of the goal from the target, m.
    #[arg(long, default_value_t = 2.0)]
    standoff: f64,
    /// Distance from the goal at which the rover has arrived, m.
    #[arg(long, default_value_t = 0.01)]
    tolerance: f64,
    /// Leave the rocks on the rover's way; without it, none above 10 cm is there.
    #[arg(long)]
    obstacles: bool,
    /// The navigator that chooses the motions.
    #[arg(long, value_name = "NAME", default_value = "arcs")]
    navigator: NavigatorName,
    /// The drives with one rule of the goal alone.
    #[arg(long, value_name = "RULE")]
    only: Option<Rule>,
    /// Keep the drives in this folder, each with its images.
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// What is written to the standard output.
    #[arg(long, default_value = "text")]
    format: Format,
}

/// A rule of the goal.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Rule {
    /// The goal follows the tracked target.
    Follows,
    /// The goal stays where the designation put it.
    Fixed,
}

/// What is written to the standard output.
#[derive(Clone, Copy, Debug, PartialEq, ValueEnum)]
enum Format {
    /// One line for each rule of the goal.
    Text,
    /// One JSON object for each rule of the goal, with every drive.
    Json,
}

/// The drives with one rule of the goal.
#[derive(Serialize)]
struct Report {
    goal: GoalRule,
    outcome: Outcome,
    drives: Vec<Drive>,
}

impl Driving {
    /// Drives and writes the outcome.
    ///
    /// # Errors
    /// A scenario that cannot be read, or no room for images.
    pub(super) fn run(&self) -> Result<()> {
        let mut scenario = open::scenario(&self.scenario)?;
        self.of.size(&mut scenario);
        let unkept = std::env::temp_dir().join(format!("sightline-driving-{}", std::process::id()));
        let folder = self.out.clone().unwrap_or_else(|| unkept.clone());
        let seeds: Vec<u64> = (self.of.seed..self.of.seed + self.worlds).collect();
        let settings = self.of.settings()?;
        let rules = match self.only {
            None => vec![GoalRule::FollowsTarget, GoalRule::Fixed],
            Some(Rule::Follows) => vec![GoalRule::FollowsTarget],
            Some(Rule::Fixed) => vec![GoalRule::Fixed],
        };
        let all = seeds.len() * rules.len();
        let progress = Mutex::new((0, Progress::new("drive")));
        let tell = || {
            let mut progress = progress.lock().unwrap_or_else(PoisonError::into_inner);
            progress.0 += 1;
            let done = progress.0;
            progress.1.tell(done, all);
        };
        for goal in rules {
            let command = DriveCommand {
                standoff_m: self.standoff,
                tolerance_m: self.tolerance,
                goal,
                navigator: self.navigator.kind(),
                ..DriveCommand::default()
            };
            let study = Drives {
                from: &scenario,
                command: &command,
                settings: &settings,
                obstacles: self.obstacles,
                folder: &folder,
                keeps: self.out.is_some(),
            };
            let drives = study.run(&seeds, &tell);
            let outcome = outcome(&drives);
            if self.format == Format::Text {
                terminal::line(&row(goal, &outcome))?;
                continue;
            }
            let report = Report { goal, outcome, drives };
            let text = serde_json::to_string(&report).map_err(|error| Error::Request(error.to_string()))?;
            terminal::line(&text)?;
        }
        let _ = std::fs::remove_dir_all(&unkept);
        Ok(())
    }
}

/// One line of the table.
fn row(goal: GoalRule, outcome: &Outcome) -> String {
    let Outcome { drives, arrived, with_way, tracked, collisions, target_error_m, goal_error_m } = outcome;
    let of_way = match with_way {
        [0, _] => String::new(),
        [exists, arrived] => format!(" (of {exists} with a way over the true ground {arrived})"),
    };
    let cm = |pair: &[f64; 2]| format!("{:.2} / {:.2} cm", 100.0 * pair[0], 100.0 * pair[1]);
    format!(
        "{goal:?}: {arrived} of {drives} arrived{of_way}, {tracked} tracked, {collisions} collisions; target error {} (median / 99 %), goal error {} (median / 95 %)",
        cm(target_error_m),
        cm(goal_error_m)
    )
}
