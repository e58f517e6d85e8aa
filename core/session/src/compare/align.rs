//! Alignment of the stops of several runs, for comparison.
//!
//! - *step*: the same stop of the drive;
//! - *distance*: equal distance driven since each run's own designation, by the estimated poses;
//! - *time*: equal time since each run's own designation.
//!
//! By distance and time, a stop of the first run is matched with the mutually nearest stop of each other run. So no stop is
//! matched twice, and none is interpolated. Of two equally near stops the earlier one counts.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::Compared;
use sightline_track::trace::StepTrace;

/// How the stops of several runs are aligned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Alignment {
    /// The same stop of the drive.
    #[default]
    Step,
    /// Equal distance driven since the designation.
    Distance,
    /// Equal time since the designation.
    Time,
}

impl Alignment {
    /// All alignments.
    pub const ALL: [Self; 3] = [Self::Step, Self::Distance, Self::Time];

    /// Its name in requests.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Step => "step",
            Self::Distance => "distance",
            Self::Time => "time",
        }
    }

    /// The unit of the aligned quantity; empty for steps.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Step => "",
            Self::Distance => "m",
            Self::Time => "s",
        }
    }

    /// A description in one sentence.
    pub const fn sentence(self) -> &'static str {
        match self {
            Self::Step => "Aligned by step: equal stops of the drive are side by side.",
            Self::Distance => {
                "Aligned by distance: the stops nearest to each other in metres driven since each designation are side by side."
            }
            Self::Time => {
                "Aligned by time: the stops nearest to each other in seconds since each designation are side by side."
            }
        }
    }
}

/// Aligned stops of the compared runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Moment {
    /// The stop of each run; null if it has no aligned stop.
    pub steps: Vec<Option<usize>>,
    /// The aligned quantity of each run: the step, distance driven in m, or time since the designation in s.
    pub at: Vec<Option<f64>>,
}

/// The moments of a comparison: by step, the stops of all runs; otherwise the stops of the first run.
pub(crate) fn moments(runs: &[Compared], align: Alignment) -> Vec<Moment> {
    if align == Alignment::Step {
        return by_step(runs);
    }
    let along: Vec<Vec<f64>> =
        runs.iter().map(|run| run.steps.iter().map(|trace| along(run, trace, align)).collect()).collect();
    let Some(first) = along.first() else { return Vec::new() };
    let moment = |k: usize| {
        let beside = |(run, other): (usize, &Vec<f64>)| {
            if run == 0 { Some(k) } else { mutual(first, k, other) }
        };
        let places: Vec<Option<usize>> = along.iter().enumerate().map(beside).collect();
        Moment {
            steps: places.iter().zip(runs).map(|(place, run)| Some(run.steps[(*place)?].step)).collect(),
            at: places.iter().zip(&along).map(|(place, along)| Some(along[(*place)?])).collect(),
        }
    };
    (0..first.len()).map(moment).collect()
}

fn by_step(runs: &[Compared]) -> Vec<Moment> {
    let mut steps: Vec<usize> =
        runs.iter().flat_map(|run| run.steps.iter().map(|trace| trace.step)).collect();
    steps.sort_unstable();
    steps.dedup();
    let moment = |step: usize| {
        let there: Vec<Option<usize>> = runs.iter().map(|run| run.step(step).map(|_| step)).collect();
        Moment { at: there.iter().map(|step| step.map(|step| step as f64)).collect(), steps: there }
    };
    steps.into_iter().map(moment).collect()
}

/// The aligned quantity of a step: the step, m driven, or s since the run's first step.
fn along(run: &Compared, trace: &StepTrace, align: Alignment) -> f64 {
    match align {
        Alignment::Step => trace.step as f64,
        Alignment::Distance => trace.update.target.travelled_m,
        Alignment::Time => trace.time_s - run.steps.first().map_or(0.0, |first| first.time_s),
    }
}

/// The index in `other` that is nearest to `first[k]`, if `k` is also the nearest to it.
fn mutual(first: &[f64], k: usize, other: &[f64]) -> Option<usize> {
    let found = nearest(other, first[k])?;
    (nearest(first, other[found]) == Some(k)).then_some(found)
}

/// The index of the nearest value; of two equally near the earlier.
fn nearest(values: &[f64], to: f64) -> Option<usize> {
    (0..values.len()).min_by(|&a, &b| (values[a] - to).abs().total_cmp(&(values[b] - to).abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_stop_stands_beside_two_others() {
        let (first, dense) = ([0.0, 1.0, 2.0], [0.0, 0.3, 0.9, 1.4, 2.2]);
        let found: Vec<_> = (0..3).map(|k| mutual(&first, k, &dense)).collect();
        assert_eq!(found, [Some(0), Some(2), Some(4)]);
        let sparse = [0.1, 1.9];
        let found: Vec<_> = (0..3).map(|k| mutual(&first, k, &sparse)).collect();
        assert_eq!(found, [Some(0), None, Some(1)]);
        assert_eq!(mutual(&first, 0, &[]), None);
    }
}
