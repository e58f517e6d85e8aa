//! What a person asks for when runs are compared: which, and how they are shown.

pub(crate) mod keys;
pub(crate) mod state;
pub(crate) mod update;
pub(crate) mod panel;

use std::collections::BTreeMap;

use sightline_session::compare::{Alignment, Comparison, NewComparison, RunName};
use sightline_session::metrics::RunMetrics;

/// How the left image shows the compared runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum View {
    /// The marks of all runs on one image.
    #[default]
    Marks,
    /// Each run's surroundings of the target, side by side.
    SideBySide,
    /// This run left of a divider, the other right of it.
    Wipe,
    /// This run, and the other one while X is held.
    Blink,
    /// What the two runs matched, one less the other.
    Difference,
}

impl View {
    /// All of them, in the order of the key.
    pub const ALL: [Self; 5] = [Self::Marks, Self::SideBySide, Self::Wipe, Self::Blink, Self::Difference];

    /// Its word.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Marks => "marks",
            Self::SideBySide => "side by side",
            Self::Wipe => "wipe",
            Self::Blink => "blink",
            Self::Difference => "difference",
        }
    }

    /// What it shows.
    pub const fn help(self) -> &'static str {
        match self {
            Self::Marks => "the marks of all runs on one image",
            Self::SideBySide => "each run’s surroundings of the target, side by side",
            Self::Wipe => "this run left of a divider, the other right of it; drag it or use the arrow keys",
            Self::Blink => "this run; the other one while X is held (no automatic blinking)",
            Self::Difference => "difference of the two runs’ templates and matched patches",
        }
    }

    /// The one after it.
    pub fn next(self) -> Self {
        let at = Self::ALL.iter().position(|&view| view == self).unwrap_or(0);
        Self::ALL[(at + 1) % Self::ALL.len()]
    }
}

/// From which difference on two runs count as different.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Closeness {
    /// Every bit counts.
    #[default]
    Exact,
    /// What only rounding makes does not.
    Rounding,
    /// What nobody would see in a picture does not.
    Visible,
}

impl Closeness {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Exact, Self::Rounding, Self::Visible];

    /// Its word.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Exact => "none",
            Self::Rounding => "1e-9",
            Self::Visible => "0.01 px, 1 mm",
        }
    }

    /// By how much values of each unit may differ and still count as equal.
    pub(crate) const fn tolerances(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Exact => &[],
            Self::Rounding => &[
                ("px", 1e-9),
                ("px2", 1e-9),
                ("m", 1e-9),
                ("m2", 1e-9),
                ("rad", 1e-9),
                ("deg", 1e-9),
                ("s", 1e-9),
                ("1", 1e-9),
            ],
            Self::Visible => &[
                ("px", 0.01),
                ("px2", 1e-3),
                ("m", 1e-3),
                ("m2", 1e-6),
                ("rad", 1e-4),
                ("deg", 0.01),
                ("s", 1e-3),
                ("1", 1e-3),
            ],
        }
    }
}

/// The metrics of the table of runs with their headings, and whether more is better.
pub(crate) const METRICS: [(&str, &str, bool); 9] = [
    ("tracked_steps", "tracked", true),
    ("survival_steps", "survived", true),
    ("ade_px", "mean, px", false),
    ("max_px", "max, px", false),
    ("ade_cm", "mean, cm", false),
    ("pck_4px", "in 4 px", true),
    ("false_lost", "false lost", false),
    ("false_tracking", "false tracking", false),
    ("mean_nees", "NEES", false),
];

/// What the table of runs is sorted by: a metric, or nothing.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sort {
    /// The metric's name; none leaves the runs in their own order.
    pub metric: Option<String>,
    /// Whether the largest comes first.
    pub is_descending: bool,
}

/// What is compared, and how it is shown.
#[derive(Clone, Debug, Default)]
pub struct Compare {
    /// The runs that the one looked at is compared with, three at most.
    pub others: Vec<RunName>,
    /// How the left image shows them.
    pub view: View,
    /// Which stops stand side by side.
    pub align: Alignment,
    /// From which difference on they count as different.
    pub closeness: Closeness,
    /// Where the divider of the wipe is, from 0 to 1; none: in the middle.
    pub wipe: Option<f32>,
    /// Whether the other run is shown while a key is held.
    pub is_blinking: bool,
    /// Whether the target is held still in the left image.
    pub is_held: bool,
    /// Whether the step before shines through.
    pub has_onion_skin: bool,
    /// The run with which the table compares.
    pub baseline: Option<RunName>,
    /// What the table is sorted by.
    pub sort: Sort,
    /// The words that the table's runs must have.
    pub filter: String,
    /// Whether a panel that shows metrics is on the screen.
    pub wants_metrics: bool,
    pub(crate) answer: Option<(Asked, Result<Comparison, String>)>,
    pub(crate) under_way: Option<Asked>,
    pub(crate) jumps: bool,
    pub(crate) metrics: BTreeMap<RunName, (usize, Result<RunMetrics, String>)>,
    pub(crate) metrics_asked: BTreeMap<RunName, usize>,
}

/// A comparison as it was asked for, with how far each run was then.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Asked {
    /// The session.
    pub(crate) session: String,
    /// What was asked.
    pub(crate) new: NewComparison,
    /// How many steps each run had.
    pub(crate) rows: Vec<usize>,
}

/// What a person asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Ask {
    /// Compares with a run in a place of its own, from 0; none takes what is there out.
    With {
        /// The place.
        place: usize,
        /// The run.
        run: Option<RunName>,
    },
    /// Adds a run to the compared ones, or takes it out.
    Toggle(RunName),
    /// Shows the comparison so.
    View(View),
    /// Shows it in the next way.
    NextView,
    /// Aligns the runs so.
    Align(Alignment),
    /// Counts from this difference on.
    Closeness(Closeness),
    /// Goes to where this run and the first compared one differ first.
    FirstDivergence,
    /// Shows the other run while a key is held.
    Blink(bool),
    /// Puts the divider of the wipe there, from 0 to 1.
    Wipe(f32),
    /// Holds the target still in the left image, or lets it go.
    Stabilise,
    /// Shows the step before through the image, or does not.
    OnionSkin,
    /// Makes a run the baseline, or takes that back.
    Baseline(RunName),
    /// Sorts the table of runs.
    Sort(Sort),
    /// Shows only the runs that have these words.
    Filter(String),
    /// Goes to a step of a run.
    Visit {
        /// The run.
        run: RunName,
        /// The step.
        step: usize,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_key_goes_through_all_ways_and_begins_again() {
        let mut view = View::default();
        for expected in [View::SideBySide, View::Wipe, View::Blink, View::Difference, View::Marks] {
            view = view.next();
            assert_eq!(view, expected);
        }
    }

    #[test]
    fn every_tolerance_has_a_unit_that_the_server_knows() {
        use sightline_session::compare::Tolerance;
        for closeness in Closeness::ALL {
            let by_unit =
                closeness.tolerances().iter().map(|(unit, value)| ((*unit).to_owned(), *value)).collect();
            let tolerance = Tolerance::new(&by_unit).unwrap();
            assert_eq!(tolerance.is_exact(), closeness == Closeness::Exact);
        }
    }
}
