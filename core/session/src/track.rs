//! The tracker over a traverse: the steps of a run, with their comparison with the truth.
//!
//! Viewer, REST and command line all use these functions, so that they show the same numbers.

use crate::step::RunStep;
use crate::times::Took;
use sightline_geometry::cancel::Cancel;
use sightline_geometry::error::Result;
use sightline_geometry::frames::Pixel;
use sightline_rover::pipeline::{self, StepChanges, Stops};
use sightline_track::cycle_stage::CycleStage;
use sightline_track::locate::template::warnings;
use sightline_track::settings::Settings;
use sightline_track::target::Designation;
use sightline_track::trace::StepTrace;
use sightline_world::target_truth::{TargetTruth, TruthSource};

/// A traverse that can be tracked and, if its truth is known, evaluated.
pub trait Drive: Stops + TruthSource {}
impl<T: Stops + TruthSource> Drive for T {}

/// Computes the first step of a run, the designation.
///
/// # Errors
/// [`sightline_geometry::error::Error::Target`] if there is no such pixel or no 3-D position at it; file errors.
pub fn designate<D: Drive>(drive: &D, designation: Designation, settings: &Settings) -> Result<RunStep> {
    designate_until(drive, designation, settings, Cancel::default())
}

/// As [`designate`], and stops soon after `cancel` is requested.
///
/// # Errors
/// As [`designate`], and [`sightline_geometry::error::Error::Cancelled`].
pub fn designate_until<D: Drive>(
    drive: &D,
    designation: Designation,
    settings: &Settings,
    cancel: Cancel<'_>,
) -> Result<RunStep> {
    drive.prepare(cancel)?;
    let mut trace = pipeline::designate_until(drive, designation, settings, cancel)?;
    warn_of_shadow(drive, &mut trace, settings);
    Ok(compared(drive, trace, None))
}

/// Adds the warning about a shadow on the window (R21), which needs the truth.
fn warn_of_shadow<D: Drive>(drive: &D, trace: &mut StepTrace, settings: &Settings) {
    let Designation { step, pixel, camera } = trace.update.target.designation;
    let warning = drive
        .shadow_share(step, camera, pixel, settings.template.template_size_px)
        .and_then(|share| warnings::of_shadow(share, &settings.limits));
    let evidence = trace.located_mut().and_then(|located| located.evidence.template_mut());
    if let (Some(evidence), Some(warning)) = (evidence, warning) {
        evidence.warnings.push(warning);
    }
}

/// Computes the step after `last`; `first` is the run's designation.
pub fn advance<D: Drive>(drive: &D, first: &StepTrace, last: &StepTrace, settings: &Settings) -> RunStep {
    compared(drive, pipeline::run_step(drive, &last.update, settings), Some(first))
}

/// The inputs of the next step of a run, with optional changes, pause and cancellation.
#[derive(Clone, Copy)]
pub struct NextStep<'a> {
    /// The run's designation.
    pub first: &'a StepTrace,
    /// The last step.
    pub last: &'a StepTrace,
    /// The configuration.
    pub settings: &'a Settings,
    /// The displaced prediction in the left image, px; `None`: by dead reckoning.
    pub prediction_px: Option<Pixel>,
    /// The stage before which the step is paused, from `point_mast` to `update`; `None`: the whole step.
    pub before: Option<CycleStage>,
    /// Called at the end of every stage.
    pub ended: Option<&'a dyn Fn(CycleStage)>,
    /// Checked several times during the step.
    pub cancel: Cancel<'a>,
}

impl NextStep<'_> {
    /// Computes the step.
    ///
    /// # Errors
    /// [`sightline_geometry::error::Error::Cancelled`] soon after `cancel` is requested.
    pub fn compute<D: Drive>(&self, drive: &D) -> Result<RunStep> {
        let Self { first, last, settings, prediction_px, before, ended, cancel } = *self;
        drive.prepare(cancel)?;
        let changes = StepChanges { prediction_px, before, ended };
        let trace = pipeline::run_step_changed(drive, &last.update, settings, &changes, cancel)?;
        Ok(compared(drive, trace, Some(first)))
    }
}

/// All steps of a run, from the designation to the last stop.
///
/// # Errors
/// As [`designate`].
pub fn run<D: Drive>(drive: &D, designation: Designation, settings: &Settings) -> Result<Vec<RunStep>> {
    let mut steps = vec![designate(drive, designation, settings)?];
    while let Some(last) = steps.last().filter(|last| last.step + 1 < drive.stop_count()) {
        let next = advance(drive, &steps[0], last, settings);
        steps.push(next);
    }
    Ok(steps)
}

pub(crate) fn compared<D: Drive>(drive: &D, trace: StepTrace, first: Option<&StepTrace>) -> RunStep {
    let target = &first.unwrap_or(&trace).update.target;
    let truth = TargetTruth::new(drive, target.designation, Some(&target.position_in_rover));
    // The comparison needs the update.
    let truth = truth.filter(|_| !trace.is_begun()).and_then(|truth| truth.compare(&trace));
    let odometry = drive.measured_motion(trace.step).cloned().map(Box::new);
    RunStep { trace, truth, odometry, took: Took::default() }
}
