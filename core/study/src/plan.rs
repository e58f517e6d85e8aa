//! Plan of a study: its configurations and grid, validated before anything is rendered, and the keys under which results
//! are stored.
//!
//! A *unit* is one configuration at one point in one world. Its key is the SHA-256 of all inputs of its result: the
//! scenario with its seed, the point, the settings, and the sources of this crate and of its dependencies. A stored
//! result with the same key is not computed again; a change of the code invalidates all stored keys.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::by_pose_row::DriveOdometry;
use super::catalogue::Study;
use super::point::Point;
use sightline_geometry::error::{Error, Result};
use sightline_track::presets::preset;
use sightline_track::settings::{Changes, Settings, parse_assignment};
use sightline_world::Scenario;

/// Digest of the sources that determine a result, from the build script.
const SOURCES: &str = env!("SIGHTLINE_STUDY_SOURCES");

/// Key of the code that determines a result.
pub(crate) fn code_key() -> String {
    SOURCES[..16].to_owned()
}

/// Largest number of configurations of a study.
const CONFIGURATION_LIMIT: usize = 32;

/// Largest number of points of a grid.
const GRID_LIMIT: usize = 64;

/// A named configuration of the tracker.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// A preset's name, followed by changes, joined by plus signs.
    pub name: String,
    /// The settings.
    pub settings: Settings,
}

impl Configuration {
    /// Reads `preset` or `preset+key=value+key=value`.
    ///
    /// # Errors
    /// An unknown preset; the message lists the known ones. A setting that does not exist or is out of range.
    pub fn parse(text: &str) -> Result<Self> {
        let mut parts = text.split('+').map(str::trim);
        let name = parts.next().unwrap_or_default();
        let changes = parts.map(parse_assignment).collect::<Result<Changes>>()?;
        Ok(Self { name: text.trim().to_owned(), settings: preset(name)?.settings()?.with(&changes)? })
    }
}

/// A validated study.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The study.
    pub study: &'static Study,
    /// Configurations, in the requested order.
    pub configurations: Vec<Configuration>,
    /// The points of the grid.
    pub points: Vec<Point>,
}

impl Plan {
    /// Validates a request; an empty list selects the study's own configurations or grid.
    ///
    /// # Errors
    /// An unknown study, configuration or setting, a value that the grid does not accept, or too many of them.
    pub fn new(study: &str, configurations: &[String], grid: &[String]) -> Result<Self> {
        let study = Study::named(study)?;
        let own: Vec<String> = study.default_configurations().into_iter().map(str::to_owned).collect();
        let names = if configurations.is_empty() { &own } else { configurations };
        let mut parsed: Vec<Configuration> = Vec::new();
        for name in names {
            let configuration = Configuration::parse(name)?;
            if parsed.iter().all(|other| other.name != configuration.name) {
                parsed.push(configuration);
            }
        }
        let mut points: Vec<Point> = Vec::new();
        for point in study.points(grid)? {
            if !points.contains(&point) {
                points.push(point);
            }
        }
        if parsed.len() > CONFIGURATION_LIMIT || points.len() > GRID_LIMIT {
            return Err(Error::Request(format!(
                "a study has at most {CONFIGURATION_LIMIT} configurations and {GRID_LIMIT} points of its grid"
            )));
        }
        Ok(Self { study, configurations: parsed, points })
    }

    /// The scenarios of the grid, without duplicates.
    pub fn scenarios(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for point in &self.points {
            if !names.contains(&point.scenario.as_str()) {
                names.push(&point.scenario);
            }
        }
        names
    }

    /// The settings of a configuration at a point.
    ///
    /// # Errors
    /// A change of the point that is not valid for the settings.
    pub fn settings(configuration: &Configuration, point: &Point) -> Result<Settings> {
        let changes = point.changes.iter().map(|text| parse_assignment(text)).collect::<Result<Changes>>()?;
        configuration.settings.with(&changes)
    }
}

/// The key of a unit's result.
pub fn key(scenario: &Scenario, point: &Point, settings: &Settings) -> String {
    Decides { sources: SOURCES, scenario, point, settings }.key()
}

/// All inputs that determine a result.
#[derive(Serialize)]
struct Decides<'a> {
    sources: &'a str,
    scenario: &'a Scenario,
    point: &'a Point,
    settings: &'a Settings,
}

impl Decides<'_> {
    /// The first 32 hexadecimal digits of the SHA-256 of the JSON.
    fn key(&self) -> String {
        let bytes = serde_json::to_vec(self).unwrap_or_default();
        Sha256::digest(bytes).iter().take(16).map(|byte| format!("{byte:02x}")).collect()
    }
}

/// Stored result of a unit: one line of the results file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Unit {
    /// Key of the unit.
    pub key: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Seed of the world.
    pub seed: u64,
    /// Name of the configuration.
    pub configuration: String,
    /// The point of the grid.
    pub point: Point,
    /// Performance of odometry in the drive; `None` unless the study uses odometry.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<DriveOdometry>,
    /// Runs, one per target.
    pub runs: Vec<super::run::Run>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_configuration_is_a_preset_with_changes() {
        let configuration = Configuration::parse("ncc-scale+ncc_min=0.5+sub_pixel=false").unwrap();
        assert_eq!(configuration.settings.limits.ncc_min, 0.5);
        assert!(!configuration.settings.template.sub_pixel && !configuration.settings.template.roll);
    }

    #[test]
    fn what_is_not_known_is_refused_by_name() {
        let refusal = |names: &[&str]| {
            let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
            Plan::new("straight", &names, &[]).unwrap_err().to_string()
        };
        let unknown = refusal(&["ncc", "best"]);
        assert!(unknown.contains("best") && unknown.contains("ncc-scale"), "{unknown}");
        assert!(refusal(&["ncc+ncc_mim=0.5"]).contains("ncc_min"));
        assert!(refusal(&["ncc+fast"]).contains("key=value"));
    }

    #[test]
    fn a_key_changes_with_all_that_decides_a_result_and_with_nothing_else() {
        let plan = Plan::new("straight", &["ncc".to_owned()], &["0".to_owned(), "4".to_owned()]).unwrap();
        let (scenario, settings) = (Scenario::demo(), Settings::default());
        let first = key(&scenario, &plan.points[0], &settings);
        assert_eq!(first, key(&scenario.clone(), &plan.points[0], &Settings::default()));
        assert_ne!(first, key(&Scenario { seed: 9, ..scenario.clone() }, &plan.points[0], &settings));
        assert_ne!(first, key(&scenario, &plan.points[1], &settings));
        assert_ne!(first, key(&scenario, &plan.points[0], &plan.configurations[0].settings));
    }

    #[test]
    fn the_key_changes_with_the_sources() {
        let plan = Plan::new("straight", &["ncc".to_owned()], &["0".to_owned()]).unwrap();
        let (scenario, settings) = (Scenario::demo(), Settings::default());
        let of = |sources| {
            Decides { sources, scenario: &scenario, point: &plan.points[0], settings: &settings }.key()
        };
        let other = SOURCES.replace(|digit: char| digit.is_ascii_digit(), "a");
        assert_eq!(of(SOURCES), key(&scenario, &plan.points[0], &settings));
        assert_ne!(of(&other), of(SOURCES));
    }
}
