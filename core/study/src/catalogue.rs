//! The studies by name: the papers' experiments with their grids, default configurations and printed results.
//!
//! | study | source | scenario | variable |
//! |---|---|---|---|
//! | `straight` | K§5.1, R108–R117 | approach-5 | `n_skip`: steps of 5 to 22.6 % |
//! | `sideways` | K§5.2, R118–R122, E19 | sideways-70 | `azimuth_step_deg` × `search_window_px` |
//! | `turn-in-place` | K§5.3, R123 | turn-in-place | `turn_step_deg` |
//! | `claim` | abstract, R127 | claim (`randomised`) | none: the seed also draws drive and light |
//! | `approach` | K§4.2, R41, R46 | approach-10 | none |
//! | `terrain` | K§5.5, R124–R126 | slope-…, stuck | `terrain` × `odometry` |
//! | `checkout-1`, `-2`, `-3` | K§7.1–7.3, R130–R143 | checkout-… | `position`: one row per step |
//! | `faults` | K§4.6, R88, R126 | several | `fault` |
//! | `recovery` | D§4, R155, R214 | k9-5 | `start_error_cm` |
//! | `k9` | D§4, R209–R215 | k9-5, k9-7.5, k9-10 | `scenario` |
//! | `feature-covariance` | D§2, R172–R177 | approach-10 | none |
//! | `feature-faults` | D§1, D§4, R156, R185, R208 | several | `fault` |
//!
//! The sideways study skips images; 70° is no multiple of 15°, 20° and larger steps, so the last full step ends earlier
//! (E19).

use serde_json::Value;

use super::point::{Fault, Picks, Point, Visit};
use sightline_geometry::error::{Error, Result};
use sightline_rover::visual_odometry::OdometryMode;
use sightline_track::presets::PRESETS;

/// Values accepted by a study's grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Grid {
    /// Number of skipped images.
    Skips,
    /// Multiples of 5° up to this angle, degrees.
    Angles(u32),
    /// Words defined by the study.
    Words(&'static [&'static str]),
    /// A single point.
    One,
}

/// A study of the catalogue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Study {
    /// Name on the command line.
    pub name: &'static str,
    /// Question of the study, as one sentence.
    pub question: &'static str,
    /// Name of the first variable.
    pub variable: &'static str,
    /// Unit of the variable, empty for words and pure numbers.
    pub unit: &'static str,
    /// Default configurations; empty for all presets.
    configurations: &'static [&'static str],
    /// Values accepted by the grid.
    grid: Grid,
    /// Default grid.
    default_grid: &'static [&'static str],
    /// Whether every step is a row of the table.
    pub is_by_step: bool,
}

/// Search windows of the sideways study, px (R120: 200 and 600; windows here have odd sides).
pub(crate) const SIDEWAYS_WINDOWS_PX: [u32; 2] = [201, 601];

/// Uses of visual odometry in the terrain study.
const ODOMETRY: [(&str, OdometryMode); 3] =
    [("off", OdometryMode::Off), ("slip-check", OdometryMode::SlipCheck), ("full", OdometryMode::Full)];

/// Step at which a jump happens.
const JUMP_STEP: usize = 3;

const TERRAINS: &[&str] = &["slope-flat", "slope-shallow", "slope-steep", "slope-oblique", "stuck"];

const FAULTS: &[&str] = &[
    "occlusion",
    "cloud",
    "shadow",
    "boundary",
    "azimuth-jump-15",
    "azimuth-jump-30",
    "out-of-frame",
    "heading-jump-2",
    "heading-jump-6",
];

const K9: &[&str] = &["k9-5", "k9-7.5", "k9-10"];

/// Errors of the target at the start of the shape registration, cm (R155, R214).
const START_ERRORS_CM: &[&str] = &["0", "5", "10", "15", "20", "25", "30", "40"];

/// Faults of the feature study; the last four are no faults of the world but test claims of the tracker (R156).
const FEATURE_FAULTS: &[&str] = &[
    "occlusion",
    "cloud",
    "shadow",
    "starvation",
    "moving-object",
    "low-texture",
    "heading-jump-6",
    "heading-jump-20",
    "wrong-prior",
    "every-third-stop",
];

const fn study(name: &'static str, question: &'static str, configurations: &'static [&'static str]) -> Study {
    Study {
        name,
        question,
        variable: "scenario",
        unit: "",
        configurations,
        grid: Grid::One,
        default_grid: &[],
        is_by_step: false,
    }
}

