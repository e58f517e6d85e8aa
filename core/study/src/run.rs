//! One target tracked with one configuration, judged at every step: the engine of the studies.
//!
//! All targets of a unit are tracked in parallel, each by the functions of `session::track`. A step releases its images
//! once the next is computed. Results are judged by R116 (`truth.rs`), with two further errors:
//!
//! * drift: `│ x_end − T_true x_0 │`, where x_0 is the first estimate in the rover frame of the designation and T_true
//!   the true motion of the rover since: the error that tracking added to that of the designation, m;
//! * error along the line of sight of the left camera, m; positive: estimated too far.
//!
//! At the step of a fault the target is *tracked* (state `tracking`, within the tolerance of R116), *lost* (declared so)
//! or *false* (state `tracking`, but wrong). The truth is projected even if it is occluded: a window with an occluded
//! corner may be tracked correctly.

use std::sync::atomic::AtomicBool;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::by_pose::ByPose;
use super::confidence::Trust;
use super::hand_over::HandOver;
use super::point::{Fault, Point};
use super::staged::Staged;
use super::step_record::StepRecord;
use sightline_geometry::error::{Error, Result};
use sightline_geometry::frames::{Pixel, Point3};
use sightline_session::step::RunStep;
use sightline_session::summary::{Summary, summarise};
use sightline_session::track::{self, Drive, NextStep};
use sightline_track::settings::Settings;
use sightline_track::target::{Designation, TrackingState};

/// A pixel to be tracked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Chosen {
    /// Pixel of the first left image.
    pub pixel: Pixel,
    /// Group: `row-1`, `boundary`, `passed` or `all`.
    pub group: String,
    /// Visited step at which the fault affects it; `None` if none does.
    pub fault_step: Option<usize>,
}

/// Outcome of a target at one step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fate {
    /// State `tracking`, and correct.
    Tracked,
    /// Declared lost or failed.
    Lost,
    /// State `tracking`, and wrong.
    False,
}

/// One target's run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Index of the target in its world.
    pub target: usize,
    /// Group of the target.
    pub group: String,
    /// The designated pixel.
    pub pixel: Pixel,
    /// Reason why the designation was refused; `None` if it was not.
    pub refused: Option<String>,
    /// Distance from the left camera at designation and at the last step, m.
    pub distance_m: Option<[f64; 2]>,
    /// Summary of all steps.
    pub summary: Summary,
    /// Tracking state after the last step.
    pub state: Option<String>,
    /// Located pixel at the last step.
    pub end_pixel: Option<Pixel>,
    /// Pixel of the truth at the last step.
    pub true_end_pixel: Option<Pixel>,
    /// Error added by tracking, m.
    pub drift_m: Option<f64>,
    /// Error at the last step along the line of sight, m.
    pub err_range_m: Option<f64>,
    /// Largest 1σ axis of the covariance at the last step, m.
    pub sigma_m: Option<f64>,
    /// Squared Mahalanobis distance of the error at the last step.
    pub nees: Option<f64>,
    /// Reliability of the confidence, and errors of the measured motions.
    #[serde(default)]
    pub trust: Trust,
    /// Errors of the shape tracker; default without one.
    #[serde(default)]
    pub hand_over: HandOver,
    /// Cause of the loss; `None` unless the study uses odometry.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by_pose: Option<ByPose>,
    /// Outcome at the last step; null without truth.
    pub end: Option<Fate>,
    /// Whether the last step was lost although its evidence was right.
    pub end_is_false_loss: bool,
    /// Visited step of the fault; null without one.
    pub fault_step: Option<usize>,
    /// Outcome at that step.
    pub at_fault: Option<Fate>,
    /// Number of false steps from the fault on.
    pub false_after_fault: usize,
    /// Every step; empty unless the study records them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<StepRecord>,
}

