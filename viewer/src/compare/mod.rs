//! The comparison of runs: the compared runs, the way they are shown, and the commands for both.

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
    /// The surroundings of the target in each run, side by side.
    SideBySide,
    /// The selected run left of a divider, the other right of it.
    Wipe,
    /// The selected run; the other one while X is held.
    Blink,
    /// The difference of the matched patches of two runs.
    Difference,
}

impl View {
    /// All views, in the order in which the key cycles through them.
    pub const ALL: [Self; 5] = [Self::Marks, Self::SideBySide, Self::Wipe, Self::Blink, Self::Difference];

    /// The label of the view.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Marks => "marks",
            Self::SideBySide => "side by side",
            Self::Wipe => "wipe",
            Self::Blink => "blink",
            Self::Difference => "difference",
        }
    }

    /// A description of the view.
    pub const fn help(self) -> &'static str {
        match self {
            Self::Marks => "the marks of all runs on one image",
            Self::SideBySide => "each run’s surroundings of the target, side by side",
            Self::Wipe => "this run left of a divider, the other right of it; drag it or use the arrow keys",
            Self::Blink => "this run; the other one while X is held (no automatic blinking)",
            Self::Difference => "difference of the two runs’ templates and matched patches",
        }
    }

    /// The next view in the cycle.
    pub fn next(self) -> Self {
        let at = Self::ALL.iter().position(|&view| view == self).unwrap_or(0);
        Self::ALL[(at + 1) % Self::ALL.len()]
    }
}

/// Tolerance within which values of two runs count as equal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ToleranceLevel {
    /// No tolerance: any difference counts.
    #[default]
    Exact,
    /// Rounding errors are ignored.
    Rounding,
    /// Differences too small to be visible are ignored.
    Visible,
}

impl ToleranceLevel {
    /// All tolerances.
    pub const ALL: [Self; 3] = [Self::Exact, Self::Rounding, Self::Visible];

    /// The label of the tolerance.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Exact => "none",
            Self::Rounding => "1e-9",
            Self::Visible => "0.01 px, 1 mm",
        }
    }

    /// The tolerance of each unit; units without one must be equal.
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

/// The metrics in the table of runs: name, heading, and whether larger is better.
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

/// The sort order of the table of runs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sort {
    /// Name of the metric; `None`: the order of the runs.
    pub metric: Option<String>,
    /// Whether the largest value is first.
    pub is_descending: bool,
}

/// The state of the comparison.
#[derive(Clone, Debug, Default)]
pub struct Compare {
    /// The runs that are compared with the selected one, at most three.
    pub others: Vec<RunName>,
    /// How the left image shows them.
    pub view: View,
    /// How the stops of the runs are aligned.
    pub align: Alignment,
    /// The tolerance within which values count as equal.
    pub tolerance: ToleranceLevel,
    /// Position of the wipe divider, from 0 (left) to 1; `None`: the middle.
    pub wipe: Option<f32>,
    /// Whether the other run is shown because its key is held.
    pub is_blinking: bool,
    /// Whether the left image is stabilised on the target.
    pub is_stabilised: bool,
    /// Whether the previous step's image is overlaid, translucent.
    pub has_onion_skin: bool,
    /// The baseline run of the table.
    pub baseline: Option<RunName>,
    /// The sort order of the table.
    pub sort: Sort,
    /// The words that a run must match to be listed.
    pub filter: String,
    /// Whether a visible panel shows metrics.
    pub wants_metrics: bool,
    pub(crate) answer: Option<(ComparisonRequest, Result<Comparison, String>)>,
    pub(crate) pending_request: Option<ComparisonRequest>,
    pub(crate) jumps: bool,
    pub(crate) metrics: BTreeMap<RunName, (usize, Result<RunMetrics, String>)>,
    pub(crate) metrics_pending: BTreeMap<RunName, usize>,
}

/// A requested comparison, with the progress of each run at that time.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ComparisonRequest {
    /// The session's id.
    pub(crate) session: String,
    /// The request.
    pub(crate) new: NewComparison,
    /// Number of rows of each run at the time of the request.
    pub(crate) rows: Vec<usize>,
}

/// A command about comparing runs.
#[derive(Clone, Debug, PartialEq)]
pub enum CompareCommand {
    /// Compares with a run at an index of the compared runs; `None` removes the run at that index.
    With {
        /// The index, from 0.
        place: usize,
        /// The run.
        run: Option<RunName>,
    },
    /// Adds a run to the compared ones, or removes it.
    Toggle(RunName),
    /// Selects the view.
    View(View),
    /// Selects the next view.
    NextView,
    /// Sets the alignment of the stops.
    Align(Alignment),
    /// Sets the tolerance.
    Tolerance(ToleranceLevel),
    /// Goes to the first divergence between the selected run and the first compared one.
    FirstDivergence,
    /// Shows the other run while a key is held.
    Blink(bool),
    /// Moves the wipe divider, from 0 (left) to 1.
    Wipe(f32),
    /// Toggles the stabilisation of the left image on the target.
    Stabilise,
    /// Toggles the overlay of the previous step.
    OnionSkin,
    /// Makes a run the baseline, or clears the baseline if it is that run.
    Baseline(RunName),
    /// Sorts the table of runs.
    Sort(Sort),
    /// Lists only the runs that match these words.
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
        for level in ToleranceLevel::ALL {
            let by_unit =
                level.tolerances().iter().map(|(unit, value)| ((*unit).to_owned(), *value)).collect();
            let tolerance = Tolerance::new(&by_unit).unwrap();
            assert_eq!(tolerance.is_exact(), level == ToleranceLevel::Exact);
        }
    }
}
