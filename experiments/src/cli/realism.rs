//! `sightline-experiments realism`: how hard simulated worlds are for plain correlation.

use std::path::{Path, PathBuf};

use crate::realism::{self, Difficulty};
use clap::Args;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::Pixel;
use sightline_recordings::{Traverse, create_simulated};
use sightline_track::settings::{Changes, Settings, parse_assignment};

use sightline_world::Scenario;

use sightline_server::cli::{open, terminal};

/// Seeds that are tried for each world asked for.
const SEEDS_PER_WORLD: u64 = 10;

/// The worlds of an experiment: each is rendered once, each of its targets is one run.
#[derive(Debug, Args)]
pub(super) struct Worlds {
    /// How many worlds; one that offers fewer targets than the scenario asks for is passed over and named.
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=1000))]
    worlds: u64,
    /// The seed of the first world; the others follow.
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// The scenario of which the worlds are made, a file or a name that `sightline scenarios` lists; by default the
    /// experiment's own.
    #[arg(long, value_name = "SCENARIO")]
    scenario: Option<PathBuf>,
    /// A setting of the tracker; can be given more than once.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The folder for worlds, table, summary and figure; worlds that are there already are used again.
    #[arg(long, value_name = "FOLDER")]
    out: PathBuf,
}

/// Strides over an approach in steps of 5 %: 5 % and 22.6 % (R111).
const STRIDES: [usize; 2] = [1, 5];

/// Plain correlation, as the paper's first configuration: nothing follows the surface, every update renews.
const PLAIN: [&str; 5] =
    ["scale=false", "roll=false", "surface_warp=false", "focus_px=0", "template_update=every_update"];

impl Worlds {
    /// Renders and tracks the worlds, and writes what was found.
    ///
    /// # Errors
    /// A bad scenario or setting, too few worlds with targets enough, or a folder that cannot be written.
    pub(super) fn run(&self) -> Result<()> {
        let settings = self.settings(&PLAIN)?;
        let mut found: Vec<Difficulty> = Vec::new();
        self.each("approach-5", |traverse, seed, targets| {
            let of_world = STRIDES.map(|stride| realism::difficulty(traverse, targets, &settings, stride));
            for (index, difficulty) in of_world.into_iter().enumerate() {
                terminal::line(&format!(
                    "world {seed}, every {} stops: {}",
                    difficulty.stride,
                    difficulty_words(&difficulty)
                ))?;
                match found.get_mut(index) {
                    Some(sum) => sum.add(&difficulty),
                    None => found.push(difficulty),
                }
            }
            Ok(())
        })?;
        let document = serde_json::to_vec_pretty(&found).map_err(|e| Error::Request(e.to_string()))?;
        write(&self.out.join("realism.json"), &document)?;
        for difficulty in &found {
            terminal::line(&format!("every {} stops: {}", difficulty.stride, difficulty_words(difficulty)))?;
        }
        Ok(())
    }

    /// The tracker's settings: the experiment's own, then those that were asked for.
    fn settings(&self, own: &[&str]) -> Result<Settings> {
        let texts = own.iter().copied().chain(self.set.iter().map(String::as_str));
        Settings::default().with(&texts.map(parse_assignment).collect::<Result<Changes>>()?)
    }

    /// Renders world after world and calls `study` with its traverse, its seed and its targets.
    ///
    /// A world that offers fewer targets than its scenario asks for is passed over: that depends on its surface and
    /// its light alone.
    fn each(
        &self,
        default: &str,
        mut study: impl FnMut(&Traverse, u64, &[Pixel]) -> Result<()>,
    ) -> Result<()> {
        let scenario = open::scenario(self.scenario.as_deref().unwrap_or(Path::new(default)))?;
        let seeds = self.first_seed..self.first_seed.saturating_add(self.worlds * SEEDS_PER_WORLD);
        let mut worlds = 0;
        for seed in seeds.clone() {
            if worlds == self.worlds {
                break;
            }
            let traverse = create_simulated(
                &Scenario { seed, ..scenario.clone() },
                &self.out.join(format!("world-{seed}")),
            )?;
            let world = traverse
                .world()
                .ok_or_else(|| Error::Request("a simulated world has no surface".to_owned()))?;
            let targets = sightline_world::choose_targets(
                world,
                &Scenario { seed, ..scenario.clone() },
                traverse.index(),
            );
            if targets.len() < scenario.targets.wanted() as usize {
                terminal::line(&format!("world {seed}: {} targets, passed over", targets.len()))?;
                continue;
            }
            open::render(&traverse)?;
            study(&traverse, seed, &targets)?;
            worlds += 1;
        }
        if worlds == self.worlds {
            return Ok(());
        }
        Err(Error::Request(format!(
            "only {worlds} of {} worlds with seeds from {} to {} offer {} targets: lower targets.count or widen targets.radius_m in the scenario",
            self.worlds,
            seeds.start,
            seeds.end - 1,
            scenario.targets.wanted()
        )))
    }
}

/// What plain correlation made of the worlds, in one line.
fn difficulty_words(difficulty: &Difficulty) -> String {
    let near = realism::RANGES_M.iter().skip(1).chain(&[0.0]);
    let ranges = realism::RANGES_M.iter().zip(near).zip(difficulty.mean_scores());
    let scores: Vec<String> = ranges
        .filter_map(|((far_m, near_m), score)| Some(format!("{far_m} to {near_m} m {:.3}", score?)))
        .collect();
    format!(
        "{} of {} targets tracked ({:.0} %), {} refused; mean score {}",
        difficulty.tracked,
        difficulty.targets,
        100.0 * difficulty.tracked_share(),
        difficulty.refused,
        scores.join(", ")
    )
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    std::fs::write(path, bytes).map_err(|source| Error::Write { path: path.to_owned(), source })
}
