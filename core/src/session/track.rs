//! The tracker over a traverse: one step of a run with its comparison against the truth.
//!
//! Page, REST and command line all come through these two functions, so that they show the same numbers.

use crate::error::Result;
use crate::pipeline::{self, Stops};
use crate::settings::Settings;
use crate::study::truth::{TargetTruth, TruthSource};
use crate::target::Designation;
use crate::trace::StepTrace;

/// A traverse that can be tracked and, where its truth is known, judged.
pub trait Drive: Stops + TruthSource {}
impl<T: Stops + TruthSource> Drive for T {}

/// The first step of a run.
///
/// # Errors
/// [`crate::error::Error::Target`] when there is no such pixel or no 3-D position under it; file errors.
pub fn designate<D: Drive>(drive: &D, designation: Designation, settings: &Settings) -> Result<StepTrace> {
    let mut trace = pipeline::designate(drive, designation, settings)?;
    compare(drive, &mut trace, None);
    Ok(trace)
}

/// The step after `last`; `first` is the run's designation.
pub fn advance<D: Drive>(drive: &D, first: &StepTrace, last: &StepTrace, settings: &Settings) -> StepTrace {
    let mut trace = pipeline::run_step(drive, &last.update, settings);
    compare(drive, &mut trace, Some(first));
    trace
}

/// All steps of a run, from the designation to the last stop.
///
/// # Errors
/// As [`designate`].
pub fn run<D: Drive>(drive: &D, designation: Designation, settings: &Settings) -> Result<Vec<StepTrace>> {
    let mut steps = vec![designate(drive, designation, settings)?];
    while let Some(last) = steps.last().filter(|last| last.step + 1 < drive.stop_count()) {
        let next = advance(drive, &steps[0], last, settings);
        steps.push(next);
    }
    Ok(steps)
}

fn compare<D: Drive>(drive: &D, trace: &mut StepTrace, first: Option<&StepTrace>) {
    let first = first.unwrap_or(trace);
    let target = &first.update.target;
    let truth = TargetTruth::new(drive, target.designation, Some(&target.position_in_rover));
    trace.truth = truth.and_then(|truth| truth.compare(trace));
}
