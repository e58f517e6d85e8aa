//! The order of a study: plan, worlds and folder.

use std::path::{Path, PathBuf};

use sightline_study::plan::Plan;
use sightline_study::wire::NewStudy;
use sightline_world::Scenario;

use crate::naming::hash;
use crate::problem::{ApiError, ApiResult};

/// Maximum number of worlds of a study started over REST.
const WORLD_LIMIT: u64 = 100;
/// The largest seed that JavaScript represents exactly.
const SEED_LIMIT: u64 = 1 << 53;

/// The worlds of a study.
#[derive(Clone, Debug, PartialEq)]
pub enum Seeds {
    /// Explicit seeds, with any number of targets.
    Named(Vec<u64>),
    /// The first worlds that have all their targets.
    Count {
        /// Number of worlds.
        worlds: u64,
        /// The first seed to try.
        first: u64,
    },
}

/// The parameters of a study.
#[derive(Clone, Debug)]
pub struct Order {
    /// Study, configurations and grid.
    pub plan: Plan,
    /// The worlds.
    pub seeds: Seeds,
    /// A scenario that replaces the study's own, with its name.
    pub scenario: Option<(String, Scenario)>,
    /// The folder for worlds and results.
    pub folder: PathBuf,
    /// The command line that reproduces the study, for the report.
    pub command: String,
}

/// The order of a requested study, with its worlds below `folder`.
///
/// # Errors
/// A problem that names the fault in the request.
pub(crate) fn order(folder: &Path, new: &NewStudy) -> ApiResult<Order> {
    let plan = Plan::new(&new.study, &new.configurations, &new.grid)?;
    let seeds = seeds(new)?;
    let scenario = match &new.scenario {
        Some(scenario) => {
            scenario.validate()?;
            // Its worlds have a separate folder.
            Some((format!("own-{}", &hash(scenario.to_toml().as_bytes())[..12]), scenario.clone()))
        }
        None => None,
    };
    let command = command(new, &plan, &seeds);
    Ok(Order { plan, seeds, scenario, folder: folder.to_owned(), command })
}

fn seeds(new: &NewStudy) -> ApiResult<Seeds> {
    let wrong = |field: &str, why: String| Err(ApiError::invalid("field", format!("{field}: {why}")));
    if new.seeds.is_empty() {
        let (worlds, first) = (new.worlds.unwrap_or(10), new.first_seed.unwrap_or(1));
        if !(1..=WORLD_LIMIT).contains(&worlds) {
            return wrong("worlds", format!("must be from 1 to {WORLD_LIMIT}, not {worlds}"));
        }
        // Ten seeds are tried for each world.
        if first > SEED_LIMIT - 10 * WORLD_LIMIT {
            return wrong("first_seed", format!("{first} is too large"));
        }
        return Ok(Seeds::Count { worlds, first });
    }
    if new.worlds.is_some() || new.first_seed.is_some() {
        return wrong("seeds", "leave out worlds and first_seed, or the seeds".to_owned());
    }
    if new.seeds.len() as u64 > WORLD_LIMIT {
        return wrong("seeds", format!("may be at most {WORLD_LIMIT}, not {}", new.seeds.len()));
    }
    match new.seeds.iter().find(|seed| **seed > SEED_LIMIT) {
        Some(seed) => wrong("seeds", format!("{seed} is above 2^53")),
        None => Ok(Seeds::Named(new.seeds.clone())),
    }
}

/// The command line that reproduces the study.
fn command(new: &NewStudy, plan: &Plan, seeds: &Seeds) -> String {
    let worlds = match seeds {
        Seeds::Named(seeds) => {
            format!("--seeds {}", seeds.iter().map(u64::to_string).collect::<Vec<_>>().join(","))
        }
        Seeds::Count { worlds, first } => format!("--worlds {worlds} --first-seed {first}"),
    };
    let names: Vec<&str> = plan.configurations.iter().map(|c| c.name.as_str()).collect();
    let grid = if new.grid.is_empty() { String::new() } else { format!(" --grid {}", new.grid.join(",")) };
    format!("sightline study {} {worlds} --configurations {}{grid}", plan.study.name, names.join(","))
}
