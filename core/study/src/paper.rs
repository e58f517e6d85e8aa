//! Printed values of the papers for the studies of the catalogue.
//!
//! Values are fractions of targets tracked unless the column says otherwise.

use serde::Serialize;

use super::catalogue::Study;

/// A printed value of the paper.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PaperValue {
    /// Our configuration that corresponds to the paper's.
    pub configuration: &'static str,
    /// Value of the study's first variable.
    pub at: f64,
    /// Printed value, in the unit of `column`.
    pub value: f64,
    /// Our column to compare it with.
    pub column: &'static str,
    /// Section or table of the paper.
    pub source: &'static str,
}

impl Study {
    /// Printed values of this study; empty if there are none.
    pub fn paper(&self) -> Vec<PaperValue> {
        let share = |configuration, at, value, source| PaperValue {
            configuration,
            at,
            value,
            column: "tracked_share",
            source,
        };
        match self.name {
            "straight" => vec![
                share("ncc", 0.0, 0.80, "Kim09 §5.1"),
                share("ncc", 4.0, 0.15, "Kim09 §5.1"),
                share("ncc-scale", 0.0, 1.00, "Kim09 §5.1"),
                share("ncc-scale", 4.0, 0.95, "Kim09 §5.1"),
            ],
            "sideways" => vec![
                share("ncc-scale", 5.0, 1.00, "Kim09 §5.2"),
                share("ncc-scale", 10.0, 1.00, "Kim09 §5.2"),
                share("ncc-scale", 15.0, 0.82, "Kim09 §5.2"),
            ],
            "turn-in-place" => {
                (1..=9).map(|step| share("ncc-scale", f64::from(5 * step), 1.0, "Kim09 §5.3")).collect()
            }
            "checkout-1" => checkout_1(),
            _ => Vec::new(),
        }
    }
}

/// A line of Table II: tracking with visual odometry on terrains (K§5.5, R125).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct PaperTerrain {
    /// Our scenario.
    pub terrain: &'static str,
    /// Terrain as named in the paper.
    pub word: &'static str,
    /// Number of trials.
    pub trials: u32,
    /// Number of failures.
    pub failures: u32,
    /// Cause of the failures as printed, abridged.
    pub cause: &'static str,
}

/// Table II (R125); its total is 26 trials with 2 failures.
pub const TABLE_II: [PaperTerrain; 4] = [
    PaperTerrain {
        terrain: "slope-flat",
        word: "Flat",
        trials: 11,
        failures: 1,
        cause: "azimuth change above 10° with occlusion",
    },
    PaperTerrain { terrain: "slope-shallow", word: "Shallow incline", trials: 4, failures: 0, cause: "–" },
    PaperTerrain {
        terrain: "slope-steep",
        word: "Steep incline",
        trials: 6,
        failures: 0,
        cause: "none although slip reached 100 % at times",
    },
    PaperTerrain {
        terrain: "slope-oblique",
        word: "Oblique",
        trials: 5,
        failures: 1,
        cause: "dramatic lighting change",
    },
];

/// Table III (R133): each column by position, from the second on.
pub(crate) const TABLE_III: [(&str, [f64; 7]); 4] = [
    ("magnification", [1.04, 1.03, 1.03, 1.01, 1.00, 0.97, 1.04]),
    ("roll_deg", [2.46, 2.46, 2.92, 3.27, 3.27, 0.06, 6.25]),
    ("azimuth_change_deg", [6.01, 6.38, 8.53, 8.58, 8.62, 0.00, 15.44]),
    ("ncc", [0.88, 0.88, 0.85, 0.87, 0.87, 0.94, 0.79]),
];

/// Table III as printed values.
fn checkout_1() -> Vec<PaperValue> {
    let rows = TABLE_III.into_iter().flat_map(|(column, values)| {
        (2_u32..).zip(values).map(move |(position, value)| PaperValue {
            configuration: "ncc-scale-roll",
            at: f64::from(position),
            value,
            column,
            source: "Kim09 Table III",
        })
    });
    rows.collect()
}