/// All studies, in the order in which they are listed.
pub const STUDIES: &[Study] = &[
    Study {
        variable: "n_skip",
        unit: "images",
        grid: Grid::Skips,
        default_grid: &["0", "1", "2", "3", "4"],
        ..study("straight", "How large may a step of a straight approach be (Kim 2009, §5.1)?", &[])
    },
    Study {
        variable: "azimuth_step_deg",
        unit: "°",
        grid: Grid::Angles(70),
        default_grid: &["5", "10", "15", "20", "30", "60"],
        ..study(
            "sideways",
            "How far may the line of sight turn in one step (Kim 2009, §5.2)?",
            &["ncc", "ncc-scale", "ncc-scale-roll", "sightline", "sightline+surface_warp=false"],
        )
    },
    Study {
        variable: "turn_step_deg",
        unit: "°",
        grid: Grid::Angles(90),
        default_grid: &["5", "10", "15", "20", "25", "30", "35", "40", "45"],
        ..study("turn-in-place", "How far may the rover turn on the spot in one step (Kim 2009, §5.3)?", &[])
    },
    study(
        "claim",
        "Is a target on natural rock tracked within several pixels, or a few centimetres, over a 10-m approach in \
         steps of 10 % (Kim 2009, abstract)? The seed draws the world, where the drive starts, where it heads, and the sun.",
        &["ncc", "ncc-scale", "ncc-scale-roll", "sightline"],
    ),
    study(
        "approach",
        "How near to the target does an approach from 10 m to 2 m end, and does the covariance say so (Kim 2009, §4.2)?",
        &["sightline", "half-pixel", "ncc-scale-roll"],
    ),
    Study {
        variable: "terrain",
        grid: Grid::Words(TERRAINS),
        default_grid: TERRAINS,
        ..study(
            "terrain",
            "Does tracking survive slopes and slip, without and with visual odometry (Kim 2009, §5.5)?",
            &["sightline", "ncc-scale-roll"],
        )
    },
    Study {
        variable: "position",
        is_by_step: true,
        ..study(
            "checkout-1",
            "What did each move around the rock change (Kim 2009, §7.1, Table III)?",
            &["ncc-scale-roll", "ncc-scale", "sightline"],
        )
    },
    Study {
        variable: "position",
        is_by_step: true,
        ..study(
            "checkout-2",
            "How much is corrected on the way from 9.65 m to 1.92 m (Kim 2009, §7.2)?",
            &["ncc-scale-roll", "sightline"],
        )
    },
    Study {
        variable: "position",
        is_by_step: true,
        ..study(
            "checkout-3",
            "Is the target kept through turning, backing up and coming back (Kim 2009, §7.3)?",
            &["ncc-scale-roll", "sightline"],
        )
    },
    Study {
        variable: "fault",
        grid: Grid::Words(FAULTS),
        default_grid: FAULTS,
        ..study(
            "faults",
            "Is a target that something happens to still tracked, or declared lost within the step (Kim 2009, §4.6)?",
            &["sightline", "ncc-scale-roll"],
        )
    },
    Study {
        grid: Grid::Words(K9),
        default_grid: K9,
        ..study(
            "k9",
            "How much error does tracking by features add over the K9 rover's three drives (Deans 2005, §4)?",
            &["features", "features-paper", "sightline", "combined", "combined-paper"],
        )
    },
    Study {
        variable: "start_error_cm",
        unit: "cm",
        grid: Grid::Words(START_ERRORS_CM),
        default_grid: START_ERRORS_CM,
        ..study(
            "recovery",
            "Without features on the way, how far off may the target be for the shape to find it again (Deans 2005, §4)?",
            &["combined", "combined-paper"],
        )
    },
    study(
        "feature-covariance",
        "Does the covariance of a target that follows the features say how far off it is (Deans 2005, §2)?",
        &["features", "features-paper"],
    ),
    Study {
        variable: "fault",
        grid: Grid::Words(FEATURE_FAULTS),
        default_grid: FEATURE_FAULTS,
        ..study(
            "feature-faults",
            "Does the confidence fall before the drift grows, and is the target found again (Deans 2005, §1)?",
            &["features", "features-paper"],
        )
    },
];