impl Run {
    /// Records that slip ended the drive at the last step: a target tracked there counts as not driven to the end.
    pub fn end_early(&mut self) {
        let is_tracked = self.end == Some(Fate::Tracked);
        self.by_pose.iter_mut().for_each(|by_pose| by_pose.not_driven = is_tracked);
    }

    /// Returns whether it was tracked at the stop at which slip ended the drive.
    pub(crate) fn is_not_driven(&self) -> bool {
        self.by_pose.as_ref().is_some_and(|by_pose| by_pose.not_driven)
    }
}

/// Progress callback and cancellation of a study.
pub struct Watch<'a> {
    /// Set to stop the study soon.
    pub cancel: &'a AtomicBool,
    /// Called after every run, from several threads.
    pub tell: &'a (dyn Fn() + Sync),
}

/// Tracks every target of a point through a drive.
///
/// # Errors
/// [`Error::Cancelled`] soon after `watch.cancel` is set.
pub fn measure<D: Drive>(
    drive: &D,
    point: &Point,
    chosen: &[Chosen],
    settings: &Settings,
    keep_steps: bool,
    watch: &Watch<'_>,
) -> Result<Vec<Run>> {
    let staged = Staged::new(drive, point.visit.by(settings.tracker));
    let staged = match point.fault {
        Some(Fault::HeadingJump { step, yaw_deg }) => staged.with_heading_jump(step, yaw_deg.to_radians()),
        Some(Fault::PositionJump { across_m }) => staged.with_position_jump(across_m),
        _ => staged,
    };
    let one = |(target, chosen): (usize, &Chosen)| -> Result<Run> {
        let mut follower = Follower::new(target, chosen, keep_steps);
        follower.run.by_pose = point.odometry.map(|_| ByPose::default());
        follower.follow(&staged, settings, watch.cancel)?;
        (watch.tell)();
        Ok(follower.run)
    };
    chosen.par_iter().enumerate().map(one).collect()
}

/// A run in progress.
struct Follower {
    run: Run,
    keep_steps: bool,
}

impl Follower {
    fn new(target: usize, chosen: &Chosen, keep_steps: bool) -> Self {
        let run = Run {
            target,
            group: chosen.group.clone(),
            pixel: chosen.pixel,
            refused: None,
            distance_m: None,
            summary: Summary::default(),
            state: None,
            end_pixel: None,
            true_end_pixel: None,
            drift_m: None,
            err_range_m: None,
            sigma_m: None,
            nees: None,
            trust: Trust::default(),
            hand_over: HandOver::default(),
            by_pose: None,
            end: None,
            end_is_false_loss: false,
            fault_step: chosen.fault_step,
            at_fault: None,
            false_after_fault: 0,
            steps: Vec::new(),
        };
        Self { run, keep_steps }
    }

    fn follow<D: Drive>(&mut self, drive: &D, settings: &Settings, cancel: &AtomicBool) -> Result<()> {
        let designation = Designation::new(0, self.run.pixel);
        let first = match track::designate_until(drive, designation, settings, cancel.into()) {
            Ok(first) => first,
            Err(Error::Cancelled) => return Err(Error::Cancelled),
            Err(error) => {
                self.run.refused = Some(error.to_string());
                return Ok(());
            }
        };
        let mut last = first.clone();
        self.record(drive, None, [&first, &last], settings);
        while last.step + 1 < drive.stop_count() {
            let next = NextStep {
                first: &first,
                last: &last,
                settings,
                prediction_px: None,
                before: None,
                ended: None,
                cancel: cancel.into(),
            };
            let next = next.compute(drive)?;
            self.record(drive, Some(&last), [&first, &next], settings);
            last = next;
        }
        self.conclude(drive, &first, &last);
        Ok(())
    }