impl Study {
    /// Finds a study by name.
    ///
    /// # Errors
    /// An unknown name; the message lists the known ones.
    pub fn named(name: &str) -> Result<&'static Self> {
        STUDIES.iter().find(|study| study.name == name).ok_or_else(|| {
            let known = STUDIES.iter().map(|study| study.name).collect::<Vec<_>>().join(", ");
            Error::setting("study", format!("there is no study {name}; known are {known}"))
        })
    }

    /// Default configurations; all presets if the study has none of its own.
    pub fn default_configurations(&self) -> Vec<&'static str> {
        if self.configurations.is_empty() {
            PRESETS.iter().map(|preset| preset.name).collect()
        } else {
            self.configurations.to_vec()
        }
    }

    /// Default grid.
    pub fn default_grid(&self) -> &'static [&'static str] {
        self.default_grid
    }

    /// Points of the grid: the study's own, or the requested ones.
    ///
    /// # Errors
    /// [`Error::Setting`] for a value that the grid of this study does not accept.
    pub fn points(&self, grid: &[String]) -> Result<Vec<Point>> {
        let refused = |value: &str, why: String| Error::setting("grid", format!("{value}: {why}"));
        if self.grid == Grid::One {
            return match grid.first() {
                Some(value) => Err(refused(value, format!("the study {} has no grid", self.name))),
                None => Ok(vec![self.single()]),
            };
        }
        let own: Vec<String> = self.default_grid.iter().map(|&value| value.to_owned()).collect();
        let values = if grid.is_empty() { &own } else { grid };
        let points = values.iter().map(|value| self.points_at(value).map_err(|why| refused(value, why)));
        Ok(points.collect::<Result<Vec<_>>>()?.concat())
    }

    /// The single point of a study without a grid.
    fn single(&self) -> Point {
        let scenario = match self.name {
            "approach" | "feature-covariance" => "approach-10",
            name => name,
        };
        let mut point = Point::plain(scenario, "scenario", scenario);
        if self.is_by_step {
            point.variables.clear();
        }
        point
    }

    fn points_at(&self, value: &str) -> Result<Vec<Point>, String> {
        let number = |low: u32, high: u32| {
            let parsed = value.parse::<u32>().ok().filter(|number| (low..=high).contains(number));
            parsed.ok_or_else(|| format!("must be a whole number from {low} to {high}"))
        };
        match self.grid {
            Grid::Skips => {
                let skipped = number(0, 28)?;
                let point = Point::plain("approach-5", self.variable, skipped);
                Ok(vec![Point { visit: Visit::Every(skipped as usize + 1), ..point }])
            }
            Grid::Angles(most) => {
                let step_deg = number(5, most)?;
                if !step_deg.is_multiple_of(5) {
                    return Err("must be a multiple of 5, the angle between two pictures".to_owned());
                }
                let scenario = if self.name == "sideways" { "sideways-70" } else { self.name };
                let point = Point::plain(scenario, self.variable, step_deg);
                let point = Point { visit: Visit::Every(step_deg as usize / 5), ..point };
                Ok(if self.name == "sideways" { with_windows(&point) } else { vec![point] })
            }
            Grid::Words(words) if words.contains(&value) => {
                let point = self.word(value);
                Ok(if self.name == "terrain" { with_odometry(&point) } else { vec![point] })
            }
            Grid::Words(words) => Err(format!("must be one of {}", words.join(", "))),
            Grid::One => Err(format!("the study {} has no grid", self.name)),
        }
    }

    fn word(&self, word: &str) -> Point {
        let on = |scenario: &str, fault: Fault| Point {
            fault: Some(fault),
            ..Point::plain(scenario, self.variable, word)
        };
        let heading = |yaw_deg: f64| on("approach-10", Fault::HeadingJump { step: 2 * JUMP_STEP, yaw_deg });
        let changed = |change: &str| Point {
            changes: vec![change.to_owned()],
            ..on("approach-10", Fault::FromTheStart)
        };
        let azimuth = |count: usize| Point {
            visit: Visit::LeavingOut { first: JUMP_STEP, count },
            ..on("sideways-70", Fault::AzimuthJump(JUMP_STEP))
        };
        match word {
            "occlusion" => on("occlusion", Fault::Occlusion),
            "cloud" => on("clouds", Fault::Cloud(6)),
            "shadow" => on("self-shadow", Fault::Shadow),
            "boundary" => Point { picks: Picks::Boundary, ..on("approach-10", Fault::Boundary) },
            "azimuth-jump-15" => azimuth(2),
            "azimuth-jump-30" => azimuth(5),
            "out-of-frame" => Point { picks: Picks::Leaving, ..on("approach-10", Fault::OutOfFrame) },
            "heading-jump-2" => heading(2.0),
            "heading-jump-6" => heading(6.0),
            "heading-jump-20" => heading(20.0),
            "starvation" => changed("features_max=40"),
            "moving-object" => on("moving-object", Fault::FromTheStart),
            "low-texture" => on("low-texture", Fault::FromTheStart),
            "wrong-prior" => Point { changes: vec!["prior_radius_px=60".to_owned()], ..heading(6.0) },
            "every-third-stop" => Point { visit: Visit::Every(3), ..on("approach-10", Fault::FromTheStart) },
            start_cm if self.name == "recovery" => Point {
                visit: Visit::AllButLast,
                // Too few for any motion: dead reckoning from the first step on, as in the rover's shadow.
                changes: vec!["features_max=3".to_owned()],
                fault: Some(Fault::PositionJump {
                    across_m: start_cm.parse::<f64>().unwrap_or_default() / 100.0,
                }),
                ..Point::plain("k9-5", self.variable, word)
            },
            k9 if self.name == "k9" => {
                Point { visit: Visit::AllButLast, ..Point::plain(k9, self.variable, word) }
            }
            terrain => Point::plain(terrain, self.variable, word),
        }
    }
}

/// A point of the sideways study with each of the search windows.
fn with_windows(point: &Point) -> Vec<Point> {
    let with = |window_px: u32| {
        let mut point = point.clone();
        point.variables.push(("search_window_px".to_owned(), Value::from(window_px)));
        point.changes.push(format!("search_window_px={window_px}"));
        point
    };
    SIDEWAYS_WINDOWS_PX.map(with).to_vec()
}

/// A point of the terrain study with each use of visual odometry.
fn with_odometry(point: &Point) -> Vec<Point> {
    let with = |(word, mode): (&str, OdometryMode)| {
        let mut point = point.clone();
        point.variables.push(("odometry".to_owned(), word.into()));
        Point { odometry: Some(mode), ..point }
    };
    ODOMETRY.map(with).to_vec()
}

#[cfg(test)]
#[path = "catalogue_tests.rs"]
mod tests;