    fn record<D: Drive>(
        &mut self,
        drive: &D,
        before: Option<&RunStep>,
        [first, trace]: [&RunStep; 2],
        settings: &Settings,
    ) {
        if let Some(before) = before {
            self.run.hand_over.add(drive, [first, before, trace]);
            self.run.trust.add(drive, trace, drift_m(drive, first, trace));
        }
        add(&mut self.run.summary, &summarise([trace]));
        let fate = fate(drive, trace);
        self.run.by_pose.iter_mut().for_each(|by_pose| by_pose.add(trace, fate, settings));
        if let Some(at) = self.run.fault_step.filter(|at| trace.step >= *at) {
            self.run.at_fault = if trace.step == at { fate } else { self.run.at_fault };
            self.run.false_after_fault += usize::from(fate == Some(Fate::False));
        }
        (self.run.end, self.run.end_is_false_loss) = (fate, trace.is_false_loss());
        if self.keep_steps {
            self.run.steps.push(StepRecord::of(drive, before, trace));
        }
    }

    fn conclude<D: Drive>(&mut self, drive: &D, first: &RunStep, last: &RunStep) {
        let row = last.row();
        let run = &mut self.run;
        run.state = Some(row.state);
        run.end_pixel = row.left_pixel;
        (run.sigma_m, run.nees) = (row.sigma_m, row.nees);
        run.drift_m = drift_m(drive, first, last);
        let Some(truth) = last.truth.as_ref().map(|truth| truth.position_in_rover) else { return };
        let of_target = last.update.target.designation.camera;
        let Some(camera) = drive.true_left_camera(last.step, of_target) else { return };
        run.true_end_pixel = camera.project(&truth);
        let centre = camera.model.centre();
        let sight = truth - centre;
        run.distance_m = Some([first.update.target.initial_distance_m, sight.norm()]);
        let error = last.update.target.position_in_rover - truth;
        run.err_range_m = sight.try_normalize(0.0).map(|sight| error.dot(&sight));
    }
}

/// Adds the summary of later steps to that of the earlier ones.
fn add(sum: &mut Summary, part: &Summary) {
    let more = |sum: Option<usize>, part: Option<usize>| match (sum, part) {
        (None, None) => None,
        (a, b) => Some(a.unwrap_or(0) + b.unwrap_or(0)),
    };
    sum.steps += part.steps;
    sum.steps_lost += part.steps_lost;
    sum.steps_not_searched += part.steps_not_searched;
    sum.steps_tracked = more(sum.steps_tracked, part.steps_tracked);
    sum.false_tracked = more(sum.false_tracked, part.false_tracked);
    sum.false_lost = more(sum.false_lost, part.false_lost);
    (sum.run_tracked, sum.final_err_px, sum.final_err_m) =
        (part.run_tracked, part.final_err_px, part.final_err_m);
}

/// Outcome of the target at a step; `None` without truth.
fn fate<D: Drive>(drive: &D, trace: &RunStep) -> Option<Fate> {
    let truth = trace.truth.as_ref()?;
    if trace.update.state != TrackingState::Tracking {
        return Some(Fate::Lost);
    }
    let pixel = drive
        .true_left_camera(trace.step, trace.update.target.designation.camera)
        .and_then(|camera| camera.project(&truth.position_in_rover));
    let located = trace.located().and_then(|located| located.left_pixel);
    let error_px = pixel.zip(located).map(|(a, b)| a.distance(b));
    Some(if error_px.is_some_and(|error| error <= truth.tolerance_px) { Fate::Tracked } else { Fate::False })
}

/// Distance between the last estimate and the first one moved by the true motion, m.
fn drift_m<D: Drive>(drive: &D, first: &RunStep, last: &RunStep) -> Option<f64> {
    let site_from_first = drive.true_site_from_rover(first.step)?;
    let site_from_last = drive.true_site_from_rover(last.step)?;
    let carried: Point3 =
        site_from_last.inverse() * (site_from_first * first.update.target.position_in_rover);
    Some((last.update.target.position_in_rover - carried).norm())
}

#[cfg(test)]
#[path = "run_tests.rs"]
mod tests;
